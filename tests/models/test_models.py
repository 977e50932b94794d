"""The ready models against what was published for them."""

import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import nonsmooth as ns
from nonsmooth import models

pytestmark = pytest.mark.physics


def numbers(system, expressions, u, t=0.0):
    traced = system.traced
    return np.array(
        sp.lambdify([traced.t, traced.u, traced.p], expressions, modules="numpy")(t, u, system.parameter_vector()),
        float,
    )


def test_every_model_is_listed_documented_and_takes_parameters():
    """Its values are those of its documentation: ``zeta`` 0.05 (damping ratio), a name and a number or a fraction."""
    files = Path(models.__file__).parent.glob("*.py")
    assert models.names() == tuple(sorted(file.stem for file in files if file.stem != "__init__"))
    for name in models.names():
        make = getattr(models, name)
        assert "References" in make.__doc__
        system = make()
        sentence = re.search(r"\*\*parameters : float\n(.*?)(\.\s|\n\n)", make.__doc__, re.DOTALL)[1]
        said = re.findall(r"``(\w+)``\s+(-?\d[\d./e-]*(?<!\.))", sentence)
        assert dict(system.values) == {key: float(Fraction(number)) for key, number in said}
        first = next(iter(system.values))
        assert make(**{first: 2.0}).values[first] == 2.0
        with pytest.raises(ValueError, match="`nonsense` is not a parameter"):
            make(nonsense=1.0)


def test_the_smoothed_support_pushes_as_eqs_8_say():
    """Entering with v_a at x = g - eta, the force grows from 0 to that of contact; leaving it is half of either."""
    eta, g, k_s, c_s = 1e-3, -0.0045, 1210.0, 0.60
    system = models.discontinuous_support().smoothed(eta)
    run = ns.simulate(system, duration=0.15, start={"x": g - 1.5 * eta, "v": 0.1}, samples=1501)
    x, v = run["u"].values.T
    mode = np.array(system.modes)[run["mode"].values]
    q, v_a = (x - g + eta) / (2 * eta), run["u_before"].values[0, 1]
    entering = -k_s / 2 * (x - g + eta) - c_s * v + c_s * v_a * (1 - q)
    leaving = -k_s / 2 * (x - g + eta) - c_s / 2 * v
    expected = {"free": 0 * x, "penetration_band": entering, "contact": -k_s * (x - g) - c_s * v}
    for name, force in (expected | {"separation_band": leaving}).items():
        at = mode == name
        assert at.sum() > 10
        np.testing.assert_allclose(run["contact_force"].values[at], force[at], atol=1e-9)


def test_the_paper_s_table_1_and_natural_frequency():
    values = models.discontinuous_support().values
    table = {"k": 8.47, "k_s": 1210, "c": 0.87, "c_s": 0.60, "m": 0.838}
    assert {key: values[key] for key in table} == table
    assert np.sqrt(2 * values["k"] / values["m"]) == pytest.approx(4.50, abs=0.005)  # printed in Sec. 3.1
    damping_ratio = values["c"] / (2 * values["m"] * np.sqrt(2 * values["k"] / values["m"]))
    assert damping_ratio == pytest.approx(0.115, abs=0.001)  # Fig. 6


def test_the_support_pushes_only_in_contact():
    system = models.discontinuous_support()
    free, contact = (numbers(system, [row[mode] for row in system.traced.outputs], (-0.004, 0.1))[0] for mode in (0, 1))
    assert free == 0
    assert contact == pytest.approx(-(1210 * 0.0005 + 0.60 * 0.1), rel=1e-12)


def test_the_impact_oscillator_grazes_at_the_published_amplitude():
    system = models.impact_oscillator()
    p = dict(system.values)
    amplitude = p["d"] * np.hypot(p["k"] - p["omega"] ** 2, p["c"] * p["omega"])
    assert amplitude == pytest.approx(0.1)
    # x = d sin(omega t) solves the equation there (resonance) and just reaches the stop
    grazing = system.with_parameters(A=amplitude)
    for t in (0.0, 0.4, 2.0):
        x, v = np.sin(t), np.cos(t)
        assert numbers(grazing, grazing.traced.fields[0], (x, v), t) == pytest.approx([v, -x])


def test_the_relief_valve_has_the_published_hopf_point():
    system = models.relief_valve(q=8.4911176352)
    # equilibrium: y2 = 0, y3 = y1 + delta, y1 sqrt(y3) = q
    lift = next(r.real for r in np.roots([1, 10, 0, -(8.4911176352**2)]) if r.real > 0)
    rest = (lift, 0.0, lift + 10)
    assert numbers(system, system.traced.fields[0], rest) == pytest.approx([0, 0, 0], abs=1e-12)
    jacobian = numbers(system, [e for row in system.derivatives.field(0) for e in row], rest).reshape(3, 3)
    leading = max(np.linalg.eigvals(jacobian), key=lambda z: z.real)
    assert leading.real == pytest.approx(0, abs=1e-9)
    assert abs(leading.imag) > 0.1


def test_listing_models_loads_no_heavy_package():
    code = "import sys; from nonsmooth import models; models.names(); "
    code += "print({'sympy', 'numba', 'xarray'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"
