"""The compile cache of all Numba code: the package's kernels and the modules generated for a model.

Numba's own disk cache looks only at the file a function stands in, so an edit in another kernel file would
run stale code, and it cannot write beside a read-only install. Here one file per compiled function lives in
``cache_folder()``; its name is a hash of the source and of what it imports, the options, the signature, the versions
and the level of the architecture (``target``), so nothing is ever stale, entries never change, and several processes
need no lock. An entry is code: it begins with a hash of its content, and one that another user may write is not read
(``folder``). What no model changes has come with the package where it could be made ahead (``ahead``).

What leans on private parts of Numba (a dispatcher's ``_cache`` and ``_compile_for_args``, ``CompileResult._reduce``,
the copies of ``ir.Scope`` and ``ir.Loc``) stands in this file and in ``target``; ``tests/kernels/test_cache.py`` covers
it. Checked with Numba 0.62 and 0.68, calls that compile with 0.68.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import importlib.util
import inspect
import pickle
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType
from typing import Any
from weakref import WeakValueDictionary

import llvmlite
import numba
from numba.core import ir
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from nonsmooth.kernels import before_compiling
from nonsmooth.kernels.compile.folder import (
    cache_folder,
    make_private,
    mark_used,
    prune,
    read_private,
    write_atomically,
)
from nonsmooth.kernels.compile.sources import GENERATED, file_stamp
from nonsmooth.kernels.compile.target import FORM, Function, made_ahead

# Kernels allocate nothing (scratch is an argument), so they need no reference counts: "_nrt" off saves a third.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": False}
# What only kernels call needs no way in from Python. Numba takes over what is not set here (``forceinline``, fastmath)
# from the function whose compilation asks for this one.
_INNER: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": False}
DEEP = 20_000  # Numba looks for a name's value by recursion, twice for each block of a function
_DIGEST = hashlib.sha256().digest_size
_lock = threading.Lock()
_passing: WeakValueDictionary[str, ModuleType] = WeakValueDictionary()  # modules of models, while somebody has them
_most_passing = 16


class _ContentCache(_Cache):
    """Numba's cache protocol over one immutable file per function, signature, source, version and level."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self._function, self._options = function, options

    @property
    def cache_path(self) -> str:
        return str(cache_folder() / "compiled")

    def entry(self, signature: Any, codegen: Any) -> str:
        """Name of the file that holds the function's code."""
        return entry_of(self._function, signature, codegen, self._options)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        payload = read_entry(self.entry(sig, target_context.codegen()))
        if not payload:  # none yet, or a damaged one: compiled anew
            cpu_target.target_context.refresh()  # of Numba's own: what all engines share is not to live in this one
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(payload))

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        if data.library.has_dynamic_globals or any(not part.can_cache for part in data.lifted):
            raise RuntimeError(
                f"kernel {self._function.__qualname__!r} cannot be cached: it refers to a large global array, a "
                "function pointer or a Python object; pass it as an argument"
            )
        payload = numba.core.serialize.dumps(data._replace(type_annotation="")._reduce())
        write_entry(self.entry(sig, data.codegen), payload)

    def enable(self) -> None:
        """Always enabled."""

    def disable(self) -> None:
        """Always enabled."""

    def flush(self) -> None:
        """Entries never become stale."""


def entry_of(function: Callable[..., Any], signature: Any, codegen: Any, options: dict[str, Any]) -> str:
    """Name of the file that holds a function's code: all that decides about it."""
    config, name = numba.config, function.__qualname__
    origin = (
        file_stamp(inspect.getfile(function)),
        f"{function.__module__}.{name}",
        sys.version_info[:2],
        numba.__version__,
        llvmlite.__version__,
        FORM,
        (config.OPT, config.BOUNDSCHECK, config.DEBUGINFO_DEFAULT, config.USING_SVML),
        sorted(options.items(), key=str),
        sorted(_INNER.items(), key=str),
    )
    key = repr((origin, str(signature), codegen.magic_tuple()))
    return f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.nbc"


def read_entry(name: str) -> bytes:
    """The content of an entry; empty, and whoever listens is told of the compile, where there is none."""
    payload = _checked(made_ahead(name))
    if not payload:
        path = cache_folder() / "compiled" / name
        payload = _checked(read_private(path))
        mark_used(path)
    if not payload:
        for call in tuple(before_compiling):
            call(name.rpartition("-")[0])
    return payload


def write_entry(name: str, payload: bytes) -> None:
    """Keep code; a full disk costs a compile in the next process, not this run."""
    path = cache_folder() / "compiled" / name
    with contextlib.suppress(OSError):
        write_atomically(path, hashlib.sha256(payload).digest() + payload)
        prune(path.parent)


def _checked(stored: bytes) -> bytes:
    """An entry without its hash; empty where there is none or it is damaged."""
    payload = stored[_DIGEST:]
    return payload if hashlib.sha256(payload).digest() == stored[:_DIGEST] else b""


# --------------------------------------------------------------------------------------------------------------
# What the other rooms use


def kernel(signature: Any, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function for exactly one signature when it is first called, through the disk cache.

    A module may hold kernels that a session never asks for, and a large one takes many seconds: only what is called is
    compiled. Threads that call at once wait for one compile.

    Parameters
    ----------
    signature
        A Numba signature, as text or object. Arguments may be functions: ``types.FunctionType(signature)``.
    **options
        Further options of ``numba.njit``; ``nogil``, ``error_model="numpy"`` and no ``fastmath`` are set.

    Returns
    -------
    decorator
        It gives a dispatcher that accepts this signature only, so that no second version is ever compiled
        silently. With ``NUMBA_DISABLE_JIT=1`` the function itself.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = _cached(function, options)
        if dispatcher is not function:
            plain_template = dispatcher.get_call_template

            def compile_for_arguments(*arguments: Any, **named: Any) -> Any:
                _compile_once(dispatcher, signature)
                return dispatcher  # Numba calls it with the same arguments; what does not fit is refused there

            def get_call_template(arguments: Any, named: Any) -> Any:  # another kernel calls this one
                _compile_once(dispatcher, signature)
                return plain_template(arguments, named)

            dispatcher.compile_now = partial(_compile_once, dispatcher, signature)
            dispatcher.entry = lambda: dispatcher._cache.entry(signature, dispatcher.targetctx.codegen())
            dispatcher._compile_for_args = compile_for_arguments
            dispatcher.get_call_template = get_call_template
        return dispatcher

    return decorate


def compiled(function: Any) -> Any:
    """The kernel itself, compiled now: before threads begin, because Ctrl-C cannot stop a compile in one of them."""
    if hasattr(function, "compile_now"):
        function.compile_now()
    return function


def _cached(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    dispatcher = _jitted(function, {**_OPTIONS, **options}, called=True)
    if dispatcher is not function:
        dispatcher._cache = _ContentCache(function, options)
    return dispatcher


def _jitted(function: Callable[..., Any], options: dict[str, Any], called: bool = False) -> Any:
    return function if numba.config.DISABLE_JIT else Function(function, options, called)


def _compile_once(dispatcher: Any, signature: Any) -> None:
    # Numba's own lock: a compile in another thread may hold it and ask for this function.
    with global_compiler_lock:
        if not dispatcher.signatures:
            with _cheaply():
                dispatcher.compile(signature)
            dispatcher.disable_compile()


@contextlib.contextmanager
def _cheaply() -> Iterator[None]:
    """Leave out what costs a compile half of its time and changes nothing, and let it recurse (see ``DEEP``).

    A compile makes millions of objects and hardly a cycle, so the collector rests. And with each block of a function
    that becomes part of its caller (:func:`once`), Numba's ``InlineWorker`` copies all names of the function and the
    places they stand at: they are shared instead, since the function's own text is thrown away."""
    running, outermost = gc.isenabled(), not hasattr(ir.Scope, "__deepcopy__")
    limit = sys.getrecursionlimit()
    gc.disable()
    sys.setrecursionlimit(max(limit, DEEP))
    for kind in (ir.Scope, ir.Loc) if outermost else ():
        kind.__deepcopy__ = lambda self, memo: self
    try:
        yield
    finally:
        for kind in (ir.Scope, ir.Loc) if outermost else ():
            del kind.__deepcopy__
        sys.setrecursionlimit(limit)
        if running:
            gc.enable()


def device(function: Callable[..., Any]) -> Any:
    """Mark a small function used inside kernels: compiled into each caller for the types it is called with.

    It has no signature and no cache entry of its own, and costs nothing when its callers are loaded from disk.
    """
    return _jitted(function, _INNER)


def inline(function: Callable[..., Any]) -> Any:
    """Like :func:`device`, but always inlined: for the few small functions of the innermost loops.

    An array argument is seven machine words and a reference count; a call that passes ten arrays costs more than
    the dozen multiplications behind it. Every call site grows the caller and its compile time, so use it sparingly.
    """
    return _jitted(function, {**_INNER, "forceinline": True})


def summed(function: Callable[..., Any]) -> Any:
    """Like :func:`inline`, for a loop whose sum may be taken in any order: it then goes in vectors."""
    return _jitted(function, {**_INNER, "forceinline": True, "fastmath": {"contract", "reassoc"}})


def once(function: Callable[..., Any]) -> Any:
    """Like :func:`inline`, but part of its caller before anything is compiled: for parts of a long function.

    A function that is compiled by itself is optimised there and once more in each caller on the way up, with all that
    stands below it: a loop of six levels took 60 s, and takes 10 as one function."""
    return _jitted(function, {**_INNER, "inline": "always"})


local = once  # on a GPU too: a function there may not return one of several arrays


def load_module(source: str, stem: str, *, lasting: bool = True) -> ModuleType:
    """Write a generated module under a name that is a hash of its content, and import it.

    Parameters
    ----------
    source
        Text of the module. Its functions are decorated with :func:`kernel` or :func:`.direct.callback`.
    stem
        Beginning of the file's name: an identifier.
    lasting
        False: its machine code ends with the last reference to its functions. Then all of them are callbacks.

    Returns
    -------
    module
        The same object for the same text, however often it is asked for while it lives.
    """
    name = f"{stem}_{hashlib.sha256(source.encode()).hexdigest()[:20]}"
    with _lock:
        full_name = f"{GENERATED}{name}"
        there = sys.modules.get(full_name) or _passing.get(full_name)
        if there is not None:
            return there
        path = cache_folder() / "generated" / f"{name}.py"
        data = source.encode()
        if read_private(path) != data:
            write_atomically(path, data)
            prune(path.parent)
        make_private(path.parent / "__pycache__")
        mark_used(path)
        spec = importlib.util.spec_from_file_location(full_name, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[full_name] = module  # before it runs: Numba's cache entries name the module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[full_name]
            raise
        if not lasting:
            vars(module)["_itself"] = module  # it lives as long as its functions
            _passing[full_name] = module
            del sys.modules[full_name]
    if not lasting:
        _collect_models()
    return module


def _collect_models() -> None:
    """Code of models hangs in cycles, and Python looks for these by the number of objects, however large they are."""
    global _most_passing
    if len(_passing) > _most_passing:
        gc.collect()
        _most_passing = len(_passing) + 16


def cache_statistics(module: ModuleType) -> Iterator[tuple[str, int, int]]:
    """(name, loads from disk, compiles) of every kernel in a module; the tests assert that nothing is compiled."""
    for name, value in vars(module).items():
        if isinstance(getattr(value, "_cache", None), _ContentCache):
            yield name, sum(value.stats.cache_hits.values()), sum(value.stats.cache_misses.values())
        elif hasattr(value, "compiles"):  # a callback of a model (``direct``)
            yield name, value.loads, value.compiles
