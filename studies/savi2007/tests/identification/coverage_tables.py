"""The tables of a coverage campaign, the limits they are held against, and its numbers as a Dataset for a picture."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ANOMALIES", "ASKED", "BESIDE", "COMPARED", "misses", "page", "pooled", "to_dataset", "unnamed"]


#: What is counted, with the largest allowed median and maximum of the error: relative, or in m for a gap (None: by
#: coverage only).
ASKED: Mapping[str, tuple[float, float] | None] = {
    "k": (0.01, 0.03),
    "k_s": (0.01, 0.03),
    "m": (0.01, 0.03),
    "omega_0": (0.01, 0.03),
    "c": (0.02, 0.05),
    "g": (1e-4, 1e-4),
    "gap_at_rest": (1e-4, 1e-4),
    "gap of compare": (1e-4, 1e-4),
    "c_s": None,
    "friction": None,
    "gain": None,
}
#: The gap that ``compare`` uses for the run with the shortest crank.
COMPARED = "gap of compare"
#: What may be wrong with a rig: whether it is, by the truth, and the words of the note that names it.
ANOMALIES: Mapping[str, tuple[Callable[[Mapping[str, float]], bool], str]] = {
    "zeroed where it sticks": (lambda truth: abs(truth["sensor_zero"]) > _COUNT, "not where it was zeroed"),
    "motor on the other side": (lambda truth: truth["motor_side"] < 0, "the motor pulls from the side away"),
    "motor wanders": (lambda truth: truth["motor_wander"] > 0, "wanders"),
    "slipped tap": (lambda truth: truth["slipped_tap"] > 0, "impulse: run 'Run #{slipped_tap:.0f}', channel 'Angle': "),
    "rotary sensor reversed": (lambda truth: truth["angle_sign"] < 0, "the rotary sensor counts away from the support"),
    "force sensor reversed": (lambda truth: truth["force_sign"] < 0, "the force sensor counts against"),
    "photogate reversed": (lambda truth: truth["turn_sign"] < 0, "the photogate counts backwards"),
}
_COUNT = 8.3e-5  # m: a count and a half, from which a zero is seen
#: Findings that no parameter rests on: label, (finding, which of its others, truth).
BESIDE: Mapping[str, tuple[str, str, str]] = {
    "gap by the grazing frequency": ("gap_grazing", "at_rest", "gap_at_rest"),
    "k by the crank's force": ("crank_force", "", "k"),
    "motor, slope": ("voltage_frequency", "", "motor_slope"),
    "motor, offset": ("voltage_frequency", "offset", "motor_offset"),
    "c by free decay": ("c_decay", "", "c"),
    "c by complex response": ("c_frequency_response", "", "c"),
    "c by amplitude, with friction": ("c_response", "", "c"),
    "c by amplitude, viscous only (Fig. 6)": ("c_viscous_only", "", "c"),
}
SHARE = 0.85  # of the truths must lie in their 95 % intervals: 34 of 40
SPREAD = (0.5, 1.6)  # of the normalised errors' root mean square
POOLED = (0.92, 0.98)  # of all truths together, on awkward rigs
_LENGTHS = ("g", "gap_at_rest", "gap of compare", "gap by the grazing frequency")
_FACTORS = ("c_s",)


def _rows(name: str, results: Sequence[Mapping[str, Any]]) -> list[Sequence[float]]:
    """Of the rigs on which the parameter was identified."""
    return [result["rows"][name] for result in results if name in result["rows"]]


class _Counted:
    """One parameter over all rigs."""

    def __init__(self, name: str, rows: Sequence[Sequence[float]]) -> None:
        truth, value, error, low, high = np.array(rows, dtype=np.float64).T
        self.n, self.inside = len(rows), int(np.count_nonzero((low <= truth) & (truth <= high)))
        z = np.log(value / truth) / (error / value) if name in _FACTORS else (value - truth) / error
        self.spread = float(np.sqrt(np.mean(z**2)))
        self.length = name in _LENGTHS
        self.off = np.abs(value - truth) / (1.0 if self.length else np.abs(truth))
        self.bias = float(np.median((value - truth) / (1.0 if self.length else np.abs(truth))))
        self.coarse = bool(np.median(self.off) > 5e-6)
        self.stated = float(np.median(error / (1.0 if self.length else np.abs(value))))

    def written(self, size: float) -> str:
        if self.length:
            return f"{1e6 * size:.1f} µm"
        return f"{100 * size:.3f} %" if self.coarse else f"{1e6 * size:.2f} ppm"


def misses(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on the limits that are not met; empty where all are."""
    found = []
    for name, limit in ASKED.items():
        rows = _rows(name, results)
        if len(rows) < len(results):
            found.append(f"{name}: not identified on {len(results) - len(rows)} of {len(results)} rigs")
        if not rows:
            continue
        counted = _Counted(name, rows)
        if counted.inside < SHARE * counted.n:
            found.append(f"{name}: {counted.inside} of {counted.n} truths lie in their intervals")
        if not SPREAD[0] <= counted.spread <= SPREAD[1]:
            found.append(f"{name}: normalised errors have a root mean square of {counted.spread:.2f}")
        if limit is not None and (np.median(counted.off) > limit[0] or np.max(counted.off) > limit[1]):
            off = [counted.written(float(size)) for size in (np.median(counted.off), np.max(counted.off))]
            found.append(f"{name}: errors of {off[0]} (median) and {off[1]} (largest)")
    return found


def pooled(results: Sequence[Mapping[str, Any]]) -> tuple[int, int]:
    """Truths within their 95 % intervals over all parameters and rigs, and their number."""
    counted = [_Counted(name, rows) for name in ASKED if (rows := _rows(name, results))]
    return sum(c.inside for c in counted), sum(c.n for c in counted)


def unnamed(result: Mapping[str, Any]) -> dict[str, bool]:
    """Anomalies that the notes of a rig do not name though it has them (True), or name though it has not (False)."""
    truth, notes = result["truth"], " ".join(result["notes"])
    found = {}
    for name, (has, words) in ANOMALIES.items():
        there, said = has(truth), words.format_map(truth) in notes
        # a zero within a count and a half may be said or not
        if there != said and (there or name != "zeroed where it sticks"):
            found[name] = there
    return found


def _anomalies(results: Sequence[Mapping[str, Any]]) -> list[str]:
    wrong = [unnamed(result) for result in results]
    lines = [
        "## Anomalies in the notes",
        "",
        "| anomaly | rigs that have it | named | named where it is not |",
        "|---|---|---|---|",
    ]
    for name, (has, _) in ANOMALIES.items():
        there = sum(has(result["truth"]) for result in results)
        lines.append(
            f"| {name} | {there} | {there - sum(row.get(name) is True for row in wrong)} | "
            f"{sum(row.get(name) is False for row in wrong)} |"
        )
    inside, n = pooled(results)
    met = POOLED[0] <= inside / n <= POOLED[1]
    return [
        *lines,
        "",
        f"Pooled over parameters and rigs {inside} of {n} truths lie in their 95 % intervals, {100 * inside / n:.1f} % "
        f"(asked: 92 to 98 %: {'met' if met else 'not met'}).",
        "",
    ]


def page(results: Sequence[Mapping[str, Any]], *, awkward: bool = False) -> str:
    """The tables and what they say, as Markdown; ``awkward`` rigs have one more."""
    n = len(results)
    lines = [
        f"{n} virtual rigs (synthetic), seeds {results[0]['seed']} to {results[-1]['seed']}.",
        "",
        "| parameter | in the 95 % interval | rms of normalised errors | median error | largest | "
        "median stated uncertainty |",
        "|---|---|---|---|---|---|",
    ]
    for name in ASKED:
        if not (rows := _rows(name, results)):
            lines.append(f"| {name} | not identified | | | | |")
            continue
        c = _Counted(name, rows)
        lines.append(
            f"| {name} | {c.inside} of {c.n} | {c.spread:.2f} | {c.written(float(np.median(c.off)))} | "
            f"{c.written(float(np.max(c.off)))} | {c.written(c.stated)} |"
        )
    wrong = misses(results)
    lines += [
        "",
        "Asked: at least 34 of 40; rms 0.5 to 1.6; median and largest relative error 1 % and 3 % for k, k_s, m, "
        "omega_0, 2 % and 5 % for c; gaps to 0.1 mm. "
        + ("All met." if not wrong else "Not met: " + "; ".join(wrong) + "."),
        *_said(results),
        "",
        *(_anomalies(results) if awkward else ()),
        "## Findings beside the parameters",
        "",
        "| finding | in its 95 % interval | rms of normalised errors | median error | largest | bias (median) | "
        "median stated uncertainty |",
        "|---|---|---|---|---|---|---|",
    ]
    for label in BESIDE:
        rows = [result["beside"][label] for result in results if label in result["beside"]]
        if rows:
            c = _Counted(label, rows)
            lines.append(
                f"| {label} | {c.inside} of {c.n} | {c.spread:.2f} | {c.written(float(np.median(c.off)))} | "
                f"{c.written(float(np.max(c.off)))} | {c.written(c.bias)} | {c.written(c.stated)} |"
            )
    lines += [
        "",
        "The last one takes dry friction for damping: its interval says how well an equivalent c is known, not the "
        "damper's, and does not hold it. That is why no parameter rests on it.",
    ]
    return "\n".join(lines) + "\n"


def _said(results: Sequence[Mapping[str, Any]]) -> list[str]:
    factors = [np.exp(1.96 * error / value) for _, value, error, *_ in _rows("c_s", results)]
    lines = ["", f"c_s is known within a factor {np.median(factors):.3f} (median, 95 %)."] if factors else [""]
    label = "c by amplitude, viscous only (Fig. 6)"
    seen = [r for r in results if label in r["beside"] and "c" in r["rows"]]
    pairs = [(r["truth"]["friction"], r["beside"][label][1] / r["rows"]["c"][0] - 1) for r in seen]
    if pairs:
        dry, bias = np.array(pairs).T
        slope = float(np.dot(dry, bias) / np.dot(dry, dry))
        lines += [
            f"The viscous-only fit of Fig. 6 is off by {100 * np.median(bias):.1f} % (median; {100 * np.min(bias):.1f} "
            f"to {100 * np.max(bias):.1f} %), {100 * slope * 0.005:.1f} % per 5 mN of dry friction.",
        ]
    return lines


def to_dataset(results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Truth, estimate, standard uncertainty and 95 % interval over rig and parameter, as the picture takes them."""
    import xarray as xr

    from nonsmooth import __version__
    from nonsmooth.results.provenance import ATTRIBUTE

    names = list(ASKED)
    table: FloatArray = np.array(
        [[result["rows"].get(name, [np.nan] * 5) for name in names] for result in results], dtype=np.float64
    )
    over = ("rig", "parameter")
    columns = ("truth", "estimate", "uncertainty", "low", "high")
    label = "c by amplitude, viscous only (Fig. 6)"
    viscous = [result["beside"].get(label, [np.nan] * 2)[1] for result in results]
    return xr.Dataset(
        {**{name: (over, table[..., i]) for i, name in enumerate(columns)}, "viscous_only_c": ("rig", viscous)},
        {"rig": [result["seed"] for result in results], "parameter": names},
        {ATTRIBUTE: json.dumps({"version": __version__, "verb": "coverage"}), "synthetic": "yes"},
    )
