"""Unstable motions of a rig, held by a controller, against the branch of its model."""

import numpy as np
import pytest

import nonsmooth as ns

CONTROLLED = {"rate": 50.0, "resolution": 5.48e-5, "jitter": 5e-5}  # 1440 counts on a wheel of 78.9 mm


@pytest.fixture(scope="module")
def theory():
    """The branch of Fig. 9 by its equations, from the upper part through the fold to the graze."""
    model = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0)
    return branch_of(ns.continue_orbit(ns.find_orbit(model, progress=False), "omega", (4.99, 5.9), step=0.01))


def branch_of(branch):
    kinds = branch["special_kind"].values.astype(str)
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    first, last = (int(i) for i in branch["special_point"].values[kinds == "fold"])
    return {
        "at": branch["omega"].values,
        "half": half,
        "upper": slice(0, first + 1),
        "unstable": slice(first, last + 1),
        "section": branch["section"].values,
        "folds": branch["omega"].values[[first, last]],
    }


def amplitude_at(theory, part, omega):
    """Amplitude of a part of the branch, over which the frequency rises or falls."""
    at, half = theory["at"][theory[part]], theory["half"][theory[part]]
    order = np.argsort(at)
    return np.interp(omega, at[order], half[order])


@pytest.fixture(scope="module")
def measured(theory):
    """The branch from the upper motion round the fold and down, as the rig shows it."""
    start = theory["section"][np.argmin(np.abs(theory["at"][theory["upper"]] - 5.72))]
    model = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.72)
    rig = ns.SimulatedRig(model, start=start.tolist(), **CONTROLLED)
    return ns.control_based_continuation(
        rig,
        "frequency",
        (5.6, 5.9),
        frequency=5.72,
        amplitude=0.14,
        step=0.25,
        holding=ns.Holding(transient=20),
        progress=False,
    )


def test_the_fold_is_where_the_model_has_it(measured, theory):
    assert measured["special_kind"].values.tolist() == ["fold"]
    assert float(measured["special_value"][0]) == pytest.approx(theory["folds"][0], rel=2e-3)


def test_unstable_motions_are_those_of_the_model(measured, theory):
    lower = measured.isel(point=slice(int(measured["special_point"][0]) + 1, None))
    lower = lower.isel(point=lower["omega"].values < 5.78)  # at the fold the amplitude has no value of its own
    assert lower.sizes["point"] >= 5
    true = amplitude_at(theory, "unstable", lower["omega"].values)
    assert np.abs(lower["amplitude"].values / true - 1).max() < 2e-3
    assert (true < 0.99 * amplitude_at(theory, "upper", lower["omega"].values)).all()  # the other branch is far


def test_the_control_force_falls_to_its_noise(measured):
    noise = measured["control_effort_noise"].values
    assert (measured["control_effort"].values < 2 * noise).all()
    assert (measured["control_effort_first"].values > 3 * noise).mean() > 0.8  # it was not small from the first
    assert (noise < 0.01 * 0.14).all()  # a hundredth of the drive


def test_motions_that_are_let_go_tell_their_stability(measured, theory):
    omega, fold = measured["omega"].values, int(measured["special_point"][0])
    stability = measured["stability"].values
    clear = omega < 5.77
    before = np.arange(len(omega)) < fold
    assert (stability[clear & ~before] == 0).all() and (clear & ~before).sum() >= 3
    assert (stability[before] != 0).all() and (stability[before] == 1).any()  # -1: not told within the noise


class Bare:
    """A rig of three methods and nothing else, round one that is simulated."""

    def __init__(self, rig, calls=10**9):
        self.rig, self.left, self.force = rig, calls, None

    def set_drive(self, frequency, amplitude):
        return self.rig.set_drive(frequency, amplitude)

    def apply_force(self, force):
        self.force = force
        self.rig.apply_force(force)

    def read(self):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
        return self.rig.read()


def free_motion(**options):
    """A rig whose mass stays clear of its support."""
    return ns.SimulatedRig(ns.models.discontinuous_support(g=0.02, rho=0.05, omega=6.5), **{**CONTROLLED, **options})


WITHOUT_CONTACT = {"frequency": 6.5, "amplitude": 0.05, "progress": False}
BRIEFLY = {"transient": 15, "release": 0}


def test_three_methods_are_enough_and_motion_without_contact_is_that_of_the_formula():
    found = ns.control_based_continuation(
        Bare(free_motion()),
        "frequency",
        (6.3, 6.8),
        direction="down",
        step=0.3,
        holding=ns.Holding(mass=0.838, **BRIEFLY),
        **WITHOUT_CONTACT,
    )
    m, k, c, rho, omega = 0.838, 8.47, 0.87, 0.05, found["drive_frequency"].values
    formula = rho / np.hypot(2 * k - m * omega**2, c * omega)
    spread = np.abs(found["amplitude"].values - formula) / found["amplitude_uncertainty"].values
    assert found.sizes["point"] >= 2 and (spread < 4).all()
    assert (found["amplitude_uncertainty"].values < 5e-3 * formula).all()


def test_a_branch_that_leaves_its_range_with_the_first_step_is_a_result_of_no_point():
    held = ns.Holding(**BRIEFLY)
    found = ns.control_based_continuation(
        free_motion(), "frequency", (6.5, 6.8), direction="down", holding=held, **WITHOUT_CONTACT
    )
    assert found.sizes["point"] == found.sizes["special"] == 0 and found["position_sine"].dims == ("point", "harmonic")
    assert str(found["ended_because"].values) == "The branch reached the edge of the range."


def test_ctrl_c_leaves_the_rig_without_a_force_and_keeps_the_points():
    rig = Bare(free_motion(), calls=15_000)
    with pytest.raises(ns.Interrupted) as caught:
        ns.control_based_continuation(
            rig, "frequency", (3.0, 6.8), step=0.01, holding=ns.Holding(mass=0.838, **BRIEFLY), **WITHOUT_CONTACT
        )
    assert caught.value.result.sizes["point"] >= 1 and "nterrupted" in str(caught.value.result["ended_because"].values)
    assert rig.force == 0.0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"parameter": "frequenzy"}, "nearest: frequency"),
        ({"range": (7.0, 6.0)}, "first end must be below"),
        ({"range": (4.0, 5.0)}, "begin within it"),
        ({"direction": "left"}, "'up', 'down'"),
        ({"holding": ns.Holding(harmonics=90, transient=0)}, "at most"),
        ({"step": 0.0}, "positive"),
    ],
)
def test_wrong_arguments_are_answered(changed, message):
    given = {"parameter": "frequency", "range": (6.0, 7.0), **WITHOUT_CONTACT, **changed}
    with pytest.raises(ValueError, match=message):
        ns.control_based_continuation(free_motion(), **given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"gains": (1.0, 0.0)}, "without damping"),
        ({"gains": 3.0}, "two numbers"),
        ({"mass": -0.8}, "positive"),
        ({"tolerance": 0.0}, "positive"),
        ({"record": 2}, "record"),
    ],
)
def test_holdings_that_hold_nothing_are_answered(given, message):
    with pytest.raises(ValueError, match=message):
        ns.Holding(**given)


def test_what_is_no_rig_is_told_how_to_become_one():
    model = ns.models.discontinuous_support()
    with pytest.raises(TypeError, match="ns.SimulatedRig"):
        ns.control_based_continuation(model, "frequency", (4.0, 5.0), frequency=4.5, amplitude=0.1)
    with pytest.raises(ValueError, match="mass=..."):
        ns.control_based_continuation(Bare(None), "frequency", (4.0, 5.0), frequency=4.5, amplitude=0.1)
    with pytest.raises(ValueError, match="nearest: omega"):
        ns.SimulatedRig(model, frequency="omgea")
    cart = ns.mechanical(
        1.0,
        0.1,
        1.0,
        coordinates=["x"],
        parameters={"P": 0.3, "w": 1.0},
        forcing={"x": lambda t, p: p.P * np.cos(p.w * t)},
    )
    options = {"velocity": "v_x", "frequency": "w", "amplitude": "P", "mass": 1.0}
    assert ns.SimulatedRig(cart, **options).mass == 1.0
    for option, given in {"velocity": "v", "frequency": "omega", "amplitude": "rho", "mass": "m"}.items():
        others = {name: one for name, one in options.items() if name != option}
        with pytest.raises(ValueError, match=f"^{option} = '{given}': .* give {option}= of this system"):
            ns.SimulatedRig(cart, **others)
    with pytest.raises(ns.SystemDefinitionError, match="no forcing period"):
        ns.SimulatedRig(ns.models.stick_slip_belt(), frequency="v_b", amplitude="F", mass=1.0)


def test_a_motion_of_twice_the_period_is_no_beginning():
    rig = ns.SimulatedRig(ns.models.discontinuous_support(g=0.02, rho=0.14, omega=3.7), **CONTROLLED)  # between flips
    with pytest.raises(ns.SolveError, match="does not repeat"):
        ns.control_based_continuation(rig, "frequency", (3.6, 4.0), frequency=3.7, amplitude=0.14, progress=False)
