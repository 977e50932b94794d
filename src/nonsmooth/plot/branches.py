"""Results of continuation: branches, curves of special points, multipliers, manifolds, branches of experiments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.plot import bands, style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import Name, columns, name_and_unit, name_axes, name_plane, only_states, variable_along
from nonsmooth.results.labels import words_of_flags
from nonsmooth.results.schema import with_amplitude
from nonsmooth.system.kinds import Positive
from nonsmooth.tables.quantities import dataset_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Marker of each kind of special point, along a branch or a curve; of others a star.
MARKERS = {
    "fold": "o",
    "flip": "s",
    "neimark_sacker": "D",
    "pitchfork": "^",
    "transcritical": "<",
    "branch_point": "v",
    "grazing": "X",
    "corner": "P",
    "hopf": "H",
    "boundary_equilibrium": "p",
    "cusp": "v",
    "fold_flip": "s",
    "resonance_1_1": "D",
    "resonance_1_2": "h",
    "resonance_1_3": "^",
    "resonance_1_4": "d",
    "grazing_fold": "o",
    "grazing_flip": "p",
    "grazing_neimark_sacker": "8",
    "double_grazing": "X",
    "chenciner": "<",
    "fold_neimark_sacker": ">",
    "flip_neimark_sacker": "H",
}
#: Words of kinds that are not those of the name itself.
_KIND_WORDS = {
    "neimark_sacker": "Neimark-Sacker",
    "hopf": "Hopf",
    "fold_flip": "fold-flip",
    "resonance_1_1": "1:1 resonance",
    "resonance_1_2": "1:2 resonance",
    "resonance_1_3": "1:3 resonance",
    "resonance_1_4": "1:4 resonance",
    "grazing_fold": "grazing-fold",
    "grazing_flip": "grazing-flip",
    "grazing_neimark_sacker": "grazing-Neimark-Sacker",
    "chenciner": "Chenciner",
    "fold_neimark_sacker": "fold-Neimark-Sacker",
    "flip_neimark_sacker": "flip-Neimark-Sacker",
}
#: Diameters in points. Several kinds meet at one point where a branch grazes: the smaller one lies on the larger.
_SIZES = {"fold": 6.5, "flip": 5.5}
_SIZE = 4.0
_STATES = {"-": "stable", "--": "unstable", ":": "virtual"}
_SEAM = 0.3  # opacity of a stable branch under the points that lie on it
_WORDS = {"section": "", "maximum": "largest ", "minimum": "smallest ", "amplitude": "amplitude of "}


@figure("continue_orbit", "stable")
def branch(
    ax: Axes,
    result: xr.Dataset,
    *,
    y: Name | None = None,
    quantity: Literal["section", "maximum", "minimum", "amplitude"] = "section",
    special: bool = True,
    color: Any = None,
) -> None:
    """Draw a branch over its parameter: stable parts solid, unstable ones dashed, virtual ones dotted.

    Parameters
    ----------
    result
        A ``continue_orbit`` or ``continue_equilibrium``; with the bands of ``propagate`` where it has them.
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
    name = draw_branch(ax, result, y=y, quantity=quantity, special=special, color=color)
    name_plane(ax, result, result.attrs["parameter"], name, _WORDS[quantity])
    style.clear_legend(ax)


def draw_branch(
    ax: Axes,
    result: xr.Dataset,
    *,
    y: Name | None = None,
    quantity: str = "section",
    special: bool = True,
    color: str | None = None,
    width: float = 0.9,
    behind: bool = False,
) -> str:
    """Draw the lines (``width`` in typographic points) and marks of a branch on axes that the caller labels; return the
    state.

    ``behind``: over points of a sweep, which lie on the stable parts: those become a pale, wide seam under them.
    """
    from nonsmooth.results.branches import with_marks_in_place

    variable_along(result, "stable", "continue_orbit")
    (name,) = only_states(result, y)
    result = with_marks_in_place(result)
    values = result[result.attrs["parameter"]].values
    ordinates = ordinates_of(result, name, quantity)
    shade = color or style.COLORS["first"]
    for line, at in lines_of(result):
        looks: style.Properties = {"linewidth": width, "zorder": 3}
        if behind and line == "-":
            looks = {"linewidth": 3 * width, "alpha": _SEAM, "zorder": 0.5}
        for row in ordinates:
            label = style.once(ax, f"{_STATES[line]} branch")
            style.line(ax, with_breaks(values, at), with_breaks(row, at), line, color=shade, label=label, **looks)
    ends = bands.ends_of(result)
    for rows in zip(*(ordinates_of(one, name, quantity) for one in ends), strict=True):
        bands.fill(ax, result, values, *rows, color=shade)
    if special and result.sizes.get("special", 0):
        bands.bars(ax, ends, ordinates[:, result["special_point"].values.astype(int)])
        _mark_special(ax, result, values, ordinates)
    return name


def check_axis(branch: xr.Dataset, parameter: str) -> None:
    """Check that a branch is over the parameter of what it is drawn over."""
    variable_along(branch, "stable", "continue_orbit")
    if (of := branch.attrs["parameter"]) != parameter:
        raise ValueError(f"the result is over {parameter!r}, this branch over {of!r}: they share no axis")


def ordinates_of(result: xr.Dataset, name: str, quantity: str) -> FloatArray:
    """One line for each section point of the orbit, (lines, point); an equilibrium is its own maximum and minimum."""
    if "eigenvalues" in result:
        rest = result["u"].sel(state=name).values.astype(float)
        return np.zeros((1, len(rest))) if quantity == "amplitude" else rest[None, :]
    source = "returns" if quantity == "section" and "returns" in result else quantity
    chosen = with_amplitude(result)[source].sel(state=name)
    others = [dim for dim in chosen.dims if dim != "point"]
    return np.asarray(chosen.transpose(*others, "point").values, dtype=float).reshape(-1, result.sizes["point"])


def words_of_kind(kind: str) -> str:
    """A kind of special point, or of a curve of them, in words."""
    return _KIND_WORDS.get(kind, kind.replace("_", " "))


def _mark_special(ax: Axes, result: xr.Dataset, x: Any, heights: FloatArray) -> None:
    """The special points on each of the lines (lines, point), every kind with its own sign and words."""
    at = result["special_point"].values.astype(int)
    kinds = result["special_kind"].values.astype(str)
    for kind in dict.fromkeys(kinds.tolist()):
        here = at[kinds == kind]
        marker, size = MARKERS.get(kind, "*"), _SIZES.get(kind, _SIZE)
        style.mark(ax, (x[here], heights[:, here]), marker, words_of_kind(kind), size, zorder=5.7 - 0.1 * size)


def lines_of(result: xr.Dataset) -> list[tuple[str, IntArray]]:
    """The style of each kind of line, and the points that it joins (-1: a break).

    A segment that begins at a special point, where stability changes, is of the kind of its end.
    """
    kind = np.where(result["stable"].values.astype(bool), 0, 1)
    if "virtual" in result:
        kind[result["virtual"].values.astype(bool)] = 2
    if len(kind) == 1:
        return [(list(_STATES)[kind[0]], np.zeros(1, int))]
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


def with_breaks(values: FloatArray, at: IntArray) -> FloatArray:
    """Return the values at points of a line, NaN at its breaks."""
    return np.where(at < 0, np.nan, values[at])


#: Colour and line of each kind of curve.
KINDS = {
    "fold": ("first", "-"),
    "flip": ("second", "--"),
    "neimark_sacker": ("fourth", "-."),
    "grazing": ("section", ":"),
}


@figure("continue_curve", "kind", "special_point")
def curve(ax: Axes, result: xr.Dataset, *, special: bool = True, color: Any = None) -> None:
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
    from matplotlib.collections import QuadMesh

    # The two parameters are the only coordinates over the points, in the order in which they were given.
    x, y = (str(name) for name, values in result.coords.items() if values.dims == ("point",))
    kind = str(result["kind"].values)
    shade, line = KINDS[kind]
    over_chart = any(isinstance(item, QuadMesh) for item in ax.collections)
    looks: style.Properties = {"path_effects": style.halo(1.8)} if over_chart else {}
    looks |= {"color": color or style.COLORS[shade], "linewidth": 1.0, "zorder": 3}
    values, heights = result[x].values, result[y].values
    style.line(ax, values, heights, line, label=style.once(ax, words_of_kind(kind)), **looks)
    if special:
        _mark_special(ax, result, values, heights[None])
    name_plane(ax, result, x, y)
    own, before = ax.get_legend_handles_labels()[1], ax.get_legend()
    if before is not None and not {text.get_text() for text in before.get_texts()} <= set(own):
        ax.add_artist(before)  # the legend of a chart stays, and that of the curves stands below it
        before.set_clip_on(False)  # else the layout takes it for a thing within the axes, and cuts it
    ax.legend(**(style.beside(0.0) if over_chart else {}))


@figure(ratio=0.9)
def multipliers(ax: Axes, result: xr.Dataset | Any, *, limit: Positive | None = None) -> None:
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
    from matplotlib.patches import Circle

    data = dataset_of(result)
    variable_along(data, "floquet_multipliers", "find_orbit or continue_orbit")
    values = data["floquet_multipliers"]
    along = "point" in values.dims
    mu = values.transpose("point", ...).values if along else values.values[None, :]
    x, y = mu.real, mu.imag
    parts = np.abs([x, y])
    half = min(1.12 * max(1.0, parts[:, np.isfinite(mu)].max(initial=0.0)), 4.0) if limit is None else float(limit)
    outside = int((~(parts <= half)).any(axis=(0, 2)).sum())
    muted = style.COLORS["muted"]
    ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=muted, linewidth=0.6, zorder=1))
    for line in (ax.axhspan, ax.axvspan):
        line(0.0, 0.0, color=muted, linewidth=0.3, zorder=0)
    if along:
        name = data.attrs["parameter"]
        shade = np.broadcast_to(data[name].values[:, None], mu.shape)
        dots = ax.scatter(x, y, c=shade, s=4, cmap="viridis", linewidths=0, zorder=3)
        name_axes(ax.figure.colorbar(dots, ax=ax).ax, y=name_and_unit(data, name))
    else:
        ax.plot(x[0], y[0], "o", color=style.COLORS["first"], markersize=3.5, zorder=3)
    ax.set(xlabel=r"Re $\mu$", ylabel=r"Im $\mu$", xlim=(-half, half), ylim=(-half, half), aspect="equal")
    if outside:
        ax.set_title(f"{outside} of {len(mu)} points reach outside" if along else "a multiplier lies outside")


@figure("manifolds", "arc_length", ratio=0.85)
def manifolds(ax: Axes, result: xr.Dataset, *, x: Name | None = None, y: Name | None = None) -> None:
    """Draw the manifolds of a saddle in the plane of two states, with the saddle's own section points.

    Parameters
    ----------
    result
        A result of ``manifolds``. Lines are broken where the section map jumps.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the two axes; by default the first two.
    """
    names = only_states(result, x, y)
    kinds = words_of_flags(result["manifold"])
    sections, saddle = (columns(result, key, names) for key in ("section", "orbit_section"))
    numbers, piece = result["arc_number"].values, result["piece"].values
    for number, code in enumerate(result["manifold"].values):
        chosen = np.flatnonzero(numbers == number)
        if not len(chosen):
            continue
        breaks = np.flatnonzero(np.diff(piece[chosen]) > 0) + 1
        # Each arc begins at the orbit itself.
        j = int(result["orbit_point"].values[number])
        xs, ys = (
            np.insert(np.insert(values[chosen], breaks, np.nan), 0, own[j])
            for values, own in zip(sections, saddle, strict=True)
        )
        kind = kinds[int(code)]
        color, above = ("second", 3) if kind == "unstable" else ("first", 2)
        ax.plot(
            xs, ys, label=style.once(ax, f"{kind} manifold"), color=style.COLORS[color], zorder=above, linewidth=0.6
        )
    style.mark(ax, saddle, "o", "saddle", zorder=5)
    name_plane(ax, result, *names)
    style.clear_legend(ax)


#: Filling and words of each ``stability``.
_LOOKS = {
    1: (style.COLORS["first"], "came back when let go: stable"),
    0: ("white", "left when let go: unstable"),
    -1: (style.COLORS["muted"], "held; stability not known"),
}
_EFFORTS = (
    ("control_effort_first", "s", "second", "before the first correction"),
    ("control_effort", "o", "first", "converged"),
    ("control_effort_noise", "_", "muted", "noise alone"),
)


@figure("control_based_continuation", "control_effort")
def controlled_branch(
    ax: Axes,
    result: xr.Dataset,
    *,
    y: Literal["amplitude", "control_effort"] = "amplitude",
    theory: xr.Dataset | None = None,
) -> None:
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
    parameter, state = result.attrs["parameter"], str(result["state"].values[0])
    if theory is not None:
        check_axis(theory, parameter)
        if y == "control_effort":
            raise ValueError(f"theory = a branch in {parameter!r} is drawn beside y='amplitude' alone; leave it out")
    if y == "control_effort":
        for name, mark, color, words in _EFFORTS:
            ax.semilogy(result[name].values, mark, color=style.COLORS[color], markersize=3.5, label=words)
        ax.set_xlabel("point along the branch")
        name_axes(ax, None, ("rms of the control force", result["control_effort"].attrs.get("units", "1")))
    else:
        values, amplitude = result[parameter].values, result["amplitude"].values
        ax.plot(values, amplitude, "-", color=style.COLORS["muted"], linewidth=0.5, zorder=2)
        for kind, (face, words) in _LOOKS.items():
            here = result["stability"].values == kind
            if here.any():
                bars = 2 * result["amplitude_uncertainty"].values[here]
                heights, color = amplitude[here], style.COLORS["first"]
                style.points(ax, values[here], heights, yerr=bars, color=color, face=face, size=3.5, label=words)
        if result.sizes["special"]:
            heights, bars = amplitude[result["special_point"].values], 2 * result["special_value_uncertainty"].values
            at, color = result["special_value"].values, style.COLORS["second"]
            looks: style.Properties = {"mark": "D", "face": "none", "size": 6.5, "label": "fold", "zorder": 5}
            style.points(ax, at, heights, xerr=bars, color=color, **looks)
        if theory is not None:
            ax.axis(ax.axis())  # those of what was measured
            draw_branch(ax, theory, y=state, quantity="amplitude", special=False, color="black")
        name_plane(ax, result, parameter, state, "amplitude of ")
    ax.legend()
