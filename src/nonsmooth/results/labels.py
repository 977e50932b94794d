"""Words of results: the labels of a system (names, units, symbols), the meanings of status codes, flags.

Results lie below the system room, so they read a system through this one record. ``labels_of`` is the
only place that knows which attributes a ``System`` has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class QuantityLabel:
    """A unit and a LaTeX symbol (without dollar signs); a value where it is a parameter."""

    unit: str = "1"
    symbol: str = ""
    value: float | None = None


@dataclass(frozen=True)
class Labels:
    """Names in the order of the arrays' columns, with units; ``text`` is the system's data-only text form."""

    name: str
    states: Mapping[str, QuantityLabel]
    parameters: Mapping[str, QuantityLabel]
    modes: tuple[str, ...]
    transitions: tuple[tuple[int, int], ...]
    indicators: tuple[str, ...]
    outputs: Mapping[str, QuantityLabel] = field(default_factory=dict)
    memory: Mapping[str, QuantityLabel] = field(default_factory=dict)
    time_unit: str = "s"
    is_map: bool = False  # the time counts iterates
    text: str = ""

    @property
    def turn(self) -> str:
        """Word for the time between two returns to a section at a phase."""
        return "iterate" if self.is_map else "forcing period"

    @property
    def transition_labels(self) -> tuple[str, ...]:
        """``source_to_target``, numbered where two transitions join the same modes."""
        plain = [f"{self.modes[a]}_to_{self.modes[b]}" for a, b in self.transitions]
        return tuple(
            label if plain.count(label) == 1 else f"{label}_{plain[: i + 1].count(label)}"
            for i, label in enumerate(plain)
        )


def labels_of(system: Any) -> Labels:
    """The labels of a ``System`` with its present parameter values."""
    states = {name: QuantityLabel(unit or "1") for name, unit in system.states.items()}
    traced = system.traced
    return Labels(
        name=system.name,
        states=states,
        parameters={name: QuantityLabel(p.unit or "1", p.symbol, p.value) for name, p in system.parameters.items()},
        modes=tuple(traced.mode_names),
        transitions=tuple((item.source, item.target) for item in traced.transitions),
        indicators=tuple(traced.indicator_names),
        outputs={name: QuantityLabel(unit or "1") for name, unit in system.outputs.items()},
        memory={name: QuantityLabel(unit or "1") for name, unit in system.memory.items()},
        # A system whose states have no units is written in a scaled time; that of a map counts iterates.
        time_unit="s" if any(quantity.unit != "1" for quantity in states.values()) and not traced.is_map else "1",
        is_map=traced.is_map,
        text=system.to_text(),
    )


def kind_of(period: int, chaotic: bool) -> str:
    """An attractor in a word or two."""
    if period > 0:
        return f"period {period}"
    return "chaos" if chaotic else "no period"


def labelled(dims: Any, values: Any, words: str, unit: str | None = None) -> tuple[Any, Any, dict[str, str]]:
    """A variable of a Dataset with its long name, and its unit where it has one."""
    return dims, values, {"long_name": words} | ({} if unit is None else {"units": unit})


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
        "modes lead straight back to each other without a reset, one condition holds behind the other: give it a "
        "second sign ('gap < 0 and rate < 0'), or declare their surface as ns.Surface.",
    ),
    Status(
        codes.TOO_MANY_CROSSINGS,
        "too_many_crossings",
        "More than 50 000 transitions took place within one section return, period or unit of time.",
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

BY_CODE = {status.code: status for status in STATUSES}
_BY_NAME = {status.name: status for status in STATUSES}


def by_code(code: int) -> Status:
    """The status of a kernel's integer; KeyError for a code that never reaches a result."""
    return BY_CODE[int(code)]


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
