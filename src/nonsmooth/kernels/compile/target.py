"""The target of our code, a level of the processor's architecture, and the engines that hold it, one per file.

Numba makes code for one processor. Ours is made for a level of the architecture, so that it can be made on one machine,
travel with the package and run on another; what the level costs stands in ``docs/decisions.md``. And Numba keeps all
code in one engine until the process ends; here each file has its own, which goes with the file's last function.

Leans on private parts of Numba: ``JITCPUCodegen`` and ``JITCodeLibrary``, a target context's ``_internal_codegen``, a
dispatcher's ``add_overload``, ``_make_finalizer`` and ``targetdescr``. Checked with 0.68.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import (
    Linkage,
    create_new_function_pass_manager,
    create_new_module_pass_manager,
    parse_assembly,
    parse_bitcode,
)
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen, get_host_cpu_features
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher, CPUTarget, cpu_target
from numba.core.typed_passes import InlineOverloads, NopythonTypeInference, PreLowerStripPhis
from numba.core.types.misc import unliteral

AHEAD = Path(__file__).parents[1] / "ahead"  # a folder for each level; what they hold comes with the package

_V2 = "cx16 popcnt sahf sse3 sse4.1 sse4.2 ssse3"
_V3 = f"{_V2} avx avx2 bmi bmi2 f16c fma lzcnt movbe xsave"
#: Machine -> level -> what a processor must have for it, as LLVM calls it; the highest level first.
LEVELS: dict[str, dict[str, str]] = {
    "x86_64": {"x86-64-v3": _V3},
    "aarch64": {"generic": "neon"},
}
FORM = "internal, without dead arguments"  # part of the names of entries: another one where code is made otherwise
_SAME = {"amd64": "x86_64", "arm64": "aarch64"}


@cache
def level() -> str:
    """The level that code is made for: that of the code that came with the package, else this processor's highest.

    ``NONSMOOTH_LEVEL`` chooses another. Empty where the processor has none of ``LEVELS``, or where ``NUMBA_CPU_NAME``
    and the like say what code is made for: then it is made as Numba makes it.

    Raises
    ------
    ValueError
        ``NONSMOOTH_LEVEL`` is not a level of this processor.
    """
    if numba.config.CPU_NAME is not None or numba.config.CPU_FEATURES is not None:
        return ""
    machine = platform.machine().lower()
    there = set(get_host_cpu_features().split(","))
    possible = [
        name
        for name, needed in LEVELS.get(_SAME.get(machine, machine), {}).items()
        if there.issuperset(f"+{feature}" for feature in needed.split())
    ]
    chosen = os.environ.get("NONSMOOTH_LEVEL", "")
    if chosen and chosen not in possible:
        raise ValueError(f"NONSMOOTH_LEVEL={chosen}: this processor has {', '.join(possible) or 'no level'}; unset it")
    with_code = [name for name in possible if (AHEAD / name).is_dir()]
    return chosen or [*with_code, *possible, ""][0]


def made_ahead(entry: str) -> bytes:
    """The content of an entry that came with the package; empty where there is none.

    Who may write there may write the package's sources as well: nothing is asked but the entry's own hash."""
    try:
        return (AHEAD / level() / entry).read_bytes() if level() else b""
    except OSError:
        return b""


class Library(JITCodeLibrary):
    """A function with all that it calls; machine code is made of it only where Python or an address calls it.

    What it calls is then its own, and arguments that nobody reads, of sixty arrays, are passed no longer. Numba makes
    code of each function below as well, by a name that the engine takes from whoever comes first: the process that
    compiled ran another code than those that load it."""

    called = False
    _shared_module: Any
    _text = b""  # of code that was loaded: read where another function is made of it

    @classmethod
    def of_code(cls, codegen: Any, name: str, code: bytes) -> Library:
        """A library of machine code."""
        library: Library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library.called = True
        library._finalize_final_module()
        return library

    @classmethod
    def of_text(cls, codegen: Any, name: str, text: str) -> Library:
        """A library of a text for LLVM."""
        library: Library = codegen.create_library(name)
        library.enable_object_caching()
        library.called = True
        module = parse_assembly(text)
        module.data_layout = codegen._data_layout
        library.add_llvm_module(module)
        library.finalize()
        return library

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Library:
        name, _, (code, text) = state
        library = cls.of_code(codegen, name, code)
        library._text = text
        return library

    def _get_module_for_linking(self) -> Any:
        if self._text and self._shared_module is None:
            self._shared_module = parse_bitcode(self._text)
        return super()._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return self._codegen._engine.get_function_address(name)

    def _optimize_final_module(self) -> None:
        if self.called:
            self._relink(Linkage.linkonce_odr, "internal")
            passes = create_new_module_pass_manager()
            passes.add_dead_arg_elimination_pass()
            passes.run(self._final_module, self._codegen._module_pass_manager()[1])
            self._relink(
                Linkage.internal, "linkonce_odr"
            )  # else what has one caller becomes part of it, which is slower
        super()._optimize_final_module()
        if self.called:
            self._relink(Linkage.linkonce_odr, "internal")

    def _finalize_final_module(self) -> None:
        if self.called:
            super()._finalize_final_module()
        else:
            self._relink(Linkage.external, "linkonce_odr")
            self._finalized, self._shared_module = True, self._final_module

    def _relink(self, before: Linkage, after: str) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == before:
                function.linkage = after


class Codegen(JITCPUCodegen):
    """An engine of its own.

    ``vectors``: loops over arrays become loops over vectors, each in four versions behind each other."""

    _library_class = Library

    def set_env(self, name: str, env: Any) -> None:
        if self._engine.get_global_value_address(name):  # else there is no code that reads it
            super().set_env(name, env)

    def __init__(self, name: str, vectors: bool = True) -> None:
        self._level, self._vectors = level(), vectors
        super().__init__(name)

    def _pass_builder(self, **options: Any) -> Any:
        return super()._pass_builder(**options if self._vectors else {**options, "loop_vectorize": False})

    def _get_host_cpu_name(self) -> Any:
        return self._level or super()._get_host_cpu_name()

    def _get_host_cpu_features(self) -> Any:
        return "" if self._level else super()._get_host_cpu_features()

    def _function_pass_manager(self, **options: Any) -> Any:
        """One for all functions: Numba makes one for each, and llvmlite never frees it (15 kB)."""
        return _function_passes()[:2]


@cache
def _function_passes() -> tuple[Any, Any, Any]:
    """Passes over a function before it meets what it calls, and an engine that does nothing but live as long: they need
    its description of the processor.

    None is made: what Numba makes here it makes again of the whole module, and of the march, in which records of sixty
    arrays are values, it took 14 of 39 s."""
    engine = Codegen("passes")
    return create_new_function_pass_manager(), engine._pass_builder(), engine


class _Target(CPUTarget):
    """Numba's own target with another engine."""

    def __init__(self, vectors: bool) -> None:
        super().__init__("cpu")
        self._context = cpu_target.target_context.subtarget(_internal_codegen=Codegen("nonsmooth", vectors))

    @property
    def target_context(self) -> Any:
        return self._context

    @property
    def typing_context(self) -> Any:
        return cpu_target.typing_context


class _Compiler(CompilerBase):
    """Numba's passes but for the rewriting of expressions over whole arrays, which no kernel has: a tenth of the time
    that a march takes before LLVM."""

    called = True

    def define_pipelines(self) -> list[Any]:
        state = self.state
        state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
        state.library.enable_object_caching()
        state.library.called = self.called
        passes = PassManager("kernel")
        passes.passes.extend(DefaultPassBuilder.define_untyped_pipeline(state).passes)
        for step in (NopythonTypeInference, PreLowerStripPhis, InlineOverloads):
            passes.add_pass(step, step.__name__)
        passes.passes.extend(DefaultPassBuilder.define_nopython_lowering_pipeline(state).passes)
        passes.finalize()
        return [passes]


class _Inner(_Compiler):
    """The same for what only compiled functions call."""

    called = False


class Function(CPUDispatcher):
    """A function as ``numba.njit`` compiles it, but in the engine of the file it stands in.

    ``called``: it is called by Python or by its address, and not only by functions that are compiled with it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], called: bool) -> None:
        names = function.__globals__
        if "_target" not in names:
            names["_target"] = _Target(bool(names.get("VECTORS", 1)))
        self.targetdescr = names["_target"]
        given = {"nopython": True, "boundscheck": None, **options}
        super().__init__(function, targetoptions=given, pipeline_class=_Compiler if called else _Inner)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """For numbers of a type, whatever they are: Numba would compile the function anew for each constant."""
        plain = {name: unliteral(kind) for name, kind in named.items()}
        return super().get_call_template(tuple(map(unliteral, arguments)), plain)

    def add_overload(self, found: Any) -> None:
        """Without what Numba noted on every line, half of what a compile leaves in memory."""
        super().add_overload(found._replace(type_annotation=None))

    @property
    def address(self) -> int:
        """The place of its code, by which kernels call it."""
        (found,) = self.overloads.values()
        return int(found.library.get_pointer_to_function(found.fndesc.llvm_func_name))

    def _make_finalizer(self) -> Callable[[], None]:
        """Numba's holds the code, which holds the names of its file, which hold this function: it would never end."""
        return lambda: None
