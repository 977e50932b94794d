"""The two ways in which every figure is computed, and how finely."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from nonsmooth import System, random_starts
from nonsmooth.models import discontinuous_support
from nonsmooth_savi2007.laboratory import Laboratory

ETA = 1e-5  # Section 4: "it is assumed that eta = 1e-5 for all simulations"

_Choice = TypeVar("_Choice")


@dataclass(frozen=True)
class Flow:
    """A model with the method that integrates it: ``key`` in file names, ``title`` and ``short`` in figures."""

    key: str
    title: str
    short: str
    eta: float | None
    options: Mapping[str, Any] = field(default_factory=dict)

    def system(self, **parameters: float) -> System:
        """The paper's oscillator with Table 1 and these parameters."""
        system = discontinuous_support(**parameters)
        return system if self.eta is None else system.smoothed(self.eta)


EXACT = Flow("exact", "exact flow", "exact", None, {"method": "exact"})
SMOOTHED = Flow("smoothed", "smoothed switch, RKF45", "smoothed", ETA, {"method": "rkf45", "rtol": 1e-6})
FLOWS = (EXACT, SMOOTHED)


@dataclass(frozen=True)
class Settings:
    """Amount of work: ``quick`` for a first look, ``full`` for the finest. ``laboratory``: where the figures of the rig
    are measured; ``folder``: where finished figures and stores of chunks are kept.
    """

    quick: bool = False
    full: bool = False
    progress: bool = True
    laboratory: Laboratory | None = None
    folder: Path | None = None

    @property
    def bench(self) -> Laboratory:
        """The laboratory; ValueError where there is none."""
        if self.laboratory is None:
            raise ValueError("a figure of the rig is measured in a laboratory: give Settings(laboratory=...)")
        return self.laboratory

    @property
    def place(self) -> Path:
        """The folder; ValueError where there is none."""
        if self.folder is None:
            raise ValueError("figures are kept in a folder: give Settings(folder=...)")
        return self.folder

    def of(self, flow: Flow, *, exact: _Choice, smoothed: _Choice, quick: _Choice) -> _Choice:
        """A number for this flow; ``quick`` takes the place of both in a quick run."""
        if self.quick:
            return quick
        return exact if flow is EXACT else smoothed


def starts(count: int) -> list[Any]:
    """First states from a box a little larger than the motions of Figs. 11-18, so that coexisting motions show."""
    return random_starts(count, {"x": -0.010, "v": -0.10}, {"x": 0.004, "v": 0.10}, seed=2007)
