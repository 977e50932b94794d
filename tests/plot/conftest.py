"""The rule that holds for every picture of a test: nothing drawn leaves its axes, and it fills half their breadth."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import QuadMesh


@pytest.fixture
def window() -> None:
    """The test's pictures are windows: they show a part of what is drawn, as an image does of the lines over it."""


@pytest.fixture(autouse=True)
def whole_pictures(request: pytest.FixtureRequest) -> Iterator[None]:
    """No line that a test has drawn leaves its axes, and all that is drawn fills more than half of their breadth."""
    plt.close("all")
    yield
    every = [ax for number in plt.get_fignums() for ax in plt.figure(number).axes]
    plt.close("all")
    if "window" in request.fixturenames:
        return
    for ax in every:
        breadth = np.ptp(ax.dataLim.intervalx)
        assert not 0 < breadth < np.inf or ax.get_xscale() != "linear" or breadth > 0.5 * np.ptp(ax.get_xlim())
        image = any(isinstance(one, QuadMesh) for one in ax.collections)
        for line in ax.lines if not image else ():
            if line.get_transform() != ax.transData:
                continue
            for values, limits in zip(line.get_data(), (ax.get_xlim(), ax.get_ylim()), strict=True):
                drawn, room = np.asarray(values, float), 1e-9 * np.ptp(limits)
                assert min(limits) - room <= np.nanmin(drawn, initial=np.inf), line.get_label()
                assert np.nanmax(drawn, initial=-np.inf) <= max(limits) + room, line.get_label()
