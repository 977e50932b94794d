"""``compare``: experiment against theory, as numbers and as what the overlays are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np
import xarray as xr

from nonsmooth.blas import one_blas_thread
from nonsmooth.diagrams.response import forcing_parameter
from nonsmooth.errors import check_keys
from nonsmooth.flow.options import solver_of
from nonsmooth.identification.compare.draws import Model, check_parameter, nominal, read_settings
from nonsmooth.identification.compare.measured import recorded_motion
from nonsmooth.identification.compare.motion import compare_motion
from nonsmooth.identification.compare.record import compare_record, read_record
from nonsmooth.identification.compare.response import compare_diagram, compare_response
from nonsmooth.identification.fit.steady import is_steady, of_table
from nonsmooth.identification.measured_units import compare_units_of_readings, units_of
from nonsmooth.identification.options import Comparing
from nonsmooth.results.labels import labelled, labels_of
from nonsmooth.results.schema import parameter_coords
from nonsmooth.system.arguments import check_system, checked
from nonsmooth.system.kinds import real_number
from nonsmooth.system.system import System

DRAWS = 60
FORMS = (
    "nonsmooth.identification.compare.motion_of(time, x, phase) makes one of a sampled position, and measured_motion "
    "of a rig with a rotary sensor and a photogate"
)
NEGLIGIBLE = 1e-4  # relative uncertainties of settings below this ask for no band


@checked
@one_blas_thread()
def compare(
    measured: Any,
    theory: System | xr.Dataset,
    *,
    channels: Any = None,
    run: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    noise: Any = None,
    parameter: str | None = None,
    values: Any = None,
    start: Any = None,
    section_phase: Any = 0.0,
    inputs: Any = None,
    **options: Unpack[Comparing],
) -> xr.Dataset:
    r"""Lay a measurement over the theory: what both show, how far apart they are, and how far they may be.

    What is compared follows from what ``measured`` holds:

    - a **motion**: a recording as :func:`nonsmooth.fit` takes it; ``u(time, state)`` with ``phase(time)`` in forcing
      periods (and ``u_error``), as :func:`nonsmooth.identification.compare.motion_of` makes it of a sampled position,
      and ``measured_motion`` of a recording of the paper's rig; or its section points alone, ``section(iterate,
      state)``. It is compared in the states that were measured, one or more;
    - a **response**: ``amplitude`` over ``run`` with the parameter (``omega``) and ``direction`` of each (up where not
      given), or a result of ``frequency_response``. It is compared in one state, the first that it holds, or, where it
      names none, the first of the theory: ``measured.sel(state="q2")`` takes another;
    - a **diagram**: ``section(<parameter>, iterate, state)`` of steady runs, or ``section(iterate, state)`` with the
      parameter over ``iterate`` for a slow rise;
    - a **record**, of a System with inputs: a recording as :func:`nonsmooth.fit` takes it, over its own time.

    Parameters
    ----------
    measured : xarray.Dataset, Recording, DataFrame or mapping
    theory : System or xarray.Dataset
        The model, or a result at hand: of ``simulate``, ``poincare`` or ``sweep`` for a motion, ``frequency_response``
        for a response, ``sweep`` for a diagram.
    channels : mapping of str to str or Sensor, optional
        Of a recording: which channel shows which state, as ``measured`` of :func:`nonsmooth.fit`. Times are those of
        the model: the forcing begins at t = 0, or at the ``phase`` that the fit found (of this run, by its name). Of
        the ``parameters`` of a fit, gain, offset and delay that it found hold for a channel given by its name alone
        (a Sensor stands as it is given, with a warning where it differs), and its clock for all.
    run : str, optional
        Of a recording that has several.
    parameters : ParameterSet or mapping, optional
        Identified parameters; with a covariance their uncertainty is carried into the prediction.
    settings : mapping, optional
        What was set in this run (``omega``, ``rho``, ``g``): numbers, or ``(value, standard uncertainty)``; the value
        may be a function of the other parameters (``lambda p: p["k"] * crank_length``). They win over ``parameters``.
    noise : mapping or sequence, optional
        Standard error of a section point in each state; from ``section_error`` or ``u_error`` where not given.
    parameter : str, optional
        The parameter of a response (where not given as of :func:`nonsmooth.frequency_response`) or of a diagram.
    values : array, optional
        Of the predicted diagram; 201 over the measured range where not given.
    start : state or list of states, optional
        Where predictions of a motion begin; rest and four measured section points where not given, other states being
        0. Of all motions they lead to the nearest is taken; all period numbers are kept.
    section_phase : float or list of float
        Phases of the stroboscopic sections, in forcing periods.
    inputs : mapping of input to channel, Input or (time, values), optional
        The courses of the system's inputs, as in :func:`nonsmooth.fit`. The motion begins with ``start`` where the
        record does, or as the fit of these readings that gave the ``parameters`` found it.

    Returns
    -------
    xarray.Dataset
        Attribute ``comparison`` says which. Dims of length one stay where the argument was a sequence.

        *motion*: ``measured_orbit``, ``theory_orbit`` over ``phase`` (or ``measured_phase`` and ``theory_phase`` for
        motions without a period number), ``measured_scatter``, ``theory_low``, ``theory_median``, ``theory_high``;
        ``orbit_distance`` (phase known), ``orbit_distance_any_phase``, ``phase_shift``; ``measured_section``,
        ``theory_section``; ``energy_distance``, ``energy_distance_matched``, ``energy_ratio``,
        ``measured_halves_median``,
        ``measured_halves_p95`` (and of the theory), ``block``; ``wasserstein_distance`` for each state and
        ``wasserstein_distance_joint``; ``measured_period_number``, ``theory_period_number``,
        ``coexisting_period_number``, ``period_agrees``, ``period_coexists``, ``period_relation`` (in words; where rig
        and theory lie on either side of a flip, that); ``draw_energy_distance``,
        ``draw_orbit_distance``, ``draw_period_number``, ``inside_band``, ``band_share``.

        *response*: ``measured_amplitude``, ``theory_at_run``, ``relative_difference`` over ``run``;
        ``theory_amplitude`` and its band over the parameter and ``direction``; ``measured_jump``, ``theory_jump``,
        ``jump_difference``, ``jump_tolerance`` over ``jump``; ``inside_band``.

        *diagram*: ``measured_section`` over ``sample``, ``theory_section`` over the parameter; period numbers; flips
        of one kind (1-2 or 2-4, with the doubled motion on the same side) in pairs, nearest to each other:
        ``measured_flip``, ``measured_flip_error``, ``measured_flip_read``, ``theory_flip``,
        ``flip_relative_difference`` over ``flip``. Of a slow rise ``measured_flip`` is where the amplitude equation of
        a flip puts it, and the record itself reads ``measured_flip_read``, later by the delay; ``rise_per_return``.

    Raises
    ------
    ValueError, TypeError
        A measurement that is none of these, states that differ, noise that is not known.

    Notes
    -----
    Distances of clouds are in units of the spread of the measured points in each state, those of orbits of the size
    of the motion, or of the noise where that is larger: a mass that stands still adds no more than its noise. The
    motion of a System is taken at the recorded phases for them: samples about an impact do not show it. The predicted
    points are given the measured noise (seeded), so that a motion that is predicted exactly is at the distance of the
    measured cloud's own halves. The energy distance is the root,
    :math:`\sqrt{2 E|X-Y| - E|X-X'| - E|Y-Y'|}`, as SciPy defines it; NaN with fewer than 40 points in a cloud.
    """
    set_ = read_settings(settings, theory) if isinstance(theory, System) else {}
    if not isinstance(theory, System) and (parameters is not None or settings):
        raise ValueError("parameters and settings change a System; this theory is a result that is at hand already")
    if options["draws"] is None:  # none of a theory in which no uncertainty shows
        uncertain = hasattr(parameters, "covariance") or any(
            pair.uncertainty > (0.0 if pair.follows else NEGLIGIBLE * abs(pair.at({}))) for pair in set_.values()
        )
        options["draws"] = DRAWS if uncertain and hasattr(theory, "parameters") else 0
    if not 0 < options["level"] < 1:
        raise ValueError(f"level = {options['level']!r} must lie between 0 and 1, as 0.95")
    record = None
    if isinstance(theory, System):
        check_system(theory, "compare", inputs=True)
    if isinstance(theory, System) and (theory.inputs or inputs is not None):
        record = read_record(nominal(theory, parameters, set_), measured, channels, run, inputs, parameters)
    elif not isinstance(measured, xr.Dataset) or channels is not None:
        if not isinstance(theory, System):
            raise TypeError(f"a recording is laid over a System, not over a result; of a measured motion: {FORMS}")
        if is_steady(measured):
            measured = of_table(theory, measured, run or "steady")
        else:
            here, told = nominal(theory, parameters, set_), getattr(parameters, "extra", {})
            measured = recorded_motion(measured, here, channels, run, told)
    if record is not None:
        synthetic = "yes" if getattr(measured, "synthetic", False) else "no"
        kind, states = "record", list(record.sensors)
        measured = xr.Dataset(attrs={"synthetic": synthetic, "title": record.records[0].name})
        own = record.noise / [abs(sensor.gain) for sensor in record.sensors.values()]
        spread = own if noise is None else _noise(measured, noise, states)
    else:
        kind, states = _kind(measured, parameter), _states(measured, theory)
        compare_units_of_readings(measured, units_of(theory))
        states = states[:1] if kind == "response" else states
        spread = np.full(1, np.nan) if kind == "response" else _noise(measured, noise, states)
    solver = solver_of(options)
    rest: dict[str, Any] = {key: value for key, value in options.items() if key not in (*solver, "direction")}
    model = Model(theory, states, parameters, set_, spread, solver, **rest)
    given = {
        "settings": {key: ["follows" if one.follows else one.value, one.uncertainty] for key, one in set_.items()},
        "parameter": parameter,
        "section_phase": section_phase,
        **options,
    }
    if kind in ("response", "diagram"):
        name = parameter or (_forcing(theory) if kind == "response" else _swept(measured))
        if model.system is not None:
            check_parameter(name, model.theory)
    if record is not None:
        variables = compare_record(record, model, start)
    elif kind == "response":
        variables = compare_response(measured, model, name=name)
    elif kind == "diagram":
        phase = real_number(section_phase, "section_phase")
        variables = compare_diagram(
            measured, model, name=name, direction=options["direction"], values=values, phase=phase
        )
    else:
        phases = [real_number(phase, "section_phase") for phase in np.atleast_1d(section_phase)]
        if "u" not in measured and len(phases) > 1:
            raise ValueError("measured section points are of one phase: give section_phase as one number")
        variables = compare_motion(measured, model, start, phases)
    result = _dataset(variables, measured, model, kind, given)
    return result.squeeze("section_phase") if kind == "motion" and np.ndim(section_phase) == 0 else result


def _kind(measured: xr.Dataset, parameter: str | None) -> str:
    if "amplitude" in measured:
        return "response"
    if "u" in measured:
        if "phase" not in measured:
            raise ValueError(
                "a measured motion needs `phase` (of the drive, in forcing periods) over time beside `u`; see "
                "nonsmooth.identification.compare.motion_of"
            )
        return "motion"
    if "section" in measured:
        if parameter is not None or any(dim not in ("iterate", "state") for dim in measured["section"].dims):
            return "diagram"
        return "motion"
    raise ValueError(
        "nothing here can be compared: a motion holds `u` over time with `phase`, or `section` over iterate; a "
        f"response `amplitude`; this Dataset holds {', '.join(map(str, measured.data_vars)) or 'nothing'}: of a "
        f"recording say channels={{state: channel}}; {FORMS}"
    )


def _states(measured: xr.Dataset, theory: Any) -> list[str]:
    known = list(theory.states) if hasattr(theory, "states") else [str(s) for s in theory["state"].values]
    if "state" not in measured.coords:
        if "amplitude" in measured:
            return known
        raise ValueError(f"`state` must name the measured states; the theory has {', '.join(known)}")
    held = [str(name) for name in np.atleast_1d(measured["state"].values)]
    if any(name not in known for name in held) or len(set(held)) < len(held):
        raise ValueError(
            f"the measured states are {', '.join(held)}, those of the theory {', '.join(known)}: name them so"
        )
    return held


def _noise(measured: xr.Dataset, noise: Any, states: list[str]) -> np.ndarray:
    if noise is None:
        for name in ("section_error", "u_error"):
            if name in measured:
                others = [dim for dim in measured[name].dims if dim != "state"]
                return np.asarray(measured[name].median(others).values, float)
        raise ValueError(
            f"the standard error of the measured states is not known: give "
            f"noise={{{', '.join(map(repr, states))}: ...}}, or `u_error` or `section_error` in the measured Dataset"
        )
    if isinstance(noise, Mapping):
        check_keys(noise, states, "noise", "a state", "this measurement")
        if missing := [name for name in states if name not in noise]:
            raise ValueError(f"noise is not given for {', '.join(missing)}")
        noise = [noise[name] for name in states]
    values = np.array([real_number(value, "noise") for value in np.atleast_1d(noise)])
    if values.shape != (len(states),) or not (values > 0).all():
        raise ValueError(f"noise must be a positive number for each of {', '.join(states)}; got {values.tolist()}")
    return values


def _forcing(theory: Any) -> str:
    """The parameter of a response: that of a theory at hand, or that of a System which sets the forcing period."""
    if isinstance(theory, System):
        return forcing_parameter(theory)
    held = theory["amplitude"].dims if "amplitude" in theory else ()
    others = [str(dim) for dim in held if dim not in ("state", "direction", "start")]
    return others[0] if len(others) == 1 else "omega"


def _swept(measured: xr.Dataset) -> str:
    others = [str(dim) for dim in measured["section"].dims if dim not in ("iterate", "state")]
    if len(others) != 1:
        raise ValueError(f"which parameter the sections lie along is not clear ({others}): give parameter=")
    return others[0]


def _dataset(
    variables: dict[str, Any], measured: xr.Dataset, model: Model, kind: str, given: dict[str, Any]
) -> xr.Dataset:
    from nonsmooth.results.provenance import (
        ATTRIBUTE,
        attribute,
        options_as_data,
        provenance,
        read_provenance,
        with_short_record,
    )

    theory, units = model.theory, units_of(model.theory)
    coords: dict[str, Any] = {
        "state": labelled("state", np.array(model.states), "state"),
        "state_unit": labelled("state", np.array([units[name] for name in model.states]), "unit"),
    }
    if model.system is None:
        record = read_provenance(theory) | {"verb": "compare", "options": options_as_data(given), "seed": model.seed}
    else:
        labels = labels_of(model.system)
        method = str(given.get("method", "auto"))
        record = read_provenance(xr.Dataset(attrs=provenance(labels, "compare", given, method=method, seed=model.seed)))
        coords |= parameter_coords(labels)
    record["measured"] = {key: str(value) for key, value in measured.attrs.items() if key != ATTRIBUTE}
    coords |= {key: variables.pop(key) for key in sorted(variables) if variables[key][0] == key}
    data = {key: (dims, np.asarray(values), attrs) for key, (dims, values, attrs) in variables.items()}
    synthetic = str(measured.attrs.get("synthetic", "no"))
    attrs = {"comparison": kind, "synthetic": synthetic, "title": str(measured.attrs.get("title", ""))}
    return with_short_record(xr.Dataset(data, coords, attrs | attribute(record)))
