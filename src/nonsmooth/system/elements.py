"""Contacts and friction by name: rigid and elastic stops, backlash, dry friction, preloaded springs.

An element is in one of a few phases (open or at rest, slipping or sticking, ...). In each its force is a law, or it is
whatever keeps a rate at zero: the approach of a contact that rests, the speed of one that sticks. A system with
elements has a mode for each combination of their phases; :mod:`nonsmooth.system.assembly` writes its fields, indicators
and transitions, as one would by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from nonsmooth.errors import SystemDefinitionError, shortened

__all__ = ["Backlash", "Coulomb", "ElasticStop", "Element", "PreloadedSpring", "Stop"]

Law = float | str | Callable[..., Any]


@dataclass(frozen=True, kw_only=True)
class Element:
    """The place where an element acts, which all of them have.

    Parameters
    ----------
    at : str, or mapping of str to float, optional
        Of a system made by :func:`nonsmooth.mechanical`: the coordinate, or a combination such as
        ``{"q1": 1, "q2": -1}`` for an element between two masses.
    on : mapping of str to number, parameter or function, optional
        Of any other system: what a unit force of the element adds to the derivatives of states,
        ``{"v": lambda t, u, p: 1 / p.m}``.
    """

    at: str | Mapping[str, float] | None = None
    on: Mapping[str, Law] | None = None

    kinematics: ClassVar[str] = ""  # the field that says where the element is, where ``at`` does not
    phases: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        label = type(self).__name__
        own = getattr(self, self.kinematics)
        if self.at is None and (own is None or not self.on):
            raise SystemDefinitionError(
                f"{label}: give {self.kinematics}= (a function of t, u, p) and on= (what a unit force adds to which "
                f"state's derivative), or at= (a coordinate) in ns.mechanical"
            )
        if self.at is not None and self.on is not None:
            raise SystemDefinitionError(f"{label}: at= (a coordinate of ns.mechanical) and on= exclude each other")
        if self.on is not None and not isinstance(self.on, Mapping):
            raise SystemDefinitionError(
                f'{label}: on= maps states to numbers or functions, {{"v": 1.0}}; not {shortened(self.on)}'
            )


@dataclass(frozen=True, kw_only=True)
class Stop(Element):
    r"""A rigid stop: impacts with restitution, then rest until the contact force would pull.

    With the gap :math:`\delta(t, u) \ge 0` and :math:`w = \dot\delta`, an impact at :math:`\delta = 0` turns w into
    :math:`-e w`. Impacts that accumulate are completed: below the speed ``creep`` the contact rests, where it would
    not open by itself. The force that holds :math:`w = 0` is the contact force; the contact opens where it vanishes.
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

    gap: Callable[..., Any] | None = None
    position: Law = 0.0
    side: int = 1
    restitution: Law = 0.0
    rest: bool = True
    creep: float | None = None

    kinematics: ClassVar[str] = "gap"
    phases: ClassVar[tuple[str, ...]] = ("open", "rest")

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_side(self)
        if isinstance(self.restitution, (int, float)) and not 0 <= self.restitution <= 1:
            raise SystemDefinitionError(f"Stop: restitution = {self.restitution}; it lies between 0 and 1")
        if self.creep is not None and not (isinstance(self.creep, (int, float)) and self.creep > 0):
            raise SystemDefinitionError(f"Stop: creep is a positive speed, not {self.creep!r}")
        if not self.rest:
            object.__setattr__(self, "phases", ("open",))


@dataclass(frozen=True, kw_only=True)
class ElasticStop(Element):
    r"""A stop with a spring and a damper: F = -k \delta - c \dot\delta while the gap \delta is negative.

    Parameters
    ----------
    gap, position, side
        As for :class:`Stop`.
    stiffness, damping : number, name of a parameter, or function
    pulls : bool
        True: in contact as long as the gap is negative, also where the damper pulls. False (a massless support that
        relaxes at once): in contact while the gap is negative and the force pushes (Savi et al. 2007, Eq. (2)).
    at, on
        See :class:`Element`.
    """

    gap: Callable[..., Any] | None = None
    position: Law = 0.0
    side: int = 1
    stiffness: Law = 0.0
    damping: Law = 0.0
    pulls: bool = False

    kinematics: ClassVar[str] = "gap"
    phases: ClassVar[tuple[str, ...]] = ("open", "contact")

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_side(self)


@dataclass(frozen=True, kw_only=True)
class Backlash(Element):
    r"""Play with elastic flanks: F = -k (s - b) - c \dot s above the half width b, its mirror image below -b.

    Parameters
    ----------
    displacement : callable
        ``s(t, u, p)``, zero in the middle of the play; a positive force drives it up.
    half_width, stiffness, damping : number, name of a parameter, or function
    at, on
        See :class:`Element`.
    """

    displacement: Callable[..., Any] | None = None
    half_width: Law = 0.0
    stiffness: Law = 0.0
    damping: Law = 0.0

    kinematics: ClassVar[str] = "displacement"
    phases: ClassVar[tuple[str, ...]] = ("free", "above", "below")


@dataclass(frozen=True, kw_only=True)
class PreloadedSpring(Element):
    r"""A spring with preload P and stiffness k: F = -P - k s for s > 0, P - k s for s < 0.

    Parameters
    ----------
    displacement : callable
        ``s(t, u, p)``; a positive force drives it up.
    preload, stiffness : number, name of a parameter, or function
    at, on
        See :class:`Element`.
    """

    displacement: Callable[..., Any] | None = None
    preload: Law = 0.0
    stiffness: Law = 0.0

    kinematics: ClassVar[str] = "displacement"
    phases: ClassVar[tuple[str, ...]] = ("above", "below")


@dataclass(frozen=True, kw_only=True)
class Coulomb(Element):
    r"""Dry friction with sticking: F = -f(v) sgn v while it slips, what holds v = 0 while it sticks.

    It sticks as long as the force that holds it stays below ``static``; Stribeck curves are functions ``friction(v)``
    of the speed's magnitude.

    Parameters
    ----------
    speed : callable
        Relative speed ``v(t, u, p)``; a positive force drives it up. With ``at=`` the coordinate's own, less ``belt``.
    belt : number, name of a parameter, or function
        Speed of what the coordinate slides on (``at=`` only).
    friction : number, name of a parameter, or function
        The friction force while slipping, positive: a number, a parameter, ``f(t, u, p)``, or ``f(v, p)`` of the
        magnitude of the speed. With ``normal``: the coefficient of friction.
    static : number, name of a parameter, or function, optional
        The largest force (coefficient) that holds; ``friction`` at v = 0 where not given.
    normal : number, name of a parameter or of an elastic element, or function, optional
        The normal force; the name of an :class:`ElasticStop` stands for its contact force.
    at, on
        See :class:`Element`.
    """

    speed: Callable[..., Any] | None = None
    belt: Law = 0.0
    friction: Law = 0.0
    static: Law | None = None
    normal: Law | None = None

    kinematics: ClassVar[str] = "speed"
    phases: ClassVar[tuple[str, ...]] = ("stick", "forward", "back")


def _check_side(element: Stop | ElasticStop) -> None:
    if element.side not in (1, -1):
        raise SystemDefinitionError(
            f"{type(element).__name__}: side is 1 (the stop lies above) or -1 (below), not {element.side!r}"
        )
