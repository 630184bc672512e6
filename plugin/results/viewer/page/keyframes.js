// The keyframes: their path and frusta as lines, which one is selected, its depth map and events.
const steps = keyframes.slice(1).map((k, i) => norm(add(k.p, keyframes[i].p, -1)))
  .sort((a, b) => a - b);
const step = steps.length > 0 ? percentile(steps, 0.5) : 0;
const frustumDepth = Math.min(Math.max(1.2 * step, 0.03 * radius), 0.07 * radius);
/// Every how many keyframes a frustum is drawn: they should not hide the map.
const frustumStride = Math.max(1, step > 0 ? Math.round(0.4 * frustumDepth / step) : 1,
                               Math.ceil(keyframes.length / 400));

/// The corners of the image at `frustumDepth`, and the camera's centre.
function frustumOf(number) {
  const {p, q} = keyframes[number], v = map.view;
  const at = (x, y) => add(p, rotate(q, [(x - v.cx) / v.fx * frustumDepth,
                                         (y - v.cy) / v.fy * frustumDepth, frustumDepth]));
  return {p, corners: [at(0, 0), at(v.width, 0), at(v.width, v.height), at(0, v.height)]};
}
/// Endpoints of its lines.
function frustumLines(number) {
  if (!map.view) return [];
  const {p, corners} = frustumOf(number);
  return corners.flatMap((corner, i) => [p, corner, corner, corners[(i + 1) % 4]]);
}
const lastShown = () => Math.min(shown.time, keyframes.length - 1);
/// Whether a keyframe is much worse than the others, by the report.
const muchWorse = new Set(report.quality && report.quality.much_worse);
const isBad = number => muchWorse.has(number);
const hasFrustum = number => number % frustumStride === 0;

let lineCache = {};
function linesNow() {
  const key = `${lastShown()} ${shown.path} ${shown.frusta} ${shown.selected}`;
  if (lineCache.key === key && lineCache.gl === gl) return lineCache.lines;
  for (const lines of Object.values(lineCache.gl === gl && lineCache.lines || {})) {
    gl.deleteVertexArray(lines.vertices);
  }
  const path = [], frusta = [], bad = [];
  for (let i = 0; i <= lastShown(); ++i) {
    if (shown.path && i > 0) path.push(keyframes[i - 1].p, keyframes[i].p);
    if (shown.frusta && isBad(i)) bad.push(...frustumLines(i));
    else if (shown.frusta && hasFrustum(i) && i !== shown.selected) frusta.push(...frustumLines(i));
  }
  const selected = shown.selected < 0 ? [] : frustumLines(shown.selected);
  const lines = {path: lineBuffer(path), frusta: lineBuffer(frusta), bad: lineBuffer(bad),
                 selected: lineBuffer(selected)};
  lineCache = {key, gl, lines};
  return lines;
}

/// The distance of (x, y) from the line between two positions on the screen.
function distanceToLine(x, y, a, b) {
  const dx = b.x - a.x, dy = b.y - a.y;
  const part = Math.min(Math.max(((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1), 0), 1);
  return Math.hypot(a.x + part * dx - x, a.y + part * dy - y);
}

/// Selects the frustum at a position of the canvas, if there is one.
function selectAt(x, y) {
  if (!map.view || !shown.frusta) return;
  const {matrix} = projection(canvas.clientWidth / canvas.clientHeight);
  let best = -1, least = 10;  // CSS pixels
  for (let i = 0; i <= lastShown(); i += frustumStride) {
    const ends = frustumLines(i).map(p => onScreen(p, matrix));
    for (let k = 0; k < ends.length; k += 2) {
      if (!ends[k] || !ends[k + 1]) continue;
      const distance = distanceToLine(x, y, ends[k], ends[k + 1]);
      if (distance < least) [least, best] = [distance, i];
    }
  }
  if (best >= 0) select(best);
}

const isShown = i => {
  if (firstKeyframeOf(i) > shown.time || supportOf(i) < shown.support) return false;
  if (!shown.slab) return true;
  const along = dot(shown.slab.axis, pointAt(i));
  return along >= shown.slab.range[0] && along <= shown.slab.range[1];
};

/// The nearest point that is drawn within a few pixels of a position of the canvas.
function pointNear(x, y) {
  const {matrix} = projection(canvas.clientWidth / canvas.clientHeight);
  const width = canvas.clientWidth, height = canvas.clientHeight, reach = 6;
  // Rows of the projection for cells instead of metres: no array is made per point.
  const row = k => [0, 1, 2].map(j => matrix[4 * j + k] * map.step_m[j])
    .concat(dot([matrix[k], matrix[4 + k], matrix[8 + k]], origin) + matrix[12 + k]);
  const [[ax, bx, cx, dx], [ay, by, cy, dy], , [aw, bw, cw, dw]] = [0, 1, 2, 3].map(row);
  let best = -1, least = Infinity;
  for (let i = 0; i < map.points; ++i) {
    const a = cellOf(i, 0), b = cellOf(i, 1), c = cellOf(i, 2);
    const w = aw * a + bw * b + cw * c + dw;
    if (w <= 0 || w >= least) continue;
    const right = ((ax * a + bx * b + cx * c + dx) / w + 1) / 2 * width - x;
    const down = (1 - (ay * a + by * b + cy * c + dy) / w) / 2 * height - y;
    if (right * right + down * down < reach * reach && isShown(i)) [best, least] = [i, w];
  }
  return best < 0 ? null : pointAt(best);
}

function countShown() {
  let count = 0;
  for (let i = 0; i < map.points; ++i) count += isShown(i) ? 1 : 0;
  return count;
}

/// @param number of a keyframe, or -1 for none.
function select(number) {
  shown.selected = number;
  const kept = pictures[number];
  element("pictures").hidden = !kept;
  element("events").hidden = !kept || !kept.events;
  for (const [id, kind] of [["picture", "depth"], ["event-picture", "events"]]) {
    const image = element(id);
    if (kept && kept[kind]) image.src = `data:image/png;base64,${kept[kind]}`;
    else image.removeAttribute("src");
  }
  const note = element("picture-text");
  note.replaceChildren();
  if (number < 0) {
    element("keyframe-text").textContent = "Click a camera in the map, or step with ‹ and ›.";
  } else {
    const keyframe = keyframes[number];
    const at = add(keyframe.p, centre).map(value => value.toFixed(2)).join(", ");
    element("keyframe-text").textContent =
      `${number + 1} of ${keyframes.length}, t = ${keyframe.t} s, at (${at}) m` +
      (isBad(number) ? "; much worse than the others" : "");
    element("picture").alt = `Depth map of keyframe ${number + 1}`;
    element("event-picture").alt = `Events of keyframe ${number + 1}`;
    const file = document.createElement("a");
    file.href = `keyframes/${keyframe.t}/depth.png`;
    file.textContent = `keyframes/${keyframe.t}/depth.png`;
    note.append(kept ? "Full size: " : "This page has no picture of it, to stay small. The file: ", file);
  }
  requestDraw();
}
