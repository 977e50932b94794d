"""Event-driven integration by SciPy: modes with their fields, and what leads out of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Leaving = tuple[Callable[..., float], int, str, Callable[..., Any] | None]  # indicator, its direction, target, reset


def march(
    fields: Mapping[str, Callable[..., Any]], leaving: Mapping[str, Sequence[Leaving]], mode: str, u: Any, end: float
) -> tuple[str, np.ndarray, list[tuple[float, str]]]:
    """The mode and state at ``end`` of the run that begins at t = 0, and when it entered which modes."""
    t, u, log = 0.0, np.asarray(u, float), []
    while t < end:
        events, ways = [], leaving.get(mode, ())
        for indicator, direction, target, reset in ways:
            if direction * indicator(t, u) > 1e-7:  # left as soon as it is entered
                u, mode = (u if reset is None else np.asarray(reset(u), float)), target
                log.append((t, mode))
                break
        if ways is not leaving.get(mode, ()):
            continue
        for indicator, direction, _, _ in ways:

            def event(t: float, u: np.ndarray, indicator: Callable[..., float] = indicator) -> float:
                return indicator(t, u)

            event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
            events.append(event)
        run = solve_ivp(
            fields[mode], (t, end), u, method="DOP853", events=events or None, rtol=1e-12, atol=1e-13, max_step=0.1
        )
        t, u = run.t[-1], run.y[:, -1]
        if run.status != 1:
            break
        _, _, target, reset = leaving[mode][next(k for k, times in enumerate(run.t_events) if len(times))]
        u, mode = (u if reset is None else np.asarray(reset(u), float)), target
        log.append((t, mode))
    return mode, u, log


def multipliers(field: Callable[..., Any], u: Any, period: float) -> np.ndarray:
    """Eigenvalues of the differences of the map over one period of a continuous field, by their magnitude."""
    ends = [
        march({"all": field}, {}, "all", np.asarray(u) + sign * 1e-4 * e, period)[1]
        for e in np.eye(len(u))
        for sign in (1, -1)
    ]
    columns = [(ends[2 * k] - ends[2 * k + 1]) / 2e-4 for k in range(len(u))]
    return np.sort_complex(np.linalg.eigvals(np.array(columns).T))
