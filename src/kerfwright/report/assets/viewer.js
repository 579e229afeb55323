"use strict";
// A turnable view of the boards: WebGL 2, no library. Data come from the JSON in #scene; see report/scene.py.
(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.querySelector(".stage canvas");
  const label = document.querySelector(".stage .name");
  const explode = document.getElementById("explode");
  const cloudBox = document.getElementById("cloud");
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    document.querySelector(".stage .missing").hidden = false;
    return;
  }

  const floats = (text) => new Float32Array(bytes(text).buffer);
  const indices = (text) => new Uint32Array(bytes(text).buffer);
  function bytes(text) {
    const raw = atob(text);
    return Uint8Array.from(raw, (c) => c.charCodeAt(0));
  }

  const VERTEX = `#version 300 es
    uniform mat4 clip_from_model; uniform vec3 shift; uniform float nearer;
    in vec3 position; in float value; out vec3 at; out float shade;
    void main() {
      at = position + shift; shade = value;
      gl_Position = clip_from_model * vec4(at, 1.0);
      gl_Position.z -= nearer * gl_Position.w;   // lines lie on the faces that they bound
      gl_PointSize = 2.5;
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    uniform vec3 colour; uniform vec3 eye; uniform int kind;
    in vec3 at; in float shade; out vec4 paint;
    void main() {
      if (kind == 1) { paint = vec4(colour, 1.0); return; }
      if (kind == 2) {
        vec3 middle = vec3(0.91), low = vec3(0.17, 0.42, 0.69), high = vec3(0.77, 0.19, 0.19);
        paint = vec4(mix(middle, shade < 0.0 ? low : high, min(abs(shade), 1.0)), 1.0); return;
      }
      vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
      vec3 light = normalize(normalize(eye - at) + vec3(0.15, 0.1, 0.6));
      paint = vec4(colour * (0.35 + 0.65 * abs(dot(normal, light))), 1.0);
    }`;

  function program() {
    const made = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text.trim());
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "position");
    gl.bindAttribLocation(made, 1, "value");
    gl.linkProgram(made);
    gl.useProgram(made);
    return made;
  }
  const shaders = program();
  const uniform = (name) => gl.getUniformLocation(shaders, name);
  const place = { clip: uniform("clip_from_model"), shift: uniform("shift"), colour: uniform("colour"),
                  eye: uniform("eye"), kind: uniform("kind"), nearer: uniform("nearer") };

  function upload(positions, elements, values) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(0, positions, 3);
    if (values) attribute(1, values, 1);
    if (elements) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, elements, gl.STATIC_DRAW);
    }
    return { array, count: elements ? elements.length : positions.length / 3 };
  }
  function attribute(slot, data, width) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, width, gl.FLOAT, false, 0, 0);
  }

  const boards = scene.boards.map((board) => {
    const positions = floats(board.positions), triangles = indices(board.triangles);
    return { ...board, points: positions, faces: triangles,
             solid: upload(positions, triangles), lines: upload(positions, indices(board.edges)) };
  });
  const cloud = scene.cloud && upload(floats(scene.cloud.positions), null, floats(scene.cloud.values));

  // --- camera -------------------------------------------------------------------------------------------------------
  const home = { turn: -0.9, tilt: 0.45, distance: 2.3 * scene.radius, x: 0, y: 0 };
  let camera = { ...home }, chosen = -1;
  const add = (a, b) => a.map((v, k) => v + b[k]);
  const minus = (a, b) => a.map((v, k) => v - b[k]);
  const times = (a, s) => a.map((v) => v * s);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => times(a, 1 / Math.hypot(...a));

  function axes() {
    const { turn, tilt, distance, x, y } = camera;
    const back = [Math.cos(tilt) * Math.cos(turn), Math.cos(tilt) * Math.sin(turn), Math.sin(tilt)];
    const right = [-Math.sin(turn), Math.cos(turn), 0], up = cross(back, right);
    const target = add(add(scene.centre, times(right, x)), times(up, y));
    return { back, right, up, eye: add(target, times(back, distance * (1 + 0.6 * explode.value))) };
  }
  const FOCAL = 2.2;   // half the height over the distance: a field of 49 degrees
  function clipFromModel({ back, right, up, eye }) {
    const aspect = canvas.width / canvas.height, near = camera.distance / 50, far = camera.distance + 20 * scene.radius;
    const sx = FOCAL / aspect, a = -(far + near) / (far - near), b = -2 * far * near / (far - near);
    const [r, u, f] = [right, up, back].map((v) => [...v, -dot(v, eye)]);
    const rows = [r.map((v) => v * sx), u.map((v) => v * FOCAL), f.map((v, k) => v * a + (k === 3 ? b : 0)), f.map((v) => -v)];
    return new Float32Array([0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])));
  }
  const shiftOf = (board) => times(minus(board.centre, scene.centre), Number(explode.value));

  // --- drawing ------------------------------------------------------------------------------------------------------
  let wanted = false;
  function draw() {
    wanted = false;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const view = axes();
    gl.uniformMatrix4fv(place.clip, false, clipFromModel(view));
    gl.uniform3fv(place.eye, view.eye);
    boards.forEach((board, index) => {
      gl.uniform3fv(place.shift, shiftOf(board));
      paint(board.solid, gl.TRIANGLES, 0, index === chosen ? [0.95, 0.55, 0.2] : board.colour, 0);
      paint(board.lines, gl.LINES, 1, [0.16, 0.13, 0.1], 4e-4);
    });
    if (cloud && cloudBox.checked && Number(explode.value) === 0) {   // the cloud cannot be taken apart
      gl.uniform3fv(place.shift, [0, 0, 0]);
      paint(cloud, gl.POINTS, 2, [0, 0, 0], 8e-4);
    }
  }
  function paint(shape, mode, kind, colour, nearer) {
    gl.uniform1i(place.kind, kind);
    gl.uniform3fv(place.colour, colour);
    gl.uniform1f(place.nearer, nearer);
    gl.bindVertexArray(shape.array);
    if (mode === gl.POINTS) gl.drawArrays(mode, 0, shape.count);
    else gl.drawElements(mode, shape.count, gl.UNSIGNED_INT, 0);
  }
  function redraw() {
    if (!wanted) { wanted = true; requestAnimationFrame(draw); }
  }

  // --- choosing a board ---------------------------------------------------------------------------------------------
  function boardAt(clientX, clientY) {
    const box = canvas.getBoundingClientRect(), { back, right, up, eye } = axes();
    const x = (2 * (clientX - box.left) / box.width - 1) * box.width / box.height / FOCAL;
    const y = (1 - 2 * (clientY - box.top) / box.height) / FOCAL;
    const ray = unit(minus(add(times(right, x), times(up, y)), back));
    let best = Infinity, found = -1;
    boards.forEach((board, index) => {
      const depth = nearest(minus(eye, shiftOf(board)), ray, board.points, board.faces);
      if (depth < best) { best = depth; found = index; }
    });
    return found;
  }
  function nearest(eye, ray, points, faces) {   // Moeller and Trumbore, 1997
    let best = Infinity;
    for (let k = 0; k < faces.length; k += 3) {
      const [a, b, c] = [0, 1, 2].map((n) => points.subarray(3 * faces[k + n], 3 * faces[k + n] + 3));
      const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
      const p = cross(ray, v), determinant = dot(u, p);
      if (Math.abs(determinant) < 1e-9) continue;
      const s = [eye[0] - a[0], eye[1] - a[1], eye[2] - a[2]], q = cross(s, u);
      const m = dot(s, p) / determinant, n = dot(ray, q) / determinant, t = dot(v, q) / determinant;
      if (m >= 0 && n >= 0 && m + n <= 1 && t > 0 && t < best) best = t;
    }
    return best;
  }
  const cards = [...document.querySelectorAll(".card[data-board]")];
  function choose(index, scroll) {
    chosen = index;
    label.textContent = index < 0 ? "" : boards[index].name;
    for (const card of cards) {
      const mine = card.dataset.board.split(" ").map(Number).includes(index);
      card.classList.toggle("chosen", mine);
      if (mine && scroll) card.scrollIntoView({ block: "nearest", behavior: "smooth" });
    }
    redraw();
  }
  for (const card of cards) card.addEventListener("click", () => choose(Number(card.dataset.board.split(" ")[0]), false));

  // --- hands --------------------------------------------------------------------------------------------------------
  const pointers = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    moved += Math.abs(dx) + Math.abs(dy);
    if (pointers.size === 2) pinch(event);
    else if (event.shiftKey || event.buttons === 4 || event.buttons === 2) slide(dx, dy);
    else turn(dx, dy);
    pointers.set(event.pointerId, event);
    redraw();
  });
  canvas.addEventListener("pointerup", (event) => {
    pointers.delete(event.pointerId);
    if (moved < 4) choose(boardAt(event.clientX, event.clientY), true);
  });
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(event.deltaY * 1e-3)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const keys = { ArrowLeft: [20, 0], ArrowRight: [-20, 0], ArrowUp: [0, 20], ArrowDown: [0, -20] };
    if (keys[event.key]) { event.preventDefault(); turn(...keys[event.key]); redraw(); }
  });
  function turn(dx, dy) {
    camera.turn -= dx * 0.008;
    camera.tilt = Math.max(-1.5, Math.min(1.5, camera.tilt + dy * 0.008));
  }
  function slide(dx, dy) {
    const step = 2 * camera.distance / FOCAL / canvas.clientHeight;
    camera.x -= dx * step;
    camera.y += dy * step;
  }
  function pinch(event) {
    const [other] = [...pointers.entries()].filter(([id]) => id !== event.pointerId).map(([, e]) => e);
    const apart = (e) => Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY);
    zoom(apart(pointers.get(event.pointerId)) / Math.max(1, apart(event)));
  }
  function zoom(factor) {
    camera.distance = Math.max(scene.radius / 5, Math.min(10 * scene.radius, camera.distance * factor));
    redraw();
  }
  explode.addEventListener("input", redraw);
  cloudBox.addEventListener("input", redraw);
  document.getElementById("home").addEventListener("click", () => { camera = { ...home }; explode.value = 0; choose(-1, false); });
  new ResizeObserver(redraw).observe(canvas);
  redraw();
})();

// The drawing over the photographs: how much of it shows, outline or shaded, and blinking.
(() => {
  const slider = document.getElementById("blend"), style = document.getElementById("style"), blink = document.getElementById("blink");
  if (!slider) return;
  const layers = [...document.querySelectorAll(".layers img + img")];
  const show = (share) => layers.forEach((image) => { image.style.opacity = share; });
  slider.addEventListener("input", () => { blink.checked = false; show(slider.value); });
  style.addEventListener("change", () => { document.body.className = style.value; });
  setInterval(() => { if (blink.checked) show(Math.floor(Date.now() / 500) % 2 ? 1 : 0); }, 100);
  blink.addEventListener("change", () => show(slider.value));
})();
