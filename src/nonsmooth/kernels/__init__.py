"""Compiled numerics: steppers, crossing location, hybrid loops, variational flow.

A kernel takes arrays and scalars, writes into arrays and returns an integer status (``codes``); it never
raises, prints or knows units. Modules of this room are imported where they are first used, because importing
one compiles its kernels (or loads them from the cache, see ``cache``).
"""

from __future__ import annotations

from collections.abc import Callable

#: Called with a kernel's name before it is compiled, which happens where the cache on disk has no entry for it.
before_compiling: list[Callable[[str], None]] = []
