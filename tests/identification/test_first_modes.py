"""The mode in which a record begins is found: a relay with hysteresis, a friction damper behind a play."""

import numpy as np
import pytest
from tests.identification import mode_cases as cases

import nonsmooth as ns

pytestmark = pytest.mark.physics

FIND = list(cases.RELAY)


def relay_run(mode, seed, duration=30.0):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration, 0.1)
    x = cases.relay_record(cases.RELAY, 0.3 * rng.uniform(-1, 1), 0.2 * rng.uniform(-1, 1), mode, t)
    return {"x": (t, x + 0.01 * x.std() * rng.standard_normal(len(t)))}


def guess(system, truth, seed):
    signs = np.random.default_rng(seed + 50).choice([-1.0, 1.0], len(truth))
    return system.with_parameters({k: v * (1 + 0.2 * s) for (k, v), s in zip(truth.items(), signs, strict=True)})


def far(found, truth):
    return np.array([(found[k] - truth[k]) / found.uncertainty[k] for k in truth if k in found.uncertainty])


def beginning(found):
    """The notes on first modes."""
    return [note for note in found.notes if "begins in mode" in note]


SLOW = [pytest.param(*case, marks=pytest.mark.slow) for case in zip(["down", "up"] * 3, [0, 1, 1, 2, 2], strict=False)]


@pytest.mark.parametrize(("mode", "seed"), [("up", 0), *SLOW])
def test_a_relay_with_hysteresis_begins_in_either_mode(mode, seed):
    system = guess(cases.relay(), cases.RELAY, seed)
    found = ns.fit(system, relay_run(mode, seed), FIND, progress=False)
    assert not found.anomalies and np.abs(far(found, cases.RELAY)).max() < 3.5
    assert len(beginning(found)) == 1 and f"mode '{mode}'" in beginning(found)[0]


def test_runs_begin_in_modes_of_their_own():
    runs = [relay_run(mode, seed, 15.0) for seed, mode in enumerate(["down", "up"])]
    found = ns.fit(guess(cases.relay(), cases.RELAY, 1), runs, FIND, tries=1, progress=False)
    assert [note.split("'")[1] for note in beginning(found)] == ["down", "up"]
    assert not found.anomalies and np.abs(far(found, cases.RELAY)).max() < 3.5


def test_a_mode_that_is_given_is_kept():
    system = guess(cases.relay(), cases.RELAY, 0)
    right = ns.fit(system, relay_run("down", 0, 15.0), FIND, mode="down", tries=1, progress=False)
    assert not beginning(right) and np.abs(far(right, cases.RELAY)).max() < 3.5
    wrong = ns.fit(system, relay_run("down", 0, 15.0), FIND, mode={"run": "up"}, tries=1, progress=False)
    assert wrong.anomalies  # it does not describe the record, and is not put right in silence


def test_modes_and_runs_that_are_none_are_answered():
    run = relay_run("up", 0)
    with pytest.raises(ValueError, match="nearest: down"):
        ns.fit(cases.relay(), run, FIND, mode="dwn", progress=False)
    with pytest.raises(ValueError, match="'run'|run"):
        ns.fit(cases.relay(), run, FIND, mode={"first": "up"}, progress=False)
    with pytest.raises(TypeError, match="mapping of run"):
        ns.fit(cases.relay(), run, FIND, mode=["up"], progress=False)


@pytest.mark.parametrize("mode", ["right", "left", "apart"])
def test_a_friction_damper_behind_a_play(mode):
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 40.0, 0.1)
    x, v = 0.3 * rng.uniform(-1, 1), 0.25 * (1 if mode == "right" else -1)
    y = {"right": x - 0.2, "left": x + 0.2, "apart": x + 0.05}[mode]
    clean = cases.damper_record(cases.DAMPER, x, v, y, mode, t)
    data = {"x": (t, clean + 0.01 * clean.std() * rng.standard_normal(len(t)))}
    truth = {name: cases.DAMPER[name] for name in ("k", "c", "f", "g")}
    found = ns.fit(guess(cases.damper(), truth, 0), data, list(truth), progress=False)
    assert not found.anomalies and np.abs(far(found, truth)).max() < 3.5
    assert np.all(np.abs([found[k] / truth[k] - 1 for k in truth]) < 0.1)  # the guess was 20 % off
