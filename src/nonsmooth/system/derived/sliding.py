r"""Sliding along surfaces (Filippov 1988) as further modes of a derived hybrid system.

A surface h = 0 with the fields :math:`f_-` (h < 0) and :math:`f_+` (h > 0) attracts where

    L_- h > 0 > L_+ h,    L h = h_t + h_u f.

There motion goes on in a mode of its own, with the convex combination

    f_s = (1 - a) f_- + a f_+,    a = (L_- h + kappa h) / (L_- h - L_+ h),

so that dh/dt = -kappa h: on the surface this is Filippov's field, and what rounding takes off it decays (kappa is the
forcing frequency, 1 without forcing). Where :math:`f_+ - f_-` has a constant direction e, as with friction and relays,
its length cancels, :math:`f_s = f_- - e (L_- h + \kappa h) / (h_u e)`: linear wherever the rest of the field is.

Sliding ends where L_+ h rises or L_- h falls through zero, never by the quotient a. Behind such an end h and its rate
vanish together; a return to the surface therefore also needs the rate of h in its own mode, whose sign is known there.
A state beyond the surface (a start, a reset) changes sides without sliding.

Where L_- h - L_+ h vanishes in sliding (a two-fold) both fields turn away at once and motion is not unique: a
transition leads to a mode whose name ends in ``NOT_UNIQUE``, and there the run ends with that status.

Two surfaces that both pairs of modes share give sliding along both: the same construction, with sliding modes in the
places of the two modes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.system.derived.meeting import Meetings
from nonsmooth.system.derived.sliding_modes import SlidingModes
from nonsmooth.system.equations import TracedSurface
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.traced import Traced

if TYPE_CHECKING:
    from nonsmooth.system.system import System

ON_SURFACE = 1e-12  # of the indicator's size: a start so near lies on the surface


def slide(traced: Traced, surfaces: Sequence[TracedSurface], scale: Mapping[str, float]) -> Traced:
    """Return the system with its sliding modes and, at each surface, the transitions between below, above and sliding,
    in place of the two plain ones, one each way."""
    build = Meetings(traced, scale)
    pairs, level = list(surfaces), list(surfaces)
    while level:
        build.add_modes(level)
        level = [pair for pair in dict.fromkeys(build.meetings(pairs)) if pair not in pairs]
        pairs += level
    build.inherit(surfaces)
    asked = [pair for pair in pairs if not build.several(pair)]
    for pair in asked:
        build.add_transitions(pair)
    build.add_meetings(surfaces, {(pair.indicator, mode) for pair in asked for mode in (pair.below, pair.above)})
    return build.put_in(along=tuple(build.along), idle=tuple(build.idle()))


@lru_cache(maxsize=256)
def _both_rates(traced: Traced, surface: TracedSurface, scale: tuple[float, ...]) -> Callable[..., FloatArray]:
    """Function of p, t, u, m: the indicator, its size, its rates below and above."""
    build = SlidingModes(traced, dict(zip(traced.state_names, scale, strict=True)))
    rates = (build.rate(surface.indicator, mode) for mode in (surface.below, surface.above))
    return numeric(traced, (traced.indicators[surface.indicator], build.size(surface.indicator), *rates))


def repelled(system: System, states: FloatArray) -> tuple[str, int] | None:
    """Return the surface on which one of the starts (S, n) lies at t = 0, both fields pointing away from it, and which
    start; else None."""
    traced, scale = system.declared, tuple(system.scale.values())
    for surface in system.surfaces:
        both = _both_rates(traced, surface, scale)
        h, size, below, above = both(system.parameter_vector(), 0.0, states, system.memory_vector()).T
        found = (np.abs(h) <= ON_SURFACE * size) & (below < 0) & (above > 0)
        if found.any():
            return traced.indicator_names[surface.indicator], int(np.argmax(found))
    return None
