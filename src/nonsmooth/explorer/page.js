/* The page's own controls. What a person does goes to the server as one line of JSON; what the page shows comes back so. */
(() => {
  const $ = id => document.getElementById(id);
  const all = which => [...document.querySelectorAll(which)];
  const node = (tag, {set, ...given}, ...within) => {
    const one = Object.assign(document.createElement(tag), given);
    if (set) one.dataset.set = set;
    one.append(...within);
    return one;
  };
  const on = (target, kind, hear) => target.addEventListener(kind, hear, target === document);
  const root = document.documentElement;
  let send = () => {}, count = 0, held = "", built = "", playing = 0, last = null;

  const act = (what, name, value) => { root.dataset.sent = ++count; send(JSON.stringify({do: what, name, value, n: count})); };
  const short = value => typeof value === "number" ? Number(value.toPrecision(7)).toString() : value;

  function fill(select, entries, chosen) {
    const key = JSON.stringify(entries);
    if (select.dataset.key !== key) {
      select.dataset.key = key;
      select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
    }
    select.value = chosen;
  }
  /* A control bears the name of the field that it sets, and shows the value that the server has of it. A field is sent
     when its text is complete, until then the server's values leave it alone; a slider is followed while it moves. */
  const put = (input, value) => { if (!input.dataset.open && input.value !== String(value)) input.value = value; };
  const commit = (name, value) => { act("set", name, value); act("end"); };
  on(document, "input", ({target: one}) => {
    const name = one.dataset.set;
    if (!name) return;
    if (one.type === "range") {
      held = name;
      for (const other of all(`[data-set="${name}"]`)) put(other, short(Number(one.value)));
      act("set", name, Number(one.value));
    } else if (one.tagName === "INPUT") one.dataset.open = "yes";
  });
  on(document, "change", ({target: one}) => {
    const name = one.dataset.set;
    if (!name) return;
    if (one.type === "range") { held = ""; act("end"); }
    else if (one.type === "checkbox") commit(name, one.checked);
    else if (one.tagName === "SELECT" || one.dataset.open) { delete one.dataset.open; commit(name, one.value); }
  });
  on(document, "keydown", ({key, target: one}) => {
    if (key === "Enter" && one.dataset.open) one.dispatchEvent(new Event("change"));
  });
  function show() {
    for (const one of last ? all("[data-set]") : []) {
      const name = one.dataset.set, value = last.state[name];
      if (value === undefined || name === held) continue;
      if (one.tagName === "SELECT") fill(one, last.choices[name], value);
      else if (one.type === "checkbox") one.checked = value;
      else put(one, short(value));
    }
  }

  function row(name, {html, unit}, ...slider) {
    const text = node("input", {id: "v-" + name, set: name, inputMode: "decimal", ariaLabel: name + (unit ? " in " + unit : "")});
    const head = node("div", {className: "name"}, node("b", {innerHTML: html}), node("span", {className: "unit", textContent: unit}), text);
    return node("div", {className: "parameter"}, head, ...slider, node("div", {className: "wrong", id: "wrong-" + name}));
  }

  function parameters(ui) {
    const key = JSON.stringify([ui.parameters.map(one => one.name), ui.states, ui.state.model]);
    if (key !== built) {
      built = key;
      $("parameters").replaceChildren(...ui.parameters.map(one => {
        const name = "p." + one.name;
        return row(name, one, node("input", {type: "range", id: "s-" + name, set: name, ariaLabel: name + ", slider"}));
      }));
      $("starts").replaceChildren(...ui.states.map(one => row("start." + one.name, one)));
    }
    for (const {name, low, high} of ui.parameters) {
      const range = $("s-p." + name);
      range.closest(".parameter").classList.toggle("over", name === ui.state.over);
      if (held !== "p." + name) Object.assign(range, {min: low, max: high, step: (high - low) / 1000});
    }
  }

  /* The tab that is chosen in each panel, with its controls and its figure. */
  function tabs(ui) {
    for (const list of all("[data-panel]")) {
      const chosen = ui.state[list.dataset.panel];
      for (const tab of list.children) {
        tab.setAttribute("aria-selected", tab.dataset.view === chosen);
        tab.tabIndex = tab.dataset.view === chosen ? 0 : -1;
      }
      for (const one of list.closest(".panel").querySelectorAll(".own, .view"))
        one.classList.toggle("away", !one.dataset.view.split(" ").includes(chosen));
    }
  }

  function render(ui) {
    last = ui;
    root.dataset.heard = ui.heard;
    fill($("model"), [...Object.entries(ui.models), ["", "build one …"]], ui.state.model);
    fill($("preset"), [["", "choose …"], ...ui.presets.map(one => [one, one])], "");
    $("preset-label").hidden = !ui.presets.length;
    parameters(ui);
    show();
    $("phase-box").hidden = !ui.forced;
    $("eta-label").hidden = ui.state.method !== "smoothed";
    [$("undo").disabled, $("redo").disabled] = ui.can.map(can => !can);
    for (const [name, legend] of Object.entries(ui.legends)) if ($("legend-" + name))
      $("legend-" + name).replaceChildren(...legend.map(([text, color, sign]) => node("span", {}, sign
        ? node("i", {className: "sign", style: "color:" + color, textContent: sign}) : node("i", {style: "background:" + color}), text)));
    $("tabs").hidden = ui.tabs < 2;
    $("tabs").textContent = `${ui.tabs} tabs`;
    tabs(ui);
    root.classList.toggle("dark", ui.dark);
    root.classList.toggle("large", ui.large);
    window.history.replaceState(null, "", "?" + ui.query);
  }

  function readout(fields) {
    $("readout").replaceChildren(...fields.map(([name, value]) => node("span", {}, name + " ", node("b", {textContent: value}))));
  }

  function progress(box, fraction, text) {
    const bar = box.querySelector("progress");
    if (fraction) bar.value = fraction; else bar.removeAttribute("value");
    box.querySelector("span").textContent = text;
  }

  function busy(told) {
    root.dataset.busy = told.view;
    $("busy").hidden = !told.long;
    if (!told.long) return;
    progress($("busy"), told.fraction, told.compiling ? `${told.view}: compiling` : told.view);
  }

  function notes(told) {
    for (const box of all(".note")) {
      const text = told[box.id.slice(0, -5)];
      box.hidden = !text;
      box.textContent = text || "";
    }
    for (const box of all(".wrong")) box.textContent = told[box.id.slice(6)] || "";
    const rest = Object.keys(told).filter(name => !$(name + "-note") && !$("wrong-" + name));
    if (rest.length && !told.page) { $("page-note").hidden = false; $("page-note").textContent = told[rest[0]]; }
  }

  function file(told) {
    const bytes = Uint8Array.from(atob(told.content), letter => letter.charCodeAt(0));
    const href = URL.createObjectURL(new Blob([bytes]));
    node("a", {href, download: told.name}).click();
    setTimeout(() => URL.revokeObjectURL(href), 10000);
  }

  function look(dark, large) {
    try { localStorage.setItem("nonsmooth-look", JSON.stringify({dark, large})); } catch { /* private windows */ }
    act("look", "", {dark, large});
  }

  function connect() {
    const doc = window.Bokeh && Bokeh.documents[0];
    const channel = doc && doc.get_model_by_name("act");
    if (!channel) return setTimeout(connect, 30);
    send = text => { channel.value = text; };
    const parts = (window.parts || []).map(part => part({$, node, on, act, show, file, progress}));
    for (const [name, hear] of Object.entries(Object.assign({ui: render, readout, busy, notes, file}, ...parts))) {
      const model = doc.get_model_by_name(name);
      const told = () => { if (model.value) hear(JSON.parse(model.value)); };
      model.properties.value.change.connect(told);
      told();
    }
    for (const list of all("[data-panel]")) {
      on(list, "click", event => {
        if (event.target.dataset.view) commit(list.dataset.panel, event.target.dataset.view);
      });
      on(list, "keydown", event => {
        const step = {ArrowRight: 1, ArrowLeft: -1}[event.key], all = [...list.children];
        if (!step) return;
        const next = all[(all.indexOf(event.target) + step + all.length) % all.length];
        next.focus();
        next.click();
      });
    }
    on($("model"), "change", () => {
      if ($("model").value) return act("model", "", $("model").value);
      $("model").value = last.state.model;
      document.dispatchEvent(new Event("build"));
    });
    on($("preset"), "change", () => { if ($("preset").value) act("preset", "", $("preset").value); });
    on($("play"), "click", () => {
      if (playing) { clearInterval(playing); playing = 0; act("end"); } else
        playing = setInterval(() => act("set", "phase", Math.round((last.state.phase + 0.01) * 1e6 % 1e6) / 1e6), 80);
      $("play").textContent = playing ? "❚❚" : "▶";
    });
    on($("save"), "click", () => act("save", "", {view: $("save-view").value, kind: $("save-kind").value}));
    for (const name of ["undo", "redo", "reset"]) on($(name), "click", () => act(name));
    on($("dark"), "click", () => look(!last.dark, last.large));
    on($("large"), "click", () => look(last.dark, !last.large));
    on(document, "keydown", event => {
      const writing = /^(INPUT|SELECT|TEXTAREA)$/.test(document.activeElement.tagName) && document.activeElement.type !== "range";
      if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !writing) {
        event.preventDefault();
        act(event.shiftKey ? "redo" : "undo");
      } else if (!writing && !event.ctrlKey && !event.metaKey && !event.altKey) {
        if (event.key === "d") $("dark").click();
        if (event.key === "l") $("large").click();
      }
    });
    let stored = null;
    try { stored = JSON.parse(localStorage.getItem("nonsmooth-look")); } catch { /* private windows */ }
    if (stored && (stored.dark || stored.large)) look(stored.dark, stored.large);
    act("begin");
    root.dataset.ready = "yes";
  }
  connect();
})();
