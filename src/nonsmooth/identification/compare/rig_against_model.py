"""The virtual rig against the model, figure by figure: one page of tables.

``python -m nonsmooth.identification.compare.rig_against_model --seeds 1 2 3 --out docs/measured_rig_against_model.md``

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

from nonsmooth.experiment.recording import RecordingWarning
from nonsmooth.identification.compare.rig_tables import page
from nonsmooth.identification.compare.rig_trial import RigTrial

__all__ = ["campaign", "main"]

#: Features that may move a motion, and those that only touch its record.
MOTION = ("friction", "string", "ripple", "support_relaxation")
SENSORS = ("quantisation", "jitter", "noise")


def campaign(seeds: Sequence[int], folder: Path, say: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """All results, by rig: ``published`` and ``seed N``; computed where ``folder`` does not have them yet."""
    from nonsmooth.experiment.rig import VirtualRig

    rigs = {"published": VirtualRig.published(), **{f"seed {seed}": VirtualRig(seed) for seed in seeds}}
    found: dict[str, Any] = {}
    for name, rig in rigs.items():
        trial = RigTrial(rig, folder / name.replace(" ", "_"))
        full = name == "published"
        one = found[name] = {"truth": dict(rig.truth)}

        def kept(
            key: str, make: Callable[[], Any], one: dict[str, Any] = one, trial: RigTrial = trial, name: str = name
        ) -> Any:
            file = trial.folder / f"{key}.json"
            if not file.is_file():
                made = make()
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(json.dumps(made, indent=1), encoding="utf-8")
                say(f"{name}: {key}")
            one[key] = json.loads(file.read_text(encoding="utf-8"))
            return one[key]

        kept("identified", lambda trial=trial: _parameters(trial))
        kept("response", trial.response)
        if full:
            kept("rises", trial.rises)
        kept("stairs", trial.stairs)
        kept("periods", trial.periods)
        attractor = kept("attractor", trial.attractor)
        chaotic = attractor["measured_period_number"] == 0 == attractor["theory_period_number"]
        for feature in (*MOTION, *(SENSORS if full else ())):
            if chaotic and (full or attractor["energy_ratio"] >= 2):
                kept(f"attractor_without_{feature}", lambda f=feature, t=trial: t.without(f).attractor())
            if full and feature in MOTION:
                kept(f"stairs_without_{feature}", lambda f=feature, t=trial: t.without(f).stairs())
                kept(f"transients_without_{feature}", lambda f=feature, t=trial: t.without(f).transients())
        if full:
            kept("transients", trial.transients)
            kept("response_without_friction", lambda t=trial: t.without("friction").response())
    return found


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
