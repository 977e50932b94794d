/* The form of a system of elements: numbers and choices go to the server, which writes the Python of them and says what is wrong. */
(window.parts = window.parts || []).push(({act, file}) => {
  const $ = id => document.getElementById(id);
  let told = {link: {}, kinds: {}, most: 4, python: "", built: 0}, begun = false;

  const node = (tag, given, ...within) => { const one = Object.assign(document.createElement(tag), given); one.append(...within); return one; };
  const number = (key, value, label) => {
    const one = node("input", {className: "short", inputMode: "decimal", value});
    one.dataset.key = key;
    one.setAttribute("aria-label", label);
    one.addEventListener("change", changed);
    return one;
  };
  const choice = (key, options, label) => {
    const one = node("select", {}, ...options.map(([value, text]) => new Option(text, value)));
    one.dataset.key = key;
    one.setAttribute("aria-label", label);
    one.addEventListener("change", changed);
    return one;
  };
  const remove = row => {
    const one = node("button", {textContent: "×", title: "remove"});
    one.setAttribute("aria-label", "remove");
    one.addEventListener("click", () => { row().remove(); arrange(); changed(); });
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

  document.addEventListener("build", () => {
    if (!begun) { begun = true; addMass(0.5); addElement("stop"); }
    $("building").showModal();
    changed();
  });
  $("building-close").addEventListener("click", () => $("building").close());
  $("building-mass").addEventListener("click", () => { addMass(0); changed(); });
  $("building-omega").addEventListener("change", changed);
  for (const one of $("building").querySelectorAll("button[data-kind]"))
    one.addEventListener("click", () => { addElement(one.dataset.kind); changed(); });
  $("building-save").addEventListener("click", () => file({name: "system.py", content: btoa(told.python)}));
  $("building-explore").addEventListener("click", () => act("build", "building", form()));

  return {building(now) {
    if (now.built !== told.built) $("building").close();
    told = now;
    $("building-python").textContent = now.python;
    for (const id of ["building-explore", "building-save"]) $(id).disabled = !now.python;
  }};
});
