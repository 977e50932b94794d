"""Blocks of memory from which a march reads what is asked of it and where it writes what it leaves."""

from __future__ import annotations

from numba import types

from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.compile.pointers import stored
from nonsmooth.kernels.hybrid.records import CALL, GROWTH, KEPT, LOG

_put_call, call_at = stored(CALL)
_put_kept, kept_at = stored(KEPT)
_put_log, log_at = stored(LOG)
_put_growth, growth_at = stored(GROWTH)


@kernel(types.void(types.int64, CALL))
def put_call(address, record):
    """Write what is asked of a march to an address."""
    _put_call(address, record)


@kernel(types.void(types.int64, KEPT))
def put_kept(address, record):
    """Write the arrays of kept returns to an address."""
    _put_kept(address, record)


@kernel(types.void(types.int64, LOG))
def put_log(address, record):
    """Write the arrays of a log to an address."""
    _put_log(address, record)


@kernel(types.void(types.int64, GROWTH))
def put_growth(address, record):
    """Write the arrays of a frame and its growth to an address."""
    _put_growth(address, record)
