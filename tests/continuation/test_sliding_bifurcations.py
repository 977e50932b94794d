"""Sliding bifurcations of a dry-friction oscillator and of a relay against their defining conditions at 30 digits.

The conditions (di Bernardo, Budd, Champneys, Kowalczyk 2008, Chapter 8) are equations for instants and states of the
events of a periodic orbit, with motion between them in closed form, solved from guesses of two or three digits.
"""

from __future__ import annotations

from typing import Any

import pytest
from mpmath import mp, mpf

import nonsmooth as ns

pytestmark = pytest.mark.physics

DIGITS = 1e-10  # relative


def root(equations: Any, *guess: float) -> Any:
    with mp.workdps(30):
        return mp.findroot(equations, [mpf(repr(x)) for x in guess], tol=1e-50)


def found(branch: Any, parameter: str) -> list[tuple[str, float]]:
    special = ns.special_points(branch)
    named = special.isel(special=special.sliding.values != "")
    return list(zip(named.sliding.values.tolist(), named[parameter].values.tolist(), strict=True))


def same(branch: Any, parameter: str, expected: list[tuple[str, Any]]) -> None:
    here = found(branch, parameter)
    assert [name for name, _ in here] == [name for name, _ in expected]
    assert [value for _, value in here] == pytest.approx([float(value) for _, value in expected], rel=DIGITS)


# x'' + 2 zeta x' + x = cos(w t) -+ f: all events have the speed of the belt

FORWARD, BACKWARD = -1, 1  # sign of the friction
STICK = 0


class Belt:
    """The oscillator on a belt of speed ``v``; ``after`` says what follows each event of a period."""

    def __init__(self, w: str, zeta: str, f: str, *after: int) -> None:
        with mp.workdps(30):
            self.w, self.zeta, self.f = mpf(w), mpf(zeta), mpf(f)
        self.after = after

    def forced(self, t: Any) -> tuple[Any, Any, Any]:
        """The forced vibration without friction, its rate and its second rate."""
        w, zeta = self.w, self.zeta
        c, s = 1 - w * w, 2 * zeta * w
        D = c * c + s * s
        x = (c * mp.cos(w * t) + s * mp.sin(w * t)) / D
        return x, w * (s * mp.cos(w * t) - c * mp.sin(w * t)) / D, -w * w * x

    def slip(self, sign: int, begin: Any, x0: Any, v0: Any, t: Any) -> tuple[Any, Any, Any]:
        """Place, speed and acceleration at t of a slip."""
        own, rate, _ = self.forced(begin)
        zeta, s = self.zeta, t - begin
        n = mp.sqrt(1 - zeta * zeta)
        a = x0 - sign * self.f - own
        b = (v0 - rate + zeta * a) / n
        cos, sin, decay = mp.cos(n * s), mp.sin(n * s), mp.exp(-zeta * s)
        x, v, acceleration = self.forced(t)
        y = decay * (a * cos + b * sin)
        dy = decay * ((n * b - zeta * a) * cos - (n * a + zeta * b) * sin)
        return x + sign * self.f + y, v + dy, acceleration - 2 * zeta * dy - y

    def rest(self, t: Any, x: Any, v: Any) -> Any:
        """All forces but friction on a mass that moves with the belt."""
        return mp.cos(self.w * t) - x - 2 * self.zeta * v

    def periodic(self, v: Any, events: list[tuple[Any, Any]]) -> list[Any]:
        """The equations of an orbit with these instants and places of events."""
        period = 2 * mp.pi / self.w
        ends = [*events[1:], (events[0][0] + period, events[0][1])]
        residuals = []
        for i, ((t0, x0), (t1, x1)) in enumerate(zip(events, ends, strict=True)):
            if self.after[i] == STICK:  # it leaves with the force that friction cannot exceed
                following = self.after[(i + 1) % len(events)]
                residuals += [x0 + v * (t1 - t0) - x1, self.rest(t1, x1, v) + following * self.f]
            else:
                x, speed, _ = self.slip(self.after[i], t0, x0, v, t1)
                residuals += [x - x1, speed - v]
        return residuals

    def edge(self, event: int, sign: int, *guess: float) -> Any:
        """The belt's speed at which an event lies on the edge of the sliding region (crossing- and switching-)."""

        def equations(v: Any, *rest: Any) -> list[Any]:
            events = list(zip(rest[::2], rest[1::2], strict=True))
            return [*self.periodic(v, events), self.rest(*events[event], v) + sign * self.f]

        return root(equations, *guess)[0]

    def touch(self, visit: int, sign: int, *guess: float) -> Any:
        """The belt's speed at which a visit touches, a stick the edge (adding-) and a slip the speed (grazing-)."""

        def equations(v: Any, t: Any, *rest: Any) -> list[Any]:
            events = list(zip(rest[::2], rest[1::2], strict=True))
            t0, x0 = events[visit]
            if self.after[visit] == STICK:
                there = [self.rest(t, x0 + v * (t - t0), v) + sign * self.f, -self.w * mp.sin(self.w * t) - v]
            else:
                _, speed, acceleration = self.slip(self.after[visit], t0, x0, v, t)
                there = [speed - v, acceleration]
            return [*self.periodic(v, events), *there]

        return root(equations, *guess)[0]

    def without_contact(self) -> Any:
        """The belt's speed that the forced vibration just reaches."""
        return self.w / mp.sqrt((1 - self.w**2) ** 2 + (2 * self.zeta * self.w) ** 2)


def friction(parameter: str, range: tuple[float, float], **values: float) -> Any:
    system = ns.models.dry_friction_oscillator(**values)
    return ns.continue_orbit(ns.find_orbit(system), parameter, range)


def test_a_fast_belt_from_crossing_to_no_contact() -> None:
    case = "0.8", "0.02", "0.3"
    branch = friction("v_b", (0.05, 2.1), omega=0.8, zeta=0.02, v_b=0.6)
    crossing = Belt(*case, FORWARD, BACKWARD).edge(1, BACKWARD, 2.01, 5.35, -1.41, 6.27, 0.52)
    switching = Belt(*case, STICK, BACKWARD).edge(0, FORWARD, 2.16, 5.62, -0.60, 6.06, 0.35)
    grazing = Belt(*case).without_contact()
    same(branch, "v_b", [("crossing_sliding", crossing)])
    branch = ns.continue_orbit(branch, range=(0.05, 3.0))
    same(
        branch,
        "v_b",
        [
            ("crossing_sliding", crossing),
            ("switching_sliding", switching),
            ("grazing_sliding", grazing),
        ],
    )
    straight_on = ns.continue_orbit(ns.special_points(branch).isel(special=1), "v_b", (2.0, 2.2), virtual=True)
    same(straight_on, "v_b", [("switching_sliding", switching)])


def test_a_slow_belt_from_two_slips_to_no_contact() -> None:
    """Some visits come and go twice: which of two equal changes of the signature it is, the condition tells."""
    case = "0.3", "0.05", "0.6"
    branch = friction("v_b", (0.01, 1.5), omega=0.3, zeta=0.05, v_b=0.1, f_k=0.6, f_s=0.6)
    slips, sticks = Belt(*case, BACKWARD, STICK), Belt(*case, STICK, BACKWARD)
    same(
        branch,
        "v_b",
        [
            ("adding_sliding", slips.touch(1, FORWARD, 0.105, 19.8, 4.21, 0.89, 9.70, -0.72)),
            ("adding_sliding", slips.touch(1, BACKWARD, 0.112, 11.8, 3.50, 1.09, 9.31, -0.61)),
            ("grazing_sliding", slips.touch(0, BACKWARD, 0.159, 9.42, 2.63, 1.29, 13.46, -0.32)),
            ("adding_sliding", sticks.touch(0, BACKWARD, 0.249, 13.7, 12.49, -0.29, 19.73, 1.51)),
            ("grazing_sliding", sticks.touch(1, BACKWARD, 0.252, 34.2, 14.82, 0.30, 19.56, 1.49)),
            ("grazing_sliding", Belt(*case).without_contact()),
        ],
    )


def test_den_hartogs_limit_of_motion_without_stops() -> None:
    """Both turning points meet the edge at once, w^2 a = f: of two events at one instant the name is theirs."""

    def amplitude(w: Any) -> Any:
        V, U = 1 / (1 - w * w), mp.sin(mp.pi / w) / (w * (1 + mp.cos(mp.pi / w)))
        return mp.sqrt(V * V - (U / 2) ** 2)

    branch = friction("omega", (0.4, 0.9), f_k=0.5, f_s=0.5)
    limit = root(lambda w: w * w * amplitude(w) - mpf("0.5"), 0.58)
    same(branch, "omega", [("crossing_sliding", limit)])


# The relay: cycles with the symmetry x -> -x, from the end of sliding at (0, 1, z)


def relay(xi: Any, omega: Any, sigma: Any) -> tuple[Any, Any]:
    """The flows in mode minus, (t, x) -> x, and along the surface, (t, x2, x3) -> (x2, x3)."""
    d = 2 * xi * omega
    A = mp.matrix([[-d - 1, 1, 0, -1], [-d - omega**2, 0, 1, 2 * sigma], [-(omega**2), 0, 0, -1], [0, 0, 0, 0]])
    S = mp.matrix([[2 * sigma, 1], [-1, 0]])
    return (
        lambda t, *x: list(mp.expm(A * t) * mp.matrix([*x, 1]))[:3],
        lambda t, *x: list(mp.expm(S * t) * mp.matrix(x)),
    )


def relay_grazing(flows: Any, *guess: float) -> Any:
    """Motion in mode minus touches the surface at t."""

    def equations(p: Any, z: Any, free: Any, slid: Any, t: Any) -> list[Any]:
        minus, along = flows(p)
        h, y2, y3 = minus(free, 0, 1, z)
        end2, end3 = along(slid, y2, y3)
        there = minus(t, 0, 1, z)
        return [h, end2 + 1, end3 + z, there[0], there[1] - 1]

    return root(equations, *guess)[0]


def relay_adding(flows: Any, sigma: Any, *guess: float) -> Any:
    """Sliding touches the edge, x2 = 1, at t."""

    def equations(p: Any, z: Any, free: Any, slid: Any, t: Any) -> list[Any]:
        minus, along = flows(p)
        h, y2, y3 = minus(free, 0, 1, z)
        end2, end3 = along(slid, y2, y3)
        there2, there3 = along(t, y2, y3)
        return [h, end2 + 1, end3 + z, there2 - 1, 2 * sigma(p) * there2 + there3]

    return root(equations, *guess)[0]


def relay_crossing(flows: Any, *guess: float) -> Any:
    """A cycle without sliding reaches the surface on the edge, x2 = -1."""

    def equations(p: Any, z: Any, free: Any) -> list[Any]:
        h, y2, y3 = flows(p)[0](free, 0, 1, z)
        return [h, y2 + 1, y3 + z]

    return root(equations, *guess)[0]


def relay_branch(parameter: str, range: tuple[float, float], **values: float) -> Any:
    orbit = ns.find_orbit(ns.models.relay_feedback(**values), start=[0.05, 0.01, 0.1])
    return ns.continue_orbit(orbit, parameter, range)


@pytest.mark.slow
def test_the_relay_s_adding_and_grazing_sliding() -> None:
    branch = relay_branch("sigma", (1.0, 2.0), xi=0.2, omega=10.0)

    def flows(sigma: Any) -> Any:
        return relay(mpf("0.2"), mpf(10), sigma)

    same(
        branch,
        "sigma",
        [
            ("adding_sliding", relay_adding(flows, lambda p: p, 1.58, 3.70, 1.97, 1.13, 0.09)),
            ("grazing_sliding", relay_grazing(flows, 1.59, 3.73, 2.16, 0.94, 2.02)),
        ],
    )


def test_the_relay_s_crossing_sliding() -> None:
    branch = relay_branch("sigma", (0.5, 2.0), xi=0.3, omega=1.2)
    sigma = relay_crossing(lambda sigma: relay(mpf("0.3"), mpf("1.2"), sigma), 1.1, 4.91, 3.27)
    same(branch, "sigma", [("crossing_sliding", sigma)])
