"""The kernels for CUDA as PTX, on a machine with or without a GPU: what the compiler makes of them.

Compiling a kernel asks the present GPU for its type where there is one; here it is told. That leans on a private part
of numba-cuda (``dispatcher.get_current_device``), checked with 0.30.
"""

from __future__ import annotations

from types import ModuleType, SimpleNamespace

CAPABILITY = (9, 0)


def ptx_of(entry: str, signature: str, shape: tuple[int, ...]) -> str:
    """One entry of the module for a shape of system, compiled for ``CAPABILITY``.

    Parameters
    ----------
    signature : str
        Types of its arguments, as Numba writes them.
    shape : tuple of int
        Arguments of :func:`nonsmooth.kernels.cuda.module.cuda_linear_module`.
    """
    from nonsmooth.kernels.cuda.module import cuda_linear_module

    observer = "growth" if entry == "frames" else "sections"
    return ptx_of_module(cuda_linear_module(*shape, observer), entry, signature)


def ptx_of_module(module: ModuleType, entry: str, signature: str) -> str:
    """The same for an entry of any module with the GPU's header."""
    from numba.cuda import compile, dispatcher

    from nonsmooth.kernels.cuda.target import THREADS

    before = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=CAPABILITY)
    try:
        function = getattr(module, entry).py_func
        text, _ = compile(function, signature, device=False, abi="numba", cc=CAPABILITY, launch_bounds=THREADS)
    finally:
        dispatcher.get_current_device = before
    return str(text)
