"""Friction at rigid contacts: worked cases of closed form, equal systems written otherwise, Painleve's paradox."""

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.errors import SolveError, SystemDefinitionError
from nonsmooth.system.derived.faces import least
from nonsmooth.system.derived.impacts import stronge

E = ns.elements
G = 9.81


def floor(friction, restitution=0.0, angle=0.0, forcing=None, normal=None, damping=0.0, stiffness=0.0, **options):
    """A unit mass above a rigid floor, x along it and y away from it; gravity inclined by an angle."""
    return ns.mechanical(
        np.eye(2),
        np.diag([damping, 0.0]),
        np.diag([stiffness, 0.0]),
        coordinates=["x", "y"],
        parameters={"w": 1.0} if forcing or normal else {},
        forcing={"x": forcing or (lambda t, p: -G * np.sin(angle)), "y": normal or (lambda t, p: -G * np.cos(angle))},
        elements={"floor": E.Stop(at="y", side=-1, restitution=restitution, friction=friction, tangent="x", **options)},
    )


class TestImpacts:
    """Worked cases of the impact law; energy."""

    @pytest.mark.parametrize(
        ("friction", "rates", "impulses"),
        [
            (0.1, (0.477842372894, -0.204695361288), (0.742724055909, 0.007605738924)),
            (0.3, (0.459891291503, 0.0), (0.755495161946, 0.051099032389)),
        ],
    )
    def test_a_slip_that_turns_and_one_that_ends(self, friction, rates, impulses):
        found = stronge(np.array([[2.0, -1.0], [-1.0, 5.0]]), np.array([-1.0, 0.5]), 0.5, friction, least)
        np.testing.assert_allclose(found[0], impulses, atol=2e-12)
        np.testing.assert_allclose(found[2], rates, atol=2e-12)

    def test_two_masses_against_the_same_case(self):
        stop = E.Stop(at={"q1": 1, "q2": 1}, side=-1, restitution=0.5, friction=0.1, tangent={"q1": -2, "q2": 1})
        pair = ns.mechanical(np.eye(2), 0 * np.eye(2), 0 * np.eye(2), parameters={}, elements={"s": stop})
        run = ns.simulate(pair, duration=1.5, start={"q1": 0.5, "q2": 0.5, "v_q1": -0.5, "v_q2": -0.5})
        v = run.u_after.values[-1, 2:]
        assert float(run.crossing_time[-1]) == pytest.approx(1.0, abs=1e-14)
        assert v.sum() == pytest.approx(0.477842372894, abs=2e-12)
        assert v[1] - 2 * v[0] == pytest.approx(-0.204695361288, abs=2e-12)
        assert 0.5 * v @ v == pytest.approx(0.057213489679, abs=2e-12)

    @pytest.mark.parametrize(("friction", "slip"), [(0.1, 0.475), (0.3, 0.0)])
    def test_a_ball_that_bounces_with_spin(self, friction, slip):
        """A solid ball: G_tt = 7/2 of the mass; the slip falls by 3.5 mu (1 + e), or ends."""
        ball = ns.mechanical(
            np.diag([1.0, 1.0, 0.4]),
            np.zeros((3, 3)),
            np.zeros((3, 3)),
            parameters={},
            coordinates=["x", "y", "r"],
            elements={"s": E.Stop(at="y", side=-1, restitution=0.5, friction=friction, tangent={"x": 1, "r": 1})},
        )
        run = ns.simulate(ball, duration=1.5, start={"y": 1.0, "v_y": -1.0, "v_x": 1.0})
        v = run.u_after.values[-1, 3:]
        assert v[1] == pytest.approx(0.5, abs=1e-12)
        assert v[0] + v[2] == pytest.approx(slip, abs=1e-12)
        assert v[0] - 1 == pytest.approx(-1.5 * friction if slip else -2 / 7, abs=1e-12)

    @pytest.mark.parametrize("number", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
    def test_energy_never_rises_and_impulses_lie_in_the_cone(self, number):
        """Random directions, masses and laws; the impulses are of degree one in the rates (Euler)."""
        draw = np.random.default_rng(3)
        for _ in range(number):
            size = int(draw.integers(2, 5))
            W = draw.normal(size=(size, size + int(draw.integers(0, 3))))
            effects, v = W @ W.T, draw.normal(size=size)
            v[0], v[2:] = -abs(v[0]), np.abs(v[2:]) * draw.integers(0, 2, size - 2)
            if draw.random() < 0.2:
                v[1] = 0.0
            friction, restitution = draw.uniform(0, 2), draw.uniform(0, 1)
            found = stronge(effects, v, restitution, friction, least)
            assert found is not None
            impulses, slopes, after = found
            work = 0.5 * impulses @ (v + after)
            assert work <= 1e-13 * np.abs(impulses) @ (np.abs(v) + np.abs(after))
            assert abs(impulses[1]) <= friction * impulses[0] * (1 + 1e-12)
            assert (impulses[2:] >= 0).all()
            assert after[0] >= 0
            np.testing.assert_allclose(slopes @ v, impulses, atol=1e-9 * np.abs(impulses).max())

    def test_the_derivative_against_differences(self):
        effects, v = np.array([[2.0, -1.0, 0.3], [-1.0, 5.0, 0.2], [0.3, 0.2, 1.0]]), np.array([-1.0, 0.5, 0.1])
        slopes = stronge(effects, v, 0.6, 0.4, least)[1]
        for j in range(3):
            h = 1e-6 * np.eye(3)[j]
            plus, minus = (stronge(effects, v + s * h, 0.6, 0.4, least)[0] for s in (1, -1))
            np.testing.assert_allclose((plus - minus) / 2e-6, slopes[:, j], atol=1e-8)


class TestSliding:
    """Contacts that rest while they slip and stick."""

    def test_thrown_up_a_slope_at_the_friction_angle_it_rests_and_stays(self):
        angle, v = 0.4, 1.0
        run = ns.simulate(floor(np.tan(angle), angle=angle), duration=1.0, start={"v_x": v})
        assert float(run.crossing_time[0]) == pytest.approx(v / (2 * G * np.sin(angle)), abs=1e-13)
        assert run.u.values[-1] == pytest.approx([v**2 / (4 * G * np.sin(angle)), 0, 0, 0], abs=1e-13)
        assert float(run.floor_force[-1]) == pytest.approx(G * np.cos(angle), rel=1e-13)
        assert float(run.floor_friction_force[-1]) == pytest.approx(G * np.sin(angle), rel=1e-13)

    def test_thrown_down_it_keeps_its_speed(self):
        run = ns.simulate(floor(np.tan(0.4), angle=0.4), duration=2.0, start={"v_x": -1.0})
        np.testing.assert_allclose(run.u.values[:, 2], -1.0, atol=1e-13)

    @pytest.mark.parametrize("friction", [0.05, 0.12])
    def test_under_gravity_it_is_dry_friction_of_that_force(self, friction):
        """Sticking, slipping and turning as ``Coulomb`` has it with the weight as normal force."""

        def load(t, p):
            return np.cos(p.w * t)

        own = floor(friction, forcing=load, stiffness=2.0, damping=0.1)
        other = ns.mechanical(
            1.0,
            0.1,
            2.0,
            coordinates=["x"],
            parameters={"w": 1.0},
            forcing={"x": load},
            elements={"f": E.Coulomb(at="x", friction=friction * G)},
        )
        one, two = (ns.simulate(s, periods=10, start={"x": 0.5}, samples=501) for s in (own, other))
        assert one.sizes["crossing"] == two.sizes["crossing"]
        np.testing.assert_allclose(one.u.sel(state="x")[-100:], two.u.sel(state="x")[-100:], atol=1e-11)

    def test_with_a_load_that_varies_it_is_friction_of_that_normal_force(self):
        """Never lifting: friction that follows the load; Coulomb has the same normal force as a function."""

        def down(t, p):
            return -(2.0 + 1.5 * np.cos(p.w * t + 1.0))

        own = floor(0.3, forcing=lambda t, p: np.cos(p.w * t), normal=down, stiffness=0.5)
        other = ns.mechanical(
            1.0,
            0.0,
            0.5,
            coordinates=["x"],
            parameters={"w": 1.0},
            forcing={"x": lambda t, p: np.cos(p.w * t)},
            elements={"f": E.Coulomb(at="x", friction=0.3, normal=lambda t, u, p: -down(t, p))},
        )
        one, two = (ns.simulate(s, periods=8, samples=401) for s in (own, other))
        assert one.sizes["crossing"] == two.sizes["crossing"] > 8
        np.testing.assert_allclose(one.crossing_time, two.crossing_time, atol=1e-10)
        np.testing.assert_allclose(one.u.sel(state="x"), two.u.sel(state="x"), atol=1e-10)

    def test_lifted_and_set_down_again(self):
        """The load lifts the mass once a period; flight, plastic landing and slip by closed forms."""
        a, mu, v = 2.0, 0.3, 50.0
        run = ns.simulate(
            floor(mu, normal=lambda t, p: -(1.0 - a * np.sin(p.w * t)), forcing=lambda t, p: 0.0 * np.cos(p.w * t)),
            duration=2.0,
            start={"v_x": v},
            samples=[2.0],
        )
        lift = np.arcsin(1 / a)
        assert float(run.crossing_time[0]) == pytest.approx(lift, abs=1e-13)
        # until lift-off the normal force is 1 - a sin t
        assert float(run.u.sel(state="v_x")[-1]) == pytest.approx(v - mu * (lift + a * (np.cos(lift) - 1)), abs=1e-12)
        height = -0.5 * (2 - lift) ** 2 - a * (np.sin(2) - np.sin(lift)) + a * np.cos(lift) * (2 - lift)
        assert float(run.u.sel(state="y")[-1]) == pytest.approx(height, abs=1e-12)

    def test_a_belt_drags_what_lies_on_it(self):
        run = ns.simulate(floor(0.2, belt=1.0), duration=2.0)
        assert float(run.crossing_time[-1]) == pytest.approx(1.0 / (0.2 * G), abs=1e-13)
        assert float(run.u.sel(state="v_x")[-1]) == pytest.approx(1.0, abs=1e-13)

    def test_sweeps_and_threads_agree(self):
        own = floor(0.1, forcing=lambda t, p: 1.5 * np.cos(p.w * t), stiffness=2.0, damping=0.1)
        values, options = [0.9, 1.0, 1.1], {"transient": 20, "keep": 10, "progress": False}
        one, two = (ns.sweep(own, "w", values, threads=n, **options) for n in (1, 2))
        assert (one.period_number == 1).all()
        np.testing.assert_array_equal(one.section, two.section)

    @pytest.mark.parametrize(("friction", "speed"), [(0.5, 1.0), (0.3, -2.0)])
    @pytest.mark.parametrize("blocks", [1, 3])
    def test_blocks_that_nothing_but_friction_stops(self, friction, speed, blocks):
        """No other force gives the speed a size by which what is left of it where the slip ends is rounding; springs
        between them that are not stretched, all at one instant, neither."""
        n = 2 * blocks
        chain = np.kron(np.diag(np.ones(blocks)), np.zeros((2, 2)))
        for i in range(blocks - 1):
            chain[2 * i : 2 * i + 3 : 2, 2 * i : 2 * i + 3 : 2] += [[1.0, -1.0], [-1.0, 1.0]]
        sliding = ns.mechanical(
            np.eye(n),
            0 * np.eye(n),
            chain,
            parameters={},
            coordinates=[f"{axis}{i}" for i in range(blocks) for axis in "xy"],
            forcing={f"y{i}": lambda t, p: -G for i in range(blocks)},
            elements={f"s{i}": E.Stop(at=f"y{i}", side=-1, friction=friction, tangent=f"x{i}") for i in range(blocks)},
        )
        run = ns.simulate(sliding, duration=2.0, start={f"v_x{i}": speed for i in range(blocks)})
        ends, distance = abs(speed) / (friction * G), speed * abs(speed) / (2 * friction * G)
        assert run.crossing_time.values == pytest.approx(ends, abs=1e-14)
        assert run.u.values[-1, 0:n:2] == pytest.approx([distance] * blocks, abs=1e-14)
        assert not run.u.values[-1, 1:n:2].any() and not run.u.values[-1, n:].any()


class TestVerbs:
    """Verbs over a contact that rubs, beside dry friction of the same force."""

    @staticmethod
    def load(t, p):
        return 1.5 * np.cos(p.w * t)

    def test_exponents(self):
        own = floor(0.1, forcing=self.load, stiffness=2.0, damping=0.1)
        other = ns.mechanical(
            1.0,
            0.1,
            2.0,
            coordinates=["x"],
            parameters={"w": 1.0},
            forcing={"x": self.load},
            elements={"f": E.Coulomb(at="x", friction=0.1 * G)},
        )
        one, two = (ns.lyapunov(s, periods=50, transient=20, progress=False).exponents.values for s in (own, other))
        np.testing.assert_allclose(one[:2], two, atol=1e-9)
        assert (one[2:] == -np.inf).all()

    def test_basins(self):
        own = floor(0.1, forcing=self.load, stiffness=2.0, damping=0.1)
        found = ns.basins(own, {"x": [-1.0, 1.0], "v_x": [-1.0, 1.0]}, progress=False)
        assert (found.label == 0).all()
        assert found.sizes["attractor"] == 1


class TestParadox:
    """No motion, or several; what is refused."""

    @staticmethod
    def rod(press):
        """G_nn = 1, G_nt = 1: slipping forward at mu = 2 the contact force would pull itself in."""
        return ns.System(
            states=["x", "y", "vx", "vy"],
            parameters={},
            modes={"all": lambda t, u, p: (u.vx, u.vy, 0.0, -press)},
            elements={
                "tip": E.Stop(
                    gap=lambda t, u, p: u.y,
                    on={"vy": 1.0, "vx": 1.0},
                    friction=2.0,
                    tangent=lambda t, u, p: u.vx,
                    on_tangent={"vx": 2.0, "vy": 1.0},
                )
            },
        )

    def test_a_landing_that_jams(self):
        """While it slips the normal impulse drives the tip on into the ground: the impact goes on until the slip ends,
        and the plastic tip then stays."""
        run = ns.simulate(self.rod(1.0), duration=5.0, start={"vx": 1.0, "y": 0.5})
        assert float(run.crossing_time[0]) == pytest.approx(1.0, abs=1e-13)
        assert run.u.values[-1] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-12)

    @pytest.mark.parametrize(("press", "status"), [(1.0, "no_motion"), (-1.0, "not_unique")])
    def test_painleve(self, press, status):
        with pytest.raises(SolveError, match="Painleve") as caught:
            ns.simulate(self.rod(press), duration=1.0, start={"vx": 1.0})
        assert caught.value.status == status

    @pytest.mark.parametrize(("angle", "inside"), [(50.6415982, 1.0), (73.0484695, -1.0)])
    @pytest.mark.parametrize("length", [0.3, 2.0])
    def test_a_thin_rod_jams_between_two_angles(self, angle, inside, length):
        """Mass 1, mu = 1.5: no contact force keeps a tip that slips forward on the floor where
        1 + 3 cos^2 a < 3 mu sin a cos a, whatever the length; a hair outside it is braked, to rest before long."""
        slopes, friction, inertia = np.array([1e-4, -1e-4]) * inside, 1.5, length**2 / 12
        for turn, status in zip(slopes, ("no_motion", ""), strict=True):
            a = np.radians(angle + turn)
            arm = length / 2 * np.array([np.sin(a), np.cos(a)])  # of the tip's forces, along and across the floor
            G = np.eye(2) + np.outer(arm, arm) / inertia
            rod = ns.System(
                states=["x", "y", "vx", "vy"],
                parameters={},
                modes={"all": lambda t, u, p: (u.vx, u.vy, 0.0, -1.0)},
                elements={
                    "tip": E.Stop(
                        gap=lambda t, u, p: u.y,
                        on={"vy": G[1, 1], "vx": G[0, 1]},
                        friction=friction,
                        tangent=lambda t, u, p: u.vx,
                        on_tangent={"vx": G[0, 0], "vy": G[0, 1]},
                    )
                },
            )
            if status:
                with pytest.raises(SolveError, match="Painleve") as caught:
                    ns.simulate(rod, duration=1.0, start={"vx": 1.0})
                assert caught.value.status == status
            else:
                run = ns.simulate(rod, duration=1.0, start={"vx": 1.0})
                brake = (friction * G[0, 0] - G[0, 1]) / (G[1, 1] - friction * G[0, 1])
                assert float(run.crossing_time[0]) == pytest.approx(1 / brake, rel=1e-8)

    def test_two_contacts_that_close_at_once_of_which_one_rubs(self):
        cup = ns.mechanical(
            np.eye(2),
            0 * np.eye(2),
            0 * np.eye(2),
            coordinates=["x", "y"],
            parameters={},
            elements={
                "floor": E.Stop(at="y", side=-1, friction=0.1, tangent="x"),
                "wall": E.Stop(at="x", side=-1),
            },
        )
        with pytest.raises(SolveError, match=r"'floor', 'wall'.*impacts at one instant"):
            ns.simulate(cup, duration=2.0, start={"x": 1.0, "y": 1.0, "v_x": -1.0, "v_y": -1.0})

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"friction": 0.1}, "go together"),
            ({"tangent": "x"}, "go together"),
            ({"friction": 0.1, "tangent": "x", "rest": False}, "rest=False"),
            ({"friction": 0.1, "tangent": lambda t, u, p: u.x}, "on_tangent"),
            ({"friction": 0.1, "tangent": "z"}, "`z` is not a coordinate"),
        ],
    )
    def test_what_does_not_fit_is_refused(self, options, message):
        with pytest.raises(SystemDefinitionError, match=message):
            ns.mechanical(
                np.eye(2),
                0 * np.eye(2),
                0 * np.eye(2),
                coordinates=["x", "y"],
                parameters={},
                elements={"s": E.Stop(at="y", **options)},
            )


class TestLoads:
    """Energies of impacts and of sliding from outputs alone."""

    def test_the_energy_lost_by_an_impact_is_that_of_both_impulses(self):
        """The worked case: .25 before, .057213489679 behind; the work of each impulse is its mean speed times it."""
        stop = E.Stop(at={"q1": 1, "q2": 1}, side=-1, restitution=0.5, friction=0.1, tangent={"q1": -2, "q2": 1})
        pair = ns.mechanical(np.eye(2), 0 * np.eye(2), 0 * np.eye(2), parameters={}, elements={"s": stop})
        run = ns.simulate(pair, duration=1.5, start={"q1": 0.5, "q2": 0.5, "v_q1": -0.5, "v_q2": -0.5})
        assert float(run.s_impulse[0]) == pytest.approx(0.742724055909, abs=2e-12)
        assert float(run.s_friction_impulse[0]) == pytest.approx(0.007605738924, abs=2e-12)
        lost = float(run.s_energy_lost[0] + run.s_friction_energy_lost[0])
        assert lost == pytest.approx(0.25 - 0.057213489679, abs=2e-12)

    def test_a_hopping_block_takes_what_the_forcing_gives(self):
        """Per period, by loads alone: work of the forcing = damping + stop + friction."""
        hop = floor(
            0.2,
            restitution=0.0,
            forcing=lambda t, p: 0.5 * np.cos(p.w * t),
            stiffness=2.0,
            damping=0.3,
            normal=lambda t, p: -(1.0 + 2.0 * np.sin(p.w * t)),
        )
        response = ns.sweep(hop, "w", [1.0], transient=200, keep=10, loads=True, progress=False)
        assert int(response.period_number[0]) == 1
        names = ("work_of_damping", "work_of_stiffness", "floor_energy", "floor_friction_energy")
        taken = sum(float(response[name][0]) for name in names if name in response)
        assert float(response.floor_impulse[0]) > 0.1
        assert taken == pytest.approx(float(response.work_of_forcing[0]), abs=1e-9)
