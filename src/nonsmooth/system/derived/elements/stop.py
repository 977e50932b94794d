"""The rigid stop: impacts with restitution, then rest; and friction at it, which `Stop(friction=...)` brings along."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.elements.coulomb import Friction
from nonsmooth.system.derived.elements.element import CREEP, SMALL, Condition, Contact, Element, Law, Leaving

if TYPE_CHECKING:
    from nonsmooth.system.derived.elements.element import Place


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
        Newton's coefficient, 0 <= e <= 1; 0 (an impact without rebound) where not given.
    rest : bool
        Without rest every impact rebounds, and an accumulation ends in the status ``chatter``.
    creep : float, optional
        Speed of approach below which impacts are not followed: 1e-7 of the scale of the speed's states.
    friction : number, name of a parameter or function of parameters, optional
        Coefficient of Coulomb's friction in the contact, :math:`|\lambda_t| \le \mu \lambda_n` (static equals kinetic),
        in impacts too, by Stronge's energetic law: ``restitution``, squared, is then the ratio of the normal works of
        restitution and compression. It needs ``tangent``; its force is that of an element ``<name>_friction``.
    tangent : str, mapping of str to float, or callable
        The direction in which it slips: with ``at=`` as ``at``; with ``gap=`` the slip speed ``v(t, u, p)``.
    on_tangent : mapping
        With ``gap=``: what a unit friction force adds to the derivatives of states, as ``on``.
    belt : number, name of a parameter, or function
        Speed of the stop's surface along ``tangent`` (with ``at=``).
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
    friction: Law | None = None
    tangent: str | Mapping[str, float] | Callable[..., Any] | None = None
    on_tangent: Mapping[str, Law] | None = None
    belt: Law = 0.0

    phases = ("open", "rest")
    laws = ("restitution",)
    conditions = ("gap", "closing", "opens", "slow", "off", "beyond")
    held = touching = ("rest",)
    strikes = True
    bears = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.restitution, (int, float)) and not 0 <= self.restitution <= 1:
            raise SystemDefinitionError(f"Stop: restitution = {self.restitution}; it lies between 0 and 1")
        if self.creep is not None and not (isinstance(self.creep, (int, float)) and self.creep > 0):
            raise SystemDefinitionError(f"Stop: creep is a positive speed, not {self.creep!r}")
        if (self.friction is None) != (self.tangent is None):
            raise SystemDefinitionError("Stop: friction= (a coefficient) and tangent= (where it slips) go together")
        if self.friction is not None and callable(self.tangent) == (self.on_tangent is None):
            raise SystemDefinitionError(
                "Stop: tangent= is a coordinate with at=; with gap= it is the slip speed, a function of t, u, p, and "
                "on_tangent= says what a unit friction force adds to which state's derivative"
            )
        if self.friction is not None and not self.rest:
            raise SystemDefinitionError("Stop: a contact with friction rests; leave out rest=False")
        if not self.rest:
            object.__setattr__(self, "phases", ("open",))

    def parts(self, name: str) -> dict[str, Element]:
        """The stop without friction, and its friction as an element of its own."""
        if self.friction is None:
            return {name: self}
        where = {"speed": self.tangent, "on": self.on_tangent} if callable(self.tangent) else {"at": self.tangent}
        plain = replace(self, friction=None, tangent=None, on_tangent=None, belt=0.0)
        rubs = Rubbing(of=name, belt=self.belt, friction=self.friction, **where)
        return {name: plain, name + RUBS: rubs}

    def force(self, here: Place) -> Any:
        return 0

    def ranges(self, here: Place) -> list[tuple[Any, str]]:
        e = here.law("restitution")
        sentence = f"restitution of element {here.name!r} lies between 0 and 1"
        return [(e, sentence), (1 - e, sentence)]

    def meeting(self, here: Place) -> list[list[Condition]]:
        return [[Condition(here.where, -1, "gap"), Condition(here.rate(), -1, "closing")]]

    def leaving(self, here: Place) -> list[Leaving]:
        if here.phase == "open" and not self.rest:
            return [Leaving("open", [Condition(here.where, -1, "gap")], here.struck(here.law("restitution")))]
        still = here.struck(0)
        pull = here.behind(here.free(), still)  # the derivative of its rate without its force, the approach ended
        presses, lifts = Condition(pull, -1, "opens"), Condition(pull, 1, "opens")
        if here.phase == "rest":
            off, ways = SMALL * here.size(here.where), [Leaving("open", [lifts])]
            if here.begins_alone():
                ways += [
                    Leaving("open", [Condition(here.where - off, 1, "off")]),
                    Leaving("open", [Condition(here.where + off, -1, "beyond")], here.back_on(still)),
                ]
            return ways
        w, restitution = here.rate(), here.law("restitution")
        closed = Condition(here.where, -1, "gap")
        closing = [closed, Condition(w, -1, "closing")]
        rests = here.back_on(still) if here.begins_alone() else still
        if here.vanishes(restitution):
            return [
                Leaving("rest", [*closing, presses], rests),
                Leaving("open", [*closing, lifts], still),
                Leaving("rest", closing, rests),  # neither, to all orders: it holds
            ]
        speed, rebound = w + (self.creep if self.creep is not None else CREEP * here.size(w)), here.struck(restitution)
        slow = [*closing, Condition(speed, 1, "slow")]
        return [
            Leaving("open", [closed, Condition(speed, -1, "slow")], rebound),
            Leaving("rest", [*slow, presses], rests),
            Leaving("open", [*slow, lifts], rebound),
            Leaving("rest", slow, rests),
        ]


RUBS = "_friction"  # ends its name, behind that of the stop


@dataclass(frozen=True, kw_only=True)
class Rubbing(Friction):
    """Coulomb's friction under the force of a rigid stop: |lambda_t| <= mu lambda_n, of which none is given.

    While the stop is closed and it slips, its force is -mu sgn v times that of the stop; while the stop is open it is
    free. What it does is always decided together with the stop (:mod:`nonsmooth.system.derived.deciding`)."""

    of: str = ""  # the stop

    phases = ("free", "stick", "forward", "back")
    laws = ("friction",)
    conditions = ("speed", "over", "under")

    def force(self, here: Place) -> Any:
        """None of its own: what it adds comes with the force of the stop."""
        return 0

    def most(self, here: Place) -> Any:
        """The coefficient of friction, which no force is measured by without that of the stop."""
        return here.law("friction")

    def meeting(self, here: Place) -> list[list[Condition]]:
        return [] if here.phase == "free" else super().meeting(here)

    def leaving(self, here: Place) -> list[Leaving]:
        return here.make.asked(here.k, here.mode, here.pattern)

    def ranges(self, here: Place) -> list[tuple[Any, str]]:
        return [(here.law("friction"), f"the friction of element {here.name!r} must not be negative")]
