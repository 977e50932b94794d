"""Random contact systems: ``nonsmooth.simulate`` beside the independent reference.

``python tests/independent/contact_campaign.py FIRST LAST [--stacks] [--reference]``: seeds FIRST to LAST - 1, six
periods, 60 instants per period. Compared up to the instant where the reference and the reference with start and
forcing 1e-14 off separate. ``--stepping``: positions of two periods beside Moreau's time stepping at two steps.
"""

from __future__ import annotations

import argparse
import importlib
import json
import multiprocessing
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from contact_draws import REST_SPEED, Draw, as_nonsmooth, random_contact_stack, random_contact_system
from contact_elements import Array
from contact_reference import simulate
from contact_time_stepping import time_stepping

PERIODS, INSTANTS = 6, 60
AGREE, DIFFERENT = 1e-9, 1e-7
EVENTS = 6000
LIMIT = 150  # seconds for one system
STEPS = 1e-5, 5e-6  # of the time stepping


def reference(draw: Draw, times: Array) -> tuple[Array, int, str, int]:
    """Return states, number of instants on which two references agree, failure, and number of events."""
    q, v = draw.q, draw.v
    run = simulate(draw.system, q, v, times, rest_speed=REST_SPEED, max_events=EVENTS)
    rng = np.random.default_rng(draw.seed)

    def off(x: Array) -> Array:
        return x * (1 + 1e-14 * rng.choice([-1.0, 1.0], x.shape))

    # zeros stay zeros, mean loads too: what is exactly at a bound or at a contact stays there
    loads = np.hstack((draw.system.loads[:, :1], off(draw.system.loads[:, 1:])))
    other = simulate(replace(draw.system, loads=loads), off(q), off(v), times, rest_speed=REST_SPEED, max_events=EVENTS)
    gap = np.abs(run.states - other.states).max(axis=1)
    apart = np.flatnonzero(~(gap < AGREE))
    return run.states, int(apart[0]) if len(apart) else len(times), run.failure, len(run.events)


def tested(draw: Draw, times: Array, floors: bool = False) -> Array:  # noqa: PT028  (no test)
    import nonsmooth as ns

    names = [f"q{i + 1}" for i in range(len(draw.q))]
    start = dict(zip(names, draw.q, strict=True)) | {f"v_{q}": x for q, x in zip(names, draw.v, strict=True)}
    out = ns.simulate(as_nonsmooth(draw, floors), duration=float(times[-1]), samples=times, start=start)
    at = np.searchsorted(out.time.values, times, side="right") - 1
    if not np.allclose(out.time.values[at], times, rtol=0, atol=1e-12):
        raise RuntimeError("the run ended early")
    return np.asarray(out.u.sel(state=list(start)).values[at])


def answer(draw: Draw, times: Array, back: Any) -> None:
    try:
        back.send(tested(draw, times))
    except Exception as problem:
        back.send(f"{type(problem).__name__}: {problem}")


def apart(draw: Draw, times: Array) -> Array | str:
    """Return states or a message, from a process of its own: it may crash or not end."""
    importlib.import_module("nonsmooth")  # once for all processes

    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=answer, args=(draw, times, there))
    process.start()
    there.close()
    out: Array | str
    try:
        out = here.recv() if here.poll(LIMIT) else f"no answer within {LIMIT} s"
    except EOFError:
        process.join()
        out = f"the process ended with exit code {process.exitcode}"
    process.kill()
    process.join()
    return out


def one(seed: int, only_reference: bool = False, stacks: bool = False) -> dict[str, Any]:
    """Compare one seed."""
    draw = random_contact_stack(seed) if stacks else random_contact_system(seed)
    times = np.linspace(0, PERIODS * draw.period, PERIODS * INSTANTS + 1)
    begun = time.perf_counter()
    states, agreed, failure, events = reference(draw, times)
    row: dict[str, Any] = {
        "seed": seed,
        "share": agreed / len(times),
        "events": events,
        "failure": failure,
        "elements": draw.words(),
        "reference_s": round(time.perf_counter() - begun, 2),
    }
    if only_reference:
        return row
    begun = time.perf_counter()
    u = apart(draw, times)
    if isinstance(u, str):
        row["refused"] = u[:160].replace("\n", " ")
    else:
        error = np.abs(u - states)[:agreed] / (1 + np.abs(states[:agreed]))
        row["difference"] = float(error.max(initial=0.0))
        bad = np.flatnonzero(~(error.max(axis=1) < DIFFERENT)) if agreed else []
        row["from"] = float(times[bad[0]]) if len(bad) else None
    row["tested_s"] = round(time.perf_counter() - begun, 2)
    return row


def stepped(seed: int) -> dict[str, Any]:
    """Largest differences of positions from those of a time stepping, of a period at each of two steps."""
    draw, n = random_contact_system(seed), PERIODS * INSTANTS // 3
    times = np.linspace(0, 2 * draw.period, n + 1)
    u, q = apart(draw, times), len(draw.q)
    row: dict[str, Any] = {"seed": seed, "elements": draw.words()}
    if isinstance(u, str):
        return row | {"refused": u[:160].replace("\n", " ")}
    every = [round(times[1] / step) for step in STEPS]
    found = [time_stepping(draw.system, draw.q, draw.v, times[1], n, number)[:, :q] for number in every]
    return row | {"errors": [float(np.abs(one - u[:, :q]).max()) for one in found]}


def table_of_steps(rows: list[dict[str, Any]]) -> str:
    """Return the summary of the comparison with a time stepping."""
    errors = np.array([r["errors"] for r in rows if "errors" in r])
    coarse, fine = errors.T
    moving = fine > 1e-9  # the others stand still, or move as the scheme does exactly
    lines = [
        f"seeds {len(rows)}, refused {len(rows) - len(errors)}, steps {STEPS}",
        f"errors at the smaller step: median {np.median(fine):.1e}, under 2e-3 {np.count_nonzero(fine < 2e-3)}",
        f"ratio of the errors: median {np.median(coarse[moving] / fine[moving]):.3f} of {np.count_nonzero(moving)}",
    ]
    for r in rows:
        if "errors" not in r or r["errors"][1] >= 2e-3:
            lines.append(f"  {r['seed']:5d}  {r.get('errors', r.get('refused'))}  {r['elements']}")
    return "\n".join(lines)


def table(rows: list[dict[str, Any]]) -> str:
    """Return the summary of all rows."""
    ran = [r for r in rows if "difference" in r]
    same = [r for r in ran if r["from"] is None]
    lines = [
        f"seeds {len(rows)}, compared share of time {np.mean([r['share'] for r in rows]):.3f}",
        f"without an answer by the reference {sum(bool(r['failure']) for r in rows)}",
        f"refused {sum('refused' in r for r in rows)}, same {len(same)}, "
        f"worst difference of these {max((r['difference'] for r in same), default=0.0):.1e}",
        f"different {len(ran) - len(same)}:",
    ]
    for r in ran:
        if r["from"] is not None:
            lines.append(f"  {r['seed']:5d}  from t = {r['from']:<7.3f} by {r['difference']:.1e}  {r['elements']}")
    messages = Counter(r["refused"][:90] for r in rows if "refused" in r)
    lines += ["refused, by message:", *(f"  {k} x {message}" for message, k in messages.most_common())]
    lines += ["reference:", *(f"  {r['seed']:5d}  {r['failure']}  {r['elements']}" for r in rows if r["failure"])]
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--reference", action="store_true", help="run the reference alone")
    parser.add_argument("--stacks", action="store_true", help="masses on each other instead of mixed systems")
    parser.add_argument("--stepping", action="store_true", help="beside Moreau's time stepping instead")
    parser.add_argument("--rows", help="file of one JSON object per seed; seeds that stand in it are not run again")
    arguments = parser.parse_args()
    store = Path(arguments.rows) if arguments.rows else None
    if store:
        store.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in store.read_text().splitlines()] if store and store.exists() else []
    rows = [r for r in rows if arguments.first <= r["seed"] < arguments.last]
    for seed in sorted(set(range(arguments.first, arguments.last)) - {r["seed"] for r in rows}):
        rows.append(stepped(seed) if arguments.stepping else one(seed, arguments.reference, arguments.stacks))
        if store:
            with store.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    rows.sort(key=lambda r: r["seed"])
    print(table_of_steps(rows) if arguments.stepping else table(rows))
