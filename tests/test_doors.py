"""Doors of verbs: what an option may be stands in its signature, and every refusal follows from that declaration."""

from __future__ import annotations

import importlib.util
import inspect
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.system.arguments import declared
from nonsmooth.system.kinds import Limit, reader_of

#: Verbs whose arguments are read by themselves: they take any names, or what is no option.
OTHERS = {"animate", "explore", "identify", "load", "load_recording", "save", "system_of", "where"}
WORDS = ("must be", "allowed:", "takes an ns.System", "give its two ends", "real number", "finite")


spec = importlib.util.spec_from_file_location("doors", Path(__file__).parents[1] / "docs" / "doors.py")
assert spec is not None and spec.loader is not None
tables = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tables)
DOORS: dict[str, Any] = tables.DOORS


def wrong(kind: Any) -> list[Any]:
    """Values that a declaration does not allow: of wrong types, and beyond its limits."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        limit = next((mark for mark in parts if isinstance(mark, Limit)), None)
        beyond = [] if limit is None else [limit.low - 1.0, *([limit.high + 1.0] if limit.high < 1e300 else [])]
        return [*wrong(parts[0]), *beyond, *([(2.0, 1.0)] if "rising" in parts else [])]
    if origin in (Union, UnionType):
        some = [wrong(part) for part in parts if part is not NoneType]
        return [one for one in some[0] if all(repr(one) in map(repr, more) for more in some)]
    if origin is Literal:
        return ["sideways", 3, ["up"]]
    if origin is tuple:
        return [3.0, (1.0,), "ab", ("a", "b")]
    if origin is Mapping:
        return [[1.0], "a", 3]
    if kind is bool:
        return ["no", "", float("nan"), 2, [True], np.zeros(2)]
    if kind is int:
        return ["3", 2.5, True, float("nan"), float("inf"), [3], 3j]
    if kind is float:
        return ["3", True, float("nan"), float("inf"), [3.0], 3j]
    if kind is str:
        return [3, ["x"]]
    return [] if kind is Any or not isinstance(kind, type) or getattr(kind, "_is_protocol", False) else [3, "x"]


@cache
def cases() -> list[tuple[str, str, Any]]:
    kinds = [(verb, name, kind) for verb, door in DOORS.items() for name, kind in door.kinds.items()]
    return [(verb, name, value) for verb, name, kind in kinds for value in wrong(kind)]


@pytest.mark.parametrize("verb", DOORS)
def test_what_a_declaration_does_not_allow_is_refused_in_a_sentence(verb: str) -> None:
    """It names the option, and says what is allowed; nothing is computed before."""
    tried = [(name, value) for which, name, value in cases() if which == verb]
    assert tried or not any(wrong(kind) for kind in DOORS[verb].kinds.values())
    for name, value in tried:
        said = str(tables.answer(verb, **{name: value}))
        assert name in said.lower() and any(word in said for word in WORDS), (name, value, said)


@pytest.mark.parametrize("verb", DOORS)
def test_a_misspelt_name_is_answered_with_the_nearest(verb: str) -> None:
    for name in DOORS[verb].kinds:
        if name != "system":
            said = str(tables.answer(verb, **{f"{name}_": 1}))
            assert f"`{name}_` is not an option of" in said and f"nearest: {name}" in said, said


def test_the_tables_name_every_option_and_hold_sentences_of_ours() -> None:
    rows = [row.split(" | ") for row in tables.options().splitlines()[2:]]
    found = {(name[3:-1], verb) for name, *_, verbs in rows for verb in re.findall(r"~nonsmooth\.(\w+)", verbs)}
    assert found == {(name, verb) for verb, door in DOORS.items() for name in door.kinds}
    assert all(allowed.strip() for _, allowed, *_ in rows)
    rows = [row.split(" | ") for row in tables.refusals().splitlines()[2:]]
    assert len({verb for verb, *_ in rows if "nonsmooth" in verb}) == len(DOORS) and len(rows) > 2 * len(DOORS)
    for _, given, said in rows:
        name = given[1 : given.index("=")]
        assert name in said and any(word in said for word in (*WORDS, "is not an option of")), said


def test_switches_and_numbers_are_read_alike_everywhere() -> None:
    """C8 of the findings: no word is a switch, 0 and 1 and those of NumPy are; 3.0 is a whole number."""
    bools = numbers = 0
    for door in DOORS.values():
        for name, kind in door.kinds.items():
            base = get_args(kind)[0] if get_origin(kind) is Annotated else kind
            if base is bool:
                bools += 1
                assert [door.readers[name](one, name) for one in (0, 1, np.True_, False)] == [False, True, True, False]
            elif base is int:
                numbers += 1
                least = next(mark.low for mark in get_args(kind) if isinstance(mark, Limit))
                read = door.readers[name](float(least + 1), name)
                assert type(read) is int and read == least + 1
    assert bools > 20 and numbers > 40


def test_every_verb_has_a_door() -> None:
    calls = {name for name in ns.__all__ if inspect.isfunction(getattr(ns, name))}
    assert calls - DOORS.keys() <= OTHERS | {"mechanical"}


def test_signature_and_help_show_all_that_is_taken() -> None:
    for verb, door in DOORS.items():
        call = getattr(ns, verb)
        shown = inspect.signature(call).parameters
        assert {*shown} == {name for name in door.items if name != "self"}, verb
        for name in door.shared:
            assert name in (call.__doc__ or "") and shown[name].default is not inspect.Parameter.empty, (verb, name)
        assert {*declared(call)} == {*door.named}
    assert inspect.signature(ns.sweep).parameters["keep"].default == 100
    assert "A Zarr store for finished chunks" in ns.chart.__doc__


def test_no_verb_has_more_than_twelve_arguments_of_its_own_or_120_lines() -> None:
    shared = set().union(*(door.shared for door in DOORS.values()))
    many: dict[str, Any] = {}
    for verb, door in DOORS.items():
        function: Callable[..., Any] = inspect.unwrap(door.function)
        own = [name for name in door.items if name not in shared and name != "self"]
        text = "" if isinstance(getattr(ns, verb), type) else inspect.getsource(function)
        lines = len(text.splitlines()) - len((function.__doc__ or "").splitlines())
        if len(own) > 12 or lines > 120:
            many[verb] = len(own), lines
    assert not many


def test_the_ends_of_limits_are_allowed_but_for_one_that_says_above() -> None:
    assert [Limit(0, 2).holds(x) for x in (-0.1, 0, 2, 2.1)] == [False, True, True, False]
    assert [Limit(0, 2, without_low=True).holds(x) for x in (0, 0.1, 2, 2.1)] == [False, True, True, False]


def test_a_number_may_be_as_large_as_it_is_and_a_count_as_large_as_it_is_exact() -> None:
    number, count = reader_of(float), reader_of(int)
    assert number(-1e300, "x") == -1e300 and count(-(2**53), "n") == -(2**53)
    with pytest.raises(ValueError, match="n = -9007199254740994"):
        count(-(2**53) - 2, "n")
