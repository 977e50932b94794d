"""Functions and files that a reader meets on the way of a call: one warm `sweep` of three points, one `continue_orbit`.

Usage: python benchmarks/stations.py [--list]; prints how many functions of src/nonsmooth the third call of each enters,
in how many files, and with --list their names in the order in which they are first entered. What Python counts as
functions of their own besides, comprehensions and generators, belongs to the function in whose text it stands.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType
from typing import Any

import nonsmooth as ns

SOURCE = str(Path(ns.__file__).parent)


def entered(call: Callable[[], object]) -> list[CodeType]:
    """The functions of the package that the third of three calls enters, in order."""
    found: dict[CodeType, None] = {}

    def look(frame: Any, event: str, _: object) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(SOURCE):
            found.setdefault(code)

    for _ in range(2):
        call()
    sys.setprofile(look)
    try:
        call()
    finally:
        sys.setprofile(None)
    return list(found)


def main() -> None:
    """Print the counts, and the names if asked."""
    s = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0)
    orbit = ns.find_orbit(s, progress=False)
    calls: dict[str, Callable[[], object]] = {
        "sweep": lambda: ns.sweep(s, "rho", [0.13, 0.14, 0.15], threads=1, progress=False),
        "continue_orbit": lambda: ns.continue_orbit(orbit, "omega", (4.8, 5.2)),
    }
    for verb, call in calls.items():
        codes = entered(call)
        files = {code.co_filename for code in codes}
        own = [code for code in codes if code.co_name not in ("<listcomp>", "<dictcomp>", "<setcomp>", "<genexpr>")]
        print(f"{verb}: {len(own)} functions ({len(codes)} with comprehensions) in {len(files)} files", flush=True)
        if "--list" in sys.argv:
            for code in own:
                print(f"  {code.co_filename.removeprefix(SOURCE + '/')}:{code.co_firstlineno} {code.co_qualname}")


if __name__ == "__main__":
    main()
