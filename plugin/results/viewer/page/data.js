// The data of the page, and what follows from them. Positions are relative to the map's centre, so
// that 32 bits resolve them anywhere in the world.
const element = id => document.getElementById(id);

function takeText(id) {
  const script = element(id), text = script.textContent;
  script.remove();  // its memory
  return text;
}

function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const map = JSON.parse(takeText("map-data"));
const report = JSON.parse(takeText("report-data"));
const pictures = JSON.parse(takeText("picture-data"));  // PNGs by the number of a keyframe
const kPointBytes = 10;  // position 3 x 2, confidence, support, first keyframe 2
let pointBytes = bytesOf(takeText("point-data"));

const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = a => Math.hypot(...a);
const unit = a => scale(a, 1 / norm(a));
/// A vector in the direction of `a` without its part along the unit vector `u`.
const across = (a, u) => add(a, u, -dot(a, u));
/// Rotates by a unit quaternion (x, y, z, w).
function rotate(q, a) {
  const t = scale(cross(q, a), 2);
  return add(add(a, t, q[3]), cross(q, t));
}
const percentile = (sorted, part) => sorted[Math.round(part * (sorted.length - 1))];

const extent = map.step_m.map(step => 65535 * step);
const centre = map.origin_m.map((origin, k) => origin + extent[k] / 2);
const origin = scale(extent, -0.5);
const cells = new DataView(pointBytes.buffer);
const cellOf = (i, k) => cells.getUint16(i * kPointBytes + 2 * k, true);
const pointAt = i => [0, 1, 2].map(k => origin[k] + map.step_m[k] * cellOf(i, k));
const supportOf = i => pointBytes[i * kPointBytes + 7];
/// The number of the first keyframe that saw the point.
const firstKeyframeOf = i => cells.getUint16(i * kPointBytes + 8, true) * map.keyframe_step;

/// The keyframes: centre p of the camera, its rotation q, time t in seconds as text.
const keyframes = map.keyframes.map(k => ({t: k.t, q: k.q, p: add(k.p, centre, -1)}));

const up = map.up;  // a unit vector

/// Sorted samples of a value of the points, which are in an order without any.
function samplesOf(value) {
  const samples = new Float64Array(Math.min(map.points, 50000));
  for (let i = 0; i < samples.length; ++i) samples[i] = value(i);
  return samples.sort();
}

/// The box that has most points, without far outliers, and the cameras.
const bounds = [0, 1, 2].map(k => {
  const sorted = samplesOf(i => origin[k] + map.step_m[k] * cellOf(i, k));
  const ends = map.points > 0 ? [percentile(sorted, 0.03), percentile(sorted, 0.97)] : [-1, 1];
  const places = keyframes.map(keyframe => keyframe.p[k]);
  return [places.reduce((a, b) => Math.min(a, b), ends[0]),
          places.reduce((a, b) => Math.max(a, b), ends[1])];
});
const middle = bounds.map(([low, high]) => (low + high) / 2);
const radius = Math.max(norm(bounds.map(([low, high]) => (high - low) / 2)), 1e-3);

const kRainbow = ["#4454c3", "#4686fb", "#1bcfd4", "#24eca6", "#61fc6c", "#a4fc3b", "#d1e834",
                  "#f3c63a", "#fe9b2d", "#f36315", "#d93806", "#b11901"];
const kBright = ["#2d3a5f", "#31688e", "#21918c", "#35b779", "#90d743", "#fde725"];  // on dark
const kDeep = ["#c3ccd6", "#8fb7c4", "#4f9aa8", "#31688e", "#3b3f80", "#440154"];    // on light
const darkTheme = matchMedia("(prefers-color-scheme: dark)");
const number = (value, digits = 3) => value.toLocaleString("en", {maximumSignificantDigits: digits});

/// How points are coloured: the range of the value, the colours, and the ends' names.
function colouringOf(name) {
  const sequential = darkTheme.matches ? kBright : kDeep;
  if (map.points === 0) return {name: "", range: [0, 1], colours: sequential, ends: ["", ""]};
  if (name === "height") {
    const heights = samplesOf(i => dot(up, pointAt(i)));
    const range = [percentile(heights, 0.01), percentile(heights, 0.99)];
    const zero = dot(up, centre);
    return {name: "height (m)", range, colours: kRainbow,
            ends: range.map(value => (value + zero).toFixed(2))};
  }
  if (name === "confidence") {
    return {name: "confidence (ray density)", range: [0, 255], colours: sequential,
            ends: map.confidence.map(value => number(value, 2))};
  }
  if (name === "support") {
    const range = [1, Math.max(2, percentile(samplesOf(supportOf), 0.99))];
    return {name: "support (keyframes)", range, colours: sequential,
            ends: ["1", `${range[1]} or more`]};
  }
  const last = Math.max(keyframes.length - 1, 1);
  return {name: "first seen (s)", range: [0, last], colours: kRainbow,
          ends: [keyframes[0], keyframes[keyframes.length - 1]].map(k => k ? sinceStart(k) : "")};
}

/// Seconds since the first keyframe.
const sinceStart = keyframe =>
  (Number(keyframe.t) - Number(keyframes[0].t)).toFixed(2);
