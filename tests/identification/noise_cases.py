"""Records with coloured noise, outliers and sensors that end: motions by SciPy (``fit_cases``, ``mode_cases``)."""

import numpy as np
from tests.identification import mode_cases
from tests.identification.fit_cases import CASES

import nonsmooth as ns
from nonsmooth.errors import SystemDefinitionError

KINDS = ("white", "AR .5", "AR .9", "outliers", "clipped")
SYSTEMS = ("relay", "friction damper", "backlash", "belt")
LEVEL = 0.01  # of the noise, over the standard deviation of the motion
#: Systems with the parameters that are found and the one whose term the model lacks.
LACKING = {
    "Duffing with a stop": (["a", "c", "g", "e"], "b"),
    "impact oscillator": (["k", "d", "e"], "c"),
    "gear pair": (["F_a", "b", "zeta"], "F_m"),
    "bilinear oscillator": (["A", "g", "zeta"], "beta"),
    "dry friction": (["f_k", "f_s"], "zeta"),
}


def autoregressive(n, rho, rng):
    """Noise of standard deviation 1 whose neighbours correlate by rho."""
    e = rng.standard_normal(n)
    for k in range(1, n):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return e


def motion(name, rng, seed):
    """System, truth, what is to be found, instants, motion and the name of what is measured."""
    if name == "relay":
        t, truth = np.arange(0, 40, 0.1), mode_cases.RELAY
        start = 0.3 * rng.uniform(-1, 1), 0.2 * rng.uniform(-1, 1), ("up", "down")[seed % 2]
        return mode_cases.relay(), truth, list(truth), t, mode_cases.relay_record(truth, *start, t), "x"
    if name == "friction damper":
        t, truth = np.arange(0, 60, 0.1), mode_cases.DAMPER
        mode, x = ("right", "left", "apart")[seed % 3], 0.3 * rng.uniform(-1, 1)
        v = 0.3 * rng.uniform(0.3, 1) * (1 if mode == "right" else -1)
        y = {"right": x - truth["g"], "left": x + truth["g"], "apart": x + 0.1 * rng.uniform(-1, 1)}[mode]
        clean = mode_cases.damper_record(truth, x, v, y, mode, t)
        return mode_cases.damper(), truth, ["k", "c", "f", "g"], t, clean, "x"
    case = CASES[{"backlash": "gear pair", "belt": "stick-slip belt"}.get(name, name)]
    t = np.linspace(0, case.duration, 600)
    clean = case.motion(case.truth, case.start(rng), t)[:, 0]
    return case.system(), case.truth, case.find, t, clean, next(iter(case.measured))


def readings(kind, clean, rng):
    """Readings, options of the sensor and of the fit, and the places of outliers."""
    size, n = LEVEL * clean.std(), len(clean)
    if kind == "clipped":
        high = float(np.quantile(clean, 0.9))
        return np.minimum(clean + size * rng.standard_normal(n), high), {"range": (-np.inf, high)}, {}, []
    rho = float(kind[3:]) if kind.startswith("AR") else 0.0
    y, out = clean + size * autoregressive(n, rho, rng), []
    if kind == "outliers":
        out = np.flatnonzero(rng.random(n) < 0.01)
        y[out] += size * rng.choice([-1, 1], len(out)) * rng.uniform(8, 40, len(out))
    return y, {}, {"loss": "huber"} if kind == "outliers" else {}, out


def off(system, truth, find, rng, by=0.2, **values):
    """The system with the parameters to be found off by 20 % either way."""
    while True:
        far = {name: truth[name] * (1 + by * rng.choice([-1, 1])) for name in find}
        try:
            return system.with_parameters({**truth, **far, **values})
        except SystemDefinitionError:  # static friction below the kinetic one
            continue


def fitted(name, kind, seed):
    """The fit, and its normalised errors."""
    rng = np.random.default_rng(seed)
    system, truth, find, t, clean, quantity = motion(name, rng, seed)
    y, of_sensor, options, _ = readings(kind, clean, rng)
    found = ns.fit(
        off(system, truth, find, rng),
        {quantity: (t, y)},
        find,
        progress=False,
        measured={quantity: ns.Sensor(quantity, **of_sensor)},
        **options,
    )
    return found, np.array([(found[k] - truth[k]) / found.uncertainty[k] for k in find])


def lacking(name, kind, seed=0, tries=3):
    """The fit of a model that lacks a term, and the term's effect on the motion, in noise deviations."""
    find, term = LACKING[name]
    rng = np.random.default_rng(seed)
    system, truth, _, t, clean, quantity = motion(name, rng, seed)
    y, _, _, _ = readings(kind, clean, rng)
    case = CASES[name]
    without = case.motion({**truth, term: 0.0}, case.start(np.random.default_rng(seed)), t)[:, 0]
    effect = np.abs(without - clean).max() / (LEVEL * clean.std())
    system = off(system, truth, find, rng, **{term: 0.0})
    return ns.fit(system, {quantity: (t, y)}, find, tries=tries, progress=False), effect
