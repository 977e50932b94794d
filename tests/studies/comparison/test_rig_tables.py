"""The page of tables says what it is given, and what misses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nonsmooth.studies.savi2007.comparison.rig_against_model import main
from nonsmooth.studies.savi2007.comparison.rig_tables import page
from nonsmooth.studies.savi2007.comparison.rig_trial import RigTrial

FLIP = {"measured_flip": 0.39, "measured_flip_error": 0.002, "measured_flip_read": 0.43, "theory_flip": 0.40}
ATTRACTOR: dict[str, Any] = {
    "measured_period_number": 0.0, "theory_period_number": 0.0, "energy_distance_matched": 0.1,
    "measured_halves_median": 0.04, "measured_halves_p95": 0.05, "energy_ratio": 2.0,
}  # fmt: skip
JUMP = {"direction": "up", "measured_jump": 5.7, "theory_jump": 5.8, "jump_tolerance": 0.03}
RIG: dict[str, Any] = {
    "truth": {"friction": 0.005, "string_length": 1.0, "ripple": 0.01},
    "identified": {name: [1.0, 0.02] for name in ("m", "k", "k_s", "c", "c_s")},
    "response": {
        "jumps": [JUMP, {**JUMP, "measured_jump": np.nan}], "period_2": {"up": [3.6, 4.05], "down": [3.6, 4.0]},
    },
    "rises": {"rises": [
        {"duration": 900.0, "rise_per_turn": 5e-4, "1-2": FLIP},
        {"duration": 450.0, "rise_per_turn": 1e-3, "1-2": {**FLIP, "measured_flip": np.nan}},
    ]},
    "stairs": {"1-2": {**FLIP, "measured_flip": 0.388}},
    "periods": [{"gap": 0.0009, "referred": 0.0009, "uncertainty": 1.6e-5, "rig": [0, 0, 2], "model": {"2": 64}}],
    "attractor": ATTRACTOR,
}  # fmt: skip


def test_the_numbers_stand_on_the_page() -> None:
    found = {
        "published": {
            **RIG, "transients": [2331, 30], "transients_without_friction": [99, 31],
            "attractor_without_friction": {**ATTRACTOR, "energy_ratio": 0.7}, "stairs_without_string": {},
        },
        "seed 7": {**RIG, "attractor": {**ATTRACTOR, "measured_period_number": 3.0}},
    }  # fmt: skip
    text = page(found)
    assert "synthetic" in text.split("\n##")[0]
    assert "| published | up | 5.700 ± 0.030 | 5.800 | -1.7 % |" in text
    assert "| published | up | none | 5.800 |  |" in text
    assert "| in 900 s | 0.500 | 0.4300 | +0.0420 | 0.3900 ± 0.0020 | 0.4000 |" in text
    assert "| in 450 s | 1.000 | 0.4300 | +0.0420 | too fast | 0.4000 |" in text
    assert "| published | 0.388 ± 0.003 | 0.4000 | -3.0 % |" in text
    assert "| published, without string | none | none |  |" in text
    assert "| published | 0.900 ± 0.016 | 0, 0, 2 | 2 (100 %) | 1 of 3 |" in text
    assert "| without dry friction | 99, 31 |" in text
    assert "| published, without dry friction | 0.0 | 0.100 | 0.040 | 0.050 | 0.70 |" in text
    assert "| seed 7 | 5.0 | rig: period 3, model: none | | | |" in text


def test_the_campaign_asks_what_a_miss_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Features are switched off for the published rig, and where the ratio misses; what is kept is not made again."""
    made: list[tuple[str, str]] = []
    distances = {"published": 1.2, "seed_3": 2.5, "seed_4": 1.0}

    def one(name: str) -> Any:
        def result(trial: RigTrial) -> Any:
            made.append((name, trial.folder.relative_to(tmp_path).as_posix()))
            if name == "periods" and trial.folder.name == "seed_4":
                return [{**RIG["periods"][0], "rig": [2, 2, 2]}]
            kept = RIG.get(name, [10, 20])
            return (
                {**ATTRACTOR, "energy_ratio": distances[trial.folder.parts[-1]]}
                if (name == "attractor" and trial.folder.parts[-1] in distances)
                else kept
            )

        return result

    for name in ("response", "rises", "stairs", "periods", "transients", "attractor"):
        monkeypatch.setattr(RigTrial, name, one(name))
    monkeypatch.setattr(RigTrial, "identified", SimpleParameters())
    monkeypatch.setattr(RigTrial, "reading", (0.0, 0.0))
    out = tmp_path / "page.md"
    arguments = ["--seeds", "3", "4", "--folder", str(tmp_path), "--out", str(out)]
    assert main(arguments) == 0
    first = out.read_text(encoding="utf-8")
    assert ("attractor", "seed_3/without_friction") in made and ("periods", "seed_3/without_string") in made
    assert not [place for _, place in made if place.startswith("seed_4/")]
    assert ("stairs", "published/without_string") in made and ("stairs", "seed_3") in made
    assert ("rises", "seed_3") not in made
    assert ("attractor", "published/without_jitter") in made and ("stairs", "published/without_jitter") not in made
    count = len(made)
    assert main(arguments) == 0
    assert len(made) == count and out.read_text(encoding="utf-8") == first


class SimpleParameters(dict):
    """One parameter set, for all rigs."""

    def __init__(self) -> None:
        super().__init__(dict.fromkeys(("m", "k", "k_s", "c", "c_s"), 1.0))
        self.uncertainty = dict.fromkeys(self, 0.02)
