"""Coverage of ``fit`` on ten systems: do 95 % intervals hold the truth of another program as often as they say?

``python -m tests.identification.fit_coverage --systems "impact damper" --seeds 0-7``
``python -m tests.identification.fit_coverage --seeds 0-39 --out docs/measured_coverage_fit.md``

Finished fits are kept in ``--folder``, under a name that the package's source and the cases give, and not computed
again: so a page can be put together from several runs, and never from fits of different sources.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.identification.fit_cases import CASES, Case

import nonsmooth as ns
from nonsmooth.errors import SolveError

INSIDE = 1.959964  # standard uncertainties on either side that hold 95 of 100
MEANING = """\
Each system is fitted to recordings of another program: its equations are written out a second time and integrated by
SciPy's DOP853 between events, one quantity is read with noise, rounded to a count (each 1 % of the reading's standard
deviation, 0.3 % for the damper), on a clock that jitters by 2 % of its step. Each seed has a start, readings and a
first guess of its own, every parameter 30 % off either way. *Converged* are the fits without an anomaly; all others
said so. Coverage and the root mean square (rms) of the normalised errors are pooled over the parameters of the fits
that converged; ± is the binomial standard error of a coverage of 0.95 at so many intervals (somewhat too small: the
intervals of one fit are not independent). *Largest* is the largest of these errors. Seconds are of processor time: the
median over the seeds, and the largest, which is mostly the first with its compiling.
"""
HEAD = "| system | parameters | converged | in the 95 % interval | rms of normalised errors | largest | seconds a fit |"


@dataclass(frozen=True, eq=False)
class Row:
    """Fits of one system: normalised errors (converged, parameters), sentences of the others by seed, seconds."""

    case: Case
    far: NDArray[np.float64]
    said: dict[int, str]
    seconds: list[float]

    def __str__(self) -> str:
        seconds = f"{np.median(self.seconds):.2g} ({max(self.seconds):.2g})"
        return (
            f"| {self.case.name} | {', '.join(self.case.find)} | {len(self.far)} of {len(self.seconds)} | "
            f"{pooled([self])} | {seconds} |"
        )


def pooled(rows: Iterable[Row]) -> str:
    z = np.concatenate([row.far.ravel() for row in rows])
    if not len(z):
        return "- | - | -"
    error = np.sqrt(0.95 * 0.05 / len(z))
    return f"{cover(z):.3f} ± {error:.3f} of {len(z)} | {rms(z):.2f} | {np.max(np.abs(z)):.1f}"


def cover(z: NDArray[np.float64]) -> float:
    return float(np.mean(np.abs(z) < INSIDE))


def rms(z: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(z**2)))


def one_fit(case: Case, seed: int, folder: Path) -> dict[str, Any]:
    """Fit a case at a seed: ``far`` (normalised errors) or ``said`` (why not), and ``seconds``; kept in ``folder``."""
    kept = folder / f"{case.name}, {seed}.json"
    if kept.is_file():
        found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    data, measured, _ = case.recording(seed)
    begun = time.process_time()
    try:
        fitted = ns.fit(case.guess(seed), data, case.find, measured=measured, progress=False)
    except SolveError as reason:
        found = {"said": str(reason)}
    else:
        far = [(fitted[name] - case.truth[name]) / fitted.uncertainty[name] for name in case.find]
        found = {"said": fitted.anomalies[0]} if fitted.anomalies else {"far": far}
    found["seconds"] = time.process_time() - begun
    kept.write_text(json.dumps(found), encoding="utf-8")
    return found


def coverage(case: Case, seeds: Iterable[int], folder: Path) -> Row:
    """Fit a case at these seeds."""
    fits = {seed: one_fit(case, seed, folder) for seed in seeds}
    far = [fit["far"] for fit in fits.values() if "far" in fit]
    said = {seed: fit["said"] for seed, fit in fits.items() if "said" in fit}
    return Row(case, np.array(far).reshape(-1, len(case.find)), said, [fit["seconds"] for fit in fits.values()])


def faults(rows: Sequence[Row]) -> list[str]:
    """Faults of forty seeds of each system, where intervals of 95 % are not that."""
    found = []
    for row in rows:
        z = row.far
        if len(z) < len(row.seconds) - 2 or np.max(np.abs(z)) > 5.0:
            found.append(f"{row.case.name}: {len(z)} fits converged, the largest error is {np.max(np.abs(z)):.1f}")
        if not (0.90 <= cover(z) and 0.85 <= rms(z) <= 1.15):
            found.append(f"{row.case.name}: {cover(z):.3f} covered, rms {rms(z):.2f}")
    every = np.concatenate([row.far.ravel() for row in rows])
    if not (0.93 <= cover(every) <= 0.97 and 0.85 <= rms(every) <= 1.15):
        found.append(f"all: {cover(every):.3f} covered, rms {rms(every):.2f}")
    return found


def source() -> str:
    """A name for the package's source and the cases as they are."""
    files = [*sorted(Path(ns.__file__).parent.rglob("*.py")), Path(sys.modules[Case.__module__].__file__ or "")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def _seeds(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row for each system, all, and what fits say that did not converge; 1 where forty seeds show faults."""
    parser = argparse.ArgumentParser(description="Coverage of fit on ten systems.")
    parser.add_argument("--systems", nargs="+", choices=list(CASES), default=list(CASES), metavar="NAME")
    parser.add_argument("--seeds", type=_seeds, default=list(range(40)), help="as 0-39")
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    parser.add_argument("--folder", type=Path, default=Path("out/coverage_fit"), help="where finished fits are kept")
    options = parser.parse_args(arguments)
    folder = options.folder / source()
    folder.mkdir(parents=True, exist_ok=True)
    lines = [HEAD, "|" + "---|" * (HEAD.count("|") - 1)]
    print(*lines, sep="\n", flush=True)
    rows = []
    for name in options.systems:
        rows.append(coverage(CASES[name], options.seeds, folder))
        print(rows[-1], flush=True)
        for seed, sentence in rows[-1].said.items():
            print(f"    seed {seed}: {sentence}", file=sys.stderr, flush=True)
    converged, fits = sum(len(row.far) for row in rows), sum(len(row.seconds) for row in rows)
    lines += [str(row) for row in rows] + [f"| all | | {converged} of {fits} | {pooled(rows)} | |"]
    print(lines[-1])
    if options.out is not None:
        by = "Printed by `python -m tests.identification.fit_coverage` (`make coverage-fit`)."
        head = f"# Measured coverage of fits\n\n{by}\n\n"
        options.out.write_text(head + MEANING + "\n" + "\n".join(lines) + "\n", encoding="utf-8")
    wrong = faults(rows) if len(options.seeds) >= 40 else []
    print(*wrong, sep="\n", end="\n" if wrong else "", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
