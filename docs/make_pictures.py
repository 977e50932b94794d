"""Draw the pictures of the documentation: one per example, and those that a page's own code draws as ``ax``.

Run it from anywhere: ``python docs/make_pictures.py``, with names of pictures for some of them only. It takes some ten
seconds (longer the first time; minutes for ``comparison_section``, which measures and identifies a virtual rig) and
writes ``docs/pictures/*.png``, which are kept with the source so that the pages can be built without computing
anything. Examples of measured data need the environment variable NONSMOOTH_DATA; without it their pictures stay as they
are. Two pictures belong to scripts that measure: ``effect_of_eta`` to ``docs/measure_methods.py``, ``chart_cost`` to
``benchmarks/chart_size.py``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axis import Axis
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.spines import Spine
from matplotlib.text import Text

from nonsmooth import plot

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
PIXELS = 1400  # wide: twice what a page shows, for screens of two pixels per point
RAISES = re.compile(r"```text\n\w+Error: ")  # below a block of Python: it ends in this error
SMALL = 300, 190  # of a picture in the gallery, in pixels of the page; its file has twice as many
INCHES = 5.2  # a figure of one column is drawn this wide, its letters as they are


def keep(drawn: Any, name: str) -> None:
    """Save a figure (or the figure of some axes) as docs/pictures/NAME.png, without date or program in it."""
    from PIL import Image

    figure = getattr(drawn, "figure", drawn)
    width, height = figure.get_size_inches()
    grown = max(1.0, INCHES / width)
    figure.set_size_inches(grown * width, grown * height)
    drawing = io.BytesIO()
    with plot.journal():
        figure.savefig(drawing, format="png", dpi=PIXELS / (grown * width))
    target = PICTURES / f"{name}.png"
    # A palette of 256 colours shows the same in a third of the bytes.
    Image.open(drawing).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)
    print(f"{name}.png: {target.stat().st_size // 1024} kB")


def small(drawn: Any, name: str) -> None:
    """Save what is left of a figure without words, its lines twice as wide: docs/pictures/small/NAME.png."""
    figure = getattr(drawn, "figure", drawn)
    for words in figure.findobj(lambda one: isinstance(one, Text | Axis)):
        words.set_visible(False)
    for legend in figure.findobj(Legend):  # unseen, it would keep its room
        legend.remove()
    for line in figure.findobj(Line2D):
        line.set(linewidth=2 * line.get_linewidth(), markersize=1.6 * line.get_markersize())
    for frame in figure.findobj(Spine):
        frame.set_linewidth(1.2)
    figure.set_size_inches(SMALL[0] / 100, SMALL[1] / 100)
    target = PICTURES / "small" / f"{name}.png"
    figure.savefig(target, dpi=200, bbox_inches="tight", pad_inches=0.04)


def comparison_section() -> Any:
    """The section points of the guide's rig over the model's, by the guide's own commands and study file."""
    from nonsmooth.cli.main import main as nonsmooth
    from nonsmooth.plot import comparison_section as draw
    from nonsmooth.results.store import load

    page = (DOCS / "tutorials" / "your_rig.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (study,) = (text for text in blocks if "[measured]" in text)
    commands = re.findall(r"^\$ nonsmooth (rig .*|identify rig_03 .*)$", page, re.MULTILINE)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("run4.toml").write_text(study, encoding="utf-8")
        for command in (*commands, "compare run4.toml"):
            assert nonsmooth(command.split()) == 0, command
        return draw(load("run4.nc"))


def drawn_by(page: Path, elsewhere: set[str]) -> list[tuple[str, str]]:
    """(file, all code of the page above it) for each picture of a page that its own code draws as ``ax``, and for each
    animation that it makes as ``moving``."""
    text = page.read_text(encoding="utf-8")
    code = ""
    found = []
    parts = r"^```python\n(.*?)^```(?=\n*(.{0,40}))|^!\[.*?\]\(\S*pictures/(\w+)\.(png|gif)\)"
    for block, after, picture, ending in re.findall(parts, text, re.M | re.S):
        code += "" if RAISES.match(after) else block
        if picture and picture not in elsewhere and {"png": "ax = ", "gif": "moving = "}[ending] in code:
            found.append((f"{picture}.{ending}", code))
    return found


def main(wanted: list[str]) -> None:
    """The pictures named, or all."""
    mpl.use("Agg")
    (PICTURES / "small").mkdir(parents=True, exist_ok=True)
    examples = sorted((DOCS.parent / "examples").glob("*.py"))
    elsewhere = {path.stem for path in examples} | {"comparison_section", "effect_of_eta", "chart_cost"}
    for page in sorted(DOCS.rglob("*.md")):
        for file, code in drawn_by(page, elsewhere):
            name, _, ending = file.partition(".")
            if wanted and name not in wanted:
                continue
            if 'os.environ["NONSMOOTH_DATA"]' in code and not os.environ.get("NONSMOOTH_DATA"):
                print(f"{file}: left as it is; NONSMOOTH_DATA names no folder")
                continue
            with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
                for given in re.findall(r"\{download\}`[^`<]*<([^>`]+)>`", page.read_text(encoding="utf-8")):
                    shutil.copy(page.parent / given, folder)
                names: dict[str, Any] = {}
                with contextlib.redirect_stdout(None):
                    exec(code, names)
                if ending == "gif":
                    target = names["moving"].save(PICTURES / file)
                    print(f"{file}: {target.stat().st_size // 1024} kB")
                else:
                    keep(names["ax"], name)
    if not wanted or "comparison_section" in wanted:
        keep(comparison_section(), "comparison_section")
    for path in examples:
        if wanted and path.stem not in wanted:
            continue
        example = runpy.run_path(str(path))
        needs = example.get("NEEDS", "")
        if needs and not (Path(os.environ.get("NONSMOOTH_DATA", "")) / needs).is_file():
            print(f"{path.stem}.png: left as it is; NONSMOOTH_DATA names no folder with {needs}")
            continue
        drawn = example["main"]()
        keep(drawn, path.stem)
        small(drawn, path.stem)
    total = sum(os.path.getsize(file) for file in PICTURES.glob("*.png"))
    print(f"together {total // 1024} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
