"""The work that is timed, and our side of it.

Every peer does the same: marches the same model from the same settled state over the same number of forcing
periods (or for the same time), finding every crossing. Ours returns more (touches, section points, status).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Section

TABLE_1 = {"m": 0.838, "k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60}


@dataclass(frozen=True)
class Case:
    """One parameter set of a figure of the paper."""

    name: str
    rho: float
    g: float
    omega: float

    @property
    def parameters(self) -> dict[str, float]:
        return dict(TABLE_1, rho=self.rho, g=self.g, omega=self.omega)


CASES = [Case(f"Fig. 11, 12: rho {rho}", rho, -0.0045, 3.69) for rho in (0.29, 0.39, 0.46)] + [
    Case(f"Fig. 13: g {g}", 0.33, g, 11.15) for g in (-0.0012, 0.0009, 0.0014, 0.0018)
]

LORENZ = {"s": 10.0, "r": 28.0, "b": 8 / 3}
VALVE_INFLOWS = (0.5, 2.0, 5.0, 7.0, 8.0)


def start_of(u: NDArray[np.float64]) -> dict[str, float]:
    return {"x": float(u[0]), "v": float(u[1])}


def section(
    system: ns.System, u: NDArray[np.float64] | None, n_periods: int, keep: int | None = None, **method: Any
) -> NDArray[np.float64]:
    """States after each of `n_periods` periods, or of the last ones, from u or rest, as `poincare` runs them.

    But every period is run: the verbs leave out those in which a motion repeats itself bit for bit."""
    engine, kept = engine_for(system, **method), keep or n_periods
    begun = np.zeros(len(system.states)) if u is None else np.asarray(u, dtype=float)
    state, out = State(begun.copy(), system.memory_vector()), engine.kept(1, kept)
    tables = engine.prepare(system.parameter_vector()[None, :])
    every = Section(extremes=0, repeats=0)
    engine.chain(tables, 0, 1, state, begun[None, :], every, n_periods - kept, kept, out)
    if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
        raise RuntimeError(f"{system.name}: status {out.status[0]}")
    return np.asarray(out.section[0])


def march(system: ns.System, u: NDArray[np.float64] | None, n_periods: int, **method: Any) -> NDArray[np.float64]:
    """State after `n_periods`, from u or rest."""
    return section(system, u, n_periods, 1, **method)[-1]


def valve_section(q: float, u: NDArray[np.float64], n_returns: int, tolerance: float) -> NDArray[np.float64]:
    """States at `n_returns` maxima of the valve's lift, impacts located."""
    valve = ns.models.relief_valve().with_parameters(q=q)
    start = dict(zip(("y1", "y2", "y3"), map(float, u), strict=True))
    top = ns.Poincare("lift_velocity", rising=False)
    result = ns.poincare(valve, n=n_returns, start=start, section=top, method="taylor", rtol=tolerance)
    return result["section"].transpose("iterate", "state").values
