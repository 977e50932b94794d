"""``VirtualRig``: the experiment of Savi et al. (2007) on the computer, with more physics than the model has."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth import Recording, SimulatedRig, System
from nonsmooth.errors import unknown
from nonsmooth.recordings import PROCEDURES
from nonsmooth_savi2007.rig import driven, figures, hand, motor, sensors
from nonsmooth_savi2007.rig.notebook import write_session
from nonsmooth_savi2007.rig.physics import METHOD, OF_THE_CAR, WANDERING, car
from nonsmooth_savi2007.rig.truth import FEATURES, HOLDING, NOMINAL_GAP, awkward, drawn, published, switched

#: The procedures of Section 3.1 and those for the gap: what identification needs.
IDENTIFICATION = ("springs", "support", "impulse", "response", "drop", "voltage", "crank", "grazing", "contact")


@dataclass(frozen=True, eq=False)
class VirtualRig:
    """A rig whose parameters are known, to try on it what is to be done on a real one. All it records is synthetic.

    Parameters
    ----------
    seed : int
        Draws the truth and all noise. Each run of each procedure has its own stream, so that a record does not
        depend on which others were made.
    truth : mapping, optional
        Values in place of those drawn; names and units are those of ``rig.UNITS``. Not drawn but
        at request: ``motor_side`` (1: the motor pulls from the support's side, -1: from the other), ``motor_wander``
        (standard deviation of the frequency about its mean, relative, slow against a turn), ``sensor_zero`` (the place
        at which the rotary sensor was zeroed, from where the springs balance), ``angle_sign``, ``force_sign`` and
        ``turn_sign`` (-1: the sensor counts the other way), ``slipped_tap`` (the impulse run, counted from 1, in which
        the string slips on the sensor's wheel; 0: none).
    holding : bool
        Dry friction that holds the car where it stops, within F_C/2k of where the springs balance, in place of one that
        lets it creep there (``creep_velocity`` is then 0.1 µm/s).
    ripple, string, friction, support_relaxation, jitter, noise, quantisation, gain_error : bool
        Features that can be switched off: the motor's uneven turning, the finite length of the crank's string, dry
        friction, the time the support takes to come back, the jitter of the clock, the noise of the force sensor,
        the steps of both sensors, the gain error of the force sensor.

    Attributes
    ----------
    truth : mapping of str to float
        What the rig is, with all features that are off left out. ``g`` is the true gap where the support's screw
        reads 1.8 mm.
    """

    seed: int = 0
    truth: Mapping[str, float] = field(default_factory=dict)
    ripple: bool = True
    string: bool = True
    friction: bool = True
    support_relaxation: bool = True
    jitter: bool = True
    noise: bool = True
    quantisation: bool = True
    gain_error: bool = True
    holding: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.truth, Mapping):
            raise TypeError(f"truth must map names to numbers, got {self.truth!r}")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ValueError(f"seed = {self.seed!r} must be a whole number, zero or more")
        for name in (*FEATURES, "holding"):
            if not isinstance(getattr(self, name), bool):
                raise TypeError(f"{name} = {getattr(self, name)!r}: a feature is on (True) or off (False)")
        held = {"creep_velocity": HOLDING} if self.holding else {}
        truth = switched(drawn(self.seed), {**self.truth, **held}, [name for name in FEATURES if name not in self.on])
        object.__setattr__(self, "truth", MappingProxyType(truth))

    @property
    def on(self) -> list[str]:
        """Features that are on."""
        return [name for name in (*FEATURES, "holding") if getattr(self, name)]

    @classmethod
    def published(cls, seed: int = 0, **options: Any) -> VirtualRig:
        """The paper's rig: Table 1 and a gap as read, with the features beside the model at typical values."""
        return cls(seed, truth={**published(), **options.pop("truth", {})}, **options)

    @classmethod
    def awkward(cls, seed: int, **options: Any) -> VirtualRig:
        """The rig of this seed with all that goes wrong in a laboratory at once.

        Friction holds the car and the sensor is zeroed where it sticks, the motor is on either side and wanders by
        0.1 %, each sensor counts one way or the other, and in one of the first six taps the wheel slips.
        """
        return cls(seed, truth={**awkward(seed), **options.pop("truth", {})}, **{"holding": True, **options})

    # The system

    def system(self, *, rising: bool = False, **settings: float) -> System:
        """The rig as a ``System`` with the truth's parameters and the settings of a run; ``rising`` with the crank's
        length as a slow state."""

        side = int(self.truth["motor_side"])
        equations = car(relaxing=self.support_relaxation, rising=rising, wanders=self.wanders, side=side)
        return equations.with_parameters(self.parameters(rising=rising, **settings))

    @property
    def wanders(self) -> bool:
        """Return whether the motor's frequency wanders."""
        return self.truth["motor_wander"] > 0

    def wander(self, procedure: str, run: int, omega: float) -> dict[str, Any]:
        """Parameters of the motor's slow terms in one run: periods of 2 to 60 s, the same part of the variance each."""
        if not self.wanders:
            return {}
        rng = np.random.default_rng([self.seed, 2, list(PROCEDURES).index(procedure), run])
        rates = 2 * np.pi / np.exp(rng.uniform(np.log(2.0), np.log(60.0), WANDERING))
        phases = rng.uniform(0.0, 2 * np.pi, WANDERING)
        sizes = omega * self.truth["motor_wander"] * np.sqrt(2 / WANDERING) / rates
        terms = {"wander": sizes, "wander_rate": rates, "wander_phase": phases}
        return {f"{name}_{j}": one for name, row in terms.items() for j, one in enumerate(row.tolist(), 1)}

    def parameters(self, *, rising: bool = False, **settings: float) -> dict[str, float]:
        """Values of the system's parameters: the truth, and the settings of a run (omega, crank_length, g)."""
        values = {name: self.truth[name] for name in OF_THE_CAR}
        values |= {"curvature": 1.0 / self.truth["string_length"], "omega": 4.5}
        return {**values, "crank_rate" if rising else "crank_length": 0.0, **settings}

    def named_parameters(self, **settings: Any) -> SimpleNamespace:
        """The same with the values as attributes, as the equations read them."""
        return SimpleNamespace(**self.parameters(**settings))

    def true_gap(self, reading: float) -> float:
        """The gap (m) where the support's screw reads ``reading``: its scale is right, its zero is not known."""
        return reading + self.truth["g"] - NOMINAL_GAP

    # What the procedures are made with

    def generator(self, procedure: str, run: int) -> np.random.Generator:
        """The stream of random numbers of one run."""
        return np.random.default_rng([self.seed, 1, list(PROCEDURES).index(procedure), run])

    def channels(
        self, rng: np.random.Generator, run: str, time: Any, x: Any, v: Any, *, pulled: Any = None, crossed: Any = None
    ) -> dict[str, xr.Dataset]:
        """Channels that the sensors record of a motion; a force sensor is ``pulled``, a photogate was ``crossed``."""
        found = {"Angle": sensors.angle(self, run, time, x, v)}
        if pulled is not None:
            reading = sensors.force(self, rng, run, time, pulled)
            found["Angle"] = found["Angle"].assign(Force=reading["Force"])
        if crossed is not None:
            found["Turn"] = sensors.turns(self, crossed)
        return found

    def recording(self, procedure: str, runs: Sequence[tuple[str, Mapping[str, Any], Mapping[str, Any]]]) -> Recording:
        """The runs (name, sensors, settings) as a Recording that says that it is synthetic."""

        told = {"file": "", "format": "virtual rig", "procedure": procedure, "seed": self.seed, "features": self.on}
        return Recording.from_runs(
            {name: dict(channels) for name, channels, _ in runs},
            synthetic=True,
            source=told,
            run_attrs={name: {"procedure": procedure, **stated} for name, _, stated in runs},
        )

    def live(self, *, gap: float, crank_length: float, omega: float = 4.5, run: int = 0) -> LiveRig:
        """The rig as the three methods that :func:`nonsmooth.control_based_continuation` takes; see `LiveRig`."""
        return LiveRig(self, gap=gap, crank_length=crank_length, omega=omega, run=run)

    # Procedures

    def record(self, procedure: str, **options: Any) -> Recording:
        """Make the recording of a procedure by its name; the options are those of the method of that name."""
        if procedure not in PROCEDURES:
            raise ValueError(unknown(procedure, "a procedure", "a virtual rig", PROCEDURES.keys()))
        return getattr(self, procedure)(**options)

    springs = hand.springs
    support = hand.support
    impulse = hand.impulse
    drop = hand.drop
    voltage = motor.voltage
    crank = motor.crank
    response = driven.response
    grazing = driven.grazing
    contact = driven.contact
    rise = figures.rise
    section = figures.section
    figure = figures.figure

    def write_session(
        self,
        folder: str | os.PathLike[str],
        procedures: Sequence[str] | None = None,
        *,
        truth: str | os.PathLike[str] | None = None,
        options: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> Path:
        """Record and write a session folder; the truth goes to a file beside it, ``<folder>.truth.toml``.

        Parameters
        ----------
        folder : path
            Made if it is not there; files of the same names are replaced.
        procedures : sequence of str, optional
            Default: those that identification needs (``IDENTIFICATION``), without ``rise`` and ``section``.
        truth : path, optional
            Where the truth goes; never into the folder.
        options : mapping, optional
            Options of procedures, as ``{"impulse": {"velocities": (0.5, -0.5)}}``.

        Returns
        -------
        Path
            The folder.
        """
        names = IDENTIFICATION if procedures is None else tuple(procedures)
        chosen = options or {}
        if strange := [name for name in chosen if name not in names]:
            raise ValueError(f"options of {', '.join(strange)}: not recorded here; there are {', '.join(names)}")
        made = {name: self.record(name, **chosen.get(name, {})) for name in names}
        return write_session(self, folder, made, truth, title=f"virtual rig, seed {self.seed}")

    def write_figure(
        self,
        number: int,
        folder: str | os.PathLike[str],
        *,
        truth: str | os.PathLike[str] | None = None,
        **options: Any,
    ) -> Path:
        """Record and write what stands behind one of the paper's Figs. 4 to 18; see :meth:`write_session`.

        The options are those of the figure's procedure, as for :meth:`figure`.
        """
        title = f"virtual rig, seed {self.seed}, Fig. {number}"
        return write_session(self, folder, self.figure(number, **options), truth, title=title)


class LiveRig(SimulatedRig):
    """A virtual rig as the three methods of a live one.

    The position is read in counts of the rotary sensor, at the interface's 100 Hz with its jitter; the motor turns at
    the frequency of the nearest step of its voltage. The actuator is one that the paper's rig has not: it pushes the
    car with the force that it is told to, without error or delay.

    Parameters
    ----------
    rig : VirtualRig
    gap : float
        Gap (m) from the car's mean position under the drive of this crank.
    crank_length : float
        Length of the crank (m) at the beginning.
    omega : float
        Frequency of the drive (rad/s) at the beginning.
    run : int
        Number of the run, which has random numbers of its own.

    Raises
    ------
    ValueError
        A motor that wanders: it has no phase to which a reference could be tied.
    """

    def __init__(self, rig: VirtualRig, *, gap: float, crank_length: float, omega: float = 4.5, run: int = 0) -> None:
        if rig.wanders:
            raise ValueError("a motor that wanders has no phase to which a reference could be tied: motor_wander = 0")
        self._rig, at_rest = rig, rig.true_gap(figures.screw_for(rig, gap, crank_length))
        super().__init__(
            rig.system(omega=omega, crank_length=crank_length, g=at_rest),
            amplitude="crank_length",
            rate=sensors.RATE,
            resolution=sensors.COUNT if rig.quantisation else 0.0,
            jitter=rig.truth["clock_jitter"],
            seed=rig.seed + 1000 * run,
            start={"x": min(0.0, at_rest)},
            method=METHOD["method"],
        )
        self.units["force"] = "N"

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the motor's voltage and the crank; return the frequency (rad/s) that it turns at, and the crank (m)."""
        return super().set_drive(motor.frequency(self._rig, motor.voltage_for(self._rig, frequency)), amplitude)

    def reading(self, position: float) -> float:
        """Return what the rotary sensor shows at a position (m)."""
        counts = self._rig.truth["encoder_zero"] * sensors.COUNT - self._rig.truth["sensor_zero"]
        return super().reading(position + counts)
