/* The panel of a recording: a file is read in the page as bytes and handed over; what they mean, the server's readers say. */
(window.parts = window.parts || []).push(({$, node, on, act, show, progress}) => {
  let most = 0, built = "", file = "";

  function take(file) {
    if (!file) return;
    if (file.size > most) return act("unread", "recording", {file: file.name, size: file.size});
    const reader = new FileReader();
    reader.onload = () => act("drop", "recording", {file: file.name, content: reader.result.split(",")[1] || ""});
    reader.onerror = () => act("unread", "recording", {file: file.name, size: file.size});
    reader.readAsDataURL(file);
  }
  on($("recording-open"), "click", () => $("recording-file").click());
  on($("recording-file"), "change", () => { take($("recording-file").files[0]); $("recording-file").value = ""; });
  let over = 0;
  on(document, "dragenter", event => { event.preventDefault(); over += 1; document.body.classList.add("dropping"); });
  on(document, "dragleave", () => { over -= 1; if (over <= 0) document.body.classList.remove("dropping"); });
  on(document, "dragover", event => event.preventDefault());
  on(document, "drop", event => {
    event.preventDefault();
    over = 0;
    document.body.classList.remove("dropping");
    take(event.dataTransfer.files[0]);
  });
  for (const [id, what] of [["fit", "fit"], ["cancel", "cancel"], ["remove", "remove"], ["drive", "take drive"]])
    on($("recording-" + id), "click", () => act(what, "recording"));

  function rows(told) {
    const key = JSON.stringify([told.rows, told.ticks]);
    if (key === built) return;
    built = key;
    $("recording-rows").replaceChildren(...told.rows.map(({name, html, unit}) => {
      const [channel, factor, shift] = ["channel", "factor", "shift"].map(what => node(what === "channel" ? "select" : "input",
        {id: what + "-" + name, set: `recording.${what}.${name}`, inputMode: "decimal", ariaLabel: what + " of " + name}));
      const scale = node("div", {className: "scale"}, "× ", factor, " + ", shift, node("span", {className: "unit", textContent: " " + unit}));
      return node("div", {className: "measured"}, node("div", {}, node("b", {innerHTML: html}), " = ", channel), scale);
    }));
    $("recording-ticks").replaceChildren(...told.ticks.map(({name, html}) =>
      node("label", {}, node("input", {type: "checkbox", id: "fit-" + name, set: "fit." + name}), node("b", {innerHTML: html}))));
    show();
  }

  function recording(told) {
    most = told.most;
    $("recording-doing").hidden = !told.doing;
    if (told.doing) progress($("recording-doing"), told.fraction, told.doing + " …");
    $("recording-body").hidden = !told.file;
    $("recording-hint").hidden = Boolean(told.file);
    if (!told.file) { file = ""; return; }
    if (file !== told.file) { file = told.file; $("recording-name").closest("div").scrollIntoView({block: "nearest"}); }
    $("recording-name").textContent = told.file;
    $("recording-name").title = told.more.join("\n");
    $("recording-run").closest("label").hidden = told.runs < 2;
    $("recording-unit").textContent = told.unit;
    rows(told);
    for (const {name} of told.rows) $("factor-" + name).closest(".scale").hidden = !told.shown.includes(name);
    $("recording-fit").disabled = Boolean(told.doing);
    $("recording-drive-box").hidden = !told.drive;
    $("recording-drive-text").textContent = told.drive;
    $("recording-found").replaceChildren(...told.found.map(([name, text]) => node("p", {}, node("b", {textContent: name}), " " + text)));
    $("recording-remarks").replaceChildren(...told.remarks.map(text => node("p", {textContent: text})));
  }
  return {recording};
});
