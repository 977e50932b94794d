"""One virtual rig against the model: what Figs. 9, 11, 14 and 15 of Savi et al. (2007) show of both.

The rig writes session folders; all that is said here comes from them, with the parameters that ``identify`` found in
the first of them, but for two things that only a virtual rig can tell, and which are named so: how long its
transients last, and what it does with one of its features switched off.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth import compare
from nonsmooth.identification.compare import measured_motion, measured_sections
from nonsmooth.identification.compare.fold import fold
from nonsmooth.identification.compare.periods import measured_period
from nonsmooth.recordings import RecordingWarning, Session, load_session
from nonsmooth.studies.savi2007.comparison.notebook import session_measurement
from nonsmooth.studies.savi2007.comparison.reference import GapOffset, gap_offset, gap_reference
from nonsmooth.studies.savi2007.comparison.rig_tables import STEP
from nonsmooth.studies.savi2007.rig import figures
from nonsmooth.studies.savi2007.rig.driven import records
from nonsmooth.studies.savi2007.rig.motor import mean_position
from nonsmooth.studies.savi2007.rig.notebook import write_session

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth import ParameterSet, System
    from nonsmooth.studies.savi2007.rig import VirtualRig

__all__ = ["RigTrial"]

STARTS = 64
RATES = (900.0, 1800.0, 3600.0, 7200.0)  # s for the rise from 0.2 to 0.5 N
LONGEST = 6000  # turns that a transient is followed


@dataclass
class RigTrial:
    """A rig and its sessions.

    Parameters
    ----------
    rig : VirtualRig
    folder : path
        Where its session folders go.
    parameters, offset : optional
        Of the full rig, for one with a feature switched off: its car and its screw are the same.
    """

    rig: VirtualRig
    folder: Path
    parameters: ParameterSet | None = None
    offset: GapOffset | None = None
    _sessions: dict[str, Session] = field(default_factory=dict, repr=False)

    def without(self, feature: str) -> RigTrial:
        """The same rig with one feature switched off, over the same identified parameters."""
        off: dict[str, Any] = {feature: False}
        return RigTrial(replace(self.rig, **off), self.folder / f"without_{feature}", self.identified, self.reading)

    @cached_property
    def session(self) -> Session:
        """The session from which the parameters are identified."""
        return load_session(self.rig.write_session(self.folder / "identification"))

    @cached_property
    def identified(self) -> ParameterSet:
        """The identified parameters."""
        from nonsmooth.studies.savi2007.identification.chain import identify

        if self.parameters is not None:
            return self.parameters
        with _quiet():
            return identify(self.session)

    @cached_property
    def reading(self) -> GapOffset:
        """Gap less the screw's reading, with its uncertainty."""
        return gap_offset(self.identified, self.session) if self.offset is None else self.offset

    @property
    def model(self) -> System:
        """The paper's oscillator."""
        from nonsmooth.models import discontinuous_support

        return discontinuous_support()

    def figure(self, number: int, name: str = "", **options: Any) -> Session:
        """The session behind a figure."""
        key = name or f"fig{number:02d}"
        if key not in self._sessions:
            self._sessions[key] = load_session(self.rig.write_figure(number, self.folder / key, **options))
        return self._sessions[key]

    def measured(self, session: Session, procedure: str, runs: str | Sequence[str] | None = None) -> Any:
        """Arguments of ``compare``; see :func:`session_measurement`."""
        with _quiet():
            return session_measurement(session, procedure, runs, k=self.identified["k"], gap_offset=self.reading)

    def against(self, measured: xr.Dataset, settings: Mapping[str, Any], **options: Any) -> xr.Dataset:
        """The comparison with the model at the identified parameters."""
        options = {"draws": 0, **options}
        return compare(measured, self.model, parameters=self.identified, settings=settings, **options)

    # The figures

    def response(self) -> dict[str, Any]:
        """Fig. 9: the jumps of rig and model, and the frequencies of the rig's period-2 motion."""
        found = self.against(*self.measured(self.figure(9), "response"))
        rows = [
            {
                "direction": str(found["jump_direction"].values[i]),
                **{k: float(found[k].values[i]) for k in ("measured_jump", "theory_jump", "jump_tolerance")},
            }
            for i in range(found.sizes.get("jump", 0))
        ]
        doubled = {}
        for word in ("up", "down"):
            mine = (found["measured_direction"].values == word) & (found["measured_period_number"].values == 2)
            at = found["measured_omega"].values[mine]
            doubled[word] = [float(at.min()), float(at.max())] if len(at) else []
        return {"jumps": rows, "period_2": doubled}

    def rises(self, rates: Sequence[float] = RATES) -> dict[str, Any]:
        """Fig. 11: the flips read off rises of several rates, the amplitude equation's, and the model's."""
        rows = []
        for duration in rates:
            session = self.figure(11, f"fig11_{duration:.0f}", duration=duration)
            found = self.against(*self.measured(session, "rise"), parameter="rho", direction="up")
            rows.append({"duration": duration, "rise_per_turn": float(found["rise_per_return"]), **_flips(found)})
        return {"rises": rows, "stairs": self.stairs()}

    def stairs(self) -> dict[str, Any]:
        """Fig. 11 in steps, waiting at each: the first flip of rig and model without a delay."""
        length = figures.crank_for(self.rig, 0.42)
        screw = figures.screw_for(self.rig, -0.0045, 0.0)
        centre = self._first_flip(screw - mean_position(self.rig, length) + self.reading[0])
        found = self._stairs(np.arange(centre - 0.066, centre + 0.0331, STEP))
        if np.isnan(found.get("1-2", {}).get("measured_flip", np.nan)):  # far from the model: look lower down
            lower = self._stairs(np.arange(centre - 0.180, centre - 0.06, STEP)).get("1-2", {})
            kept = ("measured_flip", "measured_flip_error", "measured_flip_read")
            found["1-2"] = found.get("1-2", {}) | {name: lower.get(name, np.nan) for name in kept}
        return found

    def _stairs(self, steps: NDArray[np.float64]) -> dict[str, Any]:
        forcing = steps[steps > 0.05].round(4).tolist()
        free = records(self.rig, "response", figures.without_support(self.rig, 11))
        made = {
            "section": figures.stairs(self.rig, forcing=forcing), "response": free,
            "impulse": self.rig.impulse(velocities=figures.TAPS),
        }  # fmt: skip
        folder = write_session(self.rig, self.folder / "stairs", made, title="Fig. 11 in steps")
        session = load_session(folder)
        reference = gap_reference(session, offset=self.reading)
        runs = session.recordings("section")
        k = self.identified["k"]
        travel = reference.direction * session.apparatus["distance_per_turn"].value
        lengths = [float(item.settings["crank_length"]) for item in runs]
        with _quiet():
            motions = [
                measured_motion(
                    item.recording, item.run, distance_per_turn=travel, zero=reference.mean(a)[0], mark=reference.mark
                )
                for item, a in zip(runs, lengths, strict=True)
            ]
        measured = measured_sections(motions, "rho", [k * a for a in lengths], unit="N")
        reading = float(runs[0].settings["gap"])
        settings = {
            "omega": float(motions[0]["omega"]), "g": lambda p: reference.gap(reading, p["rho"] / k)[0],
        }  # fmt: skip
        values = np.arange(forcing[0], forcing[-1] + 0.15, 0.001)
        return _flips(self.against(measured, settings, direction="up", values=values))

    def _first_flip(self, gap: float) -> float:
        """Roughly where the model halves its period in a rise."""
        from nonsmooth import sweep

        system = self.model.with_parameters(self.identified).with_parameters(omega=3.69, g=gap)
        values = np.arange(0.2, 0.7, 0.004)
        numbers = sweep(system, "rho", values, direction="up", progress=False)["period_number"].values.ravel()
        doubled = np.flatnonzero(numbers == 2)
        return float(values[doubled.max()]) if len(doubled) else 0.42

    def periods(self) -> list[dict[str, Any]]:
        """Fig. 14: the rig's period number from each start, and those of the model from many starts."""
        session = self.figure(14, periods=200)
        gaps = [gap for _, _, gap in figures.SECTIONS[14]]
        rows: list[dict[str, Any]] = [{"gap": gap, "rig": [], "model": {}} for gap in gaps]
        for i, item in enumerate(session.recordings("section")):
            measured, settings = self.measured(session, "section", item.run)
            row = rows[i % len(gaps)]
            if i < len(gaps):
                row["referred"], row["uncertainty"] = settings["g"]
                row["model"] = self._coexisting(settings)
            points = fold(measured["phase"].values, measured["u"].values, 8)[:, 0]
            noise = np.median(measured["u_error"].values, axis=0)
            row["rig"].append(measured_period(points, noise).number)
        return rows

    def _coexisting(self, settings: Mapping[str, Any]) -> dict[int, int]:
        """Number of seeded starts that lead the model to each period number."""
        from nonsmooth import sweep
        from nonsmooth.identification.compare.draws import nominal, read_settings

        system = nominal(self.model, self.identified, read_settings(settings, self.model))
        rng = np.random.default_rng(0)
        starts = np.column_stack([rng.uniform(-0.04, 0.005, STARTS), rng.uniform(-0.3, 0.3, STARTS)])
        found = sweep(system, "g", [system.values["g"]], direction=None, start=starts.tolist(), progress=False)
        numbers, counts = np.unique(found["period_number"].values, return_counts=True)
        return {int(number): int(count) for number, count in zip(numbers, counts, strict=True)}

    def transients(self, gap: float = 0.0009) -> list[int]:
        """Turns until the rig, let go as in Fig. 14, keeps period 2 (5998: longer): from its equations, no record."""
        from nonsmooth import poincare
        from nonsmooth.studies.savi2007.rig.sampled import METHOD

        length = figures.crank_for(self.rig, 0.33)
        true_gap = gap + mean_position(self.rig, length)
        system = self.rig.system().with_parameters(
            self.rig.parameters(omega=11.15, crank_length=length, g=true_gap)
        )  # fmt: skip
        found = []
        for place in (0.0, *figures.RELEASES[14]):
            options = {**METHOD, "rtol": 1e-8}
            points = poincare(system, n=LONGEST, start={"x": place}, **options)["section"].values
            moved = np.abs(points[2:] - points[:-2]).max(axis=1) > 1e-6
            found.append(int(np.flatnonzero(moved).max()) + 1 if moved.any() else 0)
        return found

    def attractor(self, periods: int = 1500) -> dict[str, Any]:
        """Fig. 15: energy distance of the section clouds beside that of the record's own halves."""
        session = self.figure(15, periods=periods)
        (item,) = session.recordings("section")
        found = self.against(*self.measured(session, "section", item.run))
        names = (
            "measured_period_number", "theory_period_number", "energy_distance", "energy_distance_matched",
            "measured_halves_median", "measured_halves_p95", "energy_ratio",
        )  # fmt: skip
        return {name: float(found[name]) for name in names} | {"points": int(found.sizes["measured_iterate"])}


def _flips(found: xr.Dataset) -> dict[str, Any]:
    names = ("measured_flip", "measured_flip_error", "measured_flip_read", "theory_flip")
    words = found["flip"].values.tolist() if "flip" in found.coords else []
    return {word: {name: float(found[name].values[i]) for name in names} for i, word in enumerate(words)}


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        yield
