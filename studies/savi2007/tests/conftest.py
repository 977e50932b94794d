"""One quick reproduction of Figs. 9 and 11 and of Table 1, by model and virtual rig, shared by the tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from nonsmooth_savi2007 import Reproduction, reproduce


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Reproduction:
    """The quick run of Figs. 9 and 11 and of Table 1."""
    folder: Path = tmp_path_factory.mktemp("savi2007")
    return reproduce(folder, figures=[9, 11, "table1"], quick=True, progress=False)
