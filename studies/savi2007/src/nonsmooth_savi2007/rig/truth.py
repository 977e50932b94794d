"""True parameters of a virtual rig, drawn from its seed around the published ones."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from nonsmooth import DataFileError
from nonsmooth.errors import unknown

#: Reading of the support's screw at which the true gap is ``truth["g"]`` (Fig. 15).
NOMINAL_GAP = 0.0018

#: Of all that a truth holds: the paper's value (Table 1 and 3.1, typical ones where it prints none), unit, and range.
_TABLE: Mapping[str, tuple[float, str, str]] = {
    "m": (0.838, "kg", "positive"),
    "k": (8.47, "N/m", "positive"),
    "k_s": (1210.0, "N/m", "positive"),
    "c": (0.87, "N s/m", "zero or more"),
    "c_s": (0.60, "N s/m", "positive"),
    "g": (NOMINAL_GAP, "m", "finite"),
    "friction": (0.005, "N", "zero or more"),
    "creep_velocity": (1e-3, "m/s", "positive"),
    "pretension": (2.0, "N", "positive"),
    "string_length": (1.0, "m", "positive"),
    "test_mass": (1.33, "kg", "positive"),
    "motor_slope": (1.25, "rad/(s V)", "positive"),
    "motor_offset": (1.0, "V", "finite"),
    "ripple": (0.01, "rad", "zero or more"),
    "ripple_phase": (0.7, "rad", "finite"),
    "force_gain": (1.0, "", "zero or more"),
    "force_noise": (0.02, "N", "zero or more"),
    "clock_jitter": (5e-5, "s", "zero or more"),
    "encoder_zero": (0.0, "counts", "finite"),
    "sensor_zero": (0.0, "m", "finite"),
    "motor_side": (1.0, "", "1 or -1"),
    "motor_wander": (0.0, "", "finite"),
    "angle_sign": (1.0, "", "1 or -1"),
    "force_sign": (1.0, "", "1 or -1"),
    "turn_sign": (1.0, "", "1 or -1"),
    "slipped_tap": (0.0, "", "zero or more"),
}
_ALLOWED: Mapping[str, Callable[[float], bool]] = {
    "positive": lambda value: value > 0,
    "zero or more": lambda value: value >= 0,
    "1 or -1": lambda value: abs(value) == 1,
    "finite": lambda value: True,
}
UNITS: Mapping[str, str] = MappingProxyType({name: unit for name, (_, unit, _) in _TABLE.items()})
#: Each feature of the rig that can be switched off, and what the truth is without it.
FEATURES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "ripple": {"ripple": 0.0},
        "string": {"string_length": math.inf},
        "friction": {"friction": 0.0},
        "support_relaxation": {},
        "jitter": {"clock_jitter": 0.0},
        "noise": {"force_noise": 0.0},
        "quantisation": {"encoder_zero": 0.0},
        "gain_error": {"force_gain": 1.0},
    }
)

#: Creep velocity (m/s) of a friction that holds: 2 µm in a record of 20 s, a thirtieth of a count.
HOLDING = 1e-7

_SPREAD = 0.2  # around Table 1


def published() -> dict[str, float]:
    """The rig of the paper: Table 1 and 3.1, and typical values where it prints none.

    References
    ----------
    M.A. Savi, S. Divenyi, L.F.P. Franca, H.I. Weber, J. Sound Vib. 301 (2007) 59-73, Section 3.1, Table 1.
    """
    return {name: value for name, (value, _, _) in _TABLE.items()}


def drawn(seed: int) -> dict[str, float]:
    """The truth of one rig: m, k, k_s, c, c_s and g uniform within 20 % of the published values, the rest as below."""
    rng = np.random.default_rng([seed, 0])
    truth = published()
    for name in ("m", "k", "k_s", "c", "c_s", "g"):
        truth[name] *= rng.uniform(1 - _SPREAD, 1 + _SPREAD)
    truth["friction"] = rng.uniform(0.0, 0.020)
    truth["string_length"] = rng.uniform(0.5, 2.0)
    truth["force_gain"] = rng.uniform(0.99, 1.01)
    truth["test_mass"] += 1e-3 * rng.standard_normal()
    truth["pretension"] *= rng.uniform(0.8, 1.2)
    truth["motor_slope"] *= rng.uniform(0.95, 1.05)
    truth["motor_offset"] *= rng.uniform(0.9, 1.1)
    truth["ripple"] = rng.uniform(0.0, 0.02)
    truth["ripple_phase"] = rng.uniform(0.0, 2 * np.pi)
    truth["encoder_zero"] = rng.uniform(-0.5, 0.5)
    return {name: float(value) for name, value in truth.items()}


def awkward(seed: int) -> dict[str, float]:
    """Additional faults of a careless experimenter's rig: see :meth:`VirtualRig.awkward`."""
    rng = np.random.default_rng([seed, 3])
    truth = drawn(seed)
    held = truth["friction"] / (2 * truth["k"])
    found = {
        "sensor_zero": rng.uniform(-0.9, 0.9) * held,
        "motor_side": rng.choice([-1.0, 1.0]),
        "motor_wander": 1e-3,
        "slipped_tap": rng.integers(1, 7),
    } | {name: rng.choice([-1.0, 1.0]) for name in ("angle_sign", "force_sign", "turn_sign")}
    return {name: float(value) for name, value in found.items()}


def switched(truth: Mapping[str, float], given: Mapping[str, Any], off: Iterable[str]) -> dict[str, float]:
    """The truth with the values of ``given`` put in, and without the features that are off.

    Raises
    ------
    ValueError, TypeError
        A name that is not among ``UNITS``, or a value that cannot be.
    """
    result = dict(truth)
    for name, value in given.items():
        if name not in UNITS:
            raise ValueError(unknown(name, "a part of the truth", "a virtual rig", UNITS))
        if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
            raise TypeError(f"truth[{name!r}] = {value!r} must be a number")
        result[name] = float(value)
    for feature in off:
        result |= FEATURES[feature]
    for name, value in result.items():
        kind = _TABLE[name][2]
        if not math.isfinite(value) and not (name == "string_length" and value == math.inf):
            raise ValueError(f"truth[{name!r}] = {value!r} must be finite")
        if not _ALLOWED[kind](value):
            raise ValueError(f"truth[{name!r}] = {value!r} must be {kind}")
    if not 0 <= result["motor_wander"] <= 0.05:
        raise ValueError(f"truth['motor_wander'] = {result['motor_wander']!r} must lie between 0 and 0.05 (relative)")
    if result["ripple"] >= 1:
        raise ValueError(f"truth['ripple'] = {result['ripple']!r}: from 1 on the motor would turn back")
    return result


def load_truth(path: str | os.PathLike[str]) -> dict[str, float]:
    """Read the truth that was written beside a session folder.

    Raises
    ------
    DataFileError
        If there is no such file, or it is not one written by a virtual rig.
    """

    file = Path(path)
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
        return {name: float(document["truth"][name]) for name in document["truth"]}
    except OSError as error:
        raise DataFileError(f"{file}: cannot be opened ({error.strerror or error})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        raise DataFileError(f"{file}: is not the truth of a virtual rig: one table [truth] of numbers") from error
