"""A parameter: its value, its unit and how it is written in a formula."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.kinds import real_number

_GREEK = frozenset(
    [
        "alpha",
        "beta",
        "gamma",
        "delta",
        "epsilon",
        "zeta",
        "eta",
        "theta",
        "iota",
        "kappa",
        "lambda",
        "mu",
        "nu",
        "xi",
        "pi",
        "rho",
        "sigma",
        "tau",
        "upsilon",
        "phi",
        "chi",
        "psi",
        "omega",
        "Gamma",
        "Delta",
        "Theta",
        "Lambda",
        "Xi",
        "Pi",
        "Sigma",
        "Upsilon",
        "Phi",
        "Psi",
        "Omega",
    ]
)


def latex_name(name: str) -> str:
    r"""Return a LaTeX form of a plain name: ``k_s`` -> ``k_{s}``, ``omega`` -> ``\omega``, ``x1`` -> ``x_{1}``.

    A stem of several letters that is no Greek letter is set upright.
    """
    stem, _, below = name.rstrip("_").partition("_")
    if not below:
        digits = len(stem) - len(stem.rstrip("0123456789"))
        if 0 < digits < len(stem):
            stem, below = stem[:-digits], stem[-digits:]
    below = ",".join(f"\\{part}" if part in _GREEK else part for part in below.split("_") if part)
    if stem in _GREEK:
        stem = f"\\{stem}"
    elif len(stem) > 1:
        stem = f"\\mathrm{{{stem}}}"
    return f"{stem}_{{{below}}}" if below else stem


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter's value, unit and LaTeX symbol.

    Parameters
    ----------
    value : float
    unit : str
        Shown and stored, never converted.
    symbol : str
        LaTeX without dollar signs; made from the name where empty.
    """

    value: float
    unit: str = ""
    symbol: str = ""

    @classmethod
    def read(cls, name: str, given: Any) -> Parameter:
        """Read ``0.838``, ``(0.838, "kg")``, ``(0.838, "kg", "m")`` or a `Parameter`."""
        if isinstance(given, Parameter):
            parts: tuple[Any, ...] = (given.value, given.unit, given.symbol)
        elif isinstance(given, (tuple, list)):
            parts = tuple(given)
        else:
            parts = (given,)
        if not 1 <= len(parts) <= 3 or not all(isinstance(part, str) for part in parts[1:]):
            raise SystemDefinitionError(
                f"parameter {name!r} is {shortened(given)}; give a number, (number, unit) or (number, unit, LaTeX "
                "symbol)"
            )
        if isinstance(parts[0], str):
            raise TypeError(
                f"parameter {name!r} must be a real number, not {shortened(parts[0])}; its unit stands beside it: "
                f'{{"{name}": (8.47, "N/m")}}'
            )
        value = real_number(parts[0], f"parameter {name!r}")
        unit = parts[1] if len(parts) > 1 else ""
        symbol = parts[2] if len(parts) > 2 and parts[2] else latex_name(name)
        return cls(value, unit, symbol)
