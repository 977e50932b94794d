r"""The variational flow: smooth segments and transitions, each with its derivatives in state and parameters.

The extended state is z = (u, memory). A segment is motion in one mode for a given duration, transitions ignored:
:math:`z(t_0 + \tau)`, :math:`\Phi = \partial z / \partial z_0`, :math:`P = \partial z / \partial p`, from
:math:`\dot\Phi = f_z \Phi` and :math:`\dot P = f_z P + f_p`. A transition at (t, z) has the saltation matrix

.. math:: S = R_z + \frac{(f^+ - R_z f^- - R_t)\, h_z}{h_t + h_z f^-}

and, with :math:`h_p` in place of :math:`h_z` and :math:`R_p` in place of :math:`R_z`, a column for each parameter.
A motion's derivative is the product of those of its segments and transitions.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.saltation import Jump, Touch, chained, of_one_instant
from nonsmooth.kernels.hybrid.kept import Segments
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.traced import along

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System


class VariationalFlow:
    """Segments and jumps of one system's equations, with derivatives in the ``active`` parameters.

    Made by :meth:`of`; it holds no parameter values, and threads may share it.

    Attributes
    ----------
    n : int
        Size of the extended state z = (u, memory).
    n_active : int
        Number of active parameters.
    active : tuple of str
        Their names.
    """

    def __init__(self, traced: Traced, active: tuple[str, ...], scale: FloatArray) -> None:
        self.active, self.places = active, tuple(traced.parameter_names.index(name) for name in active)
        self.symbols = tuple(traced.p[i] for i in self.places)
        self.n_u, self.n = len(traced.u), len(traced.u) + len(traced.m)
        self.n_active, self.n_p = len(active), len(traced.p)
        self.scale = np.concatenate([scale, np.ones(len(traced.m))])
        self._local = threading.local()
        self._made: dict[tuple[int, int], Any] = {}
        self._no_timing = np.zeros(self.n_active)
        self._take(traced)

    def _take(self, traced: Traced) -> None:
        """Take equations, the same as before but for transitions that were found since."""
        from nonsmooth.kernels.compile.pointers import addresses
        from nonsmooth.kernels.tangent.legs import Equations

        self.traced = traced
        self.model, stands = self._compiled()
        self.equations = Equations(
            addresses(self.model.jet, self.model.field, self.model.switch),
            self.model.entries,
            self.model.kinds,
            np.array(
                [(t.source, t.target, len(t.rows), k) for t, k in zip(traced.transitions, stands, strict=True)],
                dtype=np.int64,
            ).reshape(-1, 4),
        )
        rows = max([0, *(len(jump.rows) for jump in traced.transitions)])
        n, a = self.n, self.n_active
        self.n_out = n + n * n + n + n * a + rows * (2 + n + a)
        self._local = threading.local()

    def _compiled(self) -> tuple[Any, Sequence[int]]:
        """The functions of the model, and for each transition the one of them that it is."""
        from nonsmooth.system.codegen.variations import variational_model

        plain, stands = self.traced.without_answers(rows=True)
        return variational_model(plain, self.places), stands

    def path(self) -> tuple[Any, int]:
        """The jet of states and conditions, without small changes; rows of its scratch."""
        from nonsmooth.system.codegen.generate import compile_model

        model = compile_model(self.traced.without_answers()[0])
        return model.jet, model.n_scratch

    def known(self) -> Traced:
        """The equations as far as they are known by now (:mod:`.deciding`)."""
        decider = self.traced.decider
        return self.traced if decider is None else decider.known()

    def look_at(self, modes: Any, values: FloatArray) -> None:
        """Find the transitions out of some modes."""
        self.catch_up()

    def catch_up(self) -> None:
        """Take in the modes and transitions that were found since."""
        if (known := self.known()) is not self.traced:
            self._take(known)

    def on_path(self, values: FloatArray, modes: Any) -> FloatArray:
        """The constants of the model of :meth:`path` at these parameters, for these modes."""
        return _floats(values)

    def _ready(
        self, values: FloatArray, modes: Any = (), jump: tuple[int, float, FloatArray] | None = None
    ) -> tuple[FloatArray, Any]:
        """The parameters that the kernels put into their working memory, and that memory, for some modes, or for a
        transition with its time and the state before it."""
        return _floats(values), self.scratch()

    @classmethod
    def of(cls, system: System, active: Sequence[str] = (), rows: bool = True) -> VariationalFlow:
        """The flow of a system's equations; made once for the same equations and names.

        Where everything is linear it is one of rows of numbers, unless it must not be (``rows``).

        Raises
        ------
        ValueError
            A name that is not a parameter of the system.
        """
        names = (active,) if isinstance(active, str) else tuple(active)
        for name in names:
            if name not in system.values:
                from nonsmooth.errors import unknown

                units = {key: parameter.unit for key, parameter in system.parameters.items()}
                raise ValueError(unknown(name, "a parameter", repr(system.name), units))
        traced, scale = system.traced, tuple(system.scale_vector().tolist())
        if traced.patterns is None:
            return _flow(traced, traced.decider, names, scale, rows and not system.is_smoothed)
        from nonsmooth.flow.variational_rows import pattern_flow

        found: VariationalFlow = pattern_flow(traced.patterns, names, scale)
        found.catch_up()
        return found

    def segments(self, values: Any, modes: Any, t0: Any, tau: Any, z0: Any) -> Segments:
        """March segments, each in one mode, with derivatives; accurate to rounding.

        Parameters
        ----------
        values : array (n_p,)
            Parameters, in the system's order.
        modes : array (m,) of int
        t0, tau : array (m,)
            Beginning (forced systems: within the orbit, not a large absolute time) and duration, of either sign.
        z0 : array (m, n)
        """
        from nonsmooth.kernels.tangent.legs import march_legs

        modes = np.ascontiguousarray(modes, dtype=np.int64)
        out, (values, work) = Segments.room(len(modes), self.n, self.n_active), self._ready(values, modes)
        march_legs(self.equations, modes, _floats(t0), _floats(tau), _floats(z0), values, out, work)
        return out

    def jump(
        self, values: Any, k: int | Sequence[int], t: float, z: Any, row: int = -1, at_change: bool = False
    ) -> Jump:
        """Transition ``k`` at (t, z), or several that are taken there one after the other.

        ``row`` is the row of the (first) condition that is zero there, -1: the nearest to it; ``at_change``: a start
        or a change of inputs brings all of them about. For a transition at a given phase t must be the time since the
        orbit's beginning: dt/dp = (t / T) dT/dp + T d(at)/dp.
        """
        from nonsmooth.kernels.tangent.legs import Crossing, cross

        if not isinstance(k, int | np.integer):
            jumps: list[Jump] = []
            for one in k:
                jumps.append(self.jump(values, one, t, jumps[-1].z_after if jumps else z, -1 if jumps else row))
            return chained(jumps) if at_change else of_one_instant(jumps, self.scale)

        n, a = self.n, self.n_active
        values, timing = _floats(values), self._no_timing
        if a and self.traced.transitions[k].at is not None:
            period, gradient = self.period(values)
            timing = (t / period) * gradient + period * self.phase(values, int(k))[1]
        square = n + a, n + a
        out, seen = (
            np.empty(self.n_out),
            Crossing(np.empty(square), np.empty(square), np.empty(square), np.empty((3, n + a)), np.empty(n + a)),
        )
        z = _floats(z)
        values, work = self._ready(values, jump=(int(k), t, z))
        row = cross(self.equations, k, row, t, z, values, timing, self.scale, seen, out, work)
        at = n + n * n + n + n * a + row * (2 + n + a)
        h = out[at : at + 2 + n + a] if row >= 0 else np.zeros(2 + n + a)
        return Jump(
            out[:n],
            seen.reset,
            seen.fields,
            float(h[0]),
            h[1 : 1 + n],
            float(h[1 + n]),
            h[2 + n :],
            seen.step,
            seen.t_z,
            row,
            self.traced.transitions[k].rows[row].indicator if row >= 0 else -1,
        )

    def indicator(self, values: Any, i: int, mode: int, t: float, z: Any) -> Touch:
        """Indicator ``i`` at (t, z) with its first two derivatives along the flow of ``mode``, and gradients of all."""
        if (i, mode) not in self._made:
            now = self.traced
            orders = [now.indicators[i]]
            for _ in range(2):
                orders.append(along(orders[-1], now.t, now.u, now.fields[mode]))
            variables = (*now.u, *now.m, now.t, *self.symbols)
            self._made[i, mode] = numeric(now, tuple(orders), variables, quick=True)
        numbers = np.asarray(z, dtype=float).tolist()
        n, n_u = self.n, self.n_u
        found = self._made[i, mode](np.asarray(values).tolist(), float(t), numbers[:n_u], numbers[n_u:])
        parts: list[Any] = []
        for row in np.array(found).reshape(3, -1):
            parts += [float(row[0]), row[1 : 1 + n], float(row[1 + n]), row[2 + n :]]
        return Touch(*parts)

    def rates(self, values: Any, i: int, mode: int, order: int, t: FloatArray, z: FloatArray) -> tuple[FloatArray, ...]:
        """Of an indicator's derivative of some order along the flow of a mode, at some points: its values (points,),
        and its derivatives in the states, in time and in the active parameters."""
        every = [self.indicator(values, i, mode, float(at), state) for at, state in zip(t, z, strict=True)]
        name = ("h", "L", "L2")[order]
        return tuple(np.array([getattr(one, name + of) for one in every]) for of in ("", "_z", "_t", "_p"))

    def phase(self, values: Any, k: int) -> tuple[float, FloatArray]:
        """Phase of the time-triggered transition k and its derivatives (n_active,) in the active parameters."""
        at = self.traced.transitions[k].at
        if isinstance(at, int | float):
            return float(at), self._no_timing
        return self._of_parameters(k, at, values)

    def period(self, values: Any) -> tuple[float, FloatArray]:
        """Forcing period T and dT/dp (n_active,); infinite and zeros where there is none."""
        if self.traced.period is None:
            return np.inf, self._no_timing
        return self._of_parameters(-1, self.traced.period, values)

    def _of_parameters(self, key: int, expression: Any, values: Any) -> tuple[float, FloatArray]:
        """An expression of parameters, and its derivatives in the active ones."""
        if (key, -1) not in self._made:
            self._made[key, -1] = numeric(self.traced, (expression,), self.symbols, quick=True)
        found = self._made[key, -1](np.asarray(values, dtype=float).tolist())
        return found[0], np.array(found[1:])

    @property
    def n_moving(self) -> int:
        """Numbers that the kernels take for states: memory is constant and stands beside them."""
        return self.n_u

    def scratch(self) -> Any:
        """The thread's scratch memory."""
        found = getattr(self._local, "work", None)
        if found is None:
            from nonsmooth.kernels.tangent.legs import ACCURACY, ORDER

            found = self._local.work = self.steps(ORDER, ACCURACY)
        return found

    def steps(self, order: int, accuracy: float) -> Any:
        """Working memory of steps by series of this order, whose last terms are so small."""
        from nonsmooth.kernels.compile.lanes import FOUR
        from nonsmooth.kernels.compile.pointers import one_block
        from nonsmooth.kernels.tangent.legs import Steps

        n, columns, width = self.n_moving, self.n + self.n_active, order + 1
        rows, changes = 2 * n + len(self.model.entries), np.zeros((max(n, 2), columns))
        return Steps._make(
            [
                *one_block(
                    np.zeros((rows, width)),
                    np.zeros((width, columns, -(-columns // FOUR) * FOUR)),
                    np.zeros((self.model.n_scratch, width)),
                    changes[:n],
                    changes,
                    changes[:n],
                    np.zeros(width),
                    np.zeros(n),
                    np.zeros(self.n_p + len(self.traced.m)),
                ),
                accuracy,
            ]
        )


def _floats(x: Any) -> FloatArray:
    return np.ascontiguousarray(x, dtype=np.float64)


@lru_cache(maxsize=32)  # as many as of what it is made of
def _flow(
    traced: Traced, decider: Any, names: tuple[str, ...], scale: tuple[float, ...], rows: bool
) -> VariationalFlow:
    """A flow for each ``decider``: systems that were defined alike number what they find each in its own order."""
    from nonsmooth.flow.engines.linear import is_linear
    from nonsmooth.flow.variational_rows import LinearFlow
    from nonsmooth.system.codegen.linear import linear_form

    plain = traced.without_answers()[0]
    linear = rows and is_linear(plain, linear_form(plain))
    return (LinearFlow if linear else VariationalFlow)(traced, names, np.array(scale))
