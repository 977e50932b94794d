"""The functions of a generated model inside kernels: from their addresses in ``Generated.functions``."""

from numba import types

from nonsmooth.kernels.compile.cache import inline
from nonsmooth.kernels.compile.pointers import function_at

_i, _f = types.int64, types.float64
_f1, _f2 = _f[::1], _f[:, ::1]
field_at = function_at(types.FunctionType(types.void(_i, _f, _f1, _f1, _f1)))
jet_at = function_at(types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2)))
values_at = function_at(types.FunctionType(types.void(_i, _f, _f1, _f1, _f1)))
jump_at = function_at(types.FunctionType(types.void(_i, _f, _f1, _f1, _f1, _f1)))


@inline
def field_of(form):
    """The vector field."""
    return field_at(form.functions[0])


@inline
def jet_of(form):
    """Taylor coefficients along a mode."""
    return jet_at(form.functions[1])


@inline
def values_of(form):
    """Indicators and outputs."""
    return values_at(form.functions[2])


@inline
def jump_of(form):
    """The map of a transition."""
    return jump_at(form.functions[3])
