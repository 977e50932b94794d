/* The panel of a recording: a file is read in the page as bytes and handed over; what they mean, the server's readers say. */
(window.parts = window.parts || []).push(({$, node, on, act, bind, show, progress}) => {
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
  const own = ["run", "turns", "begin", "end"], parts = ["channel", "factor", "shift"];
  for (const name of own) bind($("recording-" + name), value => act("recording", "recording." + name, value));

  function rows(told, channels) {
    const key = JSON.stringify(told.rows.map(one => one.name).concat(told.ticks.map(one => one.name)));
    if (key !== built) {
      built = key;
      $("recording-rows").replaceChildren(...told.rows.map(one => {
        const [channel, factor, shift] = parts.map(what => node(
          what === "channel" ? "select" : "input", {id: what + "-" + one.name, inputMode: "decimal", ariaLabel: what + " of " + one.name}));
        [channel, factor, shift].forEach((part, k) => bind(part, value => act("recording", "recording." + parts[k] + "." + one.name, value)));
        const scale = node("div", {className: "scale"}, "× ", factor, " + ", shift, node("span", {className: "unit", textContent: " " + one.unit}));
        return node("div", {className: "measured"}, node("div", {}, node("b", {innerHTML: one.html}), " = ", channel), scale);
      }));
      $("recording-ticks").replaceChildren(...told.ticks.map(one => {
        const box = node("input", {type: "checkbox", id: "fit-" + one.name});
        on(box, "change", () => act("tick", "fit." + one.name, box.checked));
        return node("label", {}, box, node("b", {innerHTML: one.html}));
      }));
    }
    for (const one of told.rows) {
      for (const what of parts) show($(what + "-" + one.name), what === "channel" && channels, one[what]);
      $("channel-" + one.name).closest(".measured").querySelector(".scale").hidden = !one.channel;
    }
    for (const one of told.ticks) $("fit-" + one.name).checked = one.on;
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
    const channels = [["", "not recorded"], ...told.channels], choices = {run: told.runs.map(one => [one, one]), turns: channels};
    for (const name of own) show($("recording-" + name), choices[name], told[name]);
    $("recording-run").closest("label").hidden = told.runs.length < 2;
    $("recording-unit").textContent = told.unit;
    rows(told, channels);
    $("recording-fit").disabled = Boolean(told.doing);
    $("recording-drive-box").hidden = !told.drive;
    $("recording-drive-text").textContent = told.drive;
    $("recording-found").replaceChildren(...told.found.map(([name, text]) => node("p", {}, node("b", {textContent: name}), " " + text)));
    $("recording-remarks").replaceChildren(...told.remarks.map(text => node("p", {textContent: text})));
  }
  return {recording};
});
