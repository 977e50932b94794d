"""Units of forces from those of a system."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import nonsmooth as ns
from nonsmooth.elements import Coulomb, Stop
from nonsmooth.system.units import power_between, product, read_unit, unit_of, write_unit


@pytest.mark.parametrize(
    ("text", "unit", "written"),
    [
        ("N", {"kg": 1, "m": 1, "s": -2}, "N"),
        ("kg m/s^2", {"kg": 1, "m": 1, "s": -2}, "N"),
        ("N s/m", {"kg": 1, "s": -1}, "kg/s"),
        ("kg/(m s**2)", {"kg": 1, "m": -1, "s": -2}, "kg/(m s^2)"),
        ("kg m²", {"kg": 1, "m": 2}, "kg m^2"),
        ("rad/s", {"s": -1}, "1/s"),
        ("Hz", {"s": -1}, "1/s"),
        ("1", {}, "1"),
        ("mm", {"mm": 1}, "mm"),
        ("N m", {"kg": 1, "m": 2, "s": -2}, "J"),
        ("m/s/s", {"m": 1, "s": -2}, "m/s^2"),
        ("", None, ""),
        ("m/", None, ""),
        ("(m", None, ""),
        ("m)", None, ""),
        ("2 m", None, ""),
        ("?", None, ""),
    ],
)
def test_units_are_read_and_written(text: str, unit: dict[str, float] | None, written: str) -> None:
    assert read_unit(text) == unit
    assert write_unit(unit) == written
    if unit is not None:
        assert read_unit(write_unit(unit)) == unit


@pytest.mark.parametrize(
    ("one", "other", "power"),
    [
        ("mm", "m", -3),
        ("m", "mm", 3),
        ("mm/s", "m/s", -3),
        ("kN", "N", 3),
        ("m", "cm", 2),
        ("m", "m", 0),
        ("V", "m", None),
        ("min", "s", None),
        ("mm", "cm", None),
        ("deg", "rad", None),
    ],
)
def test_a_unit_with_a_prefix_is_a_power_of_ten_of_that_without(one: str, other: str, power: int | None) -> None:
    assert power_between(one, other) == power


def test_products_and_expressions() -> None:
    newton, second = read_unit("N"), read_unit("s")
    assert write_unit(product(newton, second)) == "N s" and product(newton, None) is None
    assert write_unit(read_unit("J"), turning=True) == "N m"
    m, k, x, ratio = sp.symbols("m k x r")
    units = {m: read_unit("kg"), k: read_unit("N/m"), x: read_unit("m"), ratio: None}
    assert write_unit(unit_of(-2 * ratio * k * x + 3, units)) == "N"
    assert write_unit(unit_of(sp.sqrt(k / m), units)) == "1/s"
    assert unit_of(2 * ratio, units) is None and unit_of(sp.Integer(1), units) is None


def test_forces_of_elements_have_the_units_of_their_system() -> None:
    def forces(m, unit, elements=None):
        elements = elements or {"rub": Coulomb(at="q", friction=0.1)}
        return dict(
            ns.mechanical(m, 0.0, 0.0, parameters={"m": (2.0, unit)}, coordinates={"q": "m"}, elements=elements).outputs
        )

    assert forces("m", "kg") == {"rub_force": "N"} and forces(2.0, "kg") == {"rub_force": ""}
    assert forces("m", "") == {"rub_force": ""}  # a mass without a unit
    turning = ns.mechanical(
        "J",
        0.0,
        0.0,
        parameters={"J": (2.0, "kg m^2")},
        coordinates={"a": "rad"},
        elements={"stop": Stop(at="a", position=1.0)},
    )
    assert turning.outputs["stop_force"] == "N m"
    run = ns.simulate(turning, duration=2.0, start={"v_a": 1.0})
    units = {name: run[f"stop_{name}"].attrs["units"] for name in ("force", "impulse", "impact_speed", "energy_lost")}
    assert units == {"force": "N m", "impulse": "N m s", "impact_speed": "1/s", "energy_lost": "J"}
    assert run["stop_energy_lost"].values == pytest.approx([1.0])  # 1/2 J v^2
    driven = ns.mechanical(
        "m",
        0.1,
        1.0,
        parameters={"m": (2.0, "kg"), "w": 1.0},
        coordinates={"q": "m"},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"s": Stop(at="q", position=1.0)},
    )
    assert dict(ns.System.from_text(driven.to_text()).outputs) == dict(driven.outputs) == {"s_force": "N"}
