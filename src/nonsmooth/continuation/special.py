"""``special_points``: the table of a branch's special points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.system.arguments import checked

if TYPE_CHECKING:
    import xarray as xr


@checked
def special_points(branch: Any) -> xr.Dataset:
    """Return the special points of a branch as a table of their own.

    Parameters
    ----------
    branch : xarray.Dataset
        A result of :func:`nonsmooth.continue_orbit` or :func:`nonsmooth.continue_equilibrium`, or some of its points.

    Returns
    -------
    xarray.Dataset
        Over ``special``: ``kind`` (fold, flip, neimark_sacker, pitchfork, transcritical, grazing, corner, hopf), the
        parameter, ``section``, ``floquet_multipliers`` and the orbit's other properties. Of equilibria (fold,
        pitchfork, transcritical, hopf, focus_centre, boundary_equilibrium): ``u``, ``eigenvalues``, ``stable``,
        ``mode``, and at a boundary_equilibrium ``boundary``: ``persistence`` or ``non_smooth_fold``. A crossing of
        branches whose tangents cannot be told is a branch_point. At a graze ``floquet_multipliers`` are those without
        the contact, ``contact_multipliers`` those with it in the limit, ``grazing`` says ``persistence`` or
        ``non_smooth_fold``, ``determinant`` holds det(I - M-), det(I - M+), det(I + M-), det(I + M+). ``sliding``
        names the bifurcation where a visit of a sliding mode begins, ends or is split: ``grazing_sliding``,
        ``crossing_sliding``, ``switching_sliding``, ``adding_sliding``; else it is empty. One row,
        ``.isel(special=0)``, can be given to ``continue_orbit``.

    Raises
    ------
    TypeError, ValueError
        Something that is no branch.
    """
    import xarray as xr

    from nonsmooth.results.branches import (
        EQUILIBRIUM,
        ORBIT,
        SPECIAL_EQUILIBRIUM,
        SPECIAL_ORBIT,
        STEMS,
        with_marks_in_place,
    )

    if not isinstance(branch, xr.Dataset):
        raise TypeError(f"special_points takes a branch, a result of continue_orbit; not {type(branch).__name__}")
    if "special_point" not in branch or "parameter" not in branch.attrs:
        raise ValueError("special_points takes a branch, a result of continue_orbit; this Dataset is another result")
    name, branch = str(branch.attrs["parameter"]), with_marks_in_place(branch)
    points, marks = (EQUILIBRIUM, SPECIAL_EQUILIBRIUM) if "eigenvalues" in branch else (ORBIT, SPECIAL_ORBIT)
    at = branch[[column.name for column in points]]
    table = at.isel(point=branch["special_point"].values).rename({"point": "special"}).reset_coords(name)
    table = table.assign({STEMS[column.name]: branch[column.name].variable for column in marks})
    if "special_period_number" in branch:  # branches of a bifurcation diagram
        table["period_number"], table["branch"] = (branch[f"special_{k}"].variable for k in ("period_number", "branch"))
    elif "period_number" in branch:
        table["period_number"] = branch["period_number"]
    table.attrs = dict(branch.attrs)
    return table[["kind", name, *[key for key in table.data_vars if key not in ("kind", name)]]]
