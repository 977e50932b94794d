"""Claims R1, R2 and P1 to P8: the apparatus and the parameters, as the virtual rig and identification give them.

The rig was given the paper's values. Where it agrees, the procedure finds what was put in; where it does not, the
procedure as the paper describes it has a bias.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nonsmooth.identification import Estimate, Finding
from nonsmooth_savi2007.claims.verdicts import (
    Cell,
    Data,
    Statement,
    Uncertain,
    Verdict,
    against_printed,
    agreed,
    printed_cell,
)
from nonsmooth_savi2007.figures.parameters import table_rows
from nonsmooth_savi2007.laboratory import found_in
from nonsmooth_savi2007.measure import Interval
from nonsmooth_savi2007.printed import NATURAL_FREQUENCY, NUMBERS, TABLE_1, TEST_MASS, Printed

_NO_MODEL = "not in the model"
_GIVEN = "a parameter"
_SAME = "as exact: no contact in this"
_LEAST_LINE = 1e-2  # of the range: a straight line leaves less


def _row(place: str, says: str, cell: Cell, why: str = "", model: str = _NO_MODEL) -> Statement:
    """A row to which the model has nothing to say."""
    return Statement(place, says, model, model, "see rig", Verdict.NOT_ASKED, why).measured(cell)


def _closed(says: str, printed: Printed, model: float, cell: Cell, why: str = "") -> Statement:
    """A printed number beside a closed form of the model with Table 1, and beside the rig."""
    row = against_printed(says, printed, [Interval(model, model), None], why)
    text = f"{model:.4g} {printed.unit}".rstrip()
    difference = f"closed form {row.exact_beside}"
    return replace(row, exact=f"{text} (closed form)", smoothed=_SAME, difference=difference).measured(cell)


def _back(printed: Printed, found: Uncertain, note: str = "") -> Cell:
    """Identified value of a number that the rig was given, or that follows from such."""
    return printed_cell(printed, found, note, put_in=True)


def _built(good: bool) -> Verdict:
    """The verdict on a property that the rig was built with."""
    return Verdict.INPUT if good else Verdict.DIFFERS


def r1(data: Data) -> Iterator[Statement]:
    """The apparatus of Fig. 3."""
    seen = data["table1"]["sensors"]
    step, turning, volts = (float(seen[name]) for name in ("angle_step", "turning", "volts_high"))
    good = abs(step - 0.25) < 1e-6 and turning < 30 and volts <= 12
    yield _row(
        "Fig. 3",
        "car, two springs and strings, motor 0-12 V with crank, magnetic damper, support, rotary "
        "sensor: 0.25 degrees, up to 30 rev/s",
        Cell(
            f"built so: steps of {step:g} degrees in its files, at most {turning:.1f} rev/s, up to {volts:g} V",
            _built(good),
        ),
        "By construction. Beyond the model it has strings of finite length that cannot push, an uneven motor, dry "
        "friction, a support that takes time to come back, and the errors of its sensors.",
    )


def r2(data: Data) -> Iterator[Statement]:
    """Rate and force sensor."""
    seen = data["table1"]["sensors"]
    rate, step, used = (float(seen[name]) for name in ("rate", "force_step", "force_used"))
    good = abs(rate - 100) < 0.1 and abs(step - 0.03) < 1e-6 and used <= 50
    yield _row(
        "Section 3.1",
        "100 Hz; force sensor to 50 N, 1 %, resolution 0.03 N",
        Cell(f"{rate:.2f} Hz; steps of {step:g} N, {used:.1f} N used", _built(good)),
        "By construction. The 1 % is a gain, the same in all forces: it enters every uncertainty as one.",
    )


def p1(data: Data) -> Iterator[Statement]:
    """Two stiffnesses from slopes."""
    car, support = (found_in(data["fig04"][key]) for key in ("oscillator", "support"))
    why = "The slope on the car is 2k: both springs pull. Nearly all of the uncertainty is the force sensor's gain."
    for name, found, words in (("k", car.estimate.times(0.5), why), ("k_s", support.estimate, "")):
        printed = TABLE_1[name]
        says = f"slope of force over displacement: {name} = {printed}"
        yield _row(printed.place, says, _back(printed, found), words, _GIVEN)


def p2(data: Data) -> Iterator[Statement]:
    """Mass, and the natural frequency that follows."""
    mass = table_rows(data["table1"])["m"][1]
    slope = found_in(data["fig04"]["oscillator"]).estimate
    value = math.sqrt(slope.value / mass.value)
    natural = Estimate(value, 0.5 * value * math.hypot(slope.relative, mass.relative))
    printed = NUMBERS["natural frequency"]
    yield _row(TABLE_1["m"].place, f"m = {TABLE_1['m']} by weighing", _back(TABLE_1["m"], mass), "", _GIVEN)
    yield _closed(
        f"natural frequency from stiffness and mass: {printed}",
        printed,
        NATURAL_FREQUENCY,
        _back(printed, natural, ", from the slope of Fig. 4"),
        "sqrt(2k/m), by Eq. 2; the formula printed is sqrt(k/m).",
    )


def p3(data: Data) -> Iterator[Statement]:
    """The DFT's peak, and the frequency read off it."""
    found = found_in(data["fig05"]["tap"])
    grid, peak = found.others["dft_grid"], found.others["dft_peak"]
    line, step = NUMBERS["peak of the DFT"], float(data["fig05"]["tap"]["grid_step"])
    nearest = round(NATURAL_FREQUENCY / (2 * math.pi) / step) * step
    top = grid.value / (2 * math.pi)
    yield _closed(
        f"impulsive response: peak of the DFT at {line}",
        line,
        nearest,
        _back(line, Interval(top - step / 2, top + step / 2), ", largest line"),
        f"A DFT of 2048 samples at 100 Hz has a line every {step:.4f} Hz; closed form: the line nearest to "
        f"sqrt(2k/m), {NATURAL_FREQUENCY / (2 * math.pi):.4f} Hz. Damping moves the peak down, on the rig to "
        f"{peak.value / (2 * math.pi):.4f} Hz: which of two lines is the larger depends on where the record "
        "begins.",
    )
    yield _closed(
        f"natural frequency from it: {TABLE_1['omega_0']}",
        TABLE_1["omega_0"],
        NATURAL_FREQUENCY,
        _back(TABLE_1["omega_0"], found.estimate, ", fitted in the time domain"),
        f"The paper's 4.60 is 2 pi times its line, known to half a step, {math.pi * step:.2f} rad/s: 4.50 is "
        "within that resolution.",
    )


def p4(data: Data) -> Iterator[Statement]:
    """Damping by amplitude over frequency."""
    viscous, both = (found_in(data["fig06"][key]) for key in ("viscous", "amplitudes"))
    printed, ratio = TABLE_1["c"], NUMBERS["damping ratio"]
    per = 1 / (2 * TABLE_1["m"].value * NATURAL_FREQUENCY)
    yield _closed(
        f"c = {printed} by fitting the amplitude over frequency (viscous damping alone)",
        printed,
        2 * ratio.value * TABLE_1["m"].value * NATURAL_FREQUENCY,
        _back(printed, viscous.estimate),
        "Closed form: 2 xi m omega_0 with the printed xi and omega_0 = 4.50 rad/s. "
        + viscous.notes[0][0].upper()
        + viscous.notes[0][1:]
        + ".",
    )
    yield _closed(
        f"xi = {ratio}",
        ratio,
        printed.value * per,
        _back(ratio, viscous.estimate.times(per, unit="")),
        "c / (2 m omega_0).",
    )
    yield _row(
        "Section 3.1",
        "in the considered range the dry friction may be neglected",
        Cell(
            f"with it c = {both.estimate} ({100 * (both.value / printed.value - 1):+.1f} %), without "
            f"{viscous.estimate}",
            agreed(not _apart(viscous, both)),
        ),
        "The rig's friction is 5 mN, 3.6 % of the forcing of Fig. 6; that of the paper's rig is not known.",
    )


def _apart(one: Finding, other: Finding) -> bool:
    (low, high), (other_low, other_high) = one.interval(), other.interval()
    return low > other_high or other_low > high


def p5(data: Data) -> Iterator[Statement]:
    """Damping of the support by logarithmic decrement."""
    found = found_in(data["fig07"]["drop"])
    printed, ratio = TABLE_1["c_s"], NUMBERS["damping ratio of the support"]
    per = 1 / (2 * math.sqrt(TABLE_1["k_s"].value * TEST_MASS))
    yield _closed(
        f"support with 1.33 kg, free decay: xi_s = {ratio}",
        ratio,
        printed.value * per,
        _back(ratio, found.others["damping_ratio"]),
        "Closed form: c_s / (2 sqrt(k_s M)).",
    )
    yield _closed(
        f"logarithmic decrement: c_s = {printed}",
        printed,
        ratio.value / per,
        _back(printed, found.estimate),
        "Closed form: from the printed xi_s.",
    )


def _line(data: Data, key: str) -> Cell:
    """A calibration's slope, and its largest residual relative to its range."""
    picture, found = data["fig08"][key], found_in(data["fig08"][key])
    fitted = float(picture["slope"]) * picture["setting"].values + float(picture["intercept"])
    left = np.abs(picture["reading"].values - fitted).max() / np.ptp(fitted)
    text = f"a line of slope {found.estimate}; its {len(found.runs)} points lie within {100 * left:.2g} % of the range"
    return Cell(text, _built(left < _LEAST_LINE))


def p6(data: Data) -> Iterator[Statement]:
    """Frequency over voltage."""
    offset = found_in(data["fig08"]["voltage"]).others["offset"]
    why = f"The motor turns from {offset} on: the line does not pass through zero."
    says = "frequency over motor voltage: a line is fitted (no number printed)"
    yield _row("Fig. 8a", says, _line(data, "voltage"), why)


def p7(data: Data) -> Iterator[Statement]:
    """Forcing over crank length."""
    why = "Its slope is k, to first order in the crank: only one of the springs is driven."
    says = "forcing amplitude over crank length: a line is fitted (no number printed)"
    yield _row("Fig. 8b", says, _line(data, "crank"), why, "rho = k a")


def p8(data: Data) -> Iterator[Statement]:
    """Table 1, parameter by parameter."""
    for name, (_, number, truth) in table_rows(data["table1"]).items():
        if name not in TABLE_1:
            continue
        printed = TABLE_1[name]
        low, high = number.interval()
        inside = "inside" if low <= truth <= high else "outside"
        why = f"The rig's truth, {truth:.6g}, lies {inside} the 95 % interval."
        says = f"{name} = {printed}"
        cell = _back(printed, number)
        if name == "omega_0":
            why += f" Printed to {printed.rounding:g}, but read off a DFT: known to {printed.resolution:.2f} rad/s."
            yield _closed(says, printed, NATURAL_FREQUENCY, cell, why)
        else:
            yield _row("Table 1", says, cell, why, _GIVEN)
