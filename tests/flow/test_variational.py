"""Saltation matrices and parameter sensitivities against finite differences of the exact flow, entry by entry.

The flow that is differenced is the engines' (closed form or Taylor series at rtol 1e-15), which knows nothing of
derivatives. Central differences of falling step are extrapolated (Ridders 1982), so that what is compared is known to
1e-9 or so; an entry is compared relative to its own size, or to a thousandth of the largest one of its column.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from random_systems import TEMPLATES, draw
from scipy.linalg import expm

import nonsmooth as ns
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.saltation import Jump
from nonsmooth.flow.sensitivity import sensitivity, variation
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes

PER_TEMPLATE = 10  # ten templates: 100 systems
NEAREST_GRAZE = 1e-2
TOLERANCE = 1e-7
LEVELS, SHRINK = 9, 1.7
ENOUGH = 3e-11  # of the largest entry: no further step


class OtherPathError(Exception):
    """The neighbour's transitions are not those of the run."""


def exact_end(system, state, duration, path=None):
    """(u, memory) after the duration, and the transitions taken."""
    method = "auto" if not system.is_smoothed else "taylor"
    engine = engine_for(system, method)
    if engine.name == "taylor":
        engine = engine_for(system, method, 1e-15)
    state = state.copy()
    log = engine.record(engine.prepare(system.parameter_vector()[None, :]), state, duration, np.empty(0))
    taken = tuple(log.crossing_transition.tolist())
    if log.status != codes.OK or (path is not None and taken != path):
        raise OtherPathError
    return np.concatenate([state.u, state.memory]), taken


def differenced(end, size):
    """d end / d x at x = 0 by Ridders' extrapolated central differences, and how well it is known."""
    best, error = None, np.inf
    table: list[np.ndarray] = []
    h = size
    while len(table) < LEVELS and h > 1e-6 * size:
        h /= SHRINK
        try:
            row = [(end(h) - end(-h)) / (2 * h)]
        except OtherPathError:
            table = []  # the neighbours take another path: nearer
            continue
        for k in range(len(table)):
            factor = SHRINK ** (2 * (k + 1))
            row.append((factor * row[k] - table[k]) / (factor - 1))
            spread = max(np.abs(row[k + 1] - row[k]).max(), np.abs(row[k + 1] - table[k]).max())
            if spread < error:
                best, error = row[k + 1], spread
        table = row
        if best is not None and error < ENOUGH * np.abs(best).max():
            break
    return best, error


def finite_differences(system, state, duration, active):
    """Phi and P by differences of the flow, and the error of each column."""
    _, path = exact_end(system, state, duration)
    columns, errors = [], []
    n_u = len(state.u)
    for j in range(n_u + len(state.memory)):

        def moved(h, j=j):
            other = state.copy()
            (other.u if j < n_u else other.memory)[j if j < n_u else j - n_u] += h
            return exact_end(system, other, duration, path)[0]

        columns.append(differenced(moved, 3e-3))
        errors.append(columns[-1][1])
    for name in active:

        def changed(h, name=name):
            other = system.with_parameters({name: system.values[name] + h})
            return exact_end(other, state, duration, path)[0]

        columns.append(differenced(changed, 3e-3 if name != "eta" else 1e-3))
        errors.append(columns[-1][1])
    if any(column is None for column, _ in columns):
        raise OtherPathError
    return np.stack([column for column, _ in columns], axis=1), np.array(errors)


def mismatch(computed, differences):
    """The largest difference of an entry, relative to it or to a thousandth of its column's largest."""
    size = np.abs(differences)
    floor = np.maximum(np.maximum(size, 1e-3 * size.max(axis=0)), 1e-6 * size.max())
    return np.max(np.abs(computed - differences) / floor)


class Case:
    """One random system with a run that has transitions, none of them near to grazing."""

    def __init__(self, system, start, duration, active):
        self.system, self.active = system, active
        self.flow = VariationalFlow.of(system, active)
        self.state = State(start.copy(), system.memory_vector())
        self.duration = duration
        self.variation, log = variation(system, self.flow, self.state.copy(), duration)
        if not self.variation.jumps or log.status != codes.OK:
            raise OtherPathError
        self.nearest = min(jump.transversality for jump in self.variation.jumps)

    def products(self, matrix, column):
        """Phi and P put together with saltation as the two functions of a jump give it."""
        legs = self.variation.segments
        phi, p = legs.Phi[0], legs.P[0]
        if (start := self.variation.start) is not None:
            phi, p = phi @ start.R_z, p + phi @ start.R[: start.n, start.n :]
        for i, jump in enumerate(self.variation.jumps, start=1):
            s = matrix(jump)
            phi, p = legs.Phi[i] @ (s @ phi), legs.Phi[i] @ (s @ p + column(jump)) + legs.P[i]
        return np.hstack([phi, p])


def cases(name: str):
    """Systems of one template, and how many draws were discarded for a crossing near to grazing."""
    template = TEMPLATES[name]()
    rng = np.random.default_rng(sorted(TEMPLATES).index(name) + 2024)
    kept: list[Case] = []
    discarded = 0
    while len(kept) < PER_TEMPLATE:
        try:
            case = Case(*draw(template, rng), template.active)
        except (OtherPathError, SolveError):
            continue  # no transition in this run, chatter, or a start beyond a stop
        if case.nearest < NEAREST_GRAZE:
            discarded += 1
        else:
            kept.append(case)
    return kept, discarded


@cache
def compared(name: str):
    """(case, differences of the flow, how well they are known) for every system of a template, and the discards."""
    kept, discarded = cases(name)
    return [(c, *finite_differences(c.system, c.state, c.duration, c.active)) for c in kept], discarded


def saltation(jump: Jump) -> np.ndarray:
    return jump.saltation


def column(jump: Jump) -> np.ndarray:
    return jump.S[: jump.n, jump.n :]


@pytest.mark.parametrize("name", TEMPLATES)
def test_derivatives_of_random_systems(name: str) -> None:
    found, discarded = compared(name)
    assert discarded <= 0.1 * (len(found) + discarded)
    worst = max(mismatch(case.products(saltation, column), differences) for case, differences, _ in found)
    print(f"\n{name}: {len(found)} systems, {discarded} discarded, worst relative difference {worst:.1e}")
    for case, differences, error in found:
        assert error.max() < 1e-8 * np.abs(differences).max()  # the differences themselves are good enough
        assert mismatch(case.products(saltation, column), differences) < TOLERANCE, case.system.values
        assert mismatch(case.products(saltation, column), case.variation.D[0]) < 1e-12
        # The trace identity; in a system with memory or dropped states both sides are minus infinity.
        a, b = case.variation.log_determinant, case.variation.trace
        assert a == b or abs(a - b) < 1e-10


BROKEN = {
    "sign": (lambda jump: 2 * jump.R_z - jump.saltation, column),
    "omitted": (lambda jump: jump.R_z, column),
    "identity": (lambda jump: np.eye(len(jump.z_after)), column),
    "parameters omitted": (saltation, lambda jump: 0.0 * jump.S[: jump.n, jump.n :]),
    "parameters' sign": (saltation, lambda jump: 2 * jump.R[: jump.n, jump.n :] - jump.S[: jump.n, jump.n :]),
}


@pytest.mark.parametrize("how", BROKEN)
def test_the_test_sees_a_broken_saltation_matrix(how: str) -> None:
    """A test of the test: with S broken in any of these ways it fails, in nearly every one of the systems."""
    failed, total = 0, 0
    for name in TEMPLATES:
        found, _ = compared(name)
        for case, differences, _ in found:
            failed += mismatch(case.products(*BROKEN[how]), differences) > TOLERANCE
            total += 1
    print(f"\nS {how}: {failed} of {total} fail")
    assert total == PER_TEMPLATE * len(TEMPLATES)
    assert failed >= 0.9 * total


def test_the_trace_identity_does_not_see_it() -> None:
    """If the surface holds positions only, det S = 1 for the right matrix, for a wrong sign, and for none."""
    for case, _, _ in compared("bilinear")[0]:
        for matrix in (saltation, *(pair[0] for pair in BROKEN.values())):
            determinants = [np.linalg.slogdet(matrix(jump))[1] for jump in case.variation.jumps]
            assert np.abs(determinants).max() < 1e-12


# ---------------------------------------------------------------------------------------------------------------
# Segments, jumps and indicators one by one


def test_legs_are_exponentials_of_linear_modes() -> None:
    """dz/dz0 = exp(A tau) of the paper's oscillator, forwards and backwards, and the determinant's integral."""
    system = ns.models.discontinuous_support()
    flow, v = VariationalFlow.of(system), system.values
    stiffness, damping = 2 * v["k"] + np.array([0.0, v["k_s"]]), v["c"] + np.array([0.0, v["c_s"]])
    tau = np.array([1.5, 0.08, -0.3, 0.0])
    modes = np.array([0, 1, 0, 1])
    legs = flow.segments(system.parameter_vector(), modes, [0.1, 0.5, 2.0, 0.0], tau, np.full((4, 2), -0.003))
    for i, mode in enumerate(modes):
        matrix = np.array([[0.0, 1.0], [-stiffness[mode] / v["m"], -damping[mode] / v["m"]]])
        rate = np.sqrt(stiffness[mode] / v["m"])
        scale = np.array([[1.0, 1 / rate], [rate, 1.0]])
        assert np.abs((legs.Phi[i] - expm(matrix * tau[i])) / scale).max() < 2e-14
        assert abs(legs.divergence[i] + damping[mode] / v["m"] * tau[i]) < 1e-14
    assert (legs.status == 0).all() and legs.P.shape == (4, 2, 0)


def test_a_short_leg_from_balanced_forces_ends() -> None:
    """A speed that is all rounding, as where friction lets a mass go, shrinks no steps: v(tau) = a' tau^2 / 2."""
    system = ns.models.discontinuous_support()
    flow, v = VariationalFlow.of(system, ("omega",)), system.values
    t, tau = 0.8, np.array([5e-8, -5e-8, 3e-10])
    values = system.parameter_vector()
    force = flow.segments(values, [0], [t], [0.0], [[0.0, 0.0]]).f_end[0, 1] * v["m"]
    legs = flow.segments(values, [0] * 3, [t] * 3, tau, [[force / (2 * v["k"]), 0.0]] * 3)
    assert (legs.status == codes.OK).all()
    assert legs.Phi[:, 0, 1] == pytest.approx(tau, rel=1e-6)
    growth = (legs.f_end[:, 1] - legs.f_begin[:, 1]) / tau
    assert legs.z[:2, 1] == pytest.approx(growth[:2] * tau[:2] ** 2 / 2, rel=1e-4)


def test_a_leg_where_forcing_equals_friction_ends() -> None:
    """All of the force is the rounding of A cos w t and F, whatever the states: Phi(0, v) = tau to first order."""
    system = ns.System(
        states=["x", "v"],
        parameters={"A": 0.4468628829226984, "F": 0.4468628827096838, "w": 1.2642722025962563},
        modes={"slip": lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - p.F - u.x - 0.2 * u.v)},
        period=lambda p: 2 * np.pi / p.w,
    )
    flow, tau = VariationalFlow.of(system, ("A",)), 4.87496328e-05
    legs = flow.segments(system.parameter_vector(), [0], [0.0], [tau], [[-1.39172937e-15, -3.64448472e-15]])
    assert legs.status[0] == codes.OK
    assert legs.Phi[0, 0, 1] == pytest.approx(tau * (1 - 0.1 * tau), rel=1e-9)


def test_a_leg_and_its_way_back_cancel() -> None:
    """Of a nonlinear mode, with parameters: z returns, the matrices are inverse, and P of the way back undoes P."""
    template = TEMPLATES["shell"]()
    flow = VariationalFlow.of(template.system, template.active)
    values = template.system.parameter_vector()
    there = flow.segments(values, [1], [0.4], [2.5], [[0.4, -0.3, 0.5]])
    back = flow.segments(values, [1], [2.9], [-2.5], there.z)
    assert np.abs(back.z[0] - [0.4, -0.3, 0.5]).max() < 1e-13
    assert np.abs(back.Phi[0] @ there.Phi[0] - np.eye(3)).max() < 1e-12
    assert np.abs(back.Phi[0] @ there.P[0] + back.P[0]).max() < 1e-12
    assert np.abs(there.P).max() > 1e-2


def test_derivative_in_the_beginning() -> None:
    """dz/dt0 = f_end - Phi f_begin, against differences."""
    template = TEMPLATES["pendula"]()
    flow, values = VariationalFlow.of(template.system, template.active), template.system.parameter_vector()
    z0 = np.array([[0.3, -0.2, 0.1, 0.4]])

    def end(h: float) -> np.ndarray:
        return flow.segments(values, [1], [0.7 + h], [1.3], z0).z[0]

    exact = flow.segments(values, [1], [0.7], [1.3], z0).start_time()[0]
    difference, error = differenced(end, 1e-2)
    assert error < 1e-11 and np.abs(exact - difference).max() < 1e-10


def test_an_indicator_and_its_lie_derivatives() -> None:
    """L_f h and L_f^2 h are derivatives along the motion; gradients against differences."""
    system, active = TEMPLATES["pendula"]().system, TEMPLATES["pendula"]().active
    flow, values = VariationalFlow.of(system, active), system.parameter_vector()
    t, z = 0.7, np.array([0.3, -0.2, 0.1, 0.4])
    touch = flow.indicator(values, 0, 1, t, z)

    def along(h: float) -> np.ndarray:
        leg = flow.segments(values, [1], [t], [h], z[None])
        there = flow.indicator(values, 0, 1, t + h, leg.z[0])
        return np.array([there.h, there.L])

    slope, _ = differenced(along, 1e-2)
    assert np.abs(slope - [touch.L, touch.L2]).max() < 1e-9

    def at(t: float, z: np.ndarray, values: np.ndarray) -> np.ndarray:
        there = flow.indicator(values, 0, 1, t, z)
        return np.array([there.h, there.L, there.L2])

    for j, unit in enumerate(np.eye(4)):
        slope, _ = differenced(lambda h, unit=unit: at(t, z + h * unit, values), 1e-2)
        assert np.abs(slope - [touch.h_z[j], touch.L_z[j], touch.L2_z[j]]).max() < 1e-9
    for j, name in enumerate(active):
        unit = np.eye(len(values))[list(system.values).index(name)]
        slope, _ = differenced(lambda h, unit=unit: at(t, z, values + h * unit), 1e-2)
        assert np.abs(slope - [touch.h_p[j], touch.L_p[j], touch.L2_p[j]]).max() < 1e-9
    slope, _ = differenced(lambda h: at(t + h, z, values), 1e-2)
    assert np.abs(slope - [touch.h_t, touch.L_t, touch.L2_t]).max() < 1e-9


def test_saltation_of_the_papers_oscillator() -> None:
    """S = [[1, 0], [-c_s/m, 1]] at an entry through h_a = 0; the identity where the force is zero already."""
    system = ns.models.discontinuous_support()
    v = system.values
    flow, values = VariationalFlow.of(system, ("g",)), system.parameter_vector()
    entry = flow.jump(values, 0, 0.3, [v["g"], 0.05])
    assert entry.indicator == 0 and entry.transversality > 0.05
    assert np.abs(entry.saltation - [[1.0, 0.0], [-v["c_s"] / v["m"], 1.0]]).max() < 3e-14
    # a later gap delays the entry by dg / v, and the push by as much
    assert np.abs(entry.S[: entry.n, entry.n] - [0.0, v["c_s"] / v["m"]]).max() < 3e-14
    assert abs(entry.instant[entry.n] - 1 / 0.05) < 1e-12
    release = flow.jump(values, 1, 0.3, [v["g"] + v["c_s"] / v["k_s"] * 0.05, -0.05])
    assert abs(release.h) < 1e-18 and np.abs(release.saltation - np.eye(2)).max() < 1e-12
    other = flow.jump(values, 0, 0.3, [v["g"] + 1e-5, -v["k_s"] / v["c_s"] * 1e-5])
    assert other.indicator == 1 and np.abs(other.saltation - np.eye(2)).max() < 1e-9


def test_stick_has_a_singular_saltation_matrix() -> None:
    """A mass that comes to rest on a belt forgets its velocity: a zero eigenvalue, and log|det S| is minus infinity."""
    system = ns.System(
        states=["x", "v"],
        parameters={"f": 0.3, "b": 0.2},
        modes={"slip": lambda t, u, p: (u.v, -u.x + p.f), "stick": lambda t, u, p: (p.b, 0.0)},
        indicators={"relative": lambda t, u, p: u.v - p.b},
        transitions=[ns.Transition("slip", "stick", when="relative > 0", reset=lambda t, u, p: (u.x, p.b))],
    )
    flow = VariationalFlow.of(system, ("b",))
    jump = flow.jump(system.parameter_vector(), 0, 0.0, [-0.5, 0.2])
    # at equal times: x has moved at b on both sides, v is b
    assert np.abs(jump.saltation - [[1.0, 0.0], [0.0, 0.0]]).max() < 1e-15
    assert jump.log_determinant == -np.inf
    assert np.abs(jump.S[: jump.n, jump.n] - [0.0, 1.0]).max() < 1e-15
    run = sensitivity(system, duration=2.0, start={"x": -1.0, "v": 0.0})
    assert run.log_det == -np.inf and run.trace_defect == 0.0 and len(run.crossing) == 1


def test_transitions_at_one_instant_are_one() -> None:
    """A reset that lands beyond a second surface: the second transition happens when the first does."""
    parameters = {"a": -1.0, "b": 0.7, "g": 0.5, "r": 0.4}
    system = ns.System(
        states=["x", "y"],
        parameters=parameters,
        modes={
            "one": lambda t, u, p: (1.0 + 0 * u.x, p.a * u.y),
            "two": lambda t, u, p: (2.0 + 0 * u.x, u.y),
            "three": lambda t, u, p: (0.5 + 0 * u.x, p.b * u.y + u.x),
        },
        indicators={"wall": lambda t, u, p: u.x - p.g - 0.1 * u.y, "high": lambda t, u, p: u.y - 0.2},
        transitions=[
            ns.Transition("one", "two", when="wall > 0", reset=lambda t, u, p: (u.x + p.r, 2 * u.y)),
            ns.Transition("two", "three", when="high > 0", reset=lambda t, u, p: (u.x * u.y, u.y + u.x)),
        ],
    )
    state = State(np.array([0.0, 0.6]), np.zeros(0))
    _, path = exact_end(system, state, 1.5)
    assert path == (0, 1)
    differences, error = finite_differences(system, state, 1.5, tuple(parameters))
    run = sensitivity(system, duration=1.5, start=[0.0, 0.6], parameters=tuple(parameters))
    assert error.max() < 1e-10 and len(run.crossing) == 1
    assert mismatch(np.hstack([run.Phi, run.P]), differences) < TOLERANCE


# ---------------------------------------------------------------------------------------------------------------
# The whole run


def test_after_periods_the_end_is_at_fixed_phase() -> None:
    """Against differences of the run over a number of periods, whose length depends on omega."""
    system = ns.models.discontinuous_support()
    start = np.array([-0.006, 0.0])

    def end(h: float) -> np.ndarray:
        other = system.with_parameters(omega=system.values["omega"] + h)
        return exact_end(other, State(start.copy(), np.zeros(0)), 2 * other.period())[0]

    run = sensitivity(system, periods=2, start=start, parameters="omega")
    difference, _ = differenced(end, 3e-2)
    assert np.abs(run.P.values[:, 0] / difference - 1).max() < TOLERANCE
    assert abs(run.trace_defect) < 1e-12 and run.attrs["nonsmooth"]
    assert list(run.Phi.dims) == ["state", "initial_state"] and run.saltation.shape == (len(run.crossing), 2, 2)


def test_memory_written_at_the_start_counts() -> None:
    """A start inside the smoothed switch's band writes v_a: the present velocity, with derivative 1 in it."""
    system = ns.models.discontinuous_support().smoothed(1e-3)
    state = State(np.array([system.values["g"], 0.08]), system.memory_vector())
    run = sensitivity(system, duration=0.5, start=state.u, parameters=("eta", "c_s"))
    differences, _ = scaled_differences(system, state, 0.5, ("eta", "c_s"))
    assert mismatch(np.hstack([run.Phi, run.P])[:, [0, 1, 3, 4]], differences) < TOLERANCE
    assert (run.Phi[:, 2] == 0.0).all()  # what the memory held before is forgotten


def scaled_differences(system, state, duration, active):
    """Differences of a system whose states are of the size of millimetres."""
    _, path = exact_end(system, state, duration)
    found = []
    for j, size in ((0, 1e-5), (1, 1e-4)):

        def moved(h, j=j):
            other = state.copy()
            other.u[j] += h
            return exact_end(system, other, duration, path)[0]

        found.append(differenced(moved, size))
    for name in active:
        size = 1e-2 * system.values[name]

        def changed(h, name=name):
            other = system.with_parameters({name: system.values[name] + h})
            return exact_end(other, state, duration, path)[0]

        found.append(differenced(changed, size))
    return np.stack([one for one, _ in found], axis=1), [error for _, error in found]


@pytest.mark.parametrize("name", ["P", "end", "parameter", "log_det"])
def test_a_parameter_may_have_the_name_of_a_variable_of_the_result(name: str) -> None:
    """x'' = -P x from x = 1: x(t) = cos(sqrt(P) t), and its derivative in P is -t sin(sqrt(P) t) / (2 sqrt(P))."""
    system = ns.System(
        states=["x", "v"], parameters={name: 2.0}, modes={"only": lambda t, u, p: (u.v, -getattr(p, name) * u.x)}
    )
    found = ns.sensitivity(system, duration=1.5, start={"x": 1.0}, parameters=[name])
    assert found.P.values[0, 0] == pytest.approx(-1.5 * np.sin(1.5 * 2**0.5) / (2 * 2**0.5), rel=1e-12)
    assert ns.system_of(found).values[name] == 2.0
    spectrum = ns.lyapunov(system.with_parameters({name: 3.0}), duration=20.0, start={"x": 1.0}, progress=False)
    assert ns.system_of(spectrum).values[name] == 3.0


def test_errors_at_the_door() -> None:
    system = ns.models.discontinuous_support()
    with pytest.raises(ValueError, match="`gap` is not a parameter"):
        sensitivity(system, periods=1, parameters=("gap",))
    with pytest.raises(ValueError, match="give the length of the run once"):
        sensitivity(system)
    with pytest.raises(SolveError, match="beyond"):
        sensitivity(ns.models.impact_oscillator(), periods=1, start={"x": 5.0})


def test_a_steep_layer_in_the_middle_of_a_step_is_not_passed_over() -> None:
    """Friction F tanh(v / s) turns over within 1 mm/s: nothing of that shows in a series begun far from v = 0."""
    from scipy.integrate import solve_ivp

    F, s, w = 0.3, 1e-3, 0.7
    system = ns.System(
        states=["x", "v"],
        parameters={"F": F, "s": s, "w": w},
        modes={"one": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x - 0.05 * u.v - p.F * np.tanh(u.v / p.s))},
    )

    def rates(t, z):
        x, v, *Phi = z
        bend = -0.05 - F / s / np.cosh(min(abs(v) / s, 300.0)) ** 2
        Phi = np.reshape(Phi, (2, 2))
        return [v, np.cos(w * t) - x - 0.05 * v - F * np.tanh(v / s), *(np.array([[0, 1], [-1, bend]]) @ Phi).ravel()]

    true = solve_ivp(rates, (0, 9.0), [2.0, 0.5, 1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-14, max_step=2e-3)
    found = ns.sensitivity(system, duration=9.0, start={"x": 2.0, "v": 0.5})
    assert found.end.values == pytest.approx(true.y[:2, -1], abs=1e-8)
    assert found.Phi.values.ravel() == pytest.approx(true.y[2:, -1], rel=1e-6, abs=1e-9)


def test_second_derivatives_of_linear_systems_have_gradients() -> None:
    """L_f^2 h of rows of numbers is differentiated too, in state, time and a parameter of the forcing."""
    system = ns.System(
        states=["x", "v"],
        parameters={"A": 1.3, "w": 1.7, "c": 0.4},
        modes={"one": lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - u.x - 0.2 * u.v)},
        indicators={"h": lambda t, u, p: u.v + p.c * u.x},
        transitions=[],
    )
    flow, values = VariationalFlow.of(system, ("A", "w", "c")), system.parameter_vector()
    t, z = 0.7, np.array([0.3, -0.2])
    touch = flow.indicator(values, 0, 0, t, z)

    def second(t: float, z: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.array([flow.indicator(values, 0, 0, t, z).L2])

    for unit, expected in zip(np.eye(2), touch.L2_z, strict=True):
        slope, _ = differenced(lambda h, unit=unit: second(t, z + h * unit, values), 1e-2)
        assert slope[0] == pytest.approx(expected, abs=1e-9)
    for unit, expected in zip(np.eye(3), touch.L2_p, strict=True):
        slope, _ = differenced(lambda h, unit=unit: second(t, z, values + h * unit), 1e-2)
        assert slope[0] == pytest.approx(expected, abs=1e-9)
    slope, _ = differenced(lambda h: second(t + h, z, values), 1e-2)
    assert slope[0] == pytest.approx(touch.L2_t, abs=1e-9)
