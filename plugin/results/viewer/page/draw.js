// Draws with WebGL2: the points and lines into an image with depth, and this image, shaded at steps
// of depth (eye-dome lighting), on the canvas.
const shown = {time: Infinity, support: 1, slab: null, size: 0, shading: true, path: true,
               frusta: true, selected: -1, colour: "height"};
let colouring = colouringOf(shown.colour);

const kPointVertex = `#version 300 es
layout(location = 0) in vec3 cell;
layout(location = 1) in vec2 counts;  // confidence, support
layout(location = 2) in float keyframe;
uniform mat4 projection;
uniform vec3 origin, cellSize, up, slabAxis;
uniform vec2 range, slab, pointSize;  // pointSize: metres times focal length in pixels; smallest
uniform float timeLimit, leastSupport, keyframeStep;
uniform int colour;
out float value;
void main() {
  vec3 p = origin + cellSize * cell;
  float time = keyframe * keyframeStep;
  float along = dot(slabAxis, p);
  float chosen = colour == 0 ? dot(up, p) : colour == 1 ? counts.x : colour == 2 ? counts.y : time;
  value = (chosen - range.x) / max(range.y - range.x, 1e-9);
  gl_Position = projection * vec4(p, 1);
  gl_PointSize = clamp(pointSize.x / gl_Position.w, pointSize.y, 40.0);
  bool hidden = time > timeLimit || counts.y < leastSupport || along < slab.x || along > slab.y;
  if (hidden) gl_Position = vec4(2, 2, 2, 1);
}`;
const kPointFragment = `#version 300 es
precision highp float;
in float value;
uniform sampler2D colours;
out vec4 pixel;
void main() {
  if (length(gl_PointCoord - 0.5) > 0.55) discard;
  pixel = texture(colours, vec2(clamp(value, 0.002, 0.998), 0.5));
}`;
// A line is a rectangle of the given width on the screen.
const kLineVertex = `#version 300 es
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
uniform mat4 projection;
uniform vec2 halfSize;  // of the image, pixels
uniform float halfWidth, near;
out float side;
void main() {
  vec4 a = projection * vec4(from, 1), b = projection * vec4(to, 1);
  if (a.w < near) a = mix(a, b, clamp((near - a.w) / (b.w - a.w), 0.0, 1.0));
  if (b.w < near) b = mix(b, a, clamp((near - b.w) / (a.w - b.w), 0.0, 1.0));
  vec2 along = (b.xy / b.w - a.xy / a.w) * halfSize;
  vec2 across = length(along) > 0.0 ? normalize(vec2(-along.y, along.x)) : vec2(0);
  bool last = gl_VertexID > 1;
  side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  vec4 p = last ? b : a;
  gl_Position = a.w < near && b.w < near ? vec4(2, 2, 2, 1)
      : p + vec4(side * (halfWidth + 0.5) * across / halfSize * p.w, 0, 0);
}`;
const kLineFragment = `#version 300 es
precision highp float;
in float side;
uniform vec4 ink;
uniform float halfWidth;
out vec4 pixel;
void main() {
  pixel = vec4(ink.rgb, ink.a * clamp((halfWidth + 0.5) * (1.0 - abs(side)) + 0.5, 0.0, 1.0));
}`;
const kScreenVertex = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }`;
const kScreenFragment = `#version 300 es
precision highp float;
uniform sampler2D image;
uniform highp sampler2D depth;
uniform vec3 back;
uniform vec2 planes;  // near, far
uniform float strength;
uniform int reach;  // pixels
out vec4 pixel;
float logDistance(ivec2 at) {
  float z = 2.0 * texelFetch(depth, at, 0).r - 1.0;
  return log2(2.0 * planes.x * planes.y / (planes.y + planes.x - z * (planes.y - planes.x)));
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(depth, 0) - 1;
  if (texelFetch(depth, at, 0).r >= 1.0) { pixel = vec4(back, 1); return; }
  float here = logDistance(at), behind = 0.0;
  for (int k = 0; k < 8; ++k) {
    float angle = 0.7853982 * float(k);
    ivec2 next = at + ivec2(round(float(reach) * vec2(cos(angle), sin(angle))));
    behind += clamp(here - logDistance(clamp(next, ivec2(0), last)), 0.0, 0.05);
  }
  pixel = vec4(mix(vec3(0), texelFetch(image, at, 0).rgb, exp(-strength * behind)), 1);
}`;

let gl = null, programs = {}, buffers = {}, target = null, colourTexture = null;

function compile(vertex, fragment) {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(gl.getProgramInfoLog(program));
  }
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
    const name = gl.getActiveUniform(program, i).name;
    at[name] = gl.getUniformLocation(program, name);
  }
  return {program, at};
}

function arrayBuffer(data) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  return buffer;
}

/// Lines as an array of endpoints, two after the other.
function lineBuffer(points) {
  const lines = {count: points.length / 2, vertices: gl.createVertexArray()};
  gl.bindVertexArray(lines.vertices);
  arrayBuffer(new Float32Array(points.flat()));
  for (const k of [0, 1]) {
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
    gl.vertexAttribDivisor(k, 1);
  }
  gl.bindVertexArray(null);
  return lines;
}

/// @return false where the browser has no WebGL2.
function startDrawing() {
  gl = canvas.getContext("webgl2", {antialias: false, depth: false, alpha: false});
  if (!gl) return false;
  programs = {points: compile(kPointVertex, kPointFragment),
              lines: compile(kLineVertex, kLineFragment),
              screen: compile(kScreenVertex, kScreenFragment)};
  target = null;
  buffers = {points: gl.createVertexArray(), screen: gl.createVertexArray()};
  gl.bindVertexArray(buffers.points);
  arrayBuffer(pointBytes);
  for (const [k, size, type, offset] of [[0, 3, gl.UNSIGNED_SHORT, 0], [1, 2, gl.UNSIGNED_BYTE, 6],
                                         [2, 1, gl.UNSIGNED_SHORT, 8]]) {
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, size, type, false, kPointBytes, offset);
  }
  gl.bindVertexArray(null);
  colourTexture = gl.createTexture();
  updateColours();
  return true;
}

function updateColours() {
  colouring = colouringOf(shown.colour);
  if (!gl) return;
  const strip = new OffscreenCanvas(256, 1).getContext("2d");
  const gradient = strip.createLinearGradient(0, 0, 256, 0);
  colouring.colours.forEach((c, i) => gradient.addColorStop(i / (colouring.colours.length - 1), c));
  strip.fillStyle = gradient;
  strip.fillRect(0, 0, 256, 1);
  gl.bindTexture(gl.TEXTURE_2D, colourTexture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE,
                strip.getImageData(0, 0, 256, 1));
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
}

/// The image that points are drawn into, of the canvas's size.
function resize() {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (target && canvas.width === width && canvas.height === height) return ratio;
  canvas.width = width;
  canvas.height = height;
  if (target) [target.image, target.depth].forEach(texture => gl.deleteTexture(texture));
  const frame = target ? target.frame : gl.createFramebuffer();
  target = {frame, image: gl.createTexture(), depth: gl.createTexture()};
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  for (const [texture, format, attachment] of [
    [target.image, gl.RGBA8, gl.COLOR_ATTACHMENT0],
    [target.depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
  }
  return ratio;
}

/// A colour of the style sheet, from 0 to 1.
function styleColour(name) {
  const hex = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16) / 255);
}

function drawPoints(view, ratio, count) {
  const {program, at} = programs.points;
  gl.useProgram(program);
  gl.bindVertexArray(buffers.points);
  gl.bindTexture(gl.TEXTURE_2D, colourTexture);
  gl.uniformMatrix4fv(at.projection, false, view.matrix);
  gl.uniform3fv(at.origin, origin);
  gl.uniform3fv(at.cellSize, map.step_m);
  gl.uniform3fv(at.up, up);
  gl.uniform3fv(at.slabAxis, shown.slab ? shown.slab.axis : [0, 0, 0]);
  gl.uniform2fv(at.slab, shown.slab ? shown.slab.range : [-1, 1]);
  gl.uniform2fv(at.range, colouring.range);
  const factor = 2 ** shown.size, edge = Math.max(map.voxel_m, map.thinned_m);
  // The fewer points, the larger: from 3 pixels for a thousand points to 1.3 for two million.
  const least = 3 - 0.5 * Math.log10(Math.max(map.points, 1000) / 1000);
  gl.uniform2f(at.pointSize, factor * edge * view.focal * canvas.height / 2,
               Math.max(1, least * factor * ratio));
  gl.uniform1f(at.timeLimit, Math.min(shown.time, 1e9));
  gl.uniform1f(at.leastSupport, shown.support);
  gl.uniform1f(at.keyframeStep, map.keyframe_step);
  gl.uniform1i(at.colour, ["height", "confidence", "support", "time"].indexOf(shown.colour));
  gl.drawArrays(gl.POINTS, 0, count);
}

function drawLines(lines, view, ink, width) {
  if (!lines || lines.count === 0) return;
  const {program, at} = programs.lines;
  gl.useProgram(program);
  gl.bindVertexArray(lines.vertices);
  gl.uniformMatrix4fv(at.projection, false, view.matrix);
  gl.uniform2f(at.halfSize, canvas.width / 2, canvas.height / 2);
  gl.uniform1f(at.halfWidth, width / 2);
  gl.uniform1f(at.near, view.near);
  gl.uniform4fv(at.ink, ink);
  gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
}

/// @param count of points: any first part of them covers the map.
function draw(count = map.points) {
  if (!gl || gl.isContextLost()) return;
  const ratio = resize(), back = styleColour("--back");
  const view = projection(canvas.width / canvas.height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(...back, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  drawPoints(view, ratio, count);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  const lines = linesNow();
  drawLines(lines.frusta, view, [...styleColour("--camera"), 0.75], 1.2 * ratio);
  drawLines(lines.bad, view, [...styleColour("--bad"), 1], 1.8 * ratio);
  drawLines(lines.path, view, [...styleColour("--path"), 0.9], 1.8 * ratio);
  drawLines(lines.selected, view, [...styleColour("--accent"), 1], 2.5 * ratio);
  gl.disable(gl.BLEND);

  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.disable(gl.DEPTH_TEST);
  const {program, at} = programs.screen;
  gl.useProgram(program);
  gl.bindVertexArray(buffers.screen);
  gl.activeTexture(gl.TEXTURE1);
  gl.bindTexture(gl.TEXTURE_2D, target.depth);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, target.image);
  gl.uniform1i(at.image, 0);
  gl.uniform1i(at.depth, 1);
  gl.uniform3fv(at.back, back);
  gl.uniform2f(at.planes, view.near, view.far);
  gl.uniform1f(at.strength, shown.shading ? 2.5 : 0);
  gl.uniform1i(at.reach, Math.max(1, Math.round(ratio)));
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

// While the view moves, only a part of the points is drawn if all of them take too long.
const kSlowFrame_ms = 60, kRest_ms = 250;
let frameRequested = false, movingUntil = 0, lastFrame = 0, movingPart = 1;

function requestDraw(moving = false) {
  if (moving) movingUntil = performance.now() + kRest_ms;
  if (frameRequested) return;
  frameRequested = true;
  requestAnimationFrame(now => {
    frameRequested = false;
    const moves = now < movingUntil, since = now - lastFrame;
    lastFrame = now;
    if (moves && since < 1000) {
      if (since > kSlowFrame_ms) movingPart = Math.max(0.6 * movingPart, 0.02);
      else if (since < kSlowFrame_ms / 3) movingPart = Math.min(1.1 * movingPart, 1);
    }
    const part = moves ? movingPart : 1;
    draw(Math.ceil(part * map.points));
    if (part < 1) setTimeout(requestDraw, kRest_ms);
  });
}
