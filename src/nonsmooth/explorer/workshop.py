"""The form of a system of elements: it shows the Python of its numbers, and makes a model of the page."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.explorer.building import KINDS, LINK, MOST, read_plan

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session

__all__ = ["Workshop"]

_KEPT = 50  # models that a page may have made


class Workshop:
    """Models that were made in a page, as "built 1", "built 2" and so on."""

    def __init__(self, page: Session) -> None:
        self.page = page
        self._made: dict[str, str] = {}  # the name of a model, by its Python
        self._python, self._shown = "", 0

    @property
    def actions(self) -> dict[str, Callable[[str, Any], object]]:
        """Messages of the page that concern the form."""
        return {"form": self._write, "build": self._build}

    def _write(self, name: str, value: Any) -> None:
        """Show the Python of the form; none where something in it does not fit."""
        self._python = ""
        self._python = read_plan(value).python()

    def _build(self, name: str, value: Any) -> None:
        """Make the system, and show it."""
        plan = read_plan(value)
        python = plan.python()
        if python not in self._made:
            if len(self._made) >= _KEPT:
                raise ValueError(f"this page has made {_KEPT} systems; save the Python, and open a page of its own")
            try:
                system = plan.system()
            except SystemDefinitionError as error:
                raise ValueError(str(error)) from None
            self._made[python] = self.page.add_model(f"built_{len(self._made) + 1}", system)
        self.page.show_model(self._made[python])
        self._shown += 1

    def tell(self) -> None:
        """The form as it is now."""
        def quantity(one: Any) -> dict[str, Any]:
            return {"label": one.label, "unit": one.unit, "value": one.value}

        self.page.tell("building", {
            "python": self._python, "built": self._shown, "most": MOST,
            "link": {key: quantity(one) for key, one in LINK.items()},
            "kinds": {
                key: {"label": kind.label, "sided": kind.sided,
                      "arguments": {name: quantity(one) for name, one in kind.arguments.items()}}
                for key, kind in KINDS.items()
            },
        })  # fmt: skip
