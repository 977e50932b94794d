/* The mechanism in motion beside the sliders, and the equations of the system. */
(window.parts = window.parts || []).push(({$, node, on}) => {
  const canvas = $("sketch"), paint = canvas.getContext("2d");
  let told = null, at = 0, held = matchMedia("(prefers-reduced-motion: reduce)").matches;

  function draw() {
    const [left, right, bottom, top] = told.paper, width = canvas.clientWidth, dense = window.devicePixelRatio || 1;
    const unit = Math.min(width / (right - left), 9 * parseFloat(getComputedStyle(canvas).fontSize) / (top - bottom));
    const high = unit * (top - bottom), aside = (width - unit * (right - left)) / 2;
    if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(high * dense)) {
      canvas.width = Math.round(width * dense); canvas.height = Math.round(high * dense); canvas.style.height = high + "px";
    }
    paint.setTransform(dense, 0, 0, dense, 0, 0);
    paint.clearRect(0, 0, width, high);
    const x = one => aside + unit * (one - left), y = one => unit * (top - one);
    const kinds = {
      line: (xs, ys, color, weight, fill) => {
        let down = false;
        paint.beginPath();
        xs.forEach((a, i) => {
          if (a === null || ys[i] === null) { down = false; return; }
          down ? paint.lineTo(x(a), y(ys[i])) : paint.moveTo(x(a), y(ys[i]));
          down = true;
        });
        if (fill) { paint.fillStyle = fill; paint.fill(); }
        paint.strokeStyle = color; paint.lineWidth = 1.15 * weight; paint.stroke();
      },
      text: (a, b, words, color, size, across, up) => {
        paint.font = `italic ${Math.max(0.24 * unit * size, 9)}px "STIX Two Text", Georgia, "Liberation Serif", serif`;
        paint.textAlign = across; paint.textBaseline = {center: "middle", va: "middle"}[up] || up;
        paint.fillStyle = color; paint.fillText(words, x(a), y(b));
      },
    };
    for (const [kind, ...given] of [...told.still, ...told.frames[at]]) kinds[kind](...given);
    canvas.dataset.at = at;
  }
  const hold = () => { held = !held; };
  on(canvas, "click", hold);
  on(canvas, "keydown", event => { if (event.key === " ") { event.preventDefault(); hold(); } });
  setInterval(() => {
    if (!told || held || document.hidden) return;
    at = (at + 1) % told.frames.length;
    draw();
  }, 50);

  return {
    sketch(now) {
      told = now;
      canvas.hidden = !told;
      if (told) { at %= told.frames.length; draw(); }
    },
    equations(rows) {
      $("equations").lastElementChild.replaceChildren(...rows.flatMap(([head, html]) =>
        [...(head ? [node("b", {textContent: head})] : []), node("div", {innerHTML: html})]));
    },
  };
});
