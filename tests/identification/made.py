"""Runs made from closed forms, as ``gather`` would give them: nothing of the virtual rig is in them."""

import numpy as np
import xarray as xr

from nonsmooth.identification.evidence import Run
from nonsmooth.identification.free_decay import DecayFit
from nonsmooth.identification.shooting import ShootingFit

COUNT = 0.0789 / 1440


def counted(x):
    """What an encoder of 1440 counts on a wheel of 78.9 mm makes of a position (m)."""
    return COUNT * np.rint(np.asarray(x) / COUNT)


def run(procedure, time, x=None, *, force=None, turns=None, name="Run #1", **settings):
    """A run with these channels over these times."""

    def channel(values, long_name):
        attrs = {"long_name": long_name, "run": name}
        return xr.DataArray(np.asarray(values), {"time": np.asarray(time)}, ("time",), attrs=attrs)

    return Run(
        procedure, name, settings, None if x is None else channel(x, "Angle"),
        None if force is None else channel(force, "Force"), None if turns is None else np.asarray(turns), True,
    )  # fmt: skip


def decay_of(omega_0, b, f, zero=0.0, error=1e-6):
    """The free oscillator as a free decay would have told it, without a fit behind it."""
    starts, used = np.zeros((0, 2)), np.zeros(0, dtype=bool)
    nothing = ShootingFit(np.zeros(4), np.eye(4), starts, [], [], COUNT / np.sqrt(12), 5e-5, 1.0, 1.0, 0, used)
    return DecayFit(np.array([omega_0, b, f, zero]), error**2 * np.eye(4), (), (), nothing)


def swinging(omega, amplitude, lag, mean, *, crank, duration=12.0, mark=0.0, rng=None, name="Run #1", second=0.0):
    """A steady run x = mean + A cos(omega t - lag) (+ a second harmonic), and the photogate's times of it."""
    time = np.arange(0, duration, 0.01)
    at = time if rng is None else time + 5e-5 * rng.standard_normal(len(time))
    x = mean + amplitude * np.cos(omega * at - lag) + second * np.cos(2 * omega * at)
    period = 2 * np.pi / omega
    passages = np.arange(mark % period, duration, period)
    return run("response", time, counted(x), turns=passages, name=name, crank_length=crank)
