"""Runs made from closed forms, as ``gather`` would give them: nothing of the virtual rig is in them."""

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from nonsmooth import ParameterSet
from nonsmooth.identification import Estimate
from nonsmooth_savi2007.identification.evidence import Run
from nonsmooth_savi2007.identification.free_decay import DecayFit

COUNT = 0.0789 / 1440
#: Of `driven`: natural frequency, c/m, F_C/m, k_s/m, c_s/m, gap and place of rest.
W, B, F, KAPPA, GAMMA, GAP, PLACE = 4.5, 1.04, 0.0, 1440.0, 0.70, 0.0018, 3e-5


def counted(x):
    """Return what an encoder of 1440 counts on a wheel of 78.9 mm makes of a position (m)."""
    return COUNT * np.rint(np.asarray(x) / COUNT)


def run(procedure, time, x=None, *, force=None, turns=None, name="Run #1", **settings):
    """A run with these channels over these times."""

    def channel(values, long_name):
        attrs = {"long_name": long_name, "run": name}
        return xr.DataArray(np.asarray(values), {"time": np.asarray(time)}, ("time",), attrs=attrs)

    return Run(
        procedure,
        name,
        settings,
        COUNT,
        None if x is None else channel(x, "Angle"),
        None if force is None else channel(force, "Force"),
        None if turns is None else np.asarray(turns),
        True,
    )


def decay_of(omega_0, b, f, zero=0.0, error=1e-6):
    """The free oscillator as a free decay would have told it, without a fit behind it."""
    noise = Estimate(COUNT / np.sqrt(12), 0.0, "m")
    fit = ParameterSet({}, np.zeros((1, 1)), extra={"x.noise": noise})
    return DecayFit(np.array([omega_0, b, f, zero]), error**2 * np.eye(4), (), fit)


def swinging(omega, amplitude, lag, mean, *, crank, duration=12.0, mark=0.0, rng=None, name="Run #1", second=0.0):
    """A steady run x = mean + A cos(omega t - lag) (+ a second harmonic), and the photogate's times of it."""
    time = np.arange(0, duration, 0.01)
    at = time if rng is None else time + 5e-5 * rng.standard_normal(len(time))
    x = mean + amplitude * np.cos(omega * at - lag) + second * np.cos(2 * omega * at)
    period = 2 * np.pi / omega
    passages = np.arange(mark % period, duration, period)
    return run("response", time, counted(x), turns=passages, name=name, crank_length=crank)


def driven(omega, crank, duration=16.0, *, start=(0.0, 0.0), transient=4.0, gap=GAP, phase=None):
    """A run with contact from x = g on, and until k_s (x - g) + c_s v vanishes, by SciPy's events.

    ``phase``: of the drive over time (rad), omega t where not given; ``start``: x and v at t = 0.
    """
    phi = (lambda t: omega * t) if phase is None else phase

    def rate(touching):
        def field(t, u):
            push = KAPPA * (u[0] - gap) + GAMMA * u[1] if touching else 0.0
            return u[1], W**2 * (0.5 * crank * np.cos(phi(t)) + PLACE - u[0]) - B * u[1] - push

        return field

    def begins(t, u):
        return u[0] - gap

    def ends(t, u):
        return KAPPA * (u[0] - gap) + GAMMA * u[1]

    begins.terminal, begins.direction, ends.terminal, ends.direction = True, 1, True, -1
    rng = np.random.default_rng(round(100 * omega))
    time = np.arange(0, duration, 0.01)
    at, x = time + np.abs(5e-5 * rng.standard_normal(len(time))), np.zeros(len(time))
    t, u, touching, done = 0.0, np.array(start), False, 0
    while done < len(at):
        solved = solve_ivp(
            rate(touching),
            (t, duration + 0.1),
            u,
            "DOP853",
            events=ends if touching else begins,
            rtol=1e-10,
            atol=1e-13,
            dense_output=True,
        )
        t, u = solved.t[-1], solved.y[:, -1]
        inside = (at >= solved.t[0]) & (at <= t)
        x[inside], done = solved.sol(at[inside])[0], done + np.count_nonzero(inside)
        touching = not touching
    keep, fine = time > transient, np.linspace(transient, duration, 100_001)
    angle = phi(fine)
    whole = 2 * np.pi * np.arange(np.ceil(angle[0] / (2 * np.pi)), angle[-1] / (2 * np.pi))
    turns = np.interp(whole, angle, fine)
    return run("contact", time[keep], counted(x[keep]), turns=turns, name=f"{omega}", crank_length=crank, gap=gap)
