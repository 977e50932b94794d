"""The recordings of ``docs/tutorials/a_bench.md`` and ``docs/guides/recordings.md``, computed without the package.

A mass between a spring and a damper rubs on its guide and meets an elastic stop; a shaker drives it. Segments of slip
and of stick, in contact and out of it, are integrated one after another between located events.

    python docs/make_bench.py
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

FOLDER = Path(__file__).parent / "tutorials"
M, C, K = 0.8, 1.1, 320.0  # kg, N s/m, N/m
FRICTION, GAP, STOP, STOP_DAMPING = 0.3, 4.0e-3, 1300.0, 2.0  # N, m, N/m, N s/m
FORCE, PHASE = 1.2, 0.3  # N, rad
NOISE_X, NOISE_F, NOISE_AMPLITUDE = 2.0e-4, 0.05, 4.0e-5  # m, N, m


def _excess(t: float, force: Callable[..., float], x: float, touching: bool) -> float:
    return abs(force(t, x, 0.0, touching)) - FRICTION


def motion(frequency: float, phase: float, times: np.ndarray, x: float = 0.0, v: float = 0.0) -> np.ndarray:
    """Displacement and velocity (N, 2) at ``times``, from t = 0."""
    omega = 2 * np.pi * frequency
    out = np.empty((len(times), 2))
    t, end, filled = 0.0, float(times[-1]), 0

    def force(t: float, x: float, v: float, touching: bool) -> float:
        applied = FORCE * np.cos(omega * t + phase) - K * x - C * v
        return applied - (STOP * (x - GAP) + STOP_DAMPING * v if touching else 0.0)

    touching = STOP * (x - GAP) + STOP_DAMPING * v > 0.0 and x > GAP
    while t < end:
        load = force(t, x, 0.0, touching)
        if v == 0.0 and abs(load) <= FRICTION:  # sticks until the load has grown
            later = t + np.arange(1, 20000) * 1e-4
            over = np.abs([force(s, x, 0.0, touching) for s in later]) > FRICTION
            leaves = end
            if over.any():
                b = later[np.argmax(over)]
                leaves = brentq(_excess, b - 1e-4, b, args=(force, x, touching), xtol=1e-15)
            while filled < len(times) and times[filled] <= min(leaves, end):
                out[filled] = x, 0.0
                filled += 1
            t = leaves
            load = force(t, x, 0.0, touching)
            sign = np.sign(load)
        else:
            sign = np.sign(v) or np.sign(load)

        def field(s: float, u: np.ndarray, sign: float = sign, touching: bool = touching) -> list[float]:
            return [u[1], (force(s, u[0], u[1], touching) - sign * FRICTION) / M]

        def stops(s: float, u: np.ndarray, t: float = t, sign: float = sign) -> float:
            return u[1] * sign if s > t + 1e-9 else 1.0

        def meets(s: float, u: np.ndarray, t: float = t) -> float:
            return u[0] - GAP if s > t + 1e-9 else -1.0

        def parts(s: float, u: np.ndarray, t: float = t) -> float:
            return STOP * (u[0] - GAP) + STOP_DAMPING * u[1] if s > t + 1e-9 else 1.0

        events = [stops, parts if touching else meets]
        for event, direction in zip(events, (-1, -1 if touching else 1), strict=True):
            event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
        run = solve_ivp(field, (t, end), [x, v], "DOP853", events=events, dense_output=True, rtol=1e-11, atol=1e-13)
        while filled < len(times) and times[filled] <= run.t[-1]:
            out[filled] = run.sol(times[filled])
            filled += 1
        t, (x, v) = float(run.t[-1]), run.y[:, -1]
        if len(run.t_events[0]):
            v = 0.0
        elif len(run.t_events[1]):
            touching = not touching
    return out


def pulls() -> str:
    """An export of PASCO Capstone: two decays by a rotary sensor of 1440 counts, and a slower force sensor."""
    rng, time, slow, count = np.random.default_rng(1), 0.01 * np.arange(400), 0.04 * np.arange(60), 2 * np.pi / 1440
    decay = np.exp(-0.4 * time) * np.cos(7.0 * time)
    angle, other = (count * np.round(size / count * decay) for size in (1.5, 1.2))
    force = 30.0 * np.exp(-0.4 * slow) * np.cos(7.0 * slow) + 0.05 * rng.standard_normal(60)
    columns = [
        ("Time (s) Run #1", ".3f", time),
        ("Angle (rad) Run #1", ".4f", angle),
        ("Velocity (rad/s) Run #1", ".3f", np.gradient(angle, time)),
        ("Time (s) Run #1", ".3f", slow),
        ("Force, Ch P2 (N) Run #1", ".2f", force),
        ("Time (s) Run #2", ".3f", time[:200]),
        ("Angle (rad) Run #2", ".4f", other[:200]),
    ]
    rows = [",".join(format(y[i], digits) if i < len(y) else "" for _, digits, y in columns) for i in range(400)]
    return "\n".join([",".join(f'"{name}"' for name, _, _ in columns), *rows]) + "\n"


def main() -> None:
    """Write the record of one run, the amplitudes of steady motions over rising frequency, and the export."""
    (FOLDER.parent / "guides" / "pulls.csv").write_text(pulls(), encoding="utf-8")
    rng = np.random.default_rng(20261126)
    time = np.arange(0.0, 6.0, 0.005)
    frequency = 3.1
    x = motion(frequency, PHASE, time)[:, 0] + NOISE_X * rng.standard_normal(time.size)
    force = FORCE * np.cos(2 * np.pi * frequency * time + PHASE) + NOISE_F * rng.standard_normal(time.size)
    lines = ["Bench 3, mass 0.800 kg, shaker at 3.1 Hz", "time,displacement,force", "s,mm,N"]
    lines += [f"{t:.3f},{1e3 * a:.3f},{f:.3f}" for t, a, f in zip(time, x, force, strict=True)]
    (FOLDER / "bench.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    lines = ["frequency (Hz),amplitude (mm)"]
    state = np.zeros(2)
    for f in np.arange(2.2, 4.81, 0.1):  # up, each from where the one before it ended, at the same phase
        late = np.linspace(40 / f, 44 / f, 1001)
        steady = motion(f, 0.0, np.concatenate([[0.0], late]), *state)[1:]
        state = steady[-1]
        amplitude = np.ptp(steady[:, 0]) / 2 + NOISE_AMPLITUDE * rng.standard_normal()
        lines.append(f"{f:.1f},{1e3 * amplitude:.3f}")
    (FOLDER / "bench_response.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
