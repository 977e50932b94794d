"""Every example runs and ends in the number it asserts; its figure is one that can be saved."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

#: Sizes that show the same in less time than those of the pictures: arguments, and constants in capitals.
SMALL = {
    "basins": {"points": 28},
    "chart": {"points": 18},
    "basin_fractions": {"points": 10, "starts": 20},
    "element_loads": {"points": 25},
    "real_silverbox": {"samples": 600, "TEST": 10_000},
    "relief_valve": {"points": 89},
    "three_masses": {"points": 25, "forces": 3},
}
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example(path: Path) -> None:
    ends_in_its_number(path, SMALL.get(path.stem, {}))


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for path in EXAMPLES if path.stem in SMALL], ids=lambda path: path.stem)
def test_whole_example(path: Path) -> None:
    ends_in_its_number(path, {})


def ends_in_its_number(path: Path, sizes: dict[str, int]) -> None:
    import matplotlib.pyplot as plt

    spec = importlib.util.spec_from_file_location(f"example_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    needs = getattr(module, "NEEDS", "")
    if needs and not (Path(os.environ.get("NONSMOOTH_DATA", "")) / needs).is_file():
        pytest.skip(f"{needs} is others' work and not shipped: docs/gallery says where it is; set NONSMOOTH_DATA")
    for name in filter(str.isupper, sizes):
        assert hasattr(module, name)
        setattr(module, name, sizes[name])
    drawn = module.main(**{name: size for name, size in sizes.items() if not name.isupper()})
    assert hasattr(drawn, "savefig") or hasattr(drawn, "plot")
    plt.close("all")
