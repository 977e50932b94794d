"""``special_points``: the table of a branch's special points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["special_points"]

#: Variables over ``point`` that describe the orbit at a special point too.
_ORBIT = (
    "section", "maximum", "minimum", "period", "floquet_multipliers", "stable", "virtual", "signature", "mode",
    "clearance", "layout", "unknowns", "tangent",
)  # fmt: skip


def special_points(branch: Any) -> xr.Dataset:
    """Return the special points of a branch as a table of their own.

    Parameters
    ----------
    branch : xarray.Dataset
        A result of :func:`nonsmooth.continue_orbit` or :func:`nonsmooth.continue_equilibrium`.

    Returns
    -------
    xarray.Dataset
        Over ``special``: ``kind`` (fold, flip, neimark_sacker, pitchfork, transcritical, grazing, corner, hopf), the
        parameter, ``section``, ``floquet_multipliers`` and the orbit's other properties. Of equilibria (fold,
        pitchfork, transcritical, hopf, focus_centre, boundary_equilibrium): ``u``, ``eigenvalues``, ``stable``,
        ``mode``. A crossing of branches whose tangents cannot be told is a branch_point. At a graze
        ``floquet_multipliers`` are those without the contact, ``contact_multipliers`` those with it in the limit,
        ``grazing`` says ``persistence`` or ``non_smooth_fold``, ``determinant`` holds det(I - M-), det(I - M+),
        det(I + M-), det(I + M+). ``sliding`` names the bifurcation where a visit of a sliding mode begins, ends or
        is split: ``grazing_sliding``, ``crossing_sliding``, ``switching_sliding``, ``adding_sliding``; else it is
        empty. One row, ``.isel(special=0)``, can be given to ``continue_orbit``.

    Raises
    ------
    TypeError, ValueError
        Something that is no branch.
    """
    import xarray as xr

    if not isinstance(branch, xr.Dataset):
        raise TypeError(f"special_points takes a branch, a result of continue_orbit; not {type(branch).__name__}")
    if "special_point" not in branch or "parameter" not in branch.attrs:
        raise ValueError("special_points takes a branch, a result of continue_orbit; this Dataset is another result")
    name = str(branch.attrs["parameter"])
    if "eigenvalues" in branch:
        return _of_equilibria(branch, name)
    places = branch["special_point"].values
    orbits = branch[list(_ORBIT)].isel(point=places).rename({"point": "special"})
    table = orbits.reset_coords(name)
    marks = {
        stem: branch[f"special_{stem}"]
        for stem in ("kind", "point", "indicator", "grazing", "sliding", "bounded", "doubled", "contact_multipliers",
                     "determinant")
    }  # fmt: skip
    # The touched indicator is a word of each row, beside the dim of the clearances.
    marks["touched"] = marks.pop("indicator")
    table = table.assign({stem: variable.variable for stem, variable in marks.items()})
    if "special_period_number" in branch:  # branches of a bifurcation diagram
        table["period_number"], table["branch"] = (branch[f"special_{k}"].variable for k in ("period_number", "branch"))
    else:
        table["period_number"] = branch["period_number"]
    table.attrs = dict(branch.attrs)
    return table[["kind", name, *[key for key in table.data_vars if key not in ("kind", name)]]]


def _of_equilibria(branch: xr.Dataset, name: str) -> xr.Dataset:
    table = branch[["u", "eigenvalues", "stable", "mode"]].isel(point=branch["special_point"].values)
    table = table.rename({"point": "special"}).reset_coords(name)
    table["kind"], table["point"] = branch["special_kind"].variable, branch["special_point"].variable
    table.attrs = dict(branch.attrs)
    return table[["kind", name, "u", "eigenvalues", "stable", "mode", "point"]]
