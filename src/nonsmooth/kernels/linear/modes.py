"""Tables of further modes of a system whose modes are built when they are first visited."""

from numba import types

from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.hybrid.records import FORM, TABLES, WORK
from nonsmooth.kernels.linear.build import build


@kernel(types.int64(FORM, TABLES, WORK))
def stand(form, tables, work):
    """Put the tables of the modes of ``form``, at its one point, behind those that stand; returns how many stand."""
    work.built[0] = 0
    build(0, form, tables, work)
    work.built[1] += form.A.shape[1]
    return work.built[1]
