"""`make bench`: peers side by side in one process, one core, the same work; writes `benchmarks/results.md`.

The figures to be met are those of the project's first milestone; the table says of each whether it was. `--quick`
marches a tenth as far (to see that it runs, not to be quoted).
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

# One core each: no peer may spread out. Set before anything numeric is imported.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).parent))

import branch
import chain
import chart
import chart_size
import diagram
import friction
import lyapunov
import lyapunov_nonlinear
import machine
import oscillator
import patterns
import rigid_stops
import valve
import valve_scan


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the work")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("results.md"))
    options = parser.parse_args()
    effort = 0.1 if options.quick else 1.0
    text, verdicts = ["# Benchmarks", "", *(f"- {fact}" for fact in machine.facts() if fact), ""], []
    parts = (
        oscillator,
        chain,
        rigid_stops,
        patterns,
        friction,
        valve,
        valve_scan,
        diagram,
        chart,
        chart_size,
        lyapunov,
        lyapunov_nonlinear,
        branch,
    )
    for part in parts:
        lines, part_verdicts = part.run(effort)
        print("\n".join(lines), flush=True)
        text += lines
        verdicts += part_verdicts
    summary = ["## Against the figures to be met", "", "| what | to be met | measured | met |", "|---|---|---|---|"]
    summary += [
        f"| {what} | {target} | {found} | {'yes' if met else '**no**'} |" for what, target, found, met in verdicts
    ]
    print("\n".join(summary))
    options.out.write_text("\n".join([*text, *summary, ""]), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
