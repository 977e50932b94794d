"""Studies are distributions of their own: found where they are installed, named where they are not."""

from __future__ import annotations

import ast
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import nonsmooth as ns
from nonsmooth.cli.main import main
from nonsmooth.explorer.catalogue import Catalogue, presets_of
from nonsmooth.studies import installed, study

ROOT = Path(__file__).parent.parent
INSTALL = "python -m pip install ./studies/savi2007"


def test_a_study_is_found_by_its_entry_point() -> None:
    assert "savi2007" in installed()
    assert study("savi2007").reproduce.__module__.startswith("nonsmooth_savi2007")
    assert ns.identify is study("savi2007", "identification").identify
    with pytest.raises(ValueError, match="`savi2008` is not a study of this installation; nearest: savi2007"):
        study("savi2008")


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The general toolbox, without any study; what it remembers of that is forgotten."""
    monkeypatch.setattr("nonsmooth.studies.entry_points", lambda group: ())
    vars(ns).pop("identify", None)
    presets_of.cache_clear()
    yield
    presets_of.cache_clear()


@pytest.mark.usefixtures("alone")
def test_without_the_study_its_verbs_say_how_to_install_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(AttributeError, match=INSTALL):
        ns.identify  # noqa: B018
    (tmp_path / "session.toml").touch()
    for words in (["reproduce", "savi2007"], ["identify", str(tmp_path)], ["rig", "--out", str(tmp_path / "rig")]):
        assert main(words) == 2
        assert INSTALL in capsys.readouterr().err


@pytest.mark.usefixtures("alone")
def test_without_the_study_the_explorer_shows_the_model_without_its_figures() -> None:
    assert Catalogue.of(None).state_of([]).model == "discontinuous_support"


def _named(path: str) -> Any:
    return pkgutil.resolve_name(":".join(path.rsplit(".", 1)))  # a figure, not the file of its name


def _documented() -> set[int]:
    """Identities of all that the reference shows."""
    found: list[Any] = [ns.__version__]
    for page in (ROOT / "docs" / "api").glob("*.md"):
        for path in re.findall(r"(?:auto\w+|py:data):: (nonsmooth\.[\w.]+)", page.read_text(encoding="utf-8")):
            one = _named(path)
            found += [getattr(one, name) for name in one.__all__] if hasattr(one, "__all__") else [one]
    return {id(one) for one in found}


def test_a_study_imports_what_the_reference_shows() -> None:
    documented, modules = _documented(), {ns, ns.elements, ns.models, ns.plot, ns.plot.identification}
    strange = set()
    for path in (ROOT / "studies").glob("*/src/**/*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{one.name}" for one in node.names]
            for name in names:
                if name.partition(".")[0] == "nonsmooth":
                    one = _named(name)
                    if one not in modules if isinstance(one, ModuleType) else id(one) not in documented:
                        strange.add(f"{path.name}: {name}")
    assert not strange
