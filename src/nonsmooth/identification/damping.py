r"""Damping from the steady response over frequency, by maximum amplitude as in Fig. 6, with and without dry friction.

Dry friction :math:`F_C` takes per cycle what a viscous damper :math:`4 F_C/(\pi \omega A)` would take. A viscous fit
adds it to c: at resonance, with 36 mm, 5 mN look like 0.04 N s/m (4.5 % of 0.87), and off resonance, where A is
smaller, like more: 5 to 6 % over the range of Fig. 6 at 0.14 N, and in inverse proportion to the forcing. So the fit of
Fig. 6 gives an equivalent c, not the damper's. The fit with friction balances the first harmonic only: 0.25 % of the
amplitude at 0.7 of the natural frequency with 10 mN, less above.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.experiment.signals.harmonics import fit as harmonic_fit
from nonsmooth.experiment.signals.phase import drive_phase
from nonsmooth.identification.evidence import Run
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.free_decay import DecayFit
from nonsmooth.identification.gap import grazing_amplitude

__all__ = ["amplitude_fit", "steady_amplitude"]

FloatArray = NDArray[np.float64]


def steady_amplitude(run: Run) -> tuple[float, float, float]:
    """Frequency (rad/s), amplitude of the fundamental (m) and its standard uncertainty of a steady run."""
    drive = drive_phase(run.passages)
    fitted = harmonic_fit(run.time, run.positions, drive.omega, 3)
    return drive.omega, float(fitted.amplitudes[0]), float(fitted.amplitude_errors[0])


def amplitude_fit(runs: Sequence[Run], decay: DecayFit, mass: float) -> list[Finding]:
    r"""Fit c to the amplitudes over frequency: viscous only (the paper's way), and with dry friction.

    Parameters
    ----------
    runs : sequence of Run
        Frequency steps without support.
    decay : DecayFit
        Gives :math:`\omega_0`, the start of the fit and, for the picture, nothing else: c and friction are fitted here.
    mass : float
        Mass (kg).

    Returns
    -------
    list of Finding
        ``c_viscous_only`` and ``c_response``; empty where there are fewer than five runs.
    """
    if len(runs) < 5:
        return []
    import xarray as xr
    from lmfit import Minimizer, Parameters

    omega, amplitude, error = np.array([steady_amplitude(run) for run in runs]).T
    crank = np.array([float(run.settings["crank_length"]) for run in runs])
    natural = float(decay.values[0])
    # transients, steps of the encoder, the harmonic balance itself: some tenths of a percent of the amplitude
    spread = np.hypot(error, 3e-3 * amplitude)

    def predicted(b: float, f: float, at: Any, a: Any) -> FloatArray:
        rows = [grazing_amplitude(float(w), natural, b, f, float(length)) for w, length in zip(at, a, strict=True)]
        return np.array(rows)

    fits = {}
    for friction in (False, True):
        parameters = Parameters()
        parameters.add("b", value=float(decay.values[1]), min=1e-6)
        parameters.add("f", value=float(max(decay.values[2], 1e-4)) if friction else 0.0, vary=friction)

        def residual(p: Any) -> FloatArray:
            return (predicted(p["b"].value, p["f"].value, omega, crank) - amplitude) / spread

        fits[friction] = Minimizer(residual, parameters, scale_covar=True).minimize()
    viscous, both = fits[False].params, fits[True].params

    def scaled(row: Any) -> tuple[float, float]:
        return mass * row.value, mass * float(row.stderr if row.stderr is not None else np.inf)

    c_viscous, c_both, dry = scaled(viscous["b"]), scaled(both["b"]), scaled(both["f"])
    shown = crank == np.unique(crank)[0]
    fine = np.linspace(omega[shown].min(), omega[shown].max(), 300)
    directions = [str(run.settings.get("direction", "up")) for run, use in zip(runs, shown, strict=True) if use]
    lengths = np.full(300, crank[shown][0])
    data = xr.Dataset(
        {
            "omega": ("run", omega[shown], {"units": "rad/s"}), "amplitude": ("run", amplitude[shown], {"units": "m"}),
            "amplitude_error": ("run", error[shown], {"units": "m"}),
            "direction": ("run", directions),
            "joint_amplitude": ("omega_fine", predicted(both["b"].value, both["f"].value, fine, lengths)),
            "viscous_amplitude": ("omega_fine", predicted(viscous["b"].value, 0.0, fine, lengths)),
            "c_joint": ((), c_both[0], {"units": "N s/m"}), "c_joint_error": ((), c_both[1], {"units": "N s/m"}),
            "friction_joint": ((), dry[0], {"units": "N"}),
            "c_viscous": ((), c_viscous[0], {"units": "N s/m"}),
            "c_viscous_error": ((), c_viscous[1], {"units": "N s/m"}),
        },
        {"omega_fine": ("omega_fine", fine, {"units": "rad/s"})},
        {"synthetic": "yes" if any(run.synthetic for run in runs) else "no"},
    )  # fmt: skip
    true = mass * float(decay.values[1])
    names, n = tuple(run.name for run in runs), int(sum(len(run.time) for run in runs))
    bias = 100 * (c_viscous[0] / true - 1)
    return [
        Finding(
            "c_viscous_only", Estimate(*c_viscous, "N s/m"), "maximum amplitude over frequency, viscous only (Fig. 6)",
            n, names,
            (
                f"an equivalent, not the damper's c: dry friction of {1e3 * mass * decay.values[2]:.1f} mN adds "
                f"4 F_C/(pi omega A) to it; {bias:+.1f} % against the free decay",
            ),
            data=data, plot="amplitude_fit",
        ),
        Finding(
            "c_response", Estimate(*c_both, "N s/m"),
            "amplitude over frequency, viscous damping and dry friction in first harmonic", n, names,
            others={"friction": Estimate(*dry, "N")}, data=data, plot="amplitude_fit",
        ),
    ]  # fmt: skip
