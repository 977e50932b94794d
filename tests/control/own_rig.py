"""A rig that is no part of the package: a hardening oscillator by Runge and Kutta's method, with faults."""

import math

import numpy as np
from scipy.integrate import solve_ivp

MASS, DAMPING, STIFFNESS, CUBIC, DRIVE = 1.3, 0.13, 1.3, 0.6, 0.2


class OwnRig:
    """``MASS x'' + DAMPING x' + STIFFNESS x + CUBIC x^3 = DRIVE cos(phase) + sign * force``, read late.

    ``delay``: samples by which a reading is late; ``fault``: what it shows from reading ``fault_at`` on.
    """

    mass = MASS

    def __init__(self, per_turn=40, delay=0, sign=1.0, fault=None, fault_at=None, noise=1e-4, frequency=1.3, seed=0):
        self.step = 2 * math.pi / frequency / per_turn
        self.substeps = max(1, math.ceil(60 / per_turn))
        self.sign, self.fault, self.fault_at, self.noise = sign, fault, fault_at, noise
        self.rng = np.random.default_rng(seed)
        self.x = self.v = self.phase = self.force = 0.0
        self.frequency, self.amplitude = frequency, DRIVE
        self.late = [0.0] * (delay + 1)
        self.readings = 0
        self.log = []  # reading, true position, what was shown, force commanded behind it

    def set_drive(self, frequency, amplitude):
        self.frequency, self.amplitude = frequency, amplitude
        return frequency, amplitude

    def apply_force(self, force):
        self.force = force
        if self.log:
            self.log[-1][3] = force

    def push(self, phase):
        return self.amplitude * math.cos(2 * math.pi * phase) + self.sign * self.force

    def read(self):
        h, turns = self.step / self.substeps, self.frequency * self.step / self.substeps / (2 * math.pi)
        x, v, half, last = self.x, self.v, h / 2, self.push(self.phase)
        for _ in range(self.substeps):
            first, middle, last = last, self.push(self.phase + turns / 2), self.push(self.phase + turns)
            a = (first - DAMPING * v - STIFFNESS * x - CUBIC * x * x * x) / MASS
            y, w = x + half * v, v + half * a
            b = (middle - DAMPING * w - STIFFNESS * y - CUBIC * y * y * y) / MASS
            z, s = x + half * w, v + half * b
            c = (middle - DAMPING * s - STIFFNESS * z - CUBIC * z * z * z) / MASS
            y, r = x + h * s, v + h * c
            d = (last - DAMPING * r - STIFFNESS * y - CUBIC * y * y * y) / MASS
            x, v = x + h / 6 * (v + 2 * w + 2 * s + r), v + h / 6 * (a + 2 * b + 2 * c + d)
            self.phase += turns
        self.x, self.v = x, v
        self.late = [*self.late[1:], self.x + self.noise * self.rng.standard_normal()]
        self.readings += 1
        shown = self.late[0]
        self.log.append([self.readings, self.x, shown, None])
        if self.fault_at is not None and self.readings >= self.fault_at:
            if isinstance(self.fault, Exception):
                raise self.fault
            shown = self.log[-1][2] = self.log[self.fault_at - 1][2] if self.fault == "constant" else self.fault
        return self.phase, shown


def true_frequency(amplitude, section, frequency):
    """Frequency at which the periodic motion near a state at phase 0 has half a peak-to-peak value, by SciPy."""

    def run(y, **options):
        x, v, w = y

        def f(t, u):
            return [u[1], (DRIVE * np.cos(w * t) - DAMPING * u[1] - STIFFNESS * u[0] - CUBIC * u[0] ** 3) / MASS]

        return solve_ivp(f, (0, 2 * np.pi / w), [x, v], "DOP853", rtol=1e-11, atol=1e-12, dense_output=True)

    def left(y):
        orbit = run(y)
        x, peaks = orbit.sol(np.linspace(0, orbit.t[-1], 2001))[0], []
        for sign in (1, -1):  # the vertex of the parabola through the highest three
            k = int(np.argmax(sign * x[:-1]))
            a, b, c = x[k - 1] if k else x[-2], x[k], x[k + 1]
            peaks.append(b - 0.125 * (c - a) ** 2 / (a - 2 * b + c))
        return np.append(orbit.y[:, -1] - y[:2], 0.5 * (peaks[0] - peaks[1]) - amplitude)

    y = np.array([*section, frequency])
    for _ in range(30):
        J = np.column_stack([(left(y + h) - left(y - h)) / 2e-6 for h in 1e-6 * np.eye(3)])
        move = np.linalg.solve(J, -left(y))
        y = y + move * min(1.0, 0.1 / np.abs(move).max())
        if np.abs(move).max() < 1e-8:
            return float(y[2])
    raise AssertionError(f"no periodic motion near {section}")
