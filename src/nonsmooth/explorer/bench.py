"""The recording beside the model: a file dropped into the page, its channels, and the fit of the parameters to it."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.labels import html_of, number, plain_of, rows_of, symbols_of
from nonsmooth.explorer.recorded import (
    LARGEST,
    RecordedFile,
    Setup,
    forcing_period,
    frequency_of,
    matched,
)
from nonsmooth.explorer.work import periods_shown
from nonsmooth.explorer.worker import Answer, Worker
from nonsmooth.plot.labels import with_unit

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Page


class Bench:
    """The recording of a page. Reading and fitting run in a process of their own, so that the views go on."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.setup: Setup | None = None
        self.laid: Mapping[str, Any] | None = None
        self.doing, self._fraction = "", 0.0
        self._job: tuple[int, str, str] = (0, "", "")  # number, what, model
        self._count = 0
        self._worker: Worker | None = None
        self._unticked: set[str] = set()
        self._told: list[tuple[str, str]] = []

    @property
    def actions(self) -> dict[str, Callable[[str, Any], object]]:
        """Messages of the page that concern a recording."""
        return {
            "drop": self._drop,
            "fit": self._fit,
            "cancel": lambda *_: self._stop(),
            "unread": self._unread,
            "remove": self._remove,
            "take drive": self._take_drive,
        }

    # --- what a person does

    def _drop(self, name: str, value: Any) -> None:
        """Read a file, in place of the one that is there once it has been read."""
        file = PurePath(str(value["file"])).name[:120]
        try:
            content = base64.b64decode(str(value["content"]), validate=True)
        except (binascii.Error, ValueError):
            raise ValueError(f"{file}: the file did not arrive whole; drop it again") from None
        if len(content) > LARGEST:
            raise ValueError(_too_large(file, len(content)))
        self._start("reading", {"view": "read", "content": content, "name": file})

    def _unread(self, name: str, value: Any) -> None:
        """The page could not hand a file over, or did not for its size."""
        file, size = str(value["file"])[:120], int(value["size"])
        if size > LARGEST:
            raise ValueError(_too_large(file, size))
        raise ValueError(f"{file} cannot be read: is it a folder, or was it moved?")

    def set(self, name: str, value: Any) -> None:
        """Take the value of a field: ``fit.PARAMETER``, or one of the setup after ``recording.``."""
        if self.setup is None:
            raise ValueError("there is no recording yet; drop a file into the page")
        group, _, field = name.partition(".")
        if group == "recording":
            self.setup = self.setup.changed(field, value)
        elif field not in self.page.system.parameters:
            raise ValueError(f"{field[:40]!r} is no parameter of this model")
        else:
            (self._unticked.discard if value else self._unticked.add)(field)

    def _fit(self, name: str, value: Any) -> None:
        ticked = [one for one in self.page.system.parameters if one not in self._unticked]
        if self.setup is not None and self.setup.recorded.axis != "time":
            raise ValueError("a table over frequency holds no motion to fit; drop a record over time")
        if self.setup is None or (samples := self.setup.samples) is None:
            raise ValueError("there is nothing to fit to: choose the channel of a state")
        if not ticked:
            raise ValueError("tick the parameters that are to be found")
        self._told = []
        self._start(
            "fitting",
            {
                "view": "fit",
                "text": self.page.text,
                "values": dict(self.page.state.values),
                "method": "auto",
                "eta": 0.0,
                "parameters": ticked,
                "samples": samples,
            },
        )

    def _remove(self, name: str, value: Any) -> None:
        self._stop()
        self.setup = self.laid = None
        self._told = []
        self.page.notes.pop("recording", None)

    def _take_drive(self, name: str, value: Any) -> None:
        """Set the forcing period to the recorded one, by the parameter that alone makes it."""
        period = (self.laid or {}).get("drive")
        page = self.page
        found = {} if period is None else frequency_of(page.system, page.state.values, period)
        if not found:
            raise ValueError("no parameter of this model sets its forcing period by itself; set it by hand")
        page.past.put(replace(page.state, values={**page.state.values, **found}))

    # --- work in a process of its own

    def _start(self, what: str, job: dict[str, Any]) -> None:
        self._stop()
        self._count += 1
        self._job = self._count, what, self.page.state.model
        self.doing, self._fraction = what, 0.0
        self._worker = Worker.idle(lambda answer: self.page.later(self._hear, answer))
        self._worker.ask(self._count, job)

    def _stop(self) -> None:
        """End the work; nothing of it remains."""
        if self._worker is not None:
            self._worker.close()
        self._worker, self.doing = None, ""

    close = _stop

    def _hear(self, answer: Answer) -> None:
        kind, count, content = answer
        number_, what, model = self._job
        if self._worker is None or (kind != "ended" and count != number_):
            return
        if kind in ("progress", "compiling"):
            self._fraction = float(content) if kind == "progress" else self._fraction
            self.tell()
            return
        self._stop()
        if kind == "ended":
            self.page.notes["recording"] = (
                f"The process that was {what} ended unexpectedly (code {content}); nothing has changed."
            )
        elif kind == "error":
            self.page.notes["recording"] = str(content)
        elif what == "reading":
            self.page.notes.pop("recording", None)
            self.arrange(content[0]["recorded"])
        elif model == self.page.state.model:
            self._has_fitted(content[0])
        self.page.refresh()

    def _has_fitted(self, found: Mapping[str, Any]) -> None:
        """Write the parameters to the sliders, as one step that can be undone, and say how well they are known."""
        page = self.page
        page.past.put(replace(page.state, values={**page.state.values, **found["values"]}))
        symbols = symbols_of(page.system)
        self._told = [("warning", sentence) for sentence in found["anomalies"]]
        self._told += [(plain_of(symbols[name]), text) for name, text in found["told"].items()]
        every = "" if found["step"] == 1 else f", each {found['step']}th"
        self._told.append(("fitted to", f"{found['samples']} readings{every}"))

    # --- what the page asks for and shows

    def arrange(self, recorded: RecordedFile | None = None) -> None:
        """Find the channels of the present model's states, in another file or as after another model was chosen."""
        self.laid = None
        self._told = []
        self.page.work.done.pop("recording", None)
        system = self.page.system
        period = forcing_period(system, self.page.state.values)
        times = {} if period is None else frequency_of(system, self.page.state.values, 2 * period)
        self._unticked = set(times) | {name for name, one in system.parameters.items() if one.unit == "kg"}
        recorded = recorded or (None if self.setup is None else self.setup.recorded)
        self.setup = None if recorded is None else matched(recorded, system)

    def request(self, orbit: Mapping[str, Any], period: int) -> dict[str, Any] | None:
        """The request that lays the recording over the motion of this request."""
        samples = None if self.setup is None else self.setup.samples
        if samples is None or len(samples.time) < 8:
            return None
        state = self.page.state
        return {
            **orbit,
            "view": "recording",
            "samples": samples,
            "period": period,
            "periods": periods_shown(period),
            "phase": state.phase,
            "shown": state.x,
        }

    def response(self, over: str, state: str) -> tuple[Any, Any]:
        """Measured points of the frequency response; see :meth:`nonsmooth.explorer.recorded.Setup.response`."""
        return ((), ()) if self.setup is None else self.setup.response(self.page.state.values, over, state)

    def put(self, found: Mapping[str, Any]) -> None:
        """Take in what the worker found of the recording beside the motion; nothing where it was removed meanwhile."""
        self.laid = None if self.setup is None else found
        self.tell()

    def readout(self) -> list[tuple[str, str]]:
        """The distance for the line above the views."""
        far = None if self.laid is None else self.laid["distance"]
        if far is None:
            return []
        unit = self.page.system.states[far["of"]]
        name = plain_of(symbols_of(self.page.system)[far["of"]])
        return [("distance of the recording", f"{number(far['rms'], unit, 3)} rms in {name} ({far['part']:.1%})")]

    def tell(self) -> None:
        """The panel as it is now."""
        self.page.tell("recording", self._content())

    def fields(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Values of the fields of the panel, and the choices of those that have some."""
        if (setup := self.setup) is None:
            return {}, {}
        words = {name: with_unit(name, one.unit) for name, one in setup.channels.items()}
        choices = {"recording.run": {run: run for run in setup.recorded.runs}}
        choices |= {f"recording.channel.{state}": {"": "not recorded", **words} for state in setup.states}
        choices["recording.turns"] = {"": "not recorded", **words}
        values = {f"recording.{name}": getattr(setup, name) for name in ("run", "turns", "begin", "end")}
        for state, one in setup.states.items():
            values |= {f"recording.{what}.{state}": value for what, value in vars(one).items()}
        return values | {f"fit.{name}": name not in self._unticked for name in self.page.system.parameters}, choices

    def _content(self) -> dict[str, Any]:
        busy = {"doing": self.doing, "fraction": round(self._fraction, 3), "most": LARGEST}
        if (setup := self.setup) is None:
            return {**busy, "file": ""}
        recorded, system, laid = setup.recorded, setup.system, self.laid or {"distance": None, "why": ""}
        remarks = [*setup.unlike(), *filter(None, [laid["why"]])]
        if recorded.axis != "time":
            remarks.append("a table over frequency: it lies over the frequency response")
        if (far := laid["distance"]) is not None:
            remarks.append(
                f"{far['periods']} forcing periods compared; "
                f"the record's phase leads the model's by {round(far['shift'], 3) + 0.0:.3f} of a period"
            )
        drive = laid.get("drive")
        return {
            **busy,
            "file": recorded.file + (" (synthetic)" if recorded.synthetic else ""),
            "runs": len(recorded.runs),
            "unit": "s" if recorded.axis == "time" else "Hz",
            "rows": rows_of(system),
            "shown": [*setup.shown],
            "ticks": [{"name": name, "html": html_of(symbols_of(system)[name])} for name in system.parameters],
            "drive": "" if drive is None else f"forcing period {number(drive, 's', 5)} recorded",
            "found": self._told,
            "remarks": remarks,
            "more": list(recorded.remarks[:8]),
        }


def _too_large(file: str, size: int) -> str:
    return f"{file} has {size / (1 << 20):.0f} MiB; the page takes {LARGEST >> 20} MiB: export fewer runs"
