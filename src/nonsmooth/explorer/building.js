/* The form of a system of elements: the server holds what stands in it, writes the Python of it and says what is wrong. */
(window.parts = window.parts || []).push(({$, node, on, act, show, file}) => {
  let told = {built: 0}, drawn = "";

  const words = {at: "at", other: "against", side: "side"};
  const control = ([set, label]) => label ? node("input", {set, className: "short", inputMode: "decimal", ariaLabel: label})
    : node("select", {set, ariaLabel: words[set.split(".").pop()]});
  const remove = (name, disabled) =>
    node("button", {textContent: "×", title: "remove", ariaLabel: "remove", disabled, onclick: () => act("build remove", name)});

  on(document, "build", () => { $("building").showModal(); act("build form", "building"); });
  on($("building-close"), "click", () => $("building").close());
  on($("building"), "click", ({target: one}) => { if (one.dataset.add) act("build add", one.dataset.add); });
  on($("building-save"), "click", () => file({name: "system.py", content: btoa(told.python)}));
  on($("building-explore"), "click", () => act("build", "building"));

  return {building(now) {
    if (now.built !== told.built) $("building").close();
    told = now;
    const key = JSON.stringify([now.masses, now.elements]);
    if (key !== drawn) {
      drawn = key;
      $("building-masses").replaceChildren(...now.masses.map((row, i) => node("tr", {}, node("td", {textContent: "mass " + (i + 1)}),
        ...row.map(one => node("td", {}, control(one))), node("td", {}, remove("masses." + i, now.masses.length === 1)))));
      $("building-elements").replaceChildren(...now.elements.map((row, i) => node("div", {className: "element"}, node("b", {textContent: now.labels[i]}),
        ...row.map(one => node("label", {}, (one[1] || words[one[0].split(".").pop()]) + " ", control(one), node("span", {className: "unit", textContent: one[2] === "1" ? "" : " " + one[2]}))), remove("elements." + i))));
      show();
    }
    for (const one of $("building").querySelectorAll("[data-add]"))
      one.disabled = (one.dataset.add === "mass" ? now.masses : now.elements).length >= now.most;
    $("building-python").textContent = now.python;
    for (const id of ["building-explore", "building-save"]) $(id).disabled = !now.python;
  }};
});
