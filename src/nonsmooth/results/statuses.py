"""Meanings of the kernels' status codes: name in results, what happened, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Status:
    """One outcome: its integer ``code``, its ``name`` and the sentence shown to the user."""

    code: int
    name: str
    happened: str
    remedy: str

    @property
    def sentence(self) -> str:
        """Sentence on what happened and what to do."""
        return f"{self.happened} {self.remedy}".strip()


STATUSES: tuple[Status, ...] = (
    Status(codes.OK, "ok", "The run ended as asked.", ""),
    Status(
        codes.SLOW,
        "slow",
        "The motion was still approaching its attractor when the transient ended, so its period number is not known.",
        "Raise `transient`, or find the orbit with `find_orbit`.",
    ),
    Status(
        codes.NOT_PERIODIC,
        "not_periodic",
        "No period was found up to `max_period` section returns: chaotic, quasi-periodic or of a longer period.",
        "Raise `max_period` and `keep` to look for longer periods; `lyapunov` tells chaos from the rest.",
    ),
    Status(
        codes.DIVERGED,
        "diverged",
        "The state grew beyond 1e9 times its scale or became infinite.",
        "Check the signs of stiffness and damping in every mode, the start, and the `scale` of the states.",
    ),
    Status(
        codes.CHATTER,
        "chatter",
        "Transitions followed each other in ever shorter times without end (an infinite number in finite time).",
        "Check the signs of the reset first: after it the state must move away from the surface. Where impacts do "
        "accumulate, write the stop as ns.elements.Stop, which ends them in rest, or a mode that sticks. Where two "
        "modes lead straight back to each other without a reset, declare their surface as ns.Surface.",
    ),
    Status(
        codes.TOO_MANY_CROSSINGS,
        "too_many_crossings",
        "More than 1000 transitions took place within one section return.",
        "Check that a transition does not lead straight back to where it came from, or use a section met more often.",
    ),
    Status(
        codes.NOT_GUARANTEED,
        "not_guaranteed",
        "On some steps it could not be proved that no crossing was missed (no bound on the indicator exists there).",
        "Compare with a smaller `rtol` or a fixed `step`; an indicator without corners can be bounded.",
    ),
    Status(
        codes.NO_CONVERGENCE,
        "no_convergence",
        "The trajectory did not return to the section (it may have reached an equilibrium), it began beyond a stop, or "
        "an equation did not converge.",
        "Check that the start lies on the admissible side of every stop, and that the motion meets the section's "
        "surface in the direction asked for; otherwise lower `rtol`.",
    ),
    Status(
        codes.INTERRUPTED,
        "interrupted",
        "The work was stopped before this point was computed.",
        "Run it again; finished points are whole.",
    ),
    Status(
        codes.NOT_UNIQUE,
        "not_unique",
        "Motion is not unique from there on: sliding reached a point where its surface stops attracting from both "
        "sides at once (a two-fold), or contacts with friction allow several motions (Painleve's paradox).",
        "Change the model there, or start elsewhere.",
    ),
    Status(
        codes.NO_MOTION,
        "no_motion",
        "No motion satisfies the laws of contacts with friction there (Painleve's paradox).",
        "Lower the friction, or replace a rigid contact by an elastic one.",
    ),
)

#: What a run can rest at; "undecided": an equilibrium whose eigenvalues do not say whether it is stable.
EQUILIBRIA = ("none", "stable", "unstable", "undecided")

_BY_CODE = {status.code: status for status in STATUSES}
_BY_NAME = {status.name: status for status in STATUSES}


def by_code(code: int) -> Status:
    """The status of a kernel's integer; KeyError for a code that never reaches a result."""
    return _BY_CODE[int(code)]


def by_name(name: str) -> Status:
    """The status called ``name``, e.g. ``by_name("slow").code``."""
    return _BY_NAME[name]


def flag_attributes(words: Sequence[str], values: Sequence[int] | None = None, dtype: Any = np.int8) -> dict[str, Any]:
    """CF attributes ``flag_values`` and ``flag_meanings`` of an integer variable; value i means ``words[i]``.

    The words are separated by blanks, so blanks within a word (``penetration - eta``) become underscores.
    """
    numbers = range(len(words)) if values is None else values
    meanings = " ".join("_".join(word.split()) for word in words)
    return {"flag_values": np.array(list(numbers), dtype=dtype), "flag_meanings": meanings}


def words_of_flags(array: xr.DataArray) -> list[str]:
    """The words of a variable's ``flag_meanings``: the modes' names, the transitions' labels."""
    return str(array.attrs["flag_meanings"]).split()


def in_words(array: xr.DataArray) -> Any:
    """The values of a variable as the words of its ``flag_meanings``; "?" for a number that has none."""
    words = dict(zip(np.atleast_1d(array.attrs["flag_values"]).tolist(), words_of_flags(array), strict=True))
    found = [words.get(int(code), "?") for code in array.values.ravel()]
    return np.array(found, dtype=object).reshape(array.shape)


def status_attributes() -> dict[str, Any]:
    """Attributes of every ``status`` variable."""
    return {
        "long_name": "outcome",
        **flag_attributes([s.name for s in STATUSES], [s.code for s in STATUSES]),
    }
