"""Animations: the pictures against the run, and the files that hold them."""

from __future__ import annotations

import base64
import io
import os
import re

import numpy as np
import pytest
from PIL import Image

import nonsmooth as ns
from nonsmooth.errors import DataFileError


@pytest.fixture(scope="module")
def moving():
    """Ten pictures of two periods of a free oscillator of frequency 1, x = cos t."""
    system = ns.mechanical(1.0, 0.0, 1.0, coordinates=["x"], parameters={})
    return ns.animate(ns.simulate(system, duration=4 * np.pi, start={"x": 1.0}), seconds=1.0, rate=10, pixels=360)


def test_each_picture_shows_its_instant(moving) -> None:
    assert len(moving) == 10
    for k in (0, 3, 7):
        moving.draw(k)
        t = 4 * np.pi * k / 10
        plane, over = moving._dots
        assert [float(v[0]) for v in plane.get_data()] == pytest.approx([np.cos(t), -np.sin(t)], abs=1e-9)
        assert [float(v[0]) for v in over.get_data()] == pytest.approx([t, np.cos(t)], abs=1e-9)
        (mass,) = [one.get_xy()[:, 0] for one in moving._paper.patches if len(one.get_xy()) == 5]
        sketch, _ = moving._sketch
        assert mass.min() - sketch.faces[0] == pytest.approx(sketch.scale * np.cos(t), abs=1e-9)


def test_gif_and_page(moving, tmp_path) -> None:
    with Image.open(moving.save(tmp_path / "run.gif")) as gif:
        assert gif.n_frames == 10
        assert gif.size[0] == 360
        assert gif.info["duration"] == 100
        assert gif.info["loop"] == 0
        first = gif.convert("RGB").tobytes()
        gif.seek(5)
        assert gif.convert("RGB").tobytes() != first
    page = moving.save(tmp_path / "run.html").read_text(encoding="utf-8")
    (held,) = re.findall(r"frames = \[(.*?)\]", page)
    pictures = re.findall(r'"([^"]+)"', held)
    assert len(pictures) == 10
    assert "setTimeout(step, 100 * Number(speed.value))" in page  # ms from picture to picture, at ten a second
    assert Image.open(io.BytesIO(base64.b64decode(pictures[3]))).size[0] == 360
    assert not re.search(r"(src|href)=[\"']?http", page)  # nothing from elsewhere
    assert moving._repr_html_().startswith("<div id=")


def test_pictures_are_those_of_the_whole_figure(moving, tmp_path) -> None:
    """Still parts are drawn once for all of them."""
    for k, picture in enumerate(moving.images()):
        if k in (0, 4, 9):
            moving.draw(k)
            with ns.plot.journal():
                moving.figure.savefig(tmp_path / "whole.png", dpi="figure")
            with Image.open(tmp_path / "whole.png") as whole:
                other = np.asarray(whole.convert("RGB"), dtype=int)
            far = np.abs(np.asarray(picture.convert("RGB"), dtype=int) - other).max(axis=2) > 60
            assert far.mean() < 1e-3, k


def test_a_film_needs_ffmpeg_and_says_how_to_get_it(moving, tmp_path, monkeypatch) -> None:
    import matplotlib.animation

    if matplotlib.animation.FFMpegWriter.isAvailable():
        assert moving.save(tmp_path / "run.mp4").stat().st_size > 1000
    monkeypatch.setattr(matplotlib.animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(ImportError, match=r"python -m pip install imageio-ffmpeg"):
        moving.save(tmp_path / "other.mp4")


@pytest.mark.skipif(os.name == "nt", reason="a script in place of a program")
def test_a_film_that_ffmpeg_gives_up_leaves_nothing(moving, tmp_path, monkeypatch) -> None:
    import matplotlib.animation

    program, film = tmp_path / "bin" / "ffmpeg", tmp_path / "run.mp4"
    program.parent.mkdir()
    words = ["#!/bin/sh", "for last; do :; done", 'echo half > "$last"', 'echo "No space left" >&2', "exit 1"]
    program.write_text("\n".join(words))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(matplotlib.animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: True))
    film.write_bytes(b"old")
    with pytest.raises(DataFileError, match=r"run\.mp4: ffmpeg has written no film \(No space left\); .*make room"):
        moving.save(film)
    assert film.read_bytes() == b"old" and {one.name for one in tmp_path.iterdir()} == {"bin", "run.mp4"}


def test_a_system_without_masses_has_plane_and_history() -> None:
    run = ns.simulate(ns.models.chua_circuit(), duration=2.0, start={"x": 0.1})
    pictures = list(ns.animate(run, seconds=0.4, rate=5, pixels=300).images())
    assert len(pictures) == 2


def test_what_does_not_fit_is_said(moving, tmp_path) -> None:
    run = ns.simulate(ns.models.impact_oscillator(), periods=1)
    for wrong, words in [
        (lambda: ns.animate(run, seconds=0.0), "seconds = 0.0 must be positive"),
        (lambda: ns.animate(run, seconds=1e6), "from 1 to 5000 pictures"),
        (lambda: ns.animate(run, y="z"), "neither a state nor an output"),
        (lambda: ns.animate(ns.poincare(ns.models.impact_oscillator(), n=2)), "not the result of simulate"),
        (lambda: moving.save("run.avi"), "saved as .gif, .mp4 or .html"),
    ]:
        with pytest.raises(ValueError, match=words):
            wrong()
    with pytest.raises(DataFileError, match="does not exist"):
        moving.save(tmp_path / "no" / "run.gif")
