// The panel beside the map: controls, the numbers of the report.
const count = value => value.toLocaleString("en");
const plural = (value, word) => `${count(value)} ${word}${value === 1 ? "" : "s"}`;

function addRow(table, ...texts) {
  const row = element(table).insertRow();
  for (const text of texts) row.insertCell().textContent = text;
}

function showNumbers() {
  document.title = `${map.name}: map`;
  element("name").textContent = map.name;
  const kNoBreak = "\u00a0";
  const most = report.most_extent_m;  // without the few points far from all others
  const size = most ? most.max.map((end, k) => (end - most.min[k]).toFixed(1)).join(" × ") + " m" : "";
  element("summary").textContent =
    `${plural(report.keyframes, "keyframe")}, ${plural(map.all_points, "point")}` +
    (most ? `, ${size.replaceAll(" ", kNoBreak)}` : "");

  const quality = report.quality || {word: "unknown", reasons: []};
  const percent = (value, digits) => `${(100 * value).toFixed(digits)} %`;
  if (quality.wrong_share !== undefined) {
    addRow("report", "quality", `${quality.word}: ${percent(quality.wrong_share, 0)} of the depths wrong by estimate, ` +
      `median error ${percent(quality.depth_error, 1)}`);
  }
  if (quality.agreement !== undefined) {
    addRow("report", "support", `${percent(quality.support, 0)} of the depths are in two keyframes, which agree in ` +
      percent(quality.agreement, 0));
  }
  if (quality.sharpness !== undefined) {
    addRow("report", "sharpness", `${quality.sharpness.toFixed(2)} times that with other clocks or axes of the poses`);
  }
  for (const reason of quality.reasons) addRow("report", "why", reason);

  const events = report.events || {}, seconds = value => `${number(value)} s`;  // none in a session's page
  const part = value => `${(100 * value / events.read).toFixed(1)} %`;
  const left = [["without_pose", "without a pose"], ["outside_window", "outside the keyframes' windows"],
                ["dropped", "dropped"], ["filtered", "filtered"], ["outside_lens", "outside the lens"],
                ["over_budget", "over the budget"]];
  if (events.read !== undefined) addRow("report", "events", count(events.read));
  if (events.read > 0) addRow("report", "used", `${count(events.used)} (${part(events.used)})`);
  for (const [key, words] of left) {
    if (events[key] > 0) addRow("report", "not used", `${part(events[key])} ${words}`);
  }
  if (most) {
    ["x", "y", "z"].forEach((axis, k) => addRow("report", axis,
      `${most.min[k].toFixed(2)} to ${most.max[k].toFixed(2)} m`));
  }
  addRow("report", "voxel", `${number(map.voxel_m)} m`);
  if (report.seconds) {
    addRow("report", "recording", seconds(report.recording_seconds));
    addRow("report", "time", `${seconds(report.seconds.total)}, ${report.threads} threads, ${report.kernel}`);
    addRow("report", "memory", `${number(report.peak_memory_bytes / 1e6)} MB`);
  }
  if (report.stopped_at !== undefined) {
    addRow("report", "stopped at", `${(100 * report.stopped_at).toFixed(0)} % of the recording`);
  }
  if (report.refinement && report.refinement.moved) {
    const moved = report.refinement.moved;
    addRow("report", "refinement", `moved the poses by ${(100 * moved.median_m).toFixed(2)} cm and ` +
      `${moved.median_deg.toFixed(2)}° (median); ${plural(report.refinement.loops, "loop")}`);
  }
  const missing = keyframes.length - Object.keys(pictures).length;
  if (missing > 0) {
    addRow("report", "pictures", `of ${count(keyframes.length - missing)} keyframes in this page, the others ` +
      "are left out to keep it small");
  }
  addRow("report", "version", report.version);

  for (const [kind, texts] of [["warning", report.warnings || []], ["note", report.notes || []]]) {
    element(`${kind}-section`).hidden = texts.length === 0;
    for (const {name, text} of texts) {
      for (const [tag, words] of [["dt", name], ["dd", text]]) {
        element(`${kind}s`).appendChild(document.createElement(tag)).textContent = words;
      }
    }
  }
  element("chosen-section").hidden = !report.chosen;
  for (const option of report.chosen || []) {
    addRow("chosen", option.key, `${number(option.value)}: ${option.reason}`);
  }
  for (const [section, keys] of Object.entries(report.options)) {
    for (const [key, value] of Object.entries(keys)) {
      const text = typeof value === "number" ? String(Number(value.toPrecision(8))) : String(value);
      addRow("options", `${section}.${key}`, text);
    }
  }
  element("depth-near").textContent = `${number(map.depths_m[0])} m`;
  element("depth-far").textContent = `${number(map.depths_m[1])} m`;
}

function showLegend() {
  element("legend").hidden = map.points === 0;
  element("legend-name").textContent = colouring.name;
  element("legend-bar").style.background = `linear-gradient(to right, ${colouring.colours.join(", ")})`;
  element("legend-low").textContent = colouring.ends[0];
  element("legend-high").textContent = colouring.ends[1];
}

let counting = 0;
function showCount() {
  clearTimeout(counting);
  counting = setTimeout(() => {
    const visible = countShown();
    const thinned = map.thinned_m > 0 ? ` This page has ${count(map.points)} of the ${count(map.all_points)} ` +
      `points of the map, one in each ${number(1000 * map.thinned_m)} mm; map.pcd has all.` : "";
    element("shown").textContent =
      (visible < map.points ? `${count(visible)} points are shown.` : "") + thinned;
  }, 50);
}

function update() {
  showCount();
  requestDraw();
}

const timeLimit = element("time-limit"), play = element("play");
timeLimit.max = Math.max(keyframes.length - 1, 0);
timeLimit.value = timeLimit.max;
timeLimit.disabled = play.disabled = keyframes.length < 2;
function setTime(number) {
  timeLimit.value = number;
  shown.time = number >= keyframes.length - 1 ? Infinity : number;
  const keyframe = keyframes[number];
  element("time-text").textContent =
    keyframe ? `keyframe ${number + 1} of ${keyframes.length}, ${sinceStart(keyframe)} s` : "";
  update();
}
timeLimit.addEventListener("input", () => setTime(Number(timeLimit.value)));

let playing = 0;
function togglePlay() {
  if (playing) {
    clearInterval(playing);
    playing = 0;
  } else if (keyframes.length > 1) {
    const kWhole_ms = 8000, rate_ms = Math.max(kWhole_ms / keyframes.length, 40);
    const stride = Math.max(1, Math.round(keyframes.length * rate_ms / kWhole_ms));
    if (shown.time === Infinity) setTime(0);
    playing = setInterval(() => {
      setTime(Math.min(Number(timeLimit.value) + stride, keyframes.length - 1));
      if (shown.time === Infinity) togglePlay();
    }, rate_ms);
  }
  play.textContent = playing ? "Stop" : "Play";
}
play.addEventListener("click", togglePlay);

function stepKeyframe(by) {
  if (keyframes.length === 0) return;
  const from = shown.selected < 0 ? (by > 0 ? -1 : keyframes.length) : shown.selected;
  select(Math.min(Math.max(from + by, 0), keyframes.length - 1));
}
element("previous").addEventListener("click", () => stepKeyframe(-1));
element("next").addEventListener("click", () => stepKeyframe(1));
element("close").addEventListener("click", () => select(-1));
document.addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "[") stepKeyframe(-1);
  if (event.key === "]") stepKeyframe(1);
  if (event.key === " " && event.target === canvas) {
    event.preventDefault();
    togglePlay();
  }
});

for (const button of document.querySelectorAll("[data-look]")) {
  button.addEventListener("click", () => {
    look(button.dataset.look);
    requestDraw();
  });
}
element("colour").addEventListener("change", event => {
  shown.colour = event.target.value;
  updateColours();
  showLegend();
  requestDraw();
});
element("size").addEventListener("input", event => {
  shown.size = Number(event.target.value);
  requestDraw();
});
for (const name of ["shading", "path", "frusta"]) {
  element(name).addEventListener("change", event => {
    shown[name] = event.target.checked;
    requestDraw();
  });
}
const support = element("support");
support.max = map.points > 0 ? percentile(samplesOf(supportOf), 1) : 1;
support.disabled = support.max === "1";
function setSupport() {
  shown.support = Number(support.value);
  element("support-text").textContent = support.value;
  update();
}
support.addEventListener("input", setSupport);

/// The slab's axis and its range along it.
function setSlab() {
  const chosen = element("slab").value;
  element("slab-range").hidden = chosen === "";
  shown.slab = null;
  if (chosen !== "") {
    const axis = chosen === "up" ? up : [0, 1, 2].map(k => k === Number(chosen) ? 1 : 0);
    const reach = [0, 1, 2].reduce((sum, k) => sum + Math.abs(axis[k]) * extent[k] / 2, 0);
    const at = (2 * Number(element("slab-centre").value) - 1) * reach;
    const half = Number(element("slab-thickness").value) * reach;
    const zero = dot(axis, centre);
    shown.slab = {axis, range: [at - half, at + half]};
    element("slab-text").textContent =
      `${(at - half + zero).toFixed(2)} to ${(at + half + zero).toFixed(2)} m`;
  }
  update();
}
for (const id of ["slab", "slab-centre", "slab-thickness"]) element(id).addEventListener("input", setSlab);

darkTheme.addEventListener("change", () => {
  updateColours();
  showLegend();
  requestDraw();
});
canvas.addEventListener("webglcontextlost", event => event.preventDefault());
canvas.addEventListener("webglcontextrestored", () => {
  startDrawing();
  requestDraw();
});
new ResizeObserver(() => requestDraw()).observe(canvas);

showNumbers();
look("start");
showLegend();
setSupport();
setTime(Math.max(keyframes.length - 1, 0));
const problem = !startDrawing() ? "This browser has no WebGL2, which the map needs. The numbers are beside."
  : map.points === 0 ? "The map has no points." : "";
element("problem").textContent = problem;
element("problem").hidden = problem === "";
requestDraw();
