r"""From a notebook's settings to the model's parameters, for rigs whose spring is driven by a crank.

The crank of length a moves the end of one spring by :math:`a \cos\varphi` and, over a string of length L, by
:math:`L - \sqrt{L^2 - a^2 \sin^2 \varphi}` besides. To first order the force is :math:`\rho = k a`; the mean of
the second part moves the car's mean position by :math:`a^2 / (8 L)` away from where it rested. The model's x and g
count from the mean position, the screw's reading and the sensor's zero from the rest position: both are referred.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.identification.compare.measured import measured_motion, measured_response, measured_rise

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.experiment.session import Session

__all__ = ["mean_shift", "session_measurement"]

#: What a run with each procedure shows.
SHOWS = {"section": "motion", "contact": "motion", "grazing": "motion", "response": "response", "rise": "diagram"}


def mean_shift(crank_length: float, string_length: float) -> float:
    r"""How far the car's mean position lies from its rest position, :math:`a^2 / (8 L)` (0 for no string)."""
    return crank_length**2 / (8.0 * string_length) if np.isfinite(string_length) else 0.0


def session_measurement(
    session: Session,
    procedure: str,
    runs: str | Sequence[str] | None = None,
    *,
    k: float,
    crank_force: float | None = None,
    gap_offset: float = 0.0,
    referred: bool = True,
) -> tuple[xr.Dataset, dict[str, Any]]:
    """The measurement of a session that ``compare`` takes, and the settings of the model that belong to it.

    Parameters
    ----------
    session : Session
    procedure : str
        ``section``, ``contact``, ``grazing`` (one run: a motion), ``response`` (all runs of one crank length) or
        ``rise`` (one run).
    runs : str or sequence of str, optional
        The run, or for a response the runs; needed where there are several motions.
    k : float
        The spring's stiffness (N/m), for the parameter over which a rise is drawn.
    crank_force : float, optional
        Force per crank length from a calibration (N/m); the spring's ``k`` where not given.
    gap_offset : float
        What the gap is more than the screw's reading (m).
    referred : bool
        Refer x and g to the mean position under the drive. Without it they are off by :func:`mean_shift`.

    Raises
    ------
    ValueError
        A procedure or run that the session does not have, or several where one is meant.
    """
    import xarray as xr

    from nonsmooth.system.names import unknown

    if procedure not in SHOWS:
        raise ValueError(unknown(procedure, "a procedure", "compare", SHOWS.keys()))
    found = session.recordings(procedure)
    if not found:
        raise ValueError(f"{session.folder} has no run of {procedure!r}; it has: {', '.join(session.procedures)}")
    wanted = [runs] if isinstance(runs, str) else None if runs is None else list(runs)
    for name in wanted or ():
        if name not in [item.run for item in found]:
            raise ValueError(unknown(name, "a run", f"{procedure!r} in {session.folder}", [i.run for i in found]))
    chosen = [item for item in found if wanted is None or item.run in wanted]
    if SHOWS[procedure] != "response" and len(chosen) != 1:
        raise ValueError(
            f"{len(chosen)} runs of {procedure!r}; a motion is one: run = ... one of {', '.join(i.run for i in chosen)}"
        )
    if "distance_per_turn" not in session.apparatus:
        raise ValueError(
            f"{session.folder}: [apparatus] needs distance_per_turn, the travel per turn of the sensor's wheel"
        )
    lengths = {float(item.settings["crank_length"]) for item in chosen if "crank_length" in item.settings}
    if len(lengths) > 1:
        raise ValueError(
            f"the runs have {len(lengths)} crank lengths ({', '.join(f'{a:g}' for a in sorted(lengths))} m): a "
            "response has one; name the runs"
        )
    length = lengths.pop() if lengths else 0.0
    stated = referred and "string_length" in session.apparatus
    string = float(session.apparatus["string_length"]) if stated else np.inf
    shift = 0.0 if SHOWS[procedure] == "diagram" else mean_shift(length, string)
    counts = int(float(session.apparatus["counts_per_turn"])) if "counts_per_turn" in session.apparatus else 1440
    motions = [
        measured_motion(
            item.recording, item.run, distance_per_turn=float(session.apparatus["distance_per_turn"]),
            counts_per_turn=counts, zero=shift, support="gap" in item.settings,
        )
        for item in chosen
    ]  # fmt: skip
    first = chosen[0].settings
    settings: dict[str, Any] = {"rho": _force(length, crank_force)}
    if "gap" in first:
        settings["g"] = float(first["gap"]) + gap_offset - shift
    if SHOWS[procedure] == "response":
        # Steps that do not say how they were reached: up as long as the frequency rises.
        omega = [float(motion["omega"]) for motion in motions]
        top = int(np.argmax(omega))
        words = [str(i.settings.get("direction", "up" if n <= top else "down")) for n, i in enumerate(chosen)]
        return measured_response(motions, words), settings
    (motion,) = motions
    settings["omega"] = (float(motion["omega"]), float(motion["omega_error"]))
    if SHOWS[procedure] == "diagram":
        # The crank grows in the run, and the mean position moves with it.
        per, last = k if crank_force is None else crank_force, float(first["crank_length_end"])
        rise = measured_rise(motion, "rho", per * length, per * last, unit="N")
        moved = xr.zeros_like(rise["section"])
        moved[:, 0] = [mean_shift(float(rho) / per, string) for rho in rise["rho"].values]
        screw = float(first["gap"]) + gap_offset
        settings = {"omega": settings["omega"], "g": lambda p: screw - mean_shift(p["rho"] / per, string)}
        return rise.assign(section=(rise["section"] - moved).assign_attrs(rise["section"].attrs)), settings
    return motion, settings


def _force(length: float, crank_force: float | None) -> float | Callable[[Mapping[str, float]], float]:
    if crank_force is not None:
        return crank_force * length
    return lambda p: p["k"] * length
