"""The virtual rig against the model, figure by figure: one page of tables.

``make rig-against-model`` writes ``docs/measured_rig_against_model.md``.

The first rig has the published parameters; the others are those of the seeds. Each is identified from its own session
first. Where a figure asks for more than rig and model agree, each feature of the rig is switched off in turn. What is
finished is kept in ``--folder`` and not computed again.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from nonsmooth.recordings import RecordingWarning
from nonsmooth.studies.savi2007.comparison.rig_tables import page
from nonsmooth.studies.savi2007.comparison.rig_trial import RigTrial

__all__ = ["campaign", "main"]

#: Features that may move a motion, and those that only touch its record.
MOTION = ("friction", "string", "ripple", "support_relaxation")
SENSORS = ("quantisation", "jitter", "noise")


def campaign(seeds: Sequence[int], folder: Path, say: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """All results, by rig: ``published`` and ``seed N``; computed where ``folder`` does not have them yet."""
    from nonsmooth.studies.savi2007.rig import VirtualRig

    rigs = {"published": VirtualRig.published(), **{f"seed {seed}": VirtualRig(seed) for seed in seeds}}
    found: dict[str, Any] = {}
    for name, rig in rigs.items():
        trial = RigTrial(rig, folder / name.replace(" ", "_"))
        keep = _Kept(name, trial, say)
        found[name] = keep.found
        keep.found["truth"] = dict(rig.truth)
        keep("identified")
        keep("response")
        if name == "published":
            keep("rises")
        flip = keep("stairs").get("1-2", {})
        off = abs(flip.get("measured_flip", float("nan")) / flip.get("theory_flip", 1.0) - 1)
        for feature in MOTION if name == "published" or not off < 0.05 else ():
            keep("stairs", feature)
        periods = keep("periods")
        missed = any(str(number) not in row["model"] for row in periods for number in row["rig"])
        for feature in MOTION if missed else ():
            keep("periods", feature)
        one = keep("attractor")
        chaotic = one["measured_period_number"] == 0 == one["theory_period_number"]
        if name == "published":
            keep("transients")
            keep("response", "friction")
        for feature in (*MOTION, *(SENSORS if name == "published" else ())):
            if chaotic and (name == "published" or one["energy_ratio"] >= 2):
                keep("attractor", feature)
            if name == "published" and feature in MOTION:
                keep("transients", feature)
    return found


class _Kept:
    """Results of one trial, each in a file of its own; computed where there is no such file."""

    def __init__(self, name: str, trial: RigTrial, say: Callable[[str], None]) -> None:
        self.name, self.trial, self.say = name, trial, say
        self.found: dict[str, Any] = {}

    def __call__(self, what: str, without: str = "") -> Any:
        """The result of this method of the trial, with a feature switched off or none."""
        key = f"{what}_without_{without}" if without else what
        file = self.trial.folder / f"{key}.json"
        if not file.is_file():
            trial = self.trial.without(without) if without else self.trial
            made = _parameters(trial) if what == "identified" else getattr(trial, what)()
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(made, indent=1), encoding="utf-8")
            self.say(f"{self.name}: {key}")
        self.found[key] = json.loads(file.read_text(encoding="utf-8"))
        return self.found[key]


def _parameters(trial: RigTrial) -> dict[str, list[float]]:
    found = trial.identified
    return {name: [float(found[name]), float(found.uncertainty[name])] for name in found}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description="The virtual rig against the model, as a page of tables.")
    parser.add_argument("--seeds", type=int, nargs="*", default=[1, 2, 3], help="rigs beside the published one")
    parser.add_argument("--out", type=Path, help="the page; without it, it is printed")
    parser.add_argument("--folder", type=Path, default=Path("out/rig_against_model"), help="where results are kept")
    options = parser.parse_args(arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        found = campaign(options.seeds, options.folder, lambda line: print(line, file=sys.stderr, flush=True))
    text = page(found)
    if options.out is None:
        print(text)
    else:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(text, encoding="utf-8")
        print(f"written to {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
