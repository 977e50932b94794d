"""The sources of a compiled function: its own file and all kernel files and generated modules that it imports."""

from __future__ import annotations

import hashlib
import re
import sys
from functools import cache
from pathlib import Path

GENERATED = "nonsmooth_generated_"  # before the names of generated modules
#: What an import statement names; Python's own parser takes a tenth of a second for the files of this room.
_IMPORTS = re.compile(
    r"^[ \t]*(?:from[ \t]+(\S+)[ \t]+import[ \t]*(\([^)]*\)|(?:[^\n\\]|\\.|\\\n)*)|import[ \t]+([^\n]*))", re.MULTILINE
)
_MACHINERY = {f"compile.{name}" for name in ("ahead", "assembly", "cache", "folder", "sources", "target")}


@cache
def _kernel_sources() -> dict[str, str]:
    """Name -> text of every file of this room, as they stand when the process first compiles something."""
    room = Path(__file__).parents[1]
    return {
        ".".join(path.relative_to(room).with_suffix("").parts): path.read_text(encoding="utf-8")
        for path in sorted(room.rglob("*.py"))
    }


@cache
def _imported(text: str) -> set[str]:
    """Names of the modules that a text imports, and more: within this room, full names of generated ones."""
    room = __name__.rsplit(".", 2)[0] + "."
    found: list[str] = []
    for package, names, modules in _IMPORTS.findall(text):
        package = re.sub(r"^\.+", room, package).rstrip(".")
        found += [
            package,
            *(f"{package}.{name}" for name in re.findall(r"\w+", names)),
            *re.findall(r"[\w.]+", modules),
        ]
    ours = {name.removeprefix(room) for name in found if name.startswith(room)}
    return ours | {name.partition(".")[0] for name in found if name.startswith(GENERATED)}


@cache
def _source_stamp(text: str) -> str:
    """Hash of a source text and of all that it reaches."""
    digest = hashlib.sha256(text.encode())
    for name, found in sorted(reached(text).items()):
        digest.update(f"\0{name}\0{found}".encode())
    return digest.hexdigest()


def reached(text: str) -> dict[str, str]:
    """Name -> text of every kernel file and generated module that a source imports, through any number of files.

    The files of the cache itself are left out: what they decide about a function's code stands in its key."""
    sources = _kernel_sources()
    texts: dict[str, str] = {}
    pending = [text]
    while pending:
        for name in _imported(pending.pop()):
            if name in texts or name in _MACHINERY:
                continue
            if name.startswith(GENERATED):
                found = Path(str(sys.modules[name].__file__)).read_text(encoding="utf-8")
            elif name in sources:
                found = sources[name]
            else:
                continue  # not a module: a function of the package, say
            texts[name] = found
            pending.append(found)
    return texts


@cache
def file_stamp(path: str) -> str:
    """Hash of a file and of all that it reaches."""
    return _source_stamp(Path(path).read_text(encoding="utf-8"))
