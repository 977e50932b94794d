"""The smoothed switch: its regions beside those of the sharp one (Fig. 2), and the effect of eta (claim M4).

The error over the width of its band, and where it grazes.
"""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from scipy.optimize import bisect

from nonsmooth import System, plot, poincare, simulate
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.flows import ETA, EXACT, SMOOTHED, Settings
from nonsmooth_savi2007.laboratory import as_result
from nonsmooth_savi2007.measure import grazing_frequencies, steady_state
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_11, FIGURE_13

ORBITS = {
    r"Fig. 9, $\omega = 4.8$ rad/s": {**FIGURE_9, "omega": 4.8},
    r"Fig. 11, $\rho = 0.45$ N": {**FIGURE_11, "rho": 0.45},
    "Fig. 13, $g = 0.9$ mm": {**FIGURE_13, "g": 0.0009},
}
PERIODS = 4
_AXIS, _PAPERS = "half width of the band, $\\eta$ (\N{MICRO SIGN}m)", "the paper's $\\eta$, 10 \N{MICRO SIGN}m"
ETAS = np.array([1e-6, 3e-6, 1e-5, 3e-5, 1e-4])
FITTED = (9e-7, 3.1e-5)  # etas of the fitted order: between rounding of the method and bands as wide as the contact
FINE = 1e-11  # rtol at which the error is that of the smoothing alone
NARROW = 1e-7  # rad/s, to which a grazing frequency is bisected


def general_form(system: System) -> System:
    """The same oscillator without the paper's own fields in the bands: ``smoothed`` then interpolates the fields."""
    content = json.loads(system.to_text())
    return System.from_text(json.dumps({key: value for key, value in content.items() if key != "bands"}))


def _errors(settings: Settings) -> xr.Dataset:
    """Distance to the exact flow after four periods on the attractor, in units of 1 mm and 1 cm/s."""
    etas = ETAS[1:-1] if settings.quick else ETAS
    error = np.full((3, len(ORBITS), len(etas)), np.nan)
    slowest = np.full(len(ORBITS), np.nan)
    for i, parameters in enumerate(ORBITS.values()):
        sharp = EXACT.system(**parameters)
        begin = poincare(sharp, n=1, transient=500, **EXACT.options)["section"].values[-1]
        truth = simulate(sharp, periods=PERIODS, start=begin, samples=2, **EXACT.options)
        slowest[i] = np.abs(truth["u_before"].sel(state="v").values).min()
        for j, eta in enumerate(etas):
            forms = ((sharp, FINE), (sharp, SMOOTHED.options["rtol"]), (general_form(sharp), FINE))
            for k, (model, rtol) in enumerate(forms):
                model = model.smoothed(eta)
                run = simulate(model, periods=PERIODS, start=begin, samples=2, method="rkf45", rtol=rtol)
                difference = (run["u"].values[-1] - truth["u"].values[-1]) / sharp.scale_vector()
                error[k, i, j] = np.linalg.norm(difference)
    found = xr.Dataset(
        {
            "error": (("form", "orbit", "eta"), error, {"long_name": "distance to the exact flow, 1 mm and 1 cm/s"}),
            "slowest_contact": ("orbit", slowest, {"long_name": "least speed at a transition", "units": "m/s"}),
        },
        {"form": ["paper", "paper, coarse", "general"], "orbit": list(ORBITS), "eta": ("eta", etas, {"units": "m"})},
    )
    return as_result(found, f"error after {PERIODS} periods at rtol {FINE:g}", "simulate", synthetic=False)


def _grazing(settings: Settings) -> xr.Dataset:
    """Upper frequency of Fig. 9 at which the motion without contact first meets the band; at eta 0, the support."""
    etas = np.concatenate([[0.0], ETAS[2:3] if settings.quick else ETAS])
    found = np.array([_first_meeting(eta) for eta in etas])
    made = xr.Dataset(
        {
            "grazing": ("eta", found, {"long_name": "grazing frequency, bisected", "units": "rad/s"}),
            "closed_form": (
                "eta",
                _closed(etas),
                {"long_name": "grazing frequency of the gap g - eta", "units": "rad/s"},
            ),
        },
        {"eta": ("eta", etas, {"units": "m"})},
    )
    return as_result(made, f"grazing, bisected to {NARROW:g} rad/s", "simulate", synthetic=False)


def _closed(etas: np.ndarray) -> np.ndarray:
    """The same in closed form: upper grazing frequencies of the gaps g - eta."""
    sharp = EXACT.system(**FIGURE_9).values
    return np.array([grazing_frequencies({**sharp, "g": FIGURE_9["g"] - eta})[-1] for eta in etas])


def _first_meeting(eta: float) -> float:
    """Frequency, from 5.1 to 5.3, at which the steady motion without contact first meets something within a period."""
    model = EXACT.system(**FIGURE_9)
    options = {"method": "rkf45", "rtol": FINE} if eta else EXACT.options

    def meets(omega: float) -> float:
        at = model.with_parameters(omega=omega)
        system = at.smoothed(eta) if eta else at
        run = simulate(system, periods=1, start=steady_state(at.values), samples=2, **options)
        return 0.5 - bool(run.sizes["crossing"])

    return bisect(meets, 5.1, 5.3, xtol=NARROW)  # contact at the first, none at the second


def order_in_eta(errors: xr.Dataset, form: str) -> np.ndarray:
    """Slope of log error over log eta, for each orbit."""
    chosen = errors.sel(eta=slice(*FITTED))
    return np.array(
        [np.polyfit(np.log(chosen["eta"]), np.log(row), 1)[0] for row in chosen["error"].sel(form=form).values]
    )


def _draw_regions(canvas: Canvas, data: Datasets) -> None:
    left, right = canvas.subplots(1, 2)
    for ax, flow in ((left, EXACT), (right, SMOOTHED)):
        plot.regions(flow.system(g=0.0), ax, xlim=(-5 * ETA, 5 * ETA), ylim=(-0.12, 0.12))
        ax.set_xlabel(ax.get_xlabel().replace("$x$", "$x - g$"))
    left.set_title("(a) non-smooth system, Eqs. 4-5")
    right.set_title(r"(b) smoothed system, $\eta = 10$ µm, Eqs. 9-10")


_ABOUT_REGIONS = (
    "Regions of the state plane with Table 1's support, near x = g: (a) without contact (white) and in contact "
    "(blue), parted by the surfaces S_a (x = g) and S_b (the support's force vanishes); (b) the bands of half "
    "width eta of the smoothed system in their place. Drawn from the system's own conditions."
)


def _draw(canvas: Canvas, data: Datasets) -> None:
    errors, grazing = data["error"], data["grazing"]
    left, right = canvas.subplots(1, 2)
    eta = 1e6 * errors["eta"].values  # in micrometres, as the axes
    for name, orbit in zip(("first", "second", "third"), errors["orbit"].values, strict=True):
        one, color = errors["error"].sel(orbit=orbit), plot.COLORS[name]
        left.loglog(eta, one.sel(form="paper"), "o-", color=color, label=str(orbit), markersize=3.5)
        left.loglog(eta, one.sel(form="paper, coarse"), "s", color=color, markerfacecolor="none", markersize=6)
        left.loglog(eta, one.sel(form="general"), ":", color=color)
    guide = 4 * float(errors["error"].sel(form="paper").max())
    left.loglog(eta, guide * (eta / eta.max()) ** 2, color=plot.COLORS["muted"], linewidth=0.8, label=r"$\eta^2$")
    left.plot(
        [], [], "s", label="rtol $10^{-6}$, as in the figures", color="black", markerfacecolor="none", markersize=6
    )
    left.plot([], [], ":", color="black", label="general form")
    left.set(
        title="(a) error of the smoothed switch after 4 periods",
        ylabel=r"$[(\Delta x / 1\,\mathrm{mm})^2 + (\Delta v / 10\,\mathrm{mm/s})^2]^{1/2}$",
    )
    base, met = float(grazing["closed_form"][0]), grazing.isel(eta=slice(1, None))  # without eta = 0
    widths = met["eta"].values
    fine = np.geomspace(widths.min() / 2, widths.max() * 2, 50)
    right.loglog(1e6 * fine, _closed(fine) - base, color=plot.COLORS["third"], label=r"closed form, gap $g - \eta$")
    right.loglog(
        1e6 * widths,
        met["grazing"].values - base,
        "o",
        color=plot.COLORS["first"],
        label="smoothed model, bisected",
    )
    right.set(
        ylabel="shift of the grazing frequency (rad/s)",
        title="(b) grazing of Fig. 9, falling frequency",
    )
    for ax in (left, right):
        ax.axvline(1e6 * ETA, color="black", linewidth=0.6, linestyle="--", zorder=0, label=_PAPERS)
        ax.set_xlabel(_AXIS)
        ax.xaxis.set_major_formatter("{x:g}")
    plot.shared_legend(canvas, columns=4)


def _caption(data: Datasets) -> str:
    errors = data["error"]
    orders = ", ".join(f"{order:.3f}" for order in order_in_eta(errors, "paper"))
    speed = float(errors["slowest_contact"].min())
    return (
        "Effect of the band's half width eta. (a) Error of the smoothed switch against the exact flow after "
        f"{PERIODS} periods on three orbits whose slowest transition has {speed:.3f} m/s: filled, RKF45 at rtol 1e-11 "
        f"(fitted orders {orders}); squares, rtol 1e-6 as in the figures (the paper names no tolerance); dotted, the "
        "fields interpolated in place of the paper's Eq. 8. (b) Grazing frequency of the smoothed model: it is that "
        f"of a gap g - eta. Exact flow, bisected: {float(data['grazing']['grazing'][0]):.6f} rad/s, closed form "
        f"{float(data['grazing']['closed_form'][0]):.6f} rad/s."
    )


FIGURES = (
    Figure(
        "fig02", 2, "Regions and surfaces", lambda settings: {}, _draw_regions, lambda data: _ABOUT_REGIONS, (1.0, 0.42)
    ),
    Figure(
        "eta",
        None,
        "The choice of eta",
        lambda settings: {"error": _errors(settings), "grazing": _grazing(settings)},
        _draw,
        _caption,
        (1.0, 0.52),
    ),
)
