"""The rigid stop: impacts with restitution, then rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.elements.element import CREEP, SMALL, Condition, Contact, Law, Leaving

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Place

__all__ = ["Stop"]


@dataclass(frozen=True, kw_only=True)
class Stop(Contact):
    r"""A rigid stop: impacts with restitution, then rest until the contact force would pull.

    With the gap :math:`\delta(t, u) \ge 0` and :math:`w = \dot\delta`, an impact at :math:`\delta = 0` turns w into
    :math:`-e w`. Impacts that accumulate are completed: below the speed ``creep`` the contact rests, where it would
    not open by itself. The force that holds :math:`w = 0` is the contact force; the contact opens where it vanishes.
    The impulses of impacts are not in it: results hold them beside it (:func:`nonsmooth.simulate`).
    What is left out is shorter than :math:`2 w / (|a| (1 - e))`, with the free acceleration :math:`a = \dot w`, and
    displaces nothing by more than :math:`w^2 / 2 |a|`.

    Parameters
    ----------
    gap : callable
        ``gap(t, u, p)``, positive where there is room. A positive force opens it.
    position, side : number, name of a parameter or function; {1, -1}
        With ``at=``: the stop stands at this value of the coordinate, above (1) or below (-1) it.
    restitution : number, name of a parameter, or function
        Newton's coefficient, 0 <= e <= 1.
    rest : bool
        Without rest every impact rebounds, and an accumulation ends in the status ``chatter``.
    creep : float, optional
        Speed of approach below which impacts are not followed: 1e-7 of the scale of the speed's states.
    at, on
        See :class:`Element`.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> ball = ns.System(
    ...     states=["x", "v"], parameters={"g": 9.81, "e": 0.5}, modes={"fly": lambda t, u, p: (u.v, -p.g)},
    ...     elements={"floor": ns.elements.Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution="e")})
    >>> run = ns.simulate(ball, duration=2.0, start={"x": 1.0})
    >>> str(ball.modes[int(run.mode[-1])])
    'floor_rest'
    """

    restitution: Law = 0.0
    rest: bool = True
    creep: float | None = None

    phases: ClassVar[tuple[str, ...]] = ("open", "rest")
    laws: ClassVar[tuple[str, ...]] = ("restitution",)
    conditions: ClassVar[tuple[str, ...]] = ("gap", "closing", "opens", "slow", "off", "beyond")
    held: ClassVar[tuple[str, ...]] = ("rest",)
    strikes: ClassVar[bool] = True
    bears: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.restitution, (int, float)) and not 0 <= self.restitution <= 1:
            raise SystemDefinitionError(f"Stop: restitution = {self.restitution}; it lies between 0 and 1")
        if self.creep is not None and not (isinstance(self.creep, (int, float)) and self.creep > 0):
            raise SystemDefinitionError(f"Stop: creep is a positive speed, not {self.creep!r}")
        if not self.rest:
            object.__setattr__(self, "phases", ("open",))

    def force(self, here: Place) -> Any:
        return 0

    def ranges(self, here: Place) -> list[tuple[Any, str]]:
        e = here.law("restitution")
        sentence = f"restitution of element {here.name!r} lies between 0 and 1"
        return [(e, sentence), (1 - e, sentence)]

    def meeting(self, here: Place) -> list[list[Condition]]:
        return [[Condition(here.where, -1, "gap"), Condition(here.rate(), -1, "closing")]]

    def bearing(self, here: Place) -> list[int]:
        """Those that it would pull open part instead; friction is finite and lets go of what it held."""
        return [j for j in here.held() if here.other(j).element.bears and here.effect_on(j) < 0]

    def pulled(self, here: Place, held: list[int]) -> Any:
        """The derivative of its rate without its force, where the approach has ended."""
        return here.behind(here.free(), here.struck(0, held))

    def leaving(self, here: Place) -> list[Leaving]:
        if here.phase == "rest":
            pull = self.pulled(here, [])
            off = SMALL * here.size(here.where)
            return [
                Leaving("open", [Condition(pull, 1, "opens")]),
                Leaving("open", [Condition(here.where - off, 1, "off")]),
                Leaving("open", [Condition(here.where + off, -1, "beyond")], here.back_on(here.struck(0, []))),
            ]
        w, held = here.rate(), self.bearing(here)
        if not here.may_hold([here.k, *held]):
            return []  # what rests and sticks leaves it no way to move
        restitution = here.law("restitution")
        rebound = here.struck(restitution, held)
        closed = Condition(here.where, -1, "gap")
        if not self.rest:
            return [Leaving("open", [closed], rebound)]
        still, pull = here.struck(0, held), self.pulled(here, held)
        closing = [closed, Condition(w, -1, "closing")]
        presses, lifts = Condition(pull, -1, "opens"), Condition(pull, 1, "opens")
        if here.vanishes(restitution):
            return [
                Leaving("rest", [*closing, presses], still), Leaving("open", [*closing, lifts], still),
                Leaving("rest", closing, still),  # neither, to all orders: it holds
            ]
        speed = w + (self.creep if self.creep is not None else CREEP * here.size(w))
        slow = [*closing, Condition(speed, 1, "slow")]
        return [
            Leaving("open", [closed, Condition(speed, -1, "slow")], rebound),
            Leaving("rest", [*slow, presses], still), Leaving("open", [*slow, lifts], rebound),
            Leaving("rest", slow, still),
        ]
