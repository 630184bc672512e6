// Runs at the end of a copy of map.html: uses the page as a person does, and leaves in the element
// "measured" the results, as JSON. `problems` is filled by the script at the page's beginning.
const measured = {};

/// Draws the view. @return the picture on the canvas.
function pixels() {
  draw();
  const {width, height} = canvas, bytes = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  return new Uint32Array(bytes.buffer);
}
/// Returns the number of pixels that differ from the background.
function drawnOf(picture) {
  const back = styleColour("--back").reduce((sum, c, k) => sum + Math.round(255 * c) * 256 ** k, 0);
  return picture.reduce((sum, pixel) => sum + ((pixel & 0xffffff) === back ? 0 : 1), 0);
}
const changedOf = (a, b) => a.reduce((sum, pixel, i) => sum + (pixel === b[i] ? 0 : 1), 0);

function pointer(type, x, y, options = {}) {
  const box = canvas.getBoundingClientRect();
  canvas.dispatchEvent(new PointerEvent(type, {clientX: box.left + x, clientY: box.top + y,
    pointerId: 1, buttons: 1, bubbles: true, ...options}));
}
function drag(dx, dy, options) {
  pointer("pointerdown", 300, 300, options);
  for (let i = 1; i <= 5; ++i) pointer("pointermove", 300 + i * dx / 5, 300 + i * dy / 5, options);
  pointer("pointerup", 300 + dx, 300 + dy, options);
}
function choose(id, value, type = "input") {
  element(id).value = value;
  element(id).dispatchEvent(new Event(type, {bubbles: true}));
}
const press = key => canvas.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));

/// Changes the view and goes back to the start. @return the number of pixels that changed.
function effectOf(change) {
  look("start");
  const before = pixels();
  change();
  const changed = changedOf(before, pixels());
  look("start");
  return changed;
}
const settled = () => new Promise(done => setTimeout(done, 400));

async function probe() {
  canvas.setPointerCapture = () => {};  // the original rejects pointers that are not real
  measured.points = map.points;
  measured.dark = darkTheme.matches;
  measured.drawn = drawnOf(pixels());
  measured.turned = effectOf(() => drag(80, 30));
  measured.moved = effectOf(() => drag(80, 30, {shiftKey: true}));
  measured.zoomed = effectOf(() => canvas.dispatchEvent(new WheelEvent("wheel", {deltaY: -300})));
  measured.turned_by_key = effectOf(() => press("ArrowLeft"));
  measured.aimed = effectOf(() => {  // a double click makes its point the centre of rotation
    let p = null;
    for (let i = 0; i < map.points && !p; ++i) p = onScreen(pointAt(i), projection(canvas.clientWidth / canvas.clientHeight).matrix);
    const box = canvas.getBoundingClientRect();
    canvas.dispatchEvent(new MouseEvent("dblclick", {clientX: box.left + p.x, clientY: box.top + p.y}));
  });
  measured.coloured = effectOf(() => choose("colour", "confidence", "change"));

  // The map grows with time; only points are drawn, without path and cameras.
  const toggleLines = () => ["path", "frusta"].forEach(id => element(id).click());
  toggleLines();
  measured.grown = [];
  for (const keyframe of [0, Math.floor(keyframes.length / 2), keyframes.length - 1]) {
    choose("time-limit", keyframe);
    measured.grown.push({shown: countShown(), drawn: drawnOf(pixels())});
  }
  choose("slab", "up");
  measured.in_slab = countShown();
  choose("slab", "");
  toggleLines();

  // A click on a camera shows its depth map and its events.
  look("top");
  if (map.view) {
    const line = frustumLines(0).map(p => onScreen(p, projection(canvas.clientWidth / canvas.clientHeight).matrix));
    const x = (line[0].x + line[1].x) / 2, y = (line[0].y + line[1].y) / 2;
    pointer("pointerdown", x, y);
    pointer("pointerup", x, y);
  }
  await settled();
  measured.selected = shown.selected;
  measured.picture_sizes = ["picture", "event-picture"].map(id => element(id))
    .map(image => image.checkVisibility() ? [image.naturalWidth, image.naturalHeight] : []);

  // The page makes no request, and the browser blocks requests that it tries.
  measured.problems = problems.slice();
  measured.requests = performance.getEntriesByType("resource").map(entry => entry.name)
    .filter(name => !name.startsWith("data:"));
  await fetch("http://127.0.0.1:9/a").catch(() => {});
  new Image().src = "http://127.0.0.1:9/b";
  document.head.appendChild(document.createElement("link")).setAttribute("rel", "stylesheet");
  document.head.lastChild.href = "http://127.0.0.1:9/c";
  await settled();
  measured.refused = problems.length - measured.problems.length;
  measured.gl_error = gl.getError();
  measured.text = document.querySelector("aside").innerText;
  const result = document.body.appendChild(document.createElement("pre"));
  result.id = "measured";
  result.textContent = JSON.stringify(measured)  // without what HTML would escape
    .replace(/[<>&\u00a0]/g, c => "\\u" + c.charCodeAt(0).toString(16).padStart(4, "0"));
}
probe().catch(error => problems.push(String(error)));
