"""Unstable motions of a rig, held by a controller, against the branch of its model."""

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.control.harmonics import fitted, values_at

CONTROLLED = {"resolution": 5.48e-5, "jitter": 5e-5}  # a rotary sensor of 1440 counts on a wheel of 78.9 mm, at 100 Hz


@pytest.fixture(scope="module")
def theory() -> dict[str, np.ndarray]:
    """The branch of Fig. 9 by its equations, from the upper part through the fold to the graze."""
    model = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.6)
    low = ns.find_orbit(model.with_parameters(omega=5.0), progress=False)
    return branch_of(ns.continue_orbit(low, "omega", (4.99, 5.9), step=0.01), "omega")


def branch_of(branch, parameter):
    kinds = branch["special_kind"].values.astype(str)
    fold = [int(i) for i in branch["special_point"].values[kinds == "fold"]]
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    return {"at": branch[parameter].values, "half": half, "folds": fold, "section": branch["section"].values}


def unstable(theory, at):
    """Amplitude of the unstable branch, between the folds, where the parameter falls."""
    first, last = theory["folds"][:2]
    part = slice(first, last + 1)
    order = np.argsort(theory["at"][part])
    return np.interp(at, theory["at"][part][order], theory["half"][part][order])


def rig_at(theory, omega, **options):
    """The paper's oscillator as a rig, in its upper motion."""
    at = int(np.argmin(np.abs(theory["at"][: theory["folds"][0]] - omega)))
    model = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=omega)
    return ns.SimulatedRig(model, start=theory["section"][at].tolist(), **{**CONTROLLED, **options})


@pytest.fixture(scope="module")
def measured(theory):
    """The branch from the upper motion round the fold and down, as the rig shows it."""
    rig = rig_at(theory, 5.72)
    return ns.control_based_continuation(
        rig, "frequency", (5.5, 5.9), frequency=5.72, amplitude=0.14, release=0, step=0.25, transient=20, progress=False,
    )  # fmt: skip


def past_the_fold(measured):
    fold = int(measured["special_point"][0])
    return measured.isel(point=slice(fold + 1, None))


def test_the_fold_is_where_the_model_has_it(measured, theory):
    assert measured["special_kind"].values.tolist() == ["fold"]
    true = theory["at"][theory["folds"][0]]
    assert float(measured["special_value"][0]) == pytest.approx(true, rel=2e-3)


def test_unstable_motions_are_those_of_the_model(measured, theory):
    lower = past_the_fold(measured)
    lower = lower.isel(point=lower["omega"].values < 5.8)  # clear of the fold, where the amplitude has no value of its own
    assert lower.sizes["point"] >= 5
    true = unstable(theory, lower["omega"].values)
    assert np.abs(lower["amplitude"].values / true - 1).max() < 2e-3
    upper = np.interp(lower["omega"].values, theory["at"][: theory["folds"][0]], theory["half"][: theory["folds"][0]])
    assert (true < 0.99 * upper).all()  # the other branch is far from these


def test_the_control_force_falls_to_its_noise(measured):
    noise = measured["control_effort_noise"].values
    assert (measured["control_effort"].values < 2 * noise).all()
    assert (measured["control_effort_first"].values[1:] > 3 * noise[1:]).mean() > 0.8  # it was not small from the first
    assert (noise < 1e-2 * 0.14).all()  # and the noise is a hundredth of the drive
