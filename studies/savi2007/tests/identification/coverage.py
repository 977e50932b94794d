"""Coverage: do the stated intervals hold the truth as often as they say? Forty virtual rigs, two tables.

``python -m studies.savi2007.tests.identification.coverage --seeds 0-39 --out docs/measured_coverage.md``

With ``--awkward`` the rigs are those on which much goes wrong at once (``VirtualRig.awkward``), and a third table
counts whether the notes of ``identify`` name each thing that does, and nothing that does not.

Each rig writes its session into a folder of its own; ``identify`` sees that folder only, and the truth, which lies
beside it, is opened when all is identified. Finished seeds are kept in ``--folder`` and not computed again.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from studies.savi2007.tests.identification.coverage_tables import ASKED, BESIDE, COMPARED, page, to_dataset

__all__ = ["campaign", "main", "one_rig"]


#: Taps of the car on an awkward rig (m/s): in one of the six the string slips.
_TAPS = {"impulse": {"velocities": (0.5, -0.5, 0.35, -0.35, 0.2, -0.2)}}

#: Meaning of the tables, above them on the page.
MEANING = """\
Each virtual rig has drawn parameters, writes its recordings to files, and is identified from these files alone. The
tables count how many true values lie in the stated 95 % intervals: 38 of 40 are expected. A normalised error is the
error divided by the stated standard uncertainty; its root mean square (rms) is 1 where uncertainties are neither too
large nor too small.
"""


def one_rig(seed: int, folder: str, awkward: bool = False) -> dict[str, Any]:
    """Write a session, identify from it, and only then compare with the truth; the result stays in ``folder``."""
    place = Path(folder)
    kept = place / f"seed_{seed:03d}.json"
    if kept.is_file():
        found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    from nonsmooth.identification import Estimate
    from nonsmooth.recordings import load_session
    from nonsmooth_savi2007.comparison import gap_offset, session_measurement
    from nonsmooth_savi2007.identification.chain import identify
    from nonsmooth_savi2007.rig import NOMINAL_GAP, VirtualRig
    from nonsmooth_savi2007.rig.truth import load_truth

    with tempfile.TemporaryDirectory(prefix=f"rig_{seed:03d}_", dir=place) as top, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        truth_file = Path(top) / "truth.toml"
        rig = VirtualRig.awkward(seed) if awkward else VirtualRig(seed)
        folder_of = rig.write_session(Path(top) / "session", truth=truth_file, options=_TAPS if awkward else None)
        session = load_session(folder_of)
        result = identify(session)
        runs = session.recordings("contact")
        shortest = min(runs, key=lambda item: float(item.settings["crank_length"]))
        used = None
        if "g" in result:
            offset = gap_offset(result, session)
            used = session_measurement(session, "contact", shortest.run, k=result["k"], gap_offset=offset)[1]["g"]
        truth = load_truth(truth_file)
        cranks = [float(item.settings["crank_length"]) for item in runs]
    expected = {
        **truth,
        "omega_0": float(np.sqrt(2 * truth["k"] / truth["m"])),
        "gain": truth["force_gain"],
        "gap_at_rest": truth["g"],
        "g": truth["g"] - _moved(truth, max(cranks)),
    }
    known = [name for name in ASKED if name in result or name in result.extra]
    rows = {name: _row(expected[name], result.estimate(name)) for name in known}
    reading = float(shortest.settings["gap"]) - NOMINAL_GAP
    if used is not None:
        value, error = used
        rows[COMPARED] = _row(truth["g"] + reading - _moved(truth, min(cranks)), Estimate(value, error, "m"))
    findings = {finding.name: finding for finding in result.findings}
    beside = {}
    for label, (name, other, of) in BESIDE.items():
        if name in findings:
            finding = findings[name]
            beside[label] = _row(expected[of], finding.others[other] if other else finding.estimate)
    found = {"seed": seed, "rows": rows, "beside": beside, "truth": truth, "notes": list(result.notes)}
    kept.write_text(json.dumps(found), encoding="utf-8")
    return found


def _row(truth: float, estimate: Any) -> list[float]:
    low, high = estimate.interval()
    return [truth, estimate.value, estimate.uncertainty, low, high]


def drive_mean(truth: Mapping[str, float], crank: float) -> float:
    """Mean of the driven end over a turn (m), string and ripple together, by quadrature (exact for its harmonics)."""
    at = np.arange(4096) * 2 * np.pi / 4096
    phi = at + truth["ripple"] * np.sin(at + truth["ripple_phase"])
    length = truth["string_length"]
    return float(np.mean(crank * np.cos(phi) + length - np.sqrt(length**2 - (crank * np.sin(phi)) ** 2)))


def _moved(truth: Mapping[str, float], crank: float) -> float:
    """Distance of the mean position under the drive from rest (m), towards the support."""
    return truth["motor_side"] * drive_mean(truth, crank) / 2


def campaign(seeds: Sequence[int], folder: Path, processes: int = 2, *, awkward: bool = False) -> list[dict[str, Any]]:
    """All rigs, spread over processes; what was finished before is not computed again."""
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[int, dict[str, Any]] = {}
    with ProcessPoolExecutor(processes) as pool:
        jobs = {pool.submit(one_rig, seed, str(folder), awkward): seed for seed in seeds}
        for job in as_completed(jobs):
            seed = jobs[job]
            found[seed] = job.result()
            print(f"seed {seed} done ({len(found)} of {len(seeds)})", file=sys.stderr, flush=True)
    return [found[seed] for seed in seeds]


def _seeds(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign, print its tables, and write them; the numbers go to ``coverage.nc`` in the folder."""
    parser = argparse.ArgumentParser(prog="coverage", description="Coverage of identify over virtual rigs.")
    parser.add_argument("--seeds", type=_seeds, default=list(range(40)), help="as 0-39")
    parser.add_argument("--out", type=Path, help="Markdown file for the tables")
    parser.add_argument("--folder", type=Path, help="where finished seeds are kept; default: out/coverage[_awkward]")
    parser.add_argument("--awkward", action="store_true", help="rigs on which much goes wrong at once")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args(arguments)
    folder = options.folder or Path("out/coverage_awkward" if options.awkward else "out/coverage")
    results = campaign(options.seeds, folder, options.processes, awkward=options.awkward)
    text = page(results, awkward=options.awkward)
    print(text)
    from nonsmooth import save

    save(to_dataset(results), folder / "coverage.nc")
    if options.out is not None:
        title, flag = ("Measured coverage", "")
        if options.awkward:
            title, flag = "Measured coverage on awkward rigs", " --awkward"
        program = "studies.savi2007.tests.identification.coverage"
        head = f"# {title}\n\nPrinted by `python -m {program}{flag}`: synthetic rigs.\n\n"
        options.out.write_text(head + MEANING + "\n" + text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
