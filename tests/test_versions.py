"""Bounds of libraries: the same wherever they stand, and ``make versions`` calls every verb."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tests" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_verb_is_called_and_the_facts_are_of_verbs(tmp_path: Path) -> None:
    every_verb = script("every_verb")
    # explore serves until it is ended, plots are drawn of what was found, the rest are types
    called = set(every_verb.steps(tmp_path))
    assert called == every_verb.verbs()
    assert set(every_verb.FACTS) <= called


def test_a_library_has_one_bound() -> None:
    """An extra, the tests and what a build needs ask for no other version than the package does."""
    project = PROJECT["project"]
    everywhere = [
        *project["dependencies"],
        *(one for extra in project["optional-dependencies"].values() for one in extra),
        *(one for group in PROJECT["dependency-groups"].values() for one in group),
        *PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["hooks"]["custom"]["dependencies"],
    ]
    bounds: dict[str, set[str]] = {}
    for one in everywhere:
        name, bound = re.match(r"([\w-]+)(?:\[\w+\])?([^;]*)", one).groups()  # type: ignore[union-attr]
        bounds.setdefault(name, set()).add(bound.strip())
    assert bounds.pop("numpy") == {">=2.1", "<2.5"}  # the upper one is that of numba-cuda
    assert {name: found for name, found in bounds.items() if len(found) > 1} == {}


def test_the_lowest_versions_are_all_that_a_user_installs() -> None:
    lowest = script("versions").lowest(PROJECT["project"])
    needed = {re.match(r"[\w-]+", one)[0] for one in PROJECT["project"]["dependencies"]}  # type: ignore[index]
    assert needed | {"zarr", "bokeh", "npTDMS", "openpyxl", "pyarrow", "pyuff", "distributed"} == set(lowest)
    assert all(re.fullmatch(r"[\d.]+", version) for version in lowest.values())


def test_a_python_that_is_not_there_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    versions = script("versions")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    assert versions.interpreter("3.99") is None
