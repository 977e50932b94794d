"""Coverage: do the stated intervals hold the truth as often as they say? Forty virtual rigs, one table.

``python -m nonsmooth.identification.coverage --seeds 0-39 --out docs/measured_coverage.md``

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

__all__ = ["campaign", "main", "one_rig", "table"]

#: What is counted, with the largest allowed median and maximum of the relative error (None: by coverage only).
ASKED: Mapping[str, tuple[float, float] | None] = {
    "k": (0.01, 0.03), "k_s": (0.01, 0.03), "m": (0.01, 0.03), "omega_0": (0.01, 0.03), "c": (0.02, 0.05),
    "g": None, "gap_at_rest": None, "c_s": None, "friction": None, "gain": None,
}  # fmt: skip
GAP_LIMIT = 1e-4  # m


def one_rig(seed: int, folder: str) -> dict[str, Any]:
    """Write a session, identify from it, and only then compare with the truth; the result stays in ``folder``."""
    place = Path(folder)
    kept = place / f"seed_{seed:03d}.json"
    if kept.is_file():
        found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    from nonsmooth.experiment.rig import VirtualRig
    from nonsmooth.experiment.rig.truth import load_truth
    from nonsmooth.identification.chain import identify

    with tempfile.TemporaryDirectory(prefix=f"rig_{seed:03d}_", dir=place) as top, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        truth_file = Path(top) / "truth.toml"
        session = VirtualRig(seed).write_session(Path(top) / "session", truth=truth_file)
        result = identify(session)
        truth = load_truth(truth_file)
        crank = max(
            float(run.settings["crank_length"]) for run in _contact_runs(session)
        )  # fmt: skip
    expected = {
        **truth, "omega_0": float(np.sqrt(2 * truth["k"] / truth["m"])), "gain": truth["force_gain"],
        "gap_at_rest": truth["g"], "g": truth["g"] - drive_mean(truth, crank) / 2,
    }  # fmt: skip
    rows = {}
    for name in ASKED:
        estimate = result.estimate(name)
        low, high = estimate.interval()
        rows[name] = [expected[name], estimate.value, estimate.uncertainty, low, high]
    viscous = {f.name: f.value for f in result.findings}.get("c_viscous_only", float("nan"))
    found = {"seed": seed, "rows": rows, "viscous_only_c": viscous, "friction": truth["friction"]}
    found["notes"] = list(result.notes)
    kept.write_text(json.dumps(found), encoding="utf-8")
    return found


def drive_mean(truth: Mapping[str, float], crank: float) -> float:
    """Mean of the driven end over a turn (m), string and ripple together, by quadrature (exact for its harmonics)."""
    at = np.arange(4096) * 2 * np.pi / 4096
    phi = at + truth["ripple"] * np.sin(at + truth["ripple_phase"])
    length = truth["string_length"]
    return float(np.mean(crank * np.cos(phi) + length - np.sqrt(length**2 - (crank * np.sin(phi)) ** 2)))


def _contact_runs(session: Path) -> list[Any]:
    from nonsmooth.experiment.session import load_session

    return load_session(session).recordings("contact")


def campaign(seeds: Sequence[int], folder: Path, processes: int = 2) -> list[dict[str, Any]]:
    """All rigs, spread over processes; what was finished before is not computed again."""
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[int, dict[str, Any]] = {}
    with ProcessPoolExecutor(processes) as pool:
        jobs = {pool.submit(one_rig, seed, str(folder)): seed for seed in seeds}
        for job in as_completed(jobs):
            seed = jobs[job]
            found[seed] = job.result()
            print(f"seed {seed} done ({len(found)} of {len(seeds)})", file=sys.stderr, flush=True)
    return [found[seed] for seed in seeds]


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """The coverage table as Markdown."""
    n = len(results)
    lines = [
        f"{n} virtual rigs (synthetic), seeds {results[0]['seed']} to {results[-1]['seed']}.", "",
        "| parameter | in the 95 % interval | rms of normalised errors | median relative error | largest | "
        "median stated uncertainty |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for name in ASKED:
        rows = np.array([result["rows"][name] for result in results])
        truth, value, error, low, high = rows.T
        inside = int(np.count_nonzero((low <= truth) & (truth <= high)))
        log = name == "c_s"
        z = np.log(value / truth) / (error / value) if log else (value - truth) / error
        if name in ("g", "gap_at_rest"):
            shown = [f"{1e6 * v:.1f} µm" for v in (np.median(np.abs(value - truth)), np.max(np.abs(value - truth)))]
            stated = f"{1e6 * np.median(error):.1f} µm"
        else:
            size = np.abs(value - truth) / np.abs(truth)
            shown = [f"{100 * v:.3f} %" for v in (np.median(size), np.max(size))]
            stated = f"{100 * np.median(error / np.abs(value)):.3f} %"
        lines.append(
            f"| {name} | {inside} of {n} | {np.sqrt(np.mean(z**2)):.2f} | {shown[0]} | {shown[1]} | {stated} |"
        )
    factor = np.median([np.exp(1.96 * r["rows"]["c_s"][2] / r["rows"]["c_s"][1]) for r in results])
    bias = [r["viscous_only_c"] / r["rows"]["c"][0] - 1 for r in results]
    dry = [r["friction"] for r in results]
    slope = float(np.dot(dry, bias) / np.dot(dry, dry))
    lines += [
        "", f"c_s is known within a factor {factor:.3f} (median, 95 %).",
        f"The viscous-only fit of Fig. 6 is off by {100 * np.median(bias):.1f} % (median; {100 * np.min(bias):.1f} to "
        f"{100 * np.max(bias):.1f} %), {100 * slope * 0.005:.1f} % per 5 mN of dry friction.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _seeds(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign, print its table, and write it."""
    parser = argparse.ArgumentParser(prog="coverage", description="Coverage of identify over virtual rigs.")
    parser.add_argument("--seeds", type=_seeds, default=list(range(40)), help="as 0-39")
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    parser.add_argument("--folder", type=Path, default=Path("out/coverage"), help="where finished seeds are kept")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args(arguments)
    text = table(campaign(options.seeds, options.folder, options.processes))
    print(text)
    if options.out is not None:
        head = "# Measured coverage\n\nPrinted by `python -m nonsmooth.identification.coverage`: synthetic rigs.\n\n"
        options.out.write_text(head + text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
