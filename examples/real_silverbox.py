"""The Silverbox, an electronic oscillator with a cubic spring, from its recorded input to a prediction.

The benchmark of nonlinear system identification (T. Wigren and J. Schoukens, Three free data sets for development and
benchmarking in nonlinear system identification, ECC 2013; nonlinearbenchmark.org): voltages V1 (input) and V2 (output)
at 610.35 Hz. The first 40 000 samples, whose size grows, are the test; 3000 samples of a multisine behind them are
fitted. The generator's voltage is band-limited, so it is drawn eight times finer before it is taken for linear between
samples. The environment variable NONSMOOTH_DATA names the folder with ``silverbox_SNLS80mV.csv.gz``.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import resample_poly

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS = "silverbox_SNLS80mV.csv.gz"
RATE, FINER, TEST = 610.35, 8, 40_000
FIRST = 40_700
MARGIN = 20  # samples of the input on each side of those that are fitted: nobody knows yet how late it is


def measured() -> np.ndarray:
    """Input and output, or a sentence that says what is lacking."""
    file = Path(os.environ.get("NONSMOOTH_DATA", "")) / NEEDS
    if not file.is_file():
        raise SystemExit(f"this example reads {NEEDS}; set NONSMOOTH_DATA to a folder that holds it (source: above)")
    return np.genfromtxt(file, delimiter=",", skip_header=1, usecols=(0, 1))


def oscillator() -> ns.System:
    """V2'' + d V2' + a V2 + q V2^2 + b V2^3 = g V1 + offset."""

    def field(t: Any, u: Any, p: Any) -> list[Any]:
        return [u.w, p.g * p.V1 + p.offset - p.d * u.w - p.a * u.V2 - p.q * u.V2**2 - p.b * u.V2**3]

    return ns.System(
        states={"V2": "V", "w": "V/s"},
        inputs={"V1": "V"},
        modes={"box": field},
        parameters={"d": 20.0, "a": 1.7e5, "b": 5e5, "g": 1e5, "q": 0.0, "offset": 0.0, "late": 0.0},
        scale={"V2": 0.1, "w": 40.0, "V1": 0.1, "V1_rate": 40.0},
    )


def finer(V1: np.ndarray, begin: int, end: int) -> ns.Input:
    """The voltage from one sample to another, drawn finer."""
    some = np.arange(FINER * begin, FINER * end)
    return ns.Input(some / (FINER * RATE), resample_poly(V1, FINER, 1)[some], delay="late")


def main(samples: int = 3000) -> Figure:
    """Fit 3000 samples, predict the 40 000 of the test."""
    import matplotlib.pyplot as plt

    V1, V2 = measured().T
    fitted = slice(FIRST, FIRST + samples)
    t = np.arange(len(V1)) / RATE
    system = oscillator()
    found = ns.fit(
        system,
        {"V2": (t[fitted], V2[fitted])},
        list(system.values),
        measured=["V2"],
        inputs={"V1": finer(V1, FIRST - MARGIN, FIRST + samples + MARGIN)},
        progress=False,
    )
    print(found)
    drive = {"V1": finer(V1, 0, TEST + MARGIN)}
    run = ns.simulate(
        system.with_parameters(found), duration=t[TEST], samples=t[:TEST], inputs=drive, start={"V2": V2[0]}
    )
    predicted = run.u.sel(state="V2").values[np.searchsorted(run.time.values, t[:TEST], side="right") - 1]
    error = predicted - V2[:TEST]
    rms = np.sqrt(np.mean(error**2))
    print(f"test: {1e3 * np.std(V2[:TEST]):.1f} mV, error {1e3 * rms:.2f} mV")

    with ns.plot.journal():
        figure, (above, below) = plt.subplots(2, 1, figsize=(ns.plot.COLUMN, ns.plot.COLUMN), sharex=True)
        above.plot(t[:TEST], 1e3 * V2[:TEST], lw=0.3, color="0.4")
        below.plot(t[:TEST], 1e3 * error, lw=0.3, color=ns.plot.COLORS["second"])
        above.set_ylabel("measured $V_2$ (mV)")
        below.set(xlabel="$t$ (s)", ylabel="predicted less measured (mV)")

    assert rms < 5e-4  # good models of the benchmark stay below 1 mV, a linear one leaves 13 mV
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "real_silverbox.pdf")
