/* The form of a system of elements: numbers and choices go to the server, which writes the Python of them and says what is wrong. */
(window.parts = window.parts || []).push(({$, node, on, act, file}) => {
  let told = {link: {}, kinds: {}, most: 4, python: "", built: 0}, begun = false;

  const input = (key, one) => { one.dataset.key = key; on(one, "change", changed); return one; };
  const number = (key, value, label) => input(key, node("input", {className: "short", inputMode: "decimal", value, ariaLabel: label}));
  const choice = (key, options, label) => input(key, node("select", {ariaLabel: label}, ...options.map(([value, text]) => new Option(text, value))));
  const remove = row => {
    const one = node("button", {textContent: "×", title: "remove", ariaLabel: "remove"});
    on(one, "click", () => { row().remove(); arrange(); changed(); });
    return one;
  };
  const values = row => Object.fromEntries([...row.querySelectorAll("[data-key]")].map(one => [one.dataset.key, one.value]));
  const form = () => ({
    masses: [...$("building-masses").children].map(values),
    elements: [...$("building-elements").children].map(row => ({kind: row.dataset.kind, ...values(row)})),
    omega: $("building-omega").value,
  });
  function changed() { act("form", "building", form()); }

  function addMass(force) {
    const row = node("tr", {}, node("td", {}));
    for (const [key, one] of Object.entries(told.link))
      row.append(node("td", {}, number(key, key === "F" ? force : one.value, one.label)));
    row.append(node("td", {}, remove(() => row)));
    $("building-masses").append(row);
    arrange();
  }
  function addElement(kind) {
    const about = told.kinds[kind], row = node("div", {className: "element"}, node("b", {textContent: about.label}), " at ");
    row.dataset.kind = kind;
    row.append(choice("at", [], "first mass"), " against ", choice("other", [], "second mass"));
    if (about.sided) row.append(" ", choice("side", [["above", "above it"], ["below", "below it"]], "side"));
    for (const [key, one] of Object.entries(about.arguments))
      row.append(node("label", {}, " " + one.label + " ", number(key, one.value, one.label), node("span", {className: "unit", textContent: one.unit === "1" ? "" : " " + one.unit})));
    row.append(" ", remove(() => row));
    $("building-elements").append(row);
    arrange();
  }
  /* The numbers of the masses, in their rows and in the choices of the elements. */
  function arrange() {
    const rows = [...$("building-masses").children];
    rows.forEach((row, i) => { row.firstChild.textContent = "mass " + (i + 1); row.lastChild.firstChild.disabled = rows.length === 1; });
    for (const select of $("building-elements").querySelectorAll("[data-key=at], [data-key=other]")) {
      const ground = select.dataset.key === "other" ? [["0", "the ground"]] : [], kept = select.value;
      select.replaceChildren(...[...ground, ...rows.map((row, i) => [i + 1, "mass " + (i + 1)])].map(([value, text]) => new Option(text, value)));
      if ([...select.options].some(one => one.value === kept)) select.value = kept;
    }
    $("building-mass").disabled = rows.length >= told.most;
    for (const one of $("building").querySelectorAll("[data-kind]"))
      if (one.tagName === "BUTTON") one.disabled = $("building-elements").children.length >= told.most;
  }

  on(document, "build", () => {
    if (!begun) { begun = true; addMass(0.5); addElement("stop"); }
    $("building").showModal();
    changed();
  });
  on($("building-close"), "click", () => $("building").close());
  on($("building-mass"), "click", () => { addMass(0); changed(); });
  on($("building-omega"), "change", changed);
  for (const one of $("building").querySelectorAll("button[data-kind]"))
    on(one, "click", () => { addElement(one.dataset.kind); changed(); });
  on($("building-save"), "click", () => file({name: "system.py", content: btoa(told.python)}));
  on($("building-explore"), "click", () => act("build", "building", form()));

  return {building(now) {
    if (now.built !== told.built) $("building").close();
    told = now;
    $("building-python").textContent = now.python;
    for (const id of ["building-explore", "building-save"]) $(id).disabled = !now.python;
  }};
});
