// The camera that looks at the map: it turns about a target.
const kFieldOfView = 50 * Math.PI / 180;
const camera = {target: middle, yaw: 0, pitch: 0, distance: 1};

// Yaw 0 looks from behind the cameras of the recording, where they look into one direction.
const lookDirection = keyframes.reduce((sum, k) => add(sum, rotate(k.q, [0, 0, 1])), [0, 0, 0]);
const levelLook = across(lookDirection, up);
const looksOneWay = norm(levelLook) > 0.3 * keyframes.length && keyframes.length > 0;
const axis1 = looksOneWay ? unit(scale(levelLook, -1))
                          : unit(across(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
const axis2 = cross(up, axis1);

function look(from) {
  const angles = {start: [0.5, looksOneWay ? 0.4 : 0.6], top: [0, Math.PI / 2 - 1e-3],
                  front: [0, 0.02], side: [Math.PI / 2, 0.02]}[from];
  [camera.yaw, camera.pitch] = angles;
  camera.target = middle;
  camera.distance = 0.95 * radius / Math.sin(kFieldOfView / 2);
}

/// The axes of the screen: right, up, and towards the viewer.
function screenAxes() {
  const level = add(scale(axis1, Math.cos(camera.yaw)), axis2, Math.sin(camera.yaw));
  const back = add(scale(level, Math.cos(camera.pitch)), up, Math.sin(camera.pitch));
  const right = unit(cross(up, level));
  return {right, upward: cross(back, right), back};
}

/// The projection of a view of the given shape, column by column.
function projection(aspect) {
  const {right, upward, back} = screenAxes();
  const eye = add(camera.target, back, camera.distance);
  const near = 0.02 * camera.distance, far = camera.distance + 20 * (radius + norm(extent));
  const f = 1 / Math.tan(kFieldOfView / 2) * Math.min(1, aspect);
  const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
  const x = [...right, -dot(right, eye)], y = [...upward, -dot(upward, eye)];
  const z = [...back, -dot(back, eye)];
  const columns = [];
  for (let k = 0; k < 4; ++k) {
    columns.push(f / aspect * x[k], f * y[k], a * z[k] + (k === 3 ? b : 0), -z[k]);
  }
  return {matrix: columns, near, far, focal: f, eye};
}

/// The position of a point on the canvas in CSS pixels, and its distance; nothing behind the camera.
function onScreen(p, matrix) {
  const clip = k => matrix[k] * p[0] + matrix[4 + k] * p[1] + matrix[8 + k] * p[2] + matrix[12 + k];
  const w = clip(3);
  if (w <= 0) return null;
  return {x: (clip(0) / w + 1) / 2 * canvas.clientWidth,
          y: (1 - clip(1) / w) / 2 * canvas.clientHeight, w};
}

function turn(dx, dy) {
  camera.yaw -= dx;
  camera.pitch = Math.min(Math.max(camera.pitch + dy, -1.57), 1.57);
}
/// By a part of the view's height.
function move(dx, dy) {
  const {right, upward} = screenAxes();
  const height = 2 * camera.distance * Math.tan(kFieldOfView / 2);
  camera.target = add(add(camera.target, right, -dx * height), upward, dy * height);
}
function zoom(factor) {
  camera.distance = Math.min(Math.max(camera.distance * factor, 0.002 * radius), 100 * radius);
}

// Mouse and touch: one pointer turns, or moves with the right button or Shift; two move and zoom.
const canvas = element("view");
const pointers = new Map();
let draggedPixels = 0;

canvas.addEventListener("pointerdown", event => {
  canvas.setPointerCapture(event.pointerId);
  if (pointers.size === 0) draggedPixels = 0;
  pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
});
canvas.addEventListener("pointermove", event => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.max(Math.hypot(a.x - b.x, a.y - b.y), 1);
  };
  const size = canvas.clientHeight, count = pointers.size;
  const dx = (event.clientX - before.x) / size, dy = (event.clientY - before.y) / size;
  draggedPixels += Math.abs(dx * size) + Math.abs(dy * size);
  const oldSpread = count === 2 ? spread() : 0;
  pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  if (count === 2) {
    zoom(oldSpread / spread());
    move(dx / 2, dy / 2);
  } else if (count === 1 && (event.buttons & 2 || event.shiftKey)) {
    move(dx, dy);
  } else if (count === 1) {
    turn(3 * dx, 3 * dy);
  }
  requestDraw(true);
});
for (const end of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(end, event => {
    const known = pointers.delete(event.pointerId);
    const isClick = known && end === "pointerup" && event.button === 0 && draggedPixels < 5;
    if (isClick) selectAt(event.offsetX, event.offsetY);
  });
}
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  zoom(Math.exp((event.deltaMode === 1 ? 20 : 1) * event.deltaY * 0.0012));
  requestDraw(true);
}, {passive: false});
canvas.addEventListener("dblclick", event => {
  const hit = pointNear(event.offsetX, event.offsetY);
  if (hit) camera.target = hit;
  requestDraw();
});
canvas.addEventListener("keydown", event => {
  const step = event.shiftKey ? (dx, dy) => move(-0.05 * dx, -0.05 * dy)
                              : (dx, dy) => turn(0.08 * dx, 0.08 * dy);
  const actions = {
    ArrowLeft: () => step(-1, 0), ArrowRight: () => step(1, 0), ArrowUp: () => step(0, -1),
    ArrowDown: () => step(0, 1), "+": () => zoom(0.87), "=": () => zoom(0.87),
    "-": () => zoom(1.15), "0": () => look("start"), Home: () => look("start")};
  if (event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
  event.preventDefault();
  actions[event.key]();
  requestDraw(true);
});
