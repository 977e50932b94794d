"""The line above the views, with what is known of the stability of the motion."""

from __future__ import annotations

from collections.abc import Mapping

from nonsmooth.explorer.readout import readout
from nonsmooth.explorer.views.view import Request, View

__all__ = ["Readout"]


class Readout(View):
    """A motion in a few words and numbers."""

    name = "readout"

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """Multipliers or exponents, once the orbit is there."""
        return {} if "motion" not in base or self.system.is_map else self.each(base["motion"])

    def redraw(self) -> None:
        """Tell the page."""
        results = self.sheet.results
        if "judged" in results:
            told = readout(self.system, self.state, results, self.results)
            self.page.tell("readout", [*told, *self.sheet.bench.readout()])

    def clear(self) -> None:
        """Tell nothing."""
        super().clear()
        self.page.tell("readout", [])
