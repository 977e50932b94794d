/* Three steps for a first visit, in a line of their own above the views: they cover nothing. The page stays usable beside them; Escape ends them, and ? begins again. */
(window.parts = window.parts || []).push(({$, on}) => {
  const box = $("tour"), known = "nonsmooth-tour";
  const steps = [
    ["parameters", "Drag a parameter", "Move a slider, or type a value: diagram, orbit and section follow. Undo brings everything back, and the page's address keeps it."],
    ["upper", "Click a column", "The other views then show the motion there. Zoom, and the diagram is computed anew. The tabs hold a frequency response and a chart over two parameters."],
    ["plane", "Click to start", "A click in the phase plane is a new initial state; the tab Basins shows which attractor each one reaches."],
  ];
  let at = -1;

  function show(step) {
    for (const [id] of steps) $(id).classList.remove("toured");
    at = step;
    box.hidden = !(step in steps);
    if (box.hidden) {
      try { localStorage.setItem(known, "seen"); } catch { /* private windows */ }
      return;
    }
    const [id, title, text] = steps[step], target = $(id);
    target.classList.add("toured");
    $("tour-title").textContent = `${step + 1} / ${steps.length}  ${title}`;
    $("tour-text").textContent = text;
    $("tour-next").textContent = step + 1 < steps.length ? "Next" : "Done";
    $("tour-next").focus();
  }
  on($("tour-next"), "click", () => show(at + 1));
  on($("tour-end"), "click", () => show(-1));
  on($("help"), "click", () => show(0));
  on(document, "keydown", event => { if (event.key === "Escape" && !box.hidden) show(-1); });
  let seen = "seen";
  try { seen = localStorage.getItem(known); } catch { /* private windows */ }
  if (!seen) show(0);
});
