"""``animate``: the moving sketch of a run, its phase plane and its history, as a file or in a notebook."""

from __future__ import annotations

import base64
import io
import os
import uuid
from collections.abc import Iterator
from pathlib import Path
from subprocess import CalledProcessError
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.errors import Answering, DataFileError
from nonsmooth.plot import style
from nonsmooth.plot.labels import columns, first_states, name_plane, variable_along
from nonsmooth.plot.mechanism import sketch_of_run
from nonsmooth.plot.pen import put
from nonsmooth.plot.trajectories import with_gaps
from nonsmooth.results.whole import REMEDY, placed
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Natural, Positive, at_least
from nonsmooth.system.origin import system_of
from nonsmooth.tables.sampled import sampled

if TYPE_CHECKING:
    import xarray as xr
    from PIL import Image

_COLORS = 48  # of a palette: lines and letters need few
_TRAIL = 0.2  # of the run: the length of the bright end of an orbit
_PLOTS = ((0, 1), (3, 2))  # abscissa and ordinate of each: two of the plane, the history over time


@checked
def animate(
    run: xr.Dataset,
    *,
    x: str | None = None,
    y: str | None = None,
    history: str | None = None,
    seconds: Positive = 6.0,
    rate: Natural = 20,
    pixels: Annotated[int, at_least(100)] = 720,
) -> Animation:
    """Animate a run: the sketch of its mechanism, the plane of two states and the history of one, together.

    Parameters
    ----------
    run : xarray.Dataset
        Of :func:`nonsmooth.simulate`; whole periods make a loop without a seam.
    x, y : str, optional
        States or outputs of the plane; the first coordinate and its speed where not given.
    history : str, optional
        State or output over time, such as a force; ``x`` where not given.
    seconds : float
        How long the whole run lasts on the screen.
    rate : int
        Pictures per second.
    pixels : int
        Width of a picture.

    Returns
    -------
    Animation
        ``.save("run.gif")`` (also ``.mp4`` and ``.html``, a page with a player of its own); a notebook shows the
        player. Positions are those at even instants, computed as :func:`nonsmooth.table` does. Displacements and gaps
        in the sketch are to one scale, the size of the masses is not. A system without masses on a line has no sketch.

    Raises
    ------
    ValueError, TypeError
        Not a run; a name that it does not have; lengths that are not positive.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> oscillator = ns.models.impact_oscillator(omega=0.8, d=0.5)
    >>> moving = ns.animate(ns.simulate(oscillator, periods=2, transient=50), seconds=1.0, rate=10)
    >>> len(moving)
    10
    """
    variable_along(run, "u", "simulate")
    if not seconds * rate <= 5000:
        raise ValueError(f"seconds = {seconds!r} at rate = {rate!r}: from 1 to 5000 pictures are made")
    n = max(1, round(seconds * rate))
    time = run["time"].values
    at = sampled(run, None, np.linspace(time[0], time[-1], n, endpoint=False) if n > 1 else time[:1])
    sketch = sketch_of_run(system_of(run), at)
    own = (None, None) if sketch is None else sketch[0].scheme.pairs[0]
    names = first_states(run, x or own[0], y or own[1])
    return Animation(run, at, sketch, [*names, history or names[0]], rate, pixels)


class Animation(Answering):
    """Pictures of a run in motion, drawn when they are asked for; :func:`animate` makes it."""

    def __init__(self, run: xr.Dataset, at: xr.Dataset, sketch: Any, names: list[str], rate: int, pixels: int) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.rate, self._run, self._sketch = rate, run, sketch
        self._made, self._ends, self._dots = list[Any](), list[Any](), list[Any]()
        self._curves, self._at = ([*columns(one, "u", names), one["time"].values] for one in (run, at))
        self._time, self._drawn = self._at[-1], self._curves[-1]
        width, plots, high = 6.0, 2.1, 0.0
        if sketch is not None:
            paper = sketch[0]
            high = min(2.2, width * (paper.top - paper.bottom) / max(paper.width, 4.2))
        with style.journal():
            self.figure = Figure(figsize=(width, plots + high + 0.1), dpi=pixels / width)
            FigureCanvasAgg(self.figure)
            sizes: style.Properties = {"height_ratios": [high, plots][not high :], "width_ratios": [1.0, 1.5]}
            grid = self.figure.add_gridspec(1 + bool(high), 2, hspace=0.1, wspace=0.24, **sizes)
            grid.update(left=0.1, right=0.98, bottom=0.42 / (plots + high), top=0.98)
            plane, over = (self.figure.add_subplot(grid[-1, k]) for k in (0, 1))
            if sketch is not None:
                self._paper = self.figure.add_subplot(grid[0, :])
                paper.frame(self._paper, room=max(0.0, 0.5 * (4.2 - paper.width)))
            over.set_xlim(self._drawn[0], self._drawn[-1])
            whole, titles = with_gaps(run, *self._curves), [*names, "time"]
            for ax, (x, y) in zip((plane, over), _PLOTS, strict=True):
                ax.plot(whole[x], whole[y], color=style.COLORS["pale"], linewidth=0.8)
                name_plane(ax, run, titles[x], titles[y])
                self._ends += ax.plot([], [], color=style.COLORS["first"], linewidth=1.3)
                self._dots += ax.plot([], [], "o", color=style.COLORS["second"], markersize=5)

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._time)

    def draw(self, k: int) -> None:
        """Bring the figure to picture k."""
        with style.journal():
            self._wipe()
            if self._sketch is not None:
                self._made = put(self._paper, self._sketch[1](k))
            now, whole = self._time[k], self._drawn[-1] - self._drawn[0]
            rows = slice(*np.searchsorted(self._drawn, [now - _TRAIL * whole, now], side="right"))
            trails = with_gaps(self._run.isel(time=rows), *(one[rows] for one in self._curves))
            for line, dot, (x, y) in zip(self._ends, self._dots, _PLOTS, strict=True):
                line.set_data(trails[x], trails[y])
                dot.set_data([self._at[x][k]], [self._at[y][k]])

    def _wipe(self) -> None:
        """Take what moves out of the sketch."""
        while self._made:
            self._made.pop().remove()

    def images(self) -> Iterator[Image.Image]:
        """The pictures, with few colours, all of one palette. What does not move is drawn once."""
        from PIL import Image

        canvas: Any = self.figure.canvas
        moving = [*self._ends, *self._dots]
        for one in moving:
            one.set_animated(True)
        self._wipe()
        with style.journal():
            canvas.draw()
        still = canvas.copy_from_bbox(self.figure.bbox)

        def picture(k: int) -> Image.Image:
            self.draw(k)
            canvas.restore_region(still)
            for one in (*self._made, *moving):
                one.axes.draw_artist(one)
            return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

        palette = picture(len(self) // 2).quantize(_COLORS, dither=Image.Dither.NONE)
        colors = np.reshape(palette.getpalette() or [], (-1, 3))
        palette.putpalette(np.where(colors.min(axis=1, keepdims=True) > 245, 255, colors).ravel().tolist())  # paper
        for k in range(len(self)):
            yield picture(k).quantize(palette=palette, dither=Image.Dither.NONE)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write it to ``path``: ``.gif``, ``.mp4`` (needs the program ffmpeg) or ``.html``, a page with a player.

        Raises
        ------
        ValueError
            Another ending.
        ImportError
            ``.mp4`` where there is no ffmpeg.
        DataFileError
            A folder that does not exist, a file that cannot be written, a full disk; what stood there stays.
        """
        target = Path(path)
        if target.suffix not in (".gif", ".mp4", ".html"):
            raise ValueError(f"{target}: an animation is saved as .gif, .mp4 or .html")
        with placed(target) as fresh:
            if target.suffix == ".mp4":
                self._film(fresh)
            elif target.suffix == ".gif":
                first, *others = self.images()
                first.save(
                    fresh,
                    save_all=True,
                    append_images=others,
                    duration=round(1000 / self.rate),
                    loop=0,
                    optimize=False,
                    disposal=1,
                )
            else:
                head = '<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>nonsmooth</title>\n'
                head += '<meta name="viewport" content="width=device-width">\n'
                fresh.write_text(f"{head}<body>{self._repr_html_()}</body></html>\n", encoding="utf-8")
        return target

    def _film(self, target: Path) -> None:
        import matplotlib as mpl
        from matplotlib.animation import FFMpegWriter, FuncAnimation

        settings: Any = {}
        if not FFMpegWriter.isAvailable():
            try:
                import imageio_ffmpeg
            except ImportError:
                raise ImportError(
                    f"{target.name}: .mp4 needs the program ffmpeg, which is not there: python -m pip install "
                    "imageio-ffmpeg; a .gif or a .html needs nothing"
                ) from None
            settings = {"animation.ffmpeg_path": imageio_ffmpeg.get_ffmpeg_exe()}
        with mpl.rc_context(settings):
            film = FuncAnimation(self.figure, self.draw, frames=len(self), repeat=False)
            writer = FFMpegWriter(fps=self.rate, extra_args=["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"])
            try:
                film.save(target, writer=writer)
            except CalledProcessError as error:
                why = " ".join(str(error.stderr or "").splitlines()[-1:])
                raise DataFileError(f"{target.name}: ffmpeg has written no film ({why}); {REMEDY}") from error

    def _repr_html_(self) -> str:
        """The pictures with a player of its own; nothing is loaded from elsewhere."""
        frames = []
        for image in self.images():
            file = io.BytesIO()
            image.save(file, format="png")
            frames.append(base64.b64encode(file.getvalue()).decode())
        name = f"a{uuid.uuid4().hex[:12]}"
        player = _PLAYER.replace("NAME", name).replace("LAST", str(len(frames) - 1))
        player = player.replace("DELAY", str(round(1000 / self.rate)))
        return player.replace("FRAMES", ",".join(f'"{one}"' for one in frames))


_PLAYER = """<div id="NAME" style="display:inline-block;max-width:100%">
<img alt="A mechanism in motion, its phase plane and its history" style="max-width:100%;display:block">
<div style="display:flex;gap:.6em;align-items:center;font:14px sans-serif">
<button type="button">pause</button>
<input type="range" min="0" max="LAST" value="0" aria-label="picture" style="flex:1">
<label>speed <select><option value="4">1/4</option><option value="2">1/2</option><option value="1" selected>1</option>
<option value="0.5">2</option></select></label></div>
<script>
(() => {
  const box = document.getElementById("NAME"), frames = [FRAMES];
  const [image, button, slider, speed] = ["img", "button", "input", "select"].map((tag) => box.querySelector(tag));
  let timer = null;
  const show = (k) => { slider.value = k; image.src = "data:image/png;base64," + frames[k]; };
  const stop = () => { clearTimeout(timer); timer = null; button.textContent = "play"; };
  const step = () => {
    show((Number(slider.value) + 1) % frames.length);
    timer = setTimeout(step, DELAY * Number(speed.value));
  };
  const play = () => { button.textContent = "pause"; step(); };
  button.onclick = () => (timer === null ? play() : stop());
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  show(0);
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) stop(); else play();
})();
</script></div>"""
