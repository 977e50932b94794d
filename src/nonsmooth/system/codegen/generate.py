"""From traced expressions to machine code: a generated module with the field, the jet, the values and the jumps.

The module is plain text with four functions of fixed signatures, compiled through the cache of
``kernels.cache``; kernels take them as arguments of function type, so a new model compiles nothing but itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from sympy import Basic, Expr, Integer, preorder_traversal

from nonsmooth.system.codegen.jet import JetCode, chain, jet_code
from nonsmooth.system.symbolic.printing import Printer, assignments, shared_terms
from nonsmooth.system.symbolic.traced import Traced

MOST_MODELS = 32  # whose code is kept though nobody uses it: a third of a MB each
# mode, [order,] t, u, q and what is written; q holds the parameters, then the memory.
SIGNATURES = {
    "field": "void(i8, f8, f8[::1], f8[::1], f8[::1])",
    "jet": "void(i8, i8, f8, f8[::1], f8[::1], f8[:,::1], f8[:,::1])",
    "values": "void(i8, f8, f8[::1], f8[::1], f8[::1])",
    "jump": "void(i8, f8, f8[::1], f8[::1], f8[::1], f8[::1])",
}
_ARGUMENTS = {
    "field": "mode, t, u, q, du",
    "jet": "mode, order, t, u, q, C, W",
    "values": "mode, t, u, q, out",
    "jump": "transition, t, u, q, u_new, q_new",
}
_INLINED = {"cos": "cosine", "sin": "sine"}


@dataclass(frozen=True)
class CompiledModel:
    """The functions of one model (see ``SIGNATURES``), to be passed to the kernels.

    Attributes
    ----------
    field : ``field(mode, t, u, q, du)``
        The vector field of a mode.
    jet : ``jet(mode, order, t, u, q, C, W)``
        Rows of C: Taylor coefficients 0..order (order >= 1) of the states, the indicators and the outputs along
        the mode's flow from (t, u). C has at least order + 1 columns, W is scratch (n_scratch, >= order + 1).
    values : ``values(mode, t, u, q, out)``
        The indicators, then the outputs of that mode.
    jump : ``jump(transition, t, u, q, u_new, q_new)``
        State and parameters-with-memory after a transition; the new arrays must not be the old ones.
    n_scratch : int
        Rows of W; at least 1.
    smooth_outputs : tuple of bool
        False where an output has a corner in some mode: there its series is NaN from coefficient 1 on.
    """

    field: Any
    jet: Any
    values: Any
    jump: Any
    n_scratch: int
    smooth_outputs: tuple[bool, ...]


@lru_cache(maxsize=MOST_MODELS)
def compile_model(traced: Traced) -> CompiledModel:
    """Generate, compile (or load from the cache) and return the functions of a traced system.

    Raises
    ------
    SystemDefinitionError
        A field or an indicator has a corner, or an expression holds a function that is not supported.
    """
    from nonsmooth.kernels.compile.cache import load_module

    module = load_module(model_source(traced), "model", lasting=False)
    return CompiledModel(
        field=module.field,
        jet=module.jet,
        values=module.values,
        jump=module.jump,
        n_scratch=module.N_SCRATCH,
        smooth_outputs=module.SMOOTH_OUTPUTS,
    )


@lru_cache(maxsize=16)
def model_source(traced: Traced) -> str:
    """The text of the generated module; the same for the same expressions, in every process."""
    modes = range(len(traced.fields))
    rows = [
        [
            *(Integer(0) if traced.keeps_at_zero(mode, i) else h for i, h in enumerate(_asked(traced, mode))),
            *(output[mode] for output in traced.outputs),
        ]
        for mode in modes
    ]
    jet = jet_code(traced.t, traced.u, constants_of(traced), traced.fields, rows)
    code = {
        "field": choosing_code(traced, fields_of(traced)),
        "values": choosing_code(traced, [_values(traced, mode) for mode in modes]),
        "jump": choosing_code(traced, [_jump(traced, i) for i in range(len(traced.transitions))]),
    }
    functions = jet.functions.union(*(used for _, _, used in code.values()))
    inlined = sorted(_INLINED[f] for f in code["field"][2] & _INLINED.keys())
    always = {
        "values": [f"for i in range({len(rows[0])}):", "    out[i] = 0.0"],
        "jump": [
            *(f"for i in range({len(traced.u)}):", "    u_new[i] = u[i]"),
            *(f"for i in range({len(traced.p) + len(traced.m)}):", "    q_new[i] = q[i]"),
        ],
    }
    smooth = tuple(all(mode[len(traced.indicators) + i] for mode in jet.smooth) for i in range(len(traced.outputs)))
    parts = [
        "from numpy import array",
        "from nonsmooth.kernels.compile.direct import callback, device",
        f"from math import {', '.join(sorted(functions))}" if functions else "",
        f"from nonsmooth.kernels.circular import {', '.join(inlined)}" if inlined else "",
        f"N_SCRATCH = {max(1, jet.n_scratch)}",
        f"SMOOTH_OUTPUTS = {smooth!r}",
    ]
    for name, signature in SIGNATURES.items():
        if name == "jet":
            parts += jet_functions(jet, f'callback("{signature}")', _ARGUMENTS[name])
        else:
            tables, lines, _ = code[name]
            lines = [*always.get(name, []), *(_inlined(lines) if name == "field" else lines)]
            parts.append(function_of(name, f'callback("{signature}")', _ARGUMENTS[name], tables, lines))
    return "\n".join(part for part in parts if part) + "\n"


def _asked(traced: Traced, mode: int) -> list[Expr]:
    """The indicators, zero in place of those that are not asked for in a mode: they are not computed there."""
    every = traced.idle if traced.decider is None else traced.decider.idle
    idle = every[mode] if every else ()
    return [Integer(0) if i in idle else h for i, h in enumerate(traced.indicators)]


def _inlined(lines: list[str]) -> list[str]:
    """The same code with the cos and sin of ``kernels.circular``: for the field alone, which is called six times a step
    and would wait for the library; elsewhere they would only lengthen the compile."""
    return [re.sub(r"\b(cos|sin)\(", lambda found: f"{_INLINED[found[1]]}(", line) for line in lines]


def function_of(name: str, kind: str, arguments: str, tables: dict[str, list[int]], lines: Sequence[str]) -> str:
    """The text of a function of some lines, in which the name of a table is its entry of the first argument.

    ``kind`` is its decorator."""
    selector, text, before, found = arguments.split(",")[0], "\n".join(lines), "", unpacked(lines)
    for entry, table in tables.items():
        if re.search(rf"\b{entry}\b", text):
            before += f"{entry}_of_{name} = array({table})\n"
            found += [f"{entry} = {entry}_of_{name}[{selector}]"]
    body = "".join(f"    {line}\n" for line in [*found, *lines] or ["pass"])
    return f"\n\n{before}@{kind}\ndef {name}({arguments}):\n{body}".rstrip("\n")


def jet_functions(jet: JetCode, kind: str, arguments: str, after: Sequence[str] = (), **tables: list[int]) -> list[str]:
    """The texts of the function ``jet`` and of those that it calls, one for a group of modes: compilers take far more
    time for one long function than for several short ones."""
    given = _ARGUMENTS["jet"]
    lines = chain([(f"group == {i}", [f"jet{i}({given})"]) for i in range(len(jet.groups))])
    return [
        *(function_of(f"jet{i}", "device", given, jet.tables, group) for i, group in enumerate(jet.groups)),
        function_of("jet", kind, arguments, {**jet.tables, **tables}, [*lines, *after]),
    ]


def unpacked(lines: Iterable[str]) -> list[str]:
    """Lines that give the parameters and the memory used in ``lines`` their names."""
    used = {int(number) for number in re.findall(r"\bq(\d+)\b", "\n".join(lines))}
    return [f"q{i} = q[{i}]" for i in sorted(used)]


def fields_of(traced: Traced) -> list[list[tuple[str, Expr]]]:
    """Targets and expressions of the vector field in each mode."""
    return [[(f"du[{i}]", e) for i, e in enumerate(field)] for field in traced.fields]


def constants_of(traced: Traced) -> dict[Basic, str]:
    """Names of parameters and memory in generated code."""
    return {symbol: f"q{i}" for i, symbol in enumerate([*traced.p, *traced.m])}


def choosing_code(
    traced: Traced, cases: Sequence[Sequence[tuple[str, Expr]]]
) -> tuple[dict[str, list[int]], list[str], set[str]]:
    """Tables for ``function_of``, lines that give targets their values in one of some cases, and functions of ``math``.

    Targets that change together are chosen together. A term that several expressions hold and at least half of the
    cases need is computed ahead of the choice.
    """
    rows = [dict(case) for case in cases]
    together: dict[tuple[int, ...], list[tuple[str, list[Expr | None]]]] = {}
    needed: dict[Basic, int] = {}  # the cases, as bits, in which a term is
    for target in dict.fromkeys(target for row in rows for target in row):
        choices: dict[Expr | None, int] = {}
        chosen = tuple(choices.setdefault(row.get(target), len(choices)) for row in rows)
        together.setdefault(chosen, []).append((target, list(choices)))
        for expression, number in choices.items():
            if expression is not None:
                bits = sum(1 << i for i, choice in enumerate(chosen) if choice == number)
                for term in preorder_traversal(expression):
                    needed[term] = needed.get(term, 0) | bits
    names = {**constants_of(traced), traced.t: "t", **{symbol: f"x{i}" for i, symbol in enumerate(traced.u)}}
    printer = Printer(names)
    every = [e for group in together.values() for _, choices in group for e in choices if e is not None]
    lines = [f"x{i} = u[{i}]" for i, symbol in enumerate(traced.u) if symbol in needed]
    lines += shared_terms(every, printer, "g", lambda e: 2 * needed[e].bit_count() >= len(cases))
    tables, used = {}, printer.used
    for number, (chosen, group) in enumerate(together.items()):
        branches = []
        for k in range(max(chosen) + 1):
            own = Printer(dict(printer.names))
            found = [(target, choices[k]) for target, choices in group]
            body = assignments([(target, e) for target, e in found if e is not None], own, "b")
            branches.append((f"w{number} == {k}", body))
            used |= own.used
        tables[f"w{number}"] = list(chosen)
        lines += chain(branches)
    return tables, lines, used


def _values(traced: Traced, mode: int) -> list[tuple[str, Expr]]:
    rows = [*_asked(traced, mode), *(output[mode] for output in traced.outputs)]
    return [(f"out[{i}]", e) for i, e in enumerate(rows) if e != 0]


def _jump(traced: Traced, index: int) -> list[tuple[str, Expr]]:
    """Changes by a transition; the rest has been copied before."""
    transition = traced.transitions[index]
    reset = traced.u if transition.reset is None else transition.reset
    targets = [(f"u_new[{i}]", e) for i, e in enumerate(reset) if e != traced.u[i]]
    return targets + [(f"q_new[{len(traced.p) + i}]", e) for i, e in transition.writes]
