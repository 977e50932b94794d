/* The page's own controls. What a person does goes to the server as one line of JSON; what the page shows comes back so. */
(() => {
  const $ = id => document.getElementById(id);
  const root = document.documentElement;
  const say = {};
  let send = () => {}, count = 0, held = null, built = "", playing = 0, last = null;

  const act = (what, name, value) => { root.dataset.sent = ++count; send(JSON.stringify({do: what, name, value, n: count})); };
  const short = value => Number(Number(value).toPrecision(7)).toString();

  function fill(select, entries, chosen) {
    const key = JSON.stringify(entries);
    if (select.dataset.key !== key) {
      select.dataset.key = key;
      select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
    }
    select.value = chosen;
  }
  /* A field is sent when its text is complete; until then the server's values leave it alone. */
  function field(input, commit) {
    const done = () => { if (input.dataset.open) { delete input.dataset.open; commit(input.value); } };
    input.addEventListener("input", () => { input.dataset.open = "yes"; });
    input.addEventListener("change", done);
    input.addEventListener("keydown", event => { if (event.key === "Enter") done(); });
  }
  const put = (input, value) => { if (!input.dataset.open && input.value !== String(value)) input.value = value; };

  function row(name, label, unit, slider) {
    const box = document.createElement("div");
    box.className = "parameter";
    box.dataset.name = name;
    box.innerHTML = `<div class="name"><b>${label}</b><span class="unit"></span><input inputmode="decimal"></div>`;
    box.querySelector(".unit").textContent = unit;
    const text = box.querySelector("input");
    text.setAttribute("aria-label", name + (unit ? " in " + unit : ""));
    text.id = "v-" + name;
    if (slider) {
      const range = document.createElement("input");
      range.type = "range";
      range.id = "s-" + name;
      range.setAttribute("aria-label", name + ", slider");
      box.append(range);
    }
    const wrong = document.createElement("div");
    wrong.className = "wrong";
    wrong.id = "wrong-" + name;
    box.append(wrong);
    return box;
  }

  function parameters(ui) {
    const key = JSON.stringify(ui.parameters.map(one => one.name).concat(ui.states.map(one => one.name), ui.state.model));
    if (key !== built) {
      built = key;
      $("parameters").replaceChildren(...ui.parameters.map(one => {
        const box = row("p." + one.name, one.html, one.unit, true);
        const [text, range] = box.querySelectorAll("input");
        field(text, value => { act("set", "p." + one.name, value); act("end"); });
        range.addEventListener("input", () => {
          held = range;
          text.value = short(range.value);
          act("set", "p." + one.name, Number(range.value));
        });
        range.addEventListener("change", () => { held = null; act("end"); });
        return box;
      }));
      $("starts").replaceChildren(...ui.states.map(one => {
        const box = row("start." + one.name, one.html, one.unit, false);
        field(box.querySelector("input"), () =>
          act("set", "start", [...$("starts").querySelectorAll("input")].map(one => one.value)));
        return box;
      }));
    }
    for (const one of ui.parameters) {
      const text = $("v-p." + one.name), range = $("s-p." + one.name);
      range.closest(".parameter").classList.toggle("over", one.name === ui.state.over);
      if (held === range) continue;
      range.min = one.low; range.max = one.high; range.step = (one.high - one.low) / 1000;
      range.value = one.value;
      put(text, short(one.value));
    }
    ui.states.forEach(one => put($("v-start." + one.name), short(one.value)));
  }

  /* The tab that is chosen in each panel, with its controls and its figure. */
  function tabs(ui) {
    for (const list of document.querySelectorAll("[data-panel]")) {
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
    for (const name of ["method", "direction"]) fill($(name), Object.entries(ui.choices[name]), ui.state[name]);
    fill($("save-kind"), Object.entries(ui.kinds), $("save-kind").value || "pdf");
    fill($("over"), Object.entries(ui.plain), ui.state.over);
    for (const name of ["x", "y", "shown"]) fill($(name), ui.states.map(one => [one.name, one.plain]), ui.state[name]);
    for (const name of ["low", "high", "phase", "eta"]) put($(name), short(ui.state[name]));
    for (const name of ["transient", "keep", "columns"]) put($(name), ui.state[name]);
    if (held !== $("phase-slider")) $("phase-slider").value = ui.state.phase;
    $("phase-box").hidden = !ui.forced;
    $("eta-label").hidden = ui.state.method !== "smoothed";
    [$("undo").disabled, $("redo").disabled] = ui.can.map(can => !can);
    for (const [name, words] of Object.entries(ui.words)) fill($(name), Object.entries(words), ui.settings[name]);
    for (const [name, value] of Object.entries(ui.settings)) if (!(name in ui.words)) put($(name), short(value));
    for (const [name, legend] of Object.entries(ui.legends)) if ($("legend-" + name))
      $("legend-" + name).replaceChildren(...legend.flatMap(([text, color]) => {
        const dot = document.createElement("i");
        dot.style.background = color;
        return [dot, text];
      }));
    $("tabs").hidden = ui.tabs < 2;
    $("tabs").textContent = `${ui.tabs} tabs`;
    tabs(ui);
    parameters(ui);
    root.classList.toggle("dark", ui.dark);
    root.classList.toggle("large", ui.large);
    window.history.replaceState(null, "", "?" + ui.query);
  }

  function readout(fields) {
    $("readout").replaceChildren(...fields.map(([name, value]) => {
      const one = document.createElement("span"), bold = document.createElement("b");
      bold.textContent = value;
      one.append(name + " ", bold);
      return one;
    }));
  }

  function busy(told) {
    root.dataset.busy = told.view;
    $("busy").hidden = !told.long;
    if (!told.long) return;
    const bar = $("busy").querySelector("progress");
    if (told.fraction) bar.value = told.fraction; else bar.removeAttribute("value");
    $("busy").querySelector("span").textContent = told.compiling ? `${told.view}: compiling` : told.view;
  }

  function notes(told) {
    for (const box of document.querySelectorAll(".note")) {
      const text = told[box.id.slice(0, -5)];
      box.hidden = !text;
      box.textContent = text || "";
    }
    for (const box of document.querySelectorAll(".wrong")) box.textContent = told[box.id.slice(6)] || "";
    const rest = Object.keys(told).filter(name => !$(name + "-note") && !$("wrong-" + name));
    if (rest.length && !told.page) { $("page-note").hidden = false; $("page-note").textContent = told[rest[0]]; }
  }

  function file(told) {
    const bytes = Uint8Array.from(atob(told.content), letter => letter.charCodeAt(0));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([bytes]));
    link.download = told.name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
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
    const parts = (window.parts || []).map(part => part({act, field, put, fill, short, file}));
    for (const [name, hear] of Object.entries(Object.assign({ui: render, readout, busy, notes, file}, ...parts))) {
      const model = doc.get_model_by_name(name);
      const told = () => { if (model.value) hear(JSON.parse(model.value)); };
      model.properties.value.change.connect(told);
      told();
    }
    for (const one of document.querySelectorAll("[data-set]")) {
      const commit = () => { act("set", one.dataset.set, one.value); act("end"); };
      if (one.tagName === "SELECT") one.addEventListener("change", commit); else field(one, commit);
    }
    for (const list of document.querySelectorAll("[data-panel]")) {
      list.addEventListener("click", event => {
        if (event.target.dataset.view) { act("set", list.dataset.panel, event.target.dataset.view); act("end"); }
      });
      list.addEventListener("keydown", event => {
        const step = {ArrowRight: 1, ArrowLeft: -1}[event.key], all = [...list.children];
        if (!step) return;
        const next = all[(all.indexOf(event.target) + step + all.length) % all.length];
        next.focus();
        next.click();
      });
    }
    $("model").addEventListener("change", () => {
      if ($("model").value) return act("model", "", $("model").value);
      $("model").value = last.state.model;
      document.dispatchEvent(new Event("build"));
    });
    $("preset").addEventListener("change", () => { if ($("preset").value) act("preset", "", $("preset").value); });
    $("phase-slider").addEventListener("input", () => { held = $("phase-slider"); act("set", "phase", Number(held.value)); });
    $("phase-slider").addEventListener("change", () => { held = null; act("end"); });
    $("play").addEventListener("click", () => {
      if (playing) { clearInterval(playing); playing = 0; act("end"); } else
        playing = setInterval(() => act("set", "phase", Math.round((last.state.phase + 0.01) * 1e6 % 1e6) / 1e6), 80);
      $("play").textContent = playing ? "❚❚" : "▶";
    });
    $("save").addEventListener("click", () => act("save", "", {view: $("save-view").value, kind: $("save-kind").value}));
    for (const name of ["undo", "redo", "reset"]) $(name).addEventListener("click", () => act(name));
    $("dark").addEventListener("click", () => look(!last.dark, last.large));
    $("large").addEventListener("click", () => look(last.dark, !last.large));
    document.addEventListener("keydown", event => {
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
