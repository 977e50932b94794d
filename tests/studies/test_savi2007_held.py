"""The S-shaped curve of Fig. 9 on the virtual rig, its unstable part held by a controller, against the model."""

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.studies.savi2007.laboratory import Laboratory
from nonsmooth.studies.savi2007.rig.figures import screw_for

CRANK = 0.01653  # m: a force of 0.14 N
STEP = 1e-3  # of a parameter, for a derivative


def half_of(system, start):
    """Half the peak-to-peak value of the orbit next to a state."""
    orbit = ns.find_orbit(system, start=list(start), period_number=1, progress=False)
    run = ns.simulate(system, periods=1, start=list(orbit.u), samples=2000)
    return 0.5 * float(np.ptp(run["u"].sel(state="x").values)), orbit


@pytest.mark.slow
def test_the_unstable_branch_lies_in_the_band_of_the_identified_model(tmp_path):
    lab = Laboratory(tmp_path)
    rig, found = lab.rig, lab.identified
    measured = ns.control_based_continuation(
        rig.live(gap=0.02, crank_length=CRANK, omega=5.0), "frequency", (4.9, 5.95), frequency=5.0, amplitude=CRANK,
        release=0, step=0.15, progress=False,
    )  # fmt: skip
    upper, lower = (int(at) for at in measured["special_point"].values)
    noise = measured["control_effort_noise"].values
    assert (measured["control_effort"].values < 2 * noise).all()
    between = measured.isel(point=slice(upper + 1, lower))
    clear = between["omega"].values < float(measured["special_value"][0]) - 0.02
    unstable = between.isel(point=np.flatnonzero(clear))
    assert unstable.sizes["point"] >= 10

    # The model: all that was identified, and the drive's string and ripple as they are built.
    names = ["m", "k", "k_s", "c", "c_s", "friction", "gap_at_rest"]
    covariance = found.full_covariance.sel(parameter=names, other=names).values
    screw = screw_for(rig, 0.02, CRANK)
    values = {name: found.estimate(name).value for name in names}
    values["g"] = screw + values.pop("gap_at_rest") - 0.0018  # the screw read 1.8 mm where the gap was identified
    model = rig.system().with_parameters(rig.parameters(crank_length=CRANK) | values)
    chosen = np.unique(np.linspace(0, unstable.sizes["point"] - 1, 10).astype(int))
    print("\nomega (rad/s)  rig (mm)  model (mm)  difference (um)  95 % band (um)  control (mN)  its noise (mN)")
    for one in (unstable.isel(point=i) for i in chosen):
        at = model.with_parameters(omega=float(one["omega"]))
        start = [*one["section"].values, 0.0]
        half, orbit = half_of(at, start)
        assert not orbit.stable
        slope = []
        for name in names:
            key = "g" if name == "gap_at_rest" else name
            value = at.values[key]
            moved, _ = half_of(at.with_parameters({key: value * (1 + STEP)}), orbit.u)
            slope.append((moved - half) / (value * STEP))
        moved, _ = half_of(at.with_parameters(omega=at.values["omega"] * (1 + 1e-4)), orbit.u)
        of_model = float(np.array(slope) @ covariance @ np.array(slope))
        u = np.sqrt(of_model + float(one["amplitude_uncertainty"]) ** 2)
        difference = float(one["amplitude"]) - half
        print(
            f"{at.values['omega']:.4f}  {1e3 * float(one['amplitude']):.4f}  {1e3 * half:.4f}  {1e6 * difference:+.1f}"
            f"  {1.96e6 * u:.1f} (model alone {1.96e6 * of_model**0.5:.1f})  {1e3 * float(one['control_effort']):.2f}"
            f"  {1e3 * float(one['control_effort_noise']):.2f}"
        )
    rig_itself = rig.system().with_parameters(
        rig.parameters(crank_length=CRANK, omega=5.0, g=rig.true_gap(screw))
    )
    branch = ns.continue_orbit(ns.find_orbit(rig_itself, start={"x": 0.01}, progress=False), "omega", (4.99, 5.9))
    fold = float(branch["special_value"].values[branch["special_kind"].values == "fold"][0])
    print(f"fold: rig held {float(measured['special_value'][0]):.4f}, its equations {fold:.4f} rad/s")
    assert float(measured["special_value"][0]) == pytest.approx(fold, rel=0.01)
