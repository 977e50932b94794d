"""``ParameterSet``: a model's parameters as identified, with covariance, ready for ``System.with_parameters``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import Answering, check_keys
from nonsmooth.identification.finding import Estimate, Finding, normal_draws
from nonsmooth.results.provenance import ATTRIBUTE, attribute, package_version, read_provenance, with_short_record
from nonsmooth.results.representation import cut, html_table, text_table
from nonsmooth.system.kinds import ends

_COLUMNS = ("value", "uncertainty", "half_width", "logarithmic")
_ROUNDS = 100  # in which draws within bounds are looked for


class ParameterSet(Answering, Mapping[str, float]):
    """Parameters by name, with what is known of how well: ``system.with_parameters(parameter_set)``.

    Parameters
    ----------
    estimates : mapping of str to Estimate
        The model's parameters.
    covariance : array (p + e, p + e)
        Of the parameters and then ``extra``, in order.
    extra : mapping of str to Estimate
        What is not a parameter of the model: ``omega_0``, ``friction``, ...
    findings : sequence of Finding
    identifiability : mapping of str to str
        For each parameter a sentence: what its value rests on, and what the data do not say.
    notes : sequence of str
    anomalies : sequence of str
        What contradicts itself, in the recordings or between them and the notebook: while one stands, a parameter may
        be wrong by more than its uncertainty.
    synthetic : bool
        Whether it was identified from computed recordings.
    bounds : mapping of str to (low, high)
        Within which parameters were searched, and are drawn; None: none.
    """

    __slots__ = (
        "_covariance",
        "anomalies",
        "bounds",
        "estimates",
        "extra",
        "findings",
        "identifiability",
        "notes",
        "synthetic",
    )
    estimates: Mapping[str, Estimate]
    extra: Mapping[str, Estimate]
    findings: tuple[Finding, ...]
    identifiability: Mapping[str, str]
    bounds: Mapping[str, tuple[float | None, float | None]]
    notes: tuple[str, ...]
    anomalies: tuple[str, ...]
    synthetic: bool
    _covariance: FloatArray

    def __init__(
        self,
        estimates: Mapping[str, Estimate],
        covariance: Any,
        *,
        extra: Mapping[str, Estimate] | None = None,
        findings: Sequence[Finding] = (),
        identifiability: Mapping[str, str] | None = None,
        notes: Sequence[str] = (),
        anomalies: Sequence[str] = (),
        synthetic: bool = False,
        bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    ) -> None:
        for name, one in {**estimates, **(extra or {})}.items():
            if not isinstance(one, Estimate):
                raise TypeError(
                    f"{name} = {one!r} is no estimate; give nonsmooth.identification.Estimate(value, uncertainty, unit)"
                )
        matrix, n = np.array(covariance, float), len(estimates) + len(extra or {})
        if matrix.shape != (n, n):
            raise ValueError(f"covariance must be ({n}, {n}): parameters, then extra; got {matrix.shape}")
        matrix.flags.writeable = False
        mappings = {"estimates": estimates, "extra": extra, "identifiability": identifiability, "bounds": bounds}
        held = {
            **{name: MappingProxyType(dict(given or {})) for name, given in mappings.items()},
            "findings": tuple(findings),
            "notes": tuple(notes),
            "anomalies": tuple(anomalies),
            "synthetic": bool(synthetic),
            "_covariance": matrix,
        }
        for name, value in held.items():
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(
            ParameterSet, dict(self.estimates), self._covariance, extra=dict(self.extra), **self._beside()
        ), ()

    def _beside(self) -> dict[str, Any]:
        """Findings and sentences that go with the numbers, as arguments."""
        held = {name: getattr(self, name) for name in ("findings", "notes", "anomalies", "synthetic")}
        return held | {"identifiability": dict(self.identifiability), "bounds": dict(self.bounds)}

    @property
    def _rows(self) -> dict[str, Estimate]:
        """The parameters, then what is in ``extra``."""
        return {**self.estimates, **self.extra}

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a ParameterSet does not change (tried to set {name!r})")

    def _elsewhere(self, name: str) -> str:
        if name not in self.estimates:
            return ""
        return f": found[{name!r}] is the value, found.estimates[{name!r}] that with its uncertainty"

    def __getitem__(self, name: str) -> float:
        if name not in self.estimates:
            raise KeyError(f"{name!r} was not identified; there are: {', '.join(self.estimates)}")
        return self.estimates[name].value

    def __iter__(self) -> Iterator[str]:
        return iter(self.estimates)

    def __len__(self) -> int:
        return len(self.estimates)

    @property
    def uncertainty(self) -> dict[str, float]:
        """Standard uncertainty of each parameter."""
        return {name: estimate.uncertainty for name, estimate in self.estimates.items()}

    @property
    def covariance(self) -> xr.DataArray:
        """Covariance of the model's parameters, ``parameter`` x ``other``."""
        names = list(self.estimates)
        return self.full_covariance.sel(parameter=names, other=names)

    @property
    def full_covariance(self) -> xr.DataArray:
        """Covariance of the parameters and of what is in ``extra``."""
        return xr.DataArray(self._covariance, {name: [*self._rows] for name in ("parameter", "other")})

    @property
    def residuals(self) -> xr.Dataset:
        """Readings, fit and residuals over ``sample``, of a set that :func:`nonsmooth.fit` found.

        Raises
        ------
        ValueError
            If it was not made by a fit in this session: residuals are not kept in files.
        """
        other = ", and those of steady states are in .steady" if "steady states" in self._data else ""
        return self._data_of("fit", f"residuals: they are those of a fit to records in this session{other}")

    @property
    def steady(self) -> xr.Dataset:
        """Readings of steady states, fit and residuals over ``sample``, of a set that :func:`nonsmooth.fit` found.

        Raises
        ------
        ValueError
            If no such readings were fitted in this session.
        """
        return self._data_of("steady states", "readings of steady states: they are those of a fit made in this session")

    @property
    def posterior(self) -> xr.DataArray:
        """Draws of all unknowns over ``draw`` and ``parameter``, of a set that ``fit(..., posterior=)`` found.

        Raises
        ------
        ValueError
            If there are none: they are asked for, and not kept in files.
        """
        return self._data_of("posterior", "posterior: ask for one, ns.fit(..., posterior=2000), in this session")[
            "value"
        ]

    @property
    def _data(self) -> dict[str, xr.Dataset]:
        """Data of the findings that have some."""
        return {one.name: one.data for one in self.findings if one.data is not None}

    def _data_of(self, name: str, lacking: str) -> xr.Dataset:
        if name not in self._data:
            raise ValueError(f"this set holds no {lacking}")
        return self._data[name]

    def estimate(self, name: str) -> Estimate:
        """A parameter or an extra quantity with all that is known of it.

        Raises
        ------
        ValueError
            If there is none of that name.
        """
        if name not in self._rows:
            raise ValueError(f"{name!r} was not identified; there are: {', '.join(self._rows)}")
        return self._rows[name]

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """The interval that holds a parameter (or an extra quantity) with this probability."""
        return self.estimate(name).interval(level)

    def only(self, names: Sequence[str] | str, note: str = "") -> ParameterSet:
        """The same set with these parameters alone; the others go to ``extra``, with their covariance."""
        names = [names] if isinstance(names, str) else names
        check_keys(names, self.estimates, "only", "a parameter", "this set")
        kept = {name: estimate for name, estimate in self.estimates.items() if name in names}
        extra = {name: estimate for name, estimate in self._rows.items() if name not in kept}
        matrix = self.full_covariance.sel(parameter=[*kept, *extra], other=[*kept, *extra])
        notes = [*self.notes, note] if note else self.notes
        return ParameterSet(kept, matrix, extra=extra, **self._beside() | {"notes": notes})

    def draw(self, n: int, seed: int = 0) -> dict[str, FloatArray]:
        """``n`` sets of the model's parameters, correlated as known, within their bounds; those known to a factor are
        log-normal.

        They are rows of the posterior where the set has one.

        Raises
        ------
        ValueError
            If next to none lies within the bounds, or the uncertainty of a parameter is infinite.
        """
        names, rng = list(self.estimates), np.random.default_rng(seed)
        if "posterior" in self._data:
            table = self.posterior.sel(parameter=names).values
            values = table[rng.integers(len(table), size=n)]
        else:
            logarithmic = [self.estimates[name].logarithmic and self[name] > 0 for name in names]
            low, high = np.array([ends(self.bounds.get(name, (None, None)), name) for name in names]).reshape(-1, 2).T
            values = np.empty((0, len(names)))
            for _ in range(_ROUNDS):
                rows = normal_draws([*self.values()], self.covariance.values, n, rng, logarithmic)
                inside = ((rows >= low) & (rows <= high)).all(axis=1)
                values = np.concatenate([values, rows[inside]])[:n]
                if len(values) == n:
                    break
            else:
                raise ValueError(
                    f"of {_ROUNDS * n} draws only {len(values)} lie within the bounds of the parameters, of which an "
                    "uncertainty is many times as wide: take others, found.only([...]), or fit(..., posterior=)"
                )
        return {name: values[:, i].copy() for i, name in enumerate(names)}

    def to_dataset(self) -> xr.Dataset:
        """All numbers and texts as a Dataset that ``nonsmooth.save`` takes; the findings' pictures stay behind."""
        rows = self._rows
        data = {name: ("parameter", [getattr(row, name) for row in rows.values()]) for name in _COLUMNS}
        record = {
            "version": package_version(),
            "verb": "identify",
            "synthetic": self.synthetic,
            "notes": list(self.notes),
            "anomalies": list(self.anomalies),
            "n_parameters": len(self.estimates),
            "identifiability": dict(self.identifiability),
            "bounds": {name: list(pair) for name, pair in self.bounds.items()},
            "units": [row.unit for row in rows.values()],
            "findings": [finding.to_record() for finding in self.findings],
        }
        found = xr.Dataset(
            {**data, "covariance": (("parameter", "other"), self._covariance.copy())},
            {"parameter": [*rows], "other": [*rows]},
            attribute(record) | {"synthetic": "yes" if self.synthetic else "no"},
        )
        return with_short_record(found.assign(logarithmic=found["logarithmic"].astype(np.int8)))

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> ParameterSet:
        """The set that `to_dataset` made the Dataset from, its findings without their pictures' data.

        Raises
        ------
        ValueError
            If the Dataset was not made so.
        """
        record = read_provenance(dataset) if ATTRIBUTE in dataset.attrs else {}
        if record.get("verb") != "identify":
            raise ValueError("this Dataset was not made by ParameterSet.to_dataset")
        columns = [dataset[name].values.tolist() for name in _COLUMNS]
        rows = {
            str(name): Estimate(v, u, unit, h, bool(g))
            for name, v, u, h, g, unit in zip(dataset["parameter"].values, *columns, record["units"], strict=True)
        }
        names, n = list(rows), record["n_parameters"]
        return cls(
            {name: rows[name] for name in names[:n]},
            dataset["covariance"].values,
            extra={name: rows[name] for name in names[n:]},
            findings=[*map(Finding.from_record, record["findings"])],
            identifiability=record["identifiability"],
            notes=record["notes"],
            anomalies=record.get("anomalies", ()),
            bounds={name: tuple(pair) for name, pair in record.get("bounds", {}).items()},
            synthetic=record["synthetic"],
        )

    def to_dataframe(self, level: float = 0.95) -> Any:  # a pandas.DataFrame
        """Return a table with a row for each parameter, then for each quantity in ``extra``.

        Parameters
        ----------
        level : float
            Probability of the interval from ``low`` to ``high``.

        Returns
        -------
        pandas.DataFrame
            Columns ``value``, ``uncertainty`` (standard), ``low``, ``high``, ``unit``, ``parameter_of_the_model`` and
            ``identifiability`` (the sentence, "" where there is none); the index holds the names.

        Examples
        --------
        >>> import nonsmooth as ns
        >>> from nonsmooth.identification.finding import Estimate
        >>> ns.ParameterSet({"k": Estimate(8.5, 0.1, "N/m")}, [[0.01]]).to_dataframe().loc["k", "unit"]
        'N/m'
        """
        import pandas as pd

        table = [
            (
                row.value,
                row.uncertainty,
                *row.interval(level),
                row.unit,
                name in self.estimates,
                self.identifiability.get(name, ""),
            )
            for name, row in self._rows.items()
        ]
        names = ["value", "uncertainty", "low", "high", "unit", "parameter_of_the_model", "identifiability"]
        return pd.DataFrame(table, pd.Index([*self._rows], name="name"), names)

    @property
    def _shown(self) -> list[tuple[str, str]]:
        """Name and value of each row; those of ``extra`` in brackets."""
        rows = [(name, f"= {estimate}") for name, estimate in self.estimates.items()]
        return rows + [(f"({name}", f"= {estimate})") for name, estimate in self.extra.items()]

    def __str__(self) -> str:
        lines = [self._title(), *(f"  {name} {value}" for name, value in self._shown)]
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines + [f"  ANOMALY: {sentence}" for sentence in self.anomalies])

    def __repr__(self) -> str:
        lines = [text_table(self._title(), self._shown, whole=False)]
        lines += [f"  ANOMALY: {cut(sentence)}" for sentence in self.anomalies]
        counts = {"findings": len(self.findings), "notes": len(self.notes)}
        if any(counts.values()):
            lines.append(f"  {', '.join(f'{n} {word}' for word, n in counts.items() if n)}: see .findings, .notes")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = [
            (name, str(row), self.identifiability.get(name, ""))
            for name, row in {**self.estimates, **{f"({name})": row for name, row in self.extra.items()}}.items()
        ]
        anomalies = [("ANOMALY", sentence, "") for sentence in self.anomalies]
        header = ("", "value", "rests on")
        return html_table(self._title(), anomalies + rows, header=header, details=self.notes, of="notes")

    def _title(self) -> str:
        return f"ParameterSet{' (synthetic recordings)' if self.synthetic else ''}"
