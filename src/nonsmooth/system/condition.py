"""The conditions of transitions: signs of indicators joined by ``and``, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Sequence

from nonsmooth.errors import SystemDefinitionError, shortened, unknown

GRAMMAR = "<indicator> > 0  or  <indicator> < 0,  joined by 'and'"
_SIGN = re.compile(r"\s*([A-Za-z_]\w*)\s*([<>])(=?)\s*0(?:\.0*)?\s*\Z")


def read_condition(text: object, indicators: Sequence[str], label: str) -> tuple[tuple[str, int, bool], ...]:
    """Return (indicator, sign, strict) for each sign of a condition; ``>= 0`` is not strict.

    Parameters
    ----------
    text : str
        For example ``"penetration > 0 and separation < 0"``.
    indicators : sequence of str
        Names that may occur.
    label : str
        The transition, for the message.

    Raises
    ------
    SystemDefinitionError
        Outside the grammar, an unknown indicator, or the same indicator asked to have both signs.
    """
    if not isinstance(text, str):
        raise SystemDefinitionError(f"{label}: `when` must be a string of the form: {GRAMMAR}; not {shortened(text)}")
    signs: dict[str, tuple[int, bool]] = {}
    for part in re.split(r"\band\b", text):
        match = _SIGN.match(part)
        if match is None:
            raise SystemDefinitionError(
                f"{label}: cannot read {shortened(part.strip())} in the condition {shortened(text)}; the grammar is: "
                f"{GRAMMAR}. "
                "('or' is a second transition; anything else is a new indicator: for x > g declare "
                'indicators={"gap": lambda t, u, p: u.x - p.g} and write "gap > 0".)'
            )
        name, sign = match[1], (1 if match[2] == ">" else -1, not match[3])
        if name not in indicators:
            raise SystemDefinitionError(f"{label}: {unknown(name, 'an indicator', 'this system', indicators)}")
        if signs.setdefault(name, sign)[0] != sign[0]:
            raise SystemDefinitionError(f"{label}: {shortened(text)} asks for both signs of {name!r} at once")
    return tuple((name, sign, strict) for name, (sign, strict) in signs.items())


def condition_text(rows: Sequence[tuple[str, int, bool]]) -> str:
    """Return the condition as the user would write it; inverse of `read_condition`."""
    return " and ".join(f"{name} {'>' if sign > 0 else '<'}{'' if strict else '='} 0" for name, sign, strict in rows)
