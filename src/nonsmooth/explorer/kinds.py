"""The views of the page as data: panels, tabs, settings, what is saved of each, and the order of its requests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.labels import plain_of, symbols_of

if TYPE_CHECKING:
    from nonsmooth.explorer.state import PageState
    from nonsmooth.system.system import System

#: What is varied first, where a model has it.
USUAL = ("rho", "omega", "A", "g", "alpha", "mu", "r", "q", "v_b", "V_in", "gamma")


@dataclass(frozen=True)
class ViewSetting:
    """A value that a page holds for one view.

    Attributes
    ----------
    label : str
        Text before its field; no field where empty.
    default : function of system and state
        Of a number, a word, or None where the view chooses.
    choices : function of system and state, optional
        Allowed words, each with the text that a person reads; a number where not given.
    also : tuple of str
        Settings that return to their defaults when this one changes.
    """

    label: str
    default: Callable[[System, PageState], float | str | None]
    choices: Callable[[System, PageState], Mapping[str, str]] | None = None
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Kind:
    """A view.

    Attributes
    ----------
    title, panel : str
        Of its tab; ``panel`` is the field of the state that says which view that panel shows. Empty where the view is
        always there, or lies in another one.
    quick, slow : tuple of str
        Names of its requests: short work, and work that takes longer.
    saved : tuple of str, optional
        Name of the result that it saves, and the function of ``nonsmooth.plot`` that draws it.
    axes : mapping
        Options of that function and the fields of the state that they come from.
    settings : mapping
        By full name, ``view.setting``.
    """

    title: str = ""
    panel: str = ""
    quick: tuple[str, ...] = ()
    slow: tuple[str, ...] = ()
    saved: tuple[str, str] | None = None
    axes: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, ViewSetting] = field(default_factory=dict)

    @property
    def stages(self) -> tuple[str, ...]:
        """Its requests in their order."""
        return self.quick + self.slow


def _parameters(system: System, state: PageState) -> dict[str, str]:
    return {name: plain_of(symbols_of(system)[name]) for name in system.parameters}


def _others(system: System, state: PageState) -> dict[str, str]:
    return {name: text for name, text in _parameters(system, state).items() if name != state.over}


def _other(system: System, state: PageState) -> str:
    others = _others(system, state)
    return next((name for name in (*USUAL, *others) if name in others), "")


def _across(factor: float) -> Callable[[System, PageState], float]:
    """Around the model's own value, so that the range stays while the parameter is moved."""

    def default(system: System, state: PageState) -> float:
        own = float(system.values.get(setting("chart.across", system, state), 0.0))
        return own + factor * (abs(own) or 1.0)

    return default


def _frequency(system: System, state: PageState) -> str:
    """The parameter that changes the period of the forcing; the first one where none does."""
    from nonsmooth.diagrams.response import forcing_parameters

    return (forcing_parameters(system) or [*system.parameters])[0]


def _response(factor: float, end: str) -> Callable[[System, PageState], float]:
    """Around the value, by powers of two of the model's own: the range stays while the parameter is moved."""

    def default(system: System, state: PageState) -> float:
        name = setting("response.over", system, state)
        if name == state.over:
            return float(getattr(state, end))
        own, value = float(system.values[name]), state.values[name]
        if own * value <= 0:
            return float(value + (factor - 1.0) * (abs(value) or 1.0))
        return factor * own * 2.0 ** round(math.log2(value / own))

    return default


_PLANE = {"x": "x", "y": "y"}
#: Views in the order of their tabs, and of their work.
KINDS: Mapping[str, Kind] = {
    "recording": Kind(quick=("recording",)),
    "portrait": Kind("Phase plane", "plane", ("orbit",), saved=("run", "phase_portrait"), axes=_PLANE),
    "diagram": Kind("Bifurcation", "upper", ("first look",), ("diagram",), ("diagram", "bifurcation"), {"y": "shown"}),
    "section": Kind(quick=("section",), saved=("section", "section"), axes=_PLANE),
    "readout": Kind(slow=("stability",)),
    "history": Kind("Time history", "lower", saved=("run", "time_history"), axes={"y": "x"}),
    "branches": Kind(
        slow=("branches",),
        saved=("branches", "bifurcation_diagram"),
        axes={"y": "shown"},
        settings={
            "branches.show": ViewSetting(
                "branches", lambda system, state: "no", lambda system, state: {"no": "hidden", "yes": "shown"}
            ),
        },
    ),
    "response": Kind(
        "Frequency response",
        "upper",
        ("first response",),
        ("response",),
        ("response", "frequency_response"),
        {"y": "shown"},
        {
            "response.over": ViewSetting("over", _frequency, _parameters, ("response.low", "response.high")),
            "response.low": ViewSetting("from", _response(0.5, "low")),
            "response.high": ViewSetting("to", _response(1.5, "high")),
        },
    ),
    "chart": Kind(
        "Chart",
        "upper",
        ("first chart",),
        ("chart", "exponents", "fine chart"),
        ("chart", "chart"),
        settings={
            "chart.across": ViewSetting("and", _other, _others, ("chart.low", "chart.high")),
            "chart.low": ViewSetting("from", _across(-0.4)),
            "chart.high": ViewSetting("to", _across(0.4)),
        },
    ),
    "basins": Kind(
        "Basins",
        "plane",
        ("first basins",),
        ("basins", "fine basins"),
        ("basins", "basins"),
        settings={
            f"basins.{end}": ViewSetting("", lambda system, state: None) for end in ("left", "right", "bottom", "top")
        },
    ),
    "mechanism": Kind(quick=("sketch",)),
    "spectrum": Kind("Spectrum", "lower", ("spectrum",), (), ("spectrum", "amplitude_spectrum"), {"y": "x"}),
}
PANELS: dict[str, dict[str, str]] = {
    panel: {name: kind.title for name, kind in KINDS.items() if kind.panel == panel}
    for panel in ("upper", "plane", "lower")
}
SETTINGS = {name: one for kind in KINDS.values() for name, one in kind.settings.items()}
#: Short work: a newer request of the same view waits for it, so that a drawing follows a hand that moves.
QUICK = tuple(stage for kind in KINDS.values() for stage in kind.quick)
#: Requests in the order in which they are computed, each with its view.
ORDER = {stage: name for name, kind in KINDS.items() for stage in kind.quick} | {
    stage: name for name, kind in KINDS.items() for stage in kind.slow
}


def setting(name: str, system: System, state: PageState) -> Any:
    """The value of a setting; its default where the page holds none, or a word that is no choice."""
    one, value = SETTINGS[name], state.settings.get(name)
    if value is None or (one.choices is not None and value not in one.choices(system, state)):
        return one.default(system, state)
    return value
