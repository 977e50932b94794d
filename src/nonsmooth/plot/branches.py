"""Results of continuation: branches, curves of special points, multipliers, manifolds, branches of experiments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import name_and_unit, name_axes, name_plane, only_states, variable_along, words_of_flags

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = [
    "MARKS", "branch", "controlled_branch", "curve", "draw_branch", "lines_of", "manifolds", "mark_special",
    "multipliers", "ordinates_of", "with_breaks",
]  # fmt: skip

#: Marker and words of each kind of special point.
MARKS = {
    "fold": ("o", "fold"),
    "flip": ("s", "flip"),
    "neimark_sacker": ("D", "Neimark-Sacker"),
    "pitchfork": ("^", "pitchfork"),
    "transcritical": ("<", "transcritical"),
    "branch_point": ("v", "branch point"),
    "grazing": ("X", "grazing"),
    "corner": ("P", "corner"),
    "hopf": ("H", "Hopf"),
    "boundary_equilibrium": ("p", "boundary equilibrium"),
}
_OTHER = "*"
#: Diameters in points. Several kinds meet at one point where a branch grazes: the smaller one lies on the larger.
_SIZES = {"fold": 6.5, "flip": 5.5}
_SIZE = 4.0
_STATES = {"-": "stable", "--": "unstable", ":": "virtual"}
_SEAM = 0.3  # opacity of a stable branch under the points that lie on it
_WORDS = {"section": "", "maximum": "largest ", "minimum": "smallest ", "amplitude": "amplitude of "}


def branch(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    y: str | None = None,
    quantity: str = "section",
    special: bool = True,
    color: str | None = None,
) -> Axes:
    """Draw a branch over its parameter: stable parts solid, unstable ones dashed, virtual ones dotted.

    Parameters
    ----------
    result
        A ``continue_orbit`` or ``continue_equilibrium``.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    quantity : {"section", "maximum", "minimum", "amplitude"}
        Section points (all of a period-n orbit where the branch has ``returns``), extremes over the orbit, or half
        their distance. Of an equilibrium the state itself, and 0.
    special
        Mark the special points, each kind with its own sign, named in the legend.
    color
        Colour of the lines.
    """
    variable_along(result, "stable", "continue_orbit")
    with style.axes(ax) as drawn:
        draw_branch(drawn, result, y=y, quantity=quantity, special=special, color=color)
        (name,) = only_states(result, y)
        name_plane(drawn, result, result.attrs["parameter"], name, _WORDS[quantity])
        style.clear_legend(drawn)
    return drawn


def draw_branch(
    ax: Axes,
    result: xr.Dataset,
    *,
    y: str | None = None,
    quantity: str = "section",
    special: bool = True,
    color: str | None = None,
    width: float = 0.9,
    behind: bool = False,
) -> None:
    """Draw the lines (``width`` in typographic points) and marks of a branch on axes that the caller labels.

    ``behind``: over points of a sweep, which lie on the stable parts: those become a pale, wide seam under them.
    """
    variable_along(result, "stable", "continue_orbit")
    if quantity not in _WORDS:
        raise ValueError(f"quantity = {quantity!r}; allowed: {', '.join(map(repr, _WORDS))}")
    (name,) = only_states(result, y)
    values = result[result.attrs["parameter"]].values
    ordinates = ordinates_of(result, name, quantity)
    shade = color or style.COLORS["first"]
    for line, at in lines_of(result):
        looks: dict[str, Any] = {"linewidth": width, "zorder": 3}
        if behind and line == "-":
            looks = {"linewidth": 3 * width, "alpha": _SEAM, "zorder": 0.5}
        for row in ordinates:
            label = style.once(ax, f"{_STATES[line]} branch")
            ax.plot(with_breaks(values, at), with_breaks(row, at), line, color=shade, label=label, **looks)
    if special and result.sizes.get("special", 0):
        mark_special(ax, result, values, ordinates, MARKS)


def ordinates_of(result: xr.Dataset, name: str, quantity: str) -> NDArray[np.float64]:
    """One line for each section point of the orbit, (lines, point); an equilibrium is its own maximum and minimum."""
    if "eigenvalues" in result:
        rest = result["u"].sel(state=name).values.astype(float)
        return np.zeros((1, len(rest))) if quantity == "amplitude" else rest[None, :]
    if quantity == "amplitude":
        chosen = 0.5 * (result["maximum"] - result["minimum"]).sel(state=name)
    else:
        source = "returns" if quantity == "section" and "returns" in result else quantity
        chosen = result[source].sel(state=name)
    others = [dim for dim in chosen.dims if dim != "point"]
    return np.asarray(chosen.transpose(*others, "point").values, dtype=float).reshape(-1, result.sizes["point"])


def mark_special(
    ax: Axes, result: xr.Dataset, x: Any, heights: NDArray[np.float64], marks: Mapping[str, tuple[str, str]]
) -> None:
    """The special points on each of the lines (lines, point), every kind with its own sign and words."""
    at = result["special_point"].values.astype(int)
    kinds = result["special_kind"].values.astype(str)
    for kind in dict.fromkeys(kinds.tolist()):
        here = at[kinds == kind]
        marker, words = marks.get(kind, (_OTHER, kind.replace("_", " ")))
        size = _SIZES.get(kind, _SIZE)
        rows = heights[:, here]
        style.mark(ax, (np.broadcast_to(x[here], rows.shape), rows), marker, words, size, zorder=5.7 - 0.1 * size)


def lines_of(result: xr.Dataset) -> list[tuple[str, NDArray[np.intp]]]:
    """The style of each kind of line, and the points that it joins (-1: a break).

    A segment that begins at a special point, where stability changes, is of the kind of its end.
    """
    kind = np.where(result["stable"].values.astype(bool), 0, 1)
    if "virtual" in result:
        kind[result["virtual"].values.astype(bool)] = 2
    first, last = kind[:-1].copy(), kind[1:]
    if result.sizes.get("special", 0):
        at = result["special_point"].values.astype(int)
        at = at[at < len(first)]
        first[at] = last[at]
    segments = np.where(last == 2, 2, first)
    found = []
    for number, line in enumerate(_STATES):
        here = np.flatnonzero(segments == number)
        runs = [run for run in np.split(here, np.flatnonzero(np.diff(here) > 1) + 1) if run.size]
        if runs:
            found.append((line, np.concatenate([[*run, run[-1] + 1, -1] for run in runs])[:-1]))
    return found


def with_breaks(values: NDArray[np.float64], at: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the values at points of a line, NaN at its breaks."""
    return np.where(at < 0, np.nan, values[at])


#: Colour, line and words of each kind of curve.
KINDS = {
    "fold": ("first", "-", "fold"),
    "flip": ("second", "--", "flip"),
    "neimark_sacker": ("fourth", "-.", "Neimark-Sacker"),
    "grazing": ("section", ":", "grazing"),
}
#: Marker and words of each point of codimension two.
POINTS = {
    "cusp": ("v", "cusp"),
    "fold_flip": ("s", "fold-flip"),
    "resonance_1_1": ("D", "1:1 resonance"),
    "resonance_1_2": ("h", "1:2 resonance"),
    "resonance_1_3": ("^", "1:3 resonance"),
    "resonance_1_4": ("d", "1:4 resonance"),
    "grazing_fold": ("o", "grazing-fold"),
    "grazing_flip": ("p", "grazing-flip"),
    "grazing_neimark_sacker": ("8", "grazing-Neimark-Sacker"),
    "double_grazing": ("X", "double grazing"),
    "generalised_flip": ("*", "generalised flip"),
    "chenciner": ("<", "Chenciner"),
    "fold_neimark_sacker": (">", "fold-Neimark-Sacker"),
    "flip_neimark_sacker": ("H", "flip-Neimark-Sacker"),
    "corner": ("P", "corner"),
}


def curve(result: xr.Dataset, ax: Axes | None = None, *, special: bool = True, color: str | None = None) -> Axes:
    """Draw a curve of special points over its two parameters; call it again on the same axes for another curve.

    Parameters
    ----------
    result
        A ``continue_curve``. Folds are solid, flips dashed, Neimark-Sacker points dash-dotted, grazing points dotted.
    ax
        Where to draw; a new one-column figure if None.
    special
        Mark the points of codimension two, each kind with its own sign, named in the legend.
    color
        Colour of the line in place of that of its kind.
    """
    variable_along(result, "kind", "continue_curve")
    variable_along(result, "special_point", "continue_curve")
    # The two parameters are the only coordinates over the points, in the order in which they were given.
    names = [str(name) for name, values in result.coords.items() if values.dims == ("point",)]
    x, y = names
    shade, line, words = KINDS[str(result["kind"].values)]
    with style.axes(ax) as drawn:
        drawn.plot(
            result[x].values, result[y].values, line, color=color or style.COLORS[shade], linewidth=1.0, zorder=3,
            label=style.once(drawn, words), path_effects=style.halo(1.8) if _over_chart(drawn) else None,
        )  # fmt: skip
        if special:
            mark_special(drawn, result, result[x].values, result[y].values[None], POINTS)
        name_plane(drawn, result, x, y)
        _legend(drawn)
    return drawn


def _over_chart(ax: Axes) -> bool:
    from matplotlib.collections import QuadMesh

    return any(isinstance(item, QuadMesh) for item in ax.collections)


def _legend(ax: Axes) -> None:
    """The legend of the curves; that of a chart beneath them stays, and the new one stands below it."""
    own, before = ax.get_legend_handles_labels()[1], ax.get_legend()
    if before is not None and not {text.get_text() for text in before.get_texts()} <= set(own):
        ax.add_artist(before)
        before.set_clip_on(False)  # else the layout takes it for a thing within the axes, and cuts it
    if _over_chart(ax):
        ax.legend(loc="lower left", bbox_to_anchor=(1.01, 0.0), borderaxespad=0.0)
    else:
        ax.legend(loc="best")


def multipliers(result: xr.Dataset | Any, ax: Axes | None = None, *, limit: float | None = None) -> Axes:
    """Draw the Floquet multipliers of an orbit, or those along a branch coloured by its parameter.

    Parameters
    ----------
    result
        An ``Orbit``, its Dataset, or a ``continue_orbit``.
    ax
        Where to draw; a new one-column figure if None.
    limit
        Half width of the picture; by default what holds the unit circle and the multipliers, but no more than 4: near
        a rigid graze one multiplier goes to infinity. Those outside are counted in the title.
    """
    data = result.to_dataset() if hasattr(result, "to_dataset") and not hasattr(result, "data_vars") else result
    variable_along(data, "floquet_multipliers", "find_orbit or continue_orbit")
    values = data["floquet_multipliers"]
    along = "point" in values.dims
    mu = values.transpose("point", ...).values if along else values.values[None, :]
    finite = mu[np.isfinite(mu)]
    size = max([1.0, *np.abs(finite.real), *np.abs(finite.imag)]) * 1.12
    half = min(size, 4.0) if limit is None else float(limit)
    outside = int(((np.abs(mu.real) > half) | (np.abs(mu.imag) > half) | ~np.isfinite(mu)).any(axis=1).sum())
    with style.axes(ax, ratio=0.9) as drawn:
        angle = np.linspace(0, 2 * np.pi, 361)
        drawn.plot(np.cos(angle), np.sin(angle), color=style.COLORS["muted"], linewidth=0.6, zorder=1)
        for line in (drawn.axhline, drawn.axvline):
            line(0.0, color=style.COLORS["muted"], linewidth=0.3, zorder=0)
        if along:
            name = str(data.attrs["parameter"])
            shade = np.broadcast_to(data[name].values[:, None], mu.shape)
            dots = drawn.scatter(
                mu.real.ravel(), mu.imag.ravel(), c=shade.ravel(), s=4, cmap="viridis", linewidths=0, zorder=3
            )
            name_axes(drawn.figure.colorbar(dots, ax=drawn).ax, y=name_and_unit(data, name))
        else:
            drawn.plot(mu.real.ravel(), mu.imag.ravel(), "o", color=style.COLORS["first"], markersize=3.5, zorder=3)
        drawn.set(
            xlabel=r"Re $\mu$", ylabel=r"Im $\mu$", xlim=(-half, half), ylim=(-half, half), aspect="equal",
        )  # fmt: skip
        if outside:
            drawn.set_title(f"{outside} of {len(mu)} points reach outside" if along else "a multiplier lies outside")
    return drawn


def manifolds(
    result: xr.Dataset, ax: Axes | None = None, *, x: str | None = None, y: str | None = None, linewidth: float = 0.6
) -> Axes:
    """Draw the manifolds of a saddle in the plane of two states, with the saddle's own section points.

    Parameters
    ----------
    result
        A result of ``manifolds``. Lines are broken where the section map jumps.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the two axes; by default the first two.
    linewidth
        In typographic points.
    """
    variable_along(result, "arc_length", "manifolds")
    names = only_states(result, x, y)
    kinds = words_of_flags(result["manifold"])
    columns = [result["section"].sel(state=name).values for name in names]
    saddle = [result["orbit_section"].sel(state=name).values for name in names]
    numbers, piece = result["arc_number"].values, result["piece"].values
    with style.axes(ax, ratio=0.85) as drawn:
        for number, code in enumerate(result["manifold"].values):
            chosen = np.flatnonzero(numbers == number)
            if not len(chosen):
                continue
            breaks = np.flatnonzero(np.diff(piece[chosen]) > 0) + 1
            kind = kinds[int(code)]
            color = "second" if kind == "unstable" else "first"
            # Each arc begins at the orbit itself.
            j = int(result["orbit_point"].values[number])
            xs, ys = (
                np.insert(np.insert(values[chosen], breaks, np.nan), 0, own[j])
                for values, own in zip(columns, saddle, strict=True)
            )
            drawn.plot(
                xs, ys, color=style.COLORS[color], linewidth=linewidth, zorder=3 if kind == "unstable" else 2,
                label=style.once(drawn, f"{kind} manifold"),
            )  # fmt: skip
        style.mark(drawn, saddle, "o", "saddle", zorder=5)
        name_plane(drawn, result, *names)
        style.clear_legend(drawn)
    return drawn


#: Filling and words of each ``stability``.
_LOOKS = {1: ("first", "came back when let go: stable"), 0: ("white", "left when let go: unstable"),
          -1: ("muted", "held; stability not known")}  # fmt: skip
_EFFORTS = (
    ("control_effort_first", "s", "before the first correction"),
    ("control_effort", "o", "converged"),
    ("control_effort_noise", "_", "noise alone"),
)


def controlled_branch(
    result: xr.Dataset, ax: Axes | None = None, *, y: str = "amplitude", theory: xr.Dataset | None = None
) -> Axes:
    """Draw the result of ``control_based_continuation``.

    Parameters
    ----------
    result
        Of ``control_based_continuation``.
    ax
        Where to draw; a new one-column figure if None.
    y : {"amplitude", "control_effort"}
        Half the peak-to-peak value over the parameter, with bars of two standard uncertainties, and the folds; or the
        control force of each point, before and after the reference was corrected, over that of noise.
    theory
        A branch of ``continue_orbit`` in the same parameter, to be drawn behind the amplitudes.

    Raises
    ------
    ValueError, TypeError
        A result of another verb, another quantity, a branch in another parameter.
    """
    variable_along(result, "control_effort", "control_based_continuation")
    if y not in ("amplitude", "control_effort"):
        raise ValueError(f"y = {y!r}; allowed: 'amplitude', 'control_effort'")
    parameter = str(result.attrs["parameter"])
    if theory is not None and theory.attrs.get("parameter") != parameter:
        raise ValueError(f"the branch is in {theory.attrs.get('parameter')!r}, the result in {parameter!r}")
    with style.axes(ax) as drawn:
        if y == "amplitude":
            _amplitudes(drawn, result, parameter, theory)
        else:
            _efforts(drawn, result)
        drawn.legend(loc="best")
    return drawn


def _amplitudes(ax: Axes, result: xr.Dataset, parameter: str, theory: xr.Dataset | None) -> None:
    values, amplitude = result[parameter].values, result["amplitude"].values
    ax.plot(values, amplitude, "-", color=style.COLORS["muted"], linewidth=0.5, zorder=2)
    if theory is not None:
        draw_branch(ax, theory, y=str(result["state"].values[0]), quantity="amplitude", special=False, color="black")
        ax.set_xlim(*_with_margin(values))
        inside = amplitude[np.isfinite(amplitude)]
        ax.set_ylim(*_with_margin(inside))
    for kind, (color, words) in _LOOKS.items():
        here = result["stability"].values == kind
        if not here.any():
            continue
        ax.errorbar(
            values[here], amplitude[here], yerr=2 * result["amplitude_uncertainty"].values[here], fmt="o", zorder=4,
            color=style.COLORS["first"], markerfacecolor=style.COLORS.get(color, color), label=words, markersize=3.5,
            markeredgewidth=0.7, elinewidth=0.6,
        )  # fmt: skip
    if result.sizes["special"]:
        at = result["special_point"].values
        ax.errorbar(
            result["special_value"].values, amplitude[at], xerr=2 * result["special_value_uncertainty"].values,
            color=style.COLORS["second"], markerfacecolor="none", markersize=6.5, elinewidth=0.8, zorder=5, fmt="D",
            label="fold",
        )  # fmt: skip
    name_plane(ax, result, parameter, str(result["state"].values[0]), "amplitude of ")


def _efforts(ax: Axes, result: xr.Dataset) -> None:
    for (name, mark, words), color in zip(_EFFORTS, ("second", "first", "muted"), strict=True):
        ax.semilogy(
            np.arange(result.sizes["point"]), result[name].values, mark, color=style.COLORS[color], markersize=3.5,
            label=words,
        )  # fmt: skip
    ax.set_xlabel("point along the branch")
    name_axes(ax, None, ("rms of the control force", result["control_effort"].attrs.get("units", "1")))


def _with_margin(values: Any) -> tuple[float, float]:
    low, high = float(np.min(values)), float(np.max(values))
    return low - 0.05 * (high - low), high + 0.08 * (high - low)
