"""The rig's equations against closed forms, and against the model where all that is more than it is switched off."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from scipy.optimize import brentq
from scipy.special import ellipe, jv

import nonsmooth as ns
from nonsmooth_savi2007.rig import VirtualRig
from nonsmooth_savi2007.rig.motor import mean_position, passages
from nonsmooth_savi2007.rig.physics import AT_REST, car, crank_angle, friction, simulated, support_force

OFF = {
    "ripple": False,
    "string": False,
    "friction": False,
    "support_relaxation": False,
    "jitter": False,
    "noise": False,
    "quantisation": False,
    "gain_error": False,
}


@pytest.mark.parametrize(
    ("omega", "rho", "g"), [(3.69, 0.45, -0.0045), (4.5, 0.14, 0.02), (11.15, 0.33, -0.0012), (8.64, 0.23, 0.0036)]
)
def test_without_its_features_the_rig_is_the_model(omega: float, rho: float, g: float) -> None:
    rig = VirtualRig(11, **OFF)
    p = rig.named_parameters(omega=omega, g=g, crank_length=rho / rig.truth["k"])
    instants = np.linspace(0.0, 12 * 2 * np.pi / omega, 2001)
    start = {"x": min(g, 0.0)}
    ours = ns.simulate(rig.system().with_parameters(vars(p)), periods=12, samples=instants, start=start, rtol=1e-13)
    model = ns.models.discontinuous_support(m=p.m, k=p.k, k_s=p.k_s, c=p.c, c_s=p.c_s, g=g, rho=rho, omega=omega)
    theirs = ns.simulate(model, periods=12, samples=instants, start=start, method="exact")
    assert ours.sizes["crossing"] == theirs.sizes["crossing"]
    np.testing.assert_allclose(ours["crossing_time"], theirs["crossing_time"], atol=1e-8)
    inner = ~np.isin(ours["time"].values, ours["crossing_time"].values)
    other = ~np.isin(theirs["time"].values, theirs["crossing_time"].values)
    np.testing.assert_allclose(ours["u"].values[inner], theirs["u"].values[other], rtol=0, atol=1e-8)


def test_the_string_moves_the_mean_position() -> None:
    """The mean of d is L - L (2/pi) E(a^2/L^2), half of it the car's: a^2 / (8 L) to first order."""
    rig = VirtualRig(2, friction=False, truth={"string_length": 0.5, "ripple": 0.0})
    a, length = 0.04, 0.5
    system = rig.system().with_parameters(rig.parameters(omega=5.0, crank_length=a, g=1.0))
    n = 256
    period = system.period()
    samples = (40 + np.arange(n) / n) * period
    run = ns.simulate(system, periods=1, transient=40, samples=samples, rtol=1e-12)
    mean = float(run["u"].sel(state="x").mean())
    exact = length * (1 - 2 / np.pi * ellipe((a / length) ** 2)) / 2
    assert mean == pytest.approx(exact, abs=1e-11)
    assert mean == pytest.approx(a**2 / (8 * length), rel=(a / length) ** 2)


@pytest.mark.parametrize("phase", [0.0, 1.0, 3.0])
def test_uneven_turning_moves_the_mean_position_too(phase: float) -> None:
    """The mean of cos(s + e sin(s + b)) is -J_1(e) cos b."""
    rig = VirtualRig(2, string=False, truth={"ripple": 0.02, "ripple_phase": phase})
    assert mean_position(rig, 0.04) == pytest.approx(-0.04 * jv(1, 0.02) * np.cos(phase) / 2, abs=1e-15)


def test_the_support_relaxes_as_it_should() -> None:
    rig = VirtualRig(5)
    p = rig.truth
    system = rig.system().with_parameters(rig.parameters(omega=4.0, crank_length=0.03, g=0.002))
    run = ns.simulate(system, periods=6, samples=200_001, method="rkf45")
    names = [run["crossing_transition"].attrs["flag_meanings"].split()[i] for i in run["crossing_transition"].values]
    left = [i for i, name in enumerate(names) if name.endswith("relaxing")]
    assert len(left) >= 3
    i = left[1]
    begin, y_0 = float(run["crossing_time"][i]), float(run["u_after"][i].sel(state="y"))
    end = float(run["crossing_time"][i + 1])
    rate = p["k_s"] / p["c_s"]
    # At release the force vanishes: k_s y + c_s v = 0.
    assert y_0 == pytest.approx(-float(run["u_after"][i].sel(state="v")) / rate, rel=1e-7)
    assert end - begin == pytest.approx(np.log(y_0 / AT_REST) / rate, rel=1e-6)
    t = run["time"].values
    inside = (t > begin) & (t < end)
    assert inside.sum() > 20
    y = run["u"].sel(state="y").values[inside]
    np.testing.assert_allclose(y, y_0 * np.exp(-rate * (t[inside] - begin)), rtol=1e-6, atol=1e-13)


def test_energy_is_kept_but_for_what_the_dampers_take() -> None:
    """Kinetic and spring energy fall by the work of friction and of the support's force."""
    rig = VirtualRig(7)
    values = rig.parameters(crank_length=0.0, g=0.001)
    system = rig.system().with_parameters(values)
    run = ns.simulate(system, duration=4.0, start={"v": 0.4}, samples=400_001, method="rkf45", rtol=1e-12)
    x, v = (run["u"].sel(state=name).values for name in ("x", "v"))
    energy = values["m"] * v**2 / 2 + values["k"] * x**2
    p = SimpleNamespace(**values)
    touching = run["mode"].values == run["mode"].attrs["flag_meanings"].split().index("contact")
    power = np.where(touching, support_force(x, v, p) * v, 0.0) - v * friction(v, p)
    # The two limits at a crossing stand side by side, so that the trapezoid rule sees no jump.
    assert run.sizes["crossing"] >= 6
    assert trapezoid(power, run["time"].values) == pytest.approx(energy[-1] - energy[0], rel=1e-6)


def test_a_string_cannot_push() -> None:
    """Beyond T_0 / k one spring alone acts: an oscillation at sqrt(k / m) about T_0 / k."""
    rig = VirtualRig(3, **OFF, truth={"c": 0.0, "pretension": 1.0})
    values = rig.parameters(crank_length=0.0, g=10.0)
    slack, w = values["pretension"] / values["k"], np.sqrt(values["k"] / values["m"])
    for side, mode in ((1.0, "slack_driven"), (-1.0, "slack_fixed")):
        start = side * 1.8 * slack
        returns = np.arccos((slack + slack) / (1.8 * slack + slack)) / w  # from 1.8 slack to slack, about -slack
        t = np.linspace(0.0, 0.999 * returns, 200)
        run = ns.simulate(
            rig.system().with_parameters(values),
            duration=2 * returns,
            start={"x": start},
            samples=np.append(t, 2 * returns),
            rtol=1e-12,
        )
        expected = side * (-slack + 2.8 * slack * np.cos(w * t))
        np.testing.assert_allclose(run["u"].sel(state="x").values[: len(t)], expected, atol=1e-10)
        assert run["mode"].attrs["flag_meanings"].split()[int(run["mode"][0])] == mode
        assert float(run["crossing_time"][-1]) == pytest.approx(returns, abs=1e-9)


@pytest.mark.parametrize(("ripple", "phase"), [(0.0, 0.3), (0.02, 0.0), (0.02, np.pi / 2), (0.3, 2.0)])
def test_photogate_sees_whole_turns(ripple: float, phase: float) -> None:
    rig = VirtualRig(1, truth={"ripple": ripple, "ripple_phase": phase})
    omega = 7.3
    seen = passages(rig, omega, 10.0, 30.0)
    period = 2 * np.pi / omega
    first = brentq(lambda s: s + ripple * np.sin(s + phase), -1.0, 1.0, xtol=1e-15) / omega
    n = np.arange(-100, 100)
    expected = first + n * period
    np.testing.assert_allclose(seen, expected[(expected >= 10) & (expected <= 30)], rtol=0, atol=1e-12)
    angles = crank_angle(seen, rig.named_parameters(omega=omega))
    np.testing.assert_allclose(angles, 2 * np.pi * np.rint(angles / (2 * np.pi)), atol=1e-11)


def test_a_crank_that_grows_at_no_rate_is_a_crank() -> None:
    rig = VirtualRig(4)
    fixed = rig.system().with_parameters(rig.parameters(omega=4.0, crank_length=0.03, g=0.002))
    growing = car(rising=True).with_parameters(rig.parameters(rising=True, omega=4.0, g=0.002))
    one = ns.simulate(fixed, periods=5, samples=501, method="rkf45")
    other = ns.simulate(growing, periods=5, samples=501, start={"a": 0.03}, method="rkf45")
    for state in ("x", "v"):
        np.testing.assert_allclose(one["u"].sel(state=state), other["u"].sel(state=state), atol=1e-9)


@pytest.mark.parametrize("velocity", [0.4, 0.05])
def test_friction_is_followed_through_its_steep_piece(velocity: float) -> None:
    """A free decay as the rig records it, against SciPy's integrator with steps that cannot miss a change of sign."""
    rig = VirtualRig(7)
    p = rig.named_parameters(crank_length=0.0, g=10.0)

    def field(t: float, u: np.ndarray) -> list[float]:
        return [u[1], (-2 * p.k * u[0] - friction(u[1], p)) / p.m]

    t = np.linspace(0.0, 3.0, 301)
    other = solve_ivp(field, (0, 3), (0, velocity), method="DOP853", rtol=1e-12, atol=1e-15, max_step=1e-3, t_eval=t)
    ours, _ = simulated(
        rig.system().with_parameters(vars(p)), "Run #1", instants=t, duration=3.0, start={"v": velocity}
    )
    np.testing.assert_allclose(ours[0], other.y[0], rtol=0, atol=3e-9)
    np.testing.assert_allclose(ours[1], other.y[1], rtol=0, atol=3e-8)
