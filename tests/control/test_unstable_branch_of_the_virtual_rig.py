"""The unstable branch of Fig. 9 on the virtual rig, against the band of the model that was identified from its records.

Run: python -m pytest -m slow -s tests/control/test_unstable_branch_of_the_virtual_rig.py
"""

import warnings

import numpy as np
import pytest
from scipy.stats import binom

import nonsmooth as ns
from nonsmooth.recordings import RecordingWarning
from nonsmooth_savi2007.rig import VirtualRig

CRANK, GAP = 0.01653, 0.02  # m; 0.14 N, Fig. 9
IDENTIFIED = ["m", "k", "k_s", "c", "c_s", "friction", "g"]
INSTANTS = np.linspace(0.0, 1.0, 4001)
SMOOTHED = 5e-3  # m/s
COLUMNS = ("omega", "amplitude", "amplitude_uncertainty", "control_effort", "control_effort_noise")


@pytest.fixture(scope="module")
def rig():
    return VirtualRig.published()


@pytest.fixture(scope="module")
def live(rig):
    return rig.live(gap=GAP, crank_length=CRANK, omega=5.1)


@pytest.fixture(scope="module")
def model(rig, live, tmp_path_factory):
    """The rig's equations with the identified parameters in place of the true ones; their covariance."""
    session = rig.write_session(tmp_path_factory.mktemp("held") / "session")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)  # of blank fields in the files
        found = ns.identify(session, crank_length=CRANK)
    values = {name: found[name] for name in IDENTIFIED[:5]} | {"friction": found.extra["friction"].value}
    # The screw's zero is what the gap at rest says; the screw itself is moved by exactly what it shows.
    values["g"] = live.system.values["g"] + found.extra["gap_at_rest"].value - rig.truth["g"]
    names = ["gap_at_rest" if name == "g" else name for name in IDENTIFIED]
    covariance = found.full_covariance.sel(parameter=names, other=names).values
    return live.system.with_parameters(values), covariance


@pytest.fixture(scope="module")
def branch(model):
    """The branch of the model, by ``continue_orbit``.

    The support without its half-millisecond of relaxation, which the car does not feel; friction that turns over within
    5 mm/s, since at 1 mm/s ``continue_orbit`` does not come through. From 10 to 5 mm/s the folds move by 2e-5 of
    themselves. It gives the folds and first guesses: amplitudes are computed at 1 mm/s, with the relaxation.
    """
    system = VirtualRig.published(support_relaxation=False).system().with_parameters(model[0].values)
    orbit = ns.find_orbit(system.with_parameters({"omega": 5.0, "creep_velocity": SMOOTHED}), progress=False)
    return ns.continue_orbit(orbit, "omega", (4.95, 6.0), step=0.01)


@pytest.fixture(scope="module")
def measured(live):
    return ns.control_based_continuation(
        live, "frequency", (4.9, 6.0), frequency=5.1, amplitude=CRANK, step=0.06, progress=False
    )


def amplitude(system, start):
    """Half the peak-to-peak value of the periodic motion near a state at phase 0; by simulation and Newton's method."""
    period = system.period()

    def after(u, instants=INSTANTS[[0, -1]]):
        run = ns.simulate(
            system, start={"x": u[0], "v": u[1]}, samples=instants * period, duration=period, method="rkf45", rtol=1e-11
        )
        return run["u"].sel(state=["x", "v"]).values

    u = np.array(start)
    for _ in range(8):
        end = after(u)[-1]
        steps = np.diag([1e-7, 1e-6])
        jacobian = np.column_stack([(after(u + h)[-1] - after(u - h)[-1]) / (2 * h.sum()) for h in steps])
        move = np.linalg.solve(jacobian - np.eye(2), u - end)
        u = u + move
        if np.abs(move).max() < 1e-10:
            return 0.5 * float(np.ptp(after(u, INSTANTS)[:, 0])), u
    raise AssertionError(f"no periodic motion near {start}")


def predicted(model, omega, start):
    """Amplitude at a frequency and its standard uncertainty, from the covariance of the identified parameters."""
    system, covariance = model
    system = system.with_parameters({"omega": omega})
    nominal, u = amplitude(system, start)
    slope = []
    for name, variance in zip(IDENTIFIED, np.diag(covariance), strict=True):
        step = np.sqrt(variance)
        ends = [amplitude(system.with_parameters({name: system.values[name] + s * step}), u)[0] for s in (1, -1)]
        slope.append((ends[0] - ends[1]) / (2 * step))
    return nominal, float(np.sqrt(np.array(slope) @ covariance @ np.array(slope)))


@pytest.mark.slow
def test_the_unstable_branch_lies_in_the_models_band(measured, branch, model):
    """The 95 % band: 1.96 times the root of the squares of the model's uncertainty and the held amplitude's.

    The model's is that of the identified parameters, with their covariance; the other is what the branch says.
    """
    kinds = branch["special_kind"].values
    first, last = (int(i) for i in branch["special_point"].values[kinds == "fold"])
    upper, lower = branch["omega"].values[[first, last]]
    folds = dict(zip(measured["special_point"].values.tolist(), measured["special_value"].values, strict=True))
    begin, end = sorted(folds)  # two, or noise has made others
    print(f"\nfolds: held {folds[begin]:.4f}, {folds[end]:.4f}; model {upper:.4f}, {lower:.4f} rad/s")

    unstable = measured.isel(point=slice(begin + 1, end))
    omega = unstable["omega"].values
    unstable = unstable.isel(point=(omega > lower + 0.01) & (omega < upper - 0.01))  # where the amplitude has a value
    part = branch.isel(point=slice(first, last + 1))
    rows = []
    print("  rad/s  held mm  model mm  away um  u_held  u_model  95 %  frictionless  effort mN  noise mN  stability")
    for k in range(unstable.sizes["point"]):
        one = unstable.isel(point=k)
        near = part.isel(point=int(np.argmin(np.abs(part["omega"].values - float(one["omega"])))))
        start = near["section"].sel(state=["x", "v"]).values
        w, held, u_held, effort, noise = (float(one[name]) for name in COLUMNS)
        size, u_model = predicted(model, w, start)
        bare = amplitude(model[0].with_parameters({"omega": w, "friction": 0.0}), start)[0] - size
        away, band = held - size, 1.96 * np.hypot(u_held, u_model)
        rows.append((abs(away) / band, effort / noise, int(one["stability"]), abs(bare) / band, abs(away) / u_model))
        print(
            f"{w:.5f}  {1e3 * held:7.4f}  {1e3 * size:8.4f}  {1e6 * away:7.1f}  {1e6 * u_held:6.1f}"
            f"  {1e6 * u_model:7.1f}  {1e6 * band:4.1f}  {1e6 * bare:12.1f}"
            f"  {1e3 * effort:9.3f}  {1e3 * noise:8.3f}  {rows[-1][2]:9d}"
        )
    outside, effort, stability, without_friction, in_model = np.array(rows).T
    print(f"within the band: {(outside < 1).sum()} of {len(rows)}; within the model's part: {(in_model < 1.96).sum()}")
    assert len(rows) >= 10
    np.testing.assert_allclose([folds[begin], folds[end]], [upper, lower], rtol=0.01)
    assert (effort < 2).all()
    assert (stability != 1).all() and (stability == 0).sum() >= 0.7 * len(rows)
    assert (outside < 1).sum() >= binom.ppf(0.01, len(rows), 0.95) and (outside < 1.8).all()
    assert (without_friction > 1).all()  # the band is narrow enough to tell 5 mN of friction
