"use strict";
// The page: a clip comes in, settings change, the module translates it, the result is drawn and can be saved.
(async () => {
  const $ = (id) => document.getElementById(id);
  const page = document.documentElement;
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const show = (message) => { $("message").textContent = message; $("message").hidden = !message; page.dataset.error = message; };
  const failed = (error) => { show(error.message || String(error)); page.dataset.state = "error"; };
  addEventListener("error", (e) => failed(e.error || e));
  addEventListener("unhandledrejection", (e) => failed(e.reason));

  const stage = new Stage($("view"));
  const drawn = stage.gl ? "" : "This browser has no WebGL 2: the motion is translated, but not drawn.";
  const module = await Module.load(bytes(GESTUS.wasm));
  let names = null, mix = null, point = null, clip = null, result = null;
  let time = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;

  // ---- settings ----
  const sliders = { groups: [], factors: [] };
  function slider(kind, name, range, value) {
    const row = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
    row.className = "slider";
    Object.assign(input, { type: "range", ...range, step: 0.05, value });
    input.setAttribute("aria-label", name);
    output.textContent = value;
    input.oninput = () => { output.textContent = input.value; if (kind === "factors") $("useeffort").checked = true; soon(); };
    row.append(name, input, output);
    $(kind).append(row);
    sliders[kind].push(input);
  }

  function svg(kind, attributes, parent) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    parent.append(made);
    return made;
  }

  function makePolygon() {
    const corners = STYLE_POLYGON.corners(names.styles.length), view = $("polygon");
    view.textContent = "";
    svg(corners.length === 2 ? "line" : "polygon", corners.length === 2
      ? { x1: corners[0][0], y1: corners[0][1], x2: corners[1][0], y2: corners[1][1] }
      : { points: corners.map((c) => c.join()).join(" ") }, view);
    const labels = names.styles.map((name, i) => {
      const [x, y] = corners[i];
      const label = svg("text", {
        x: 1.1 * x, y: 1.14 * y + 0.05, "text-anchor": x > 0.1 ? "start" : x < -0.1 ? "end" : "middle", tabindex: 0, role: "button",
      }, view);
      label.textContent = name;
      label.onclick = () => put(corners[i]);
      label.onkeydown = (e) => { if (e.key === "Enter" || e.key === " ") put(corners[i]); };
      return label;
    });
    const dot = svg("circle", { r: 0.07 }, view);
    function put(p) {
      point = STYLE_POLYGON.inside(corners, p);
      mix = STYLE_POLYGON.weights(corners, point);
      $("useeffort").checked = false;
      dot.setAttribute("cx", point[0]);
      dot.setAttribute("cy", point[1]);
      labels.forEach((label, i) => label.classList.toggle("on", mix[i] > 0.005));
      $("mix").textContent = names.styles.map((name, i) => [name, mix[i]]).filter(([, w]) => w > 0.005)
        .sort((a, b) => b[1] - a[1]).map(([name, w]) => `${name} ${Math.round(100 * w)}%`).join(", ");
      soon();
    }
    const at = (e) => {
      const p = new DOMPoint(e.clientX, e.clientY).matrixTransform(view.getScreenCTM().inverse());
      return [p.x, p.y];
    };
    let held = false;
    view.onpointerdown = (e) => { if (e.target.tagName === "text") return; held = true; put(at(e)); if (e.isTrusted) view.setPointerCapture(e.pointerId); };
    view.onpointermove = (e) => { if (held) put(at(e)); };
    view.onpointerup = view.onpointercancel = () => { held = false; };
    put(corners[Math.min(1, corners.length - 1)]);
  }

  function options(id, list, first) {
    $(id).textContent = "";
    if (first) $(id).add(new Option(first, ""));
    list.forEach((name, i) => $(id).add(new Option(name, i)));
  }

  function useDatabase(blob) {
    names = module.call("database", {}, blob).json;
    for (const kind of ["groups", "factors"]) { $(kind).textContent = ""; sliders[kind] = []; }
    names.groups.forEach((name) => slider("groups", name, { min: 0, max: 2 }, 1));
    $("effort").hidden = !names.effort;
    $("useeffort").checked = false;
    if (names.effort) ["flow", "weight", "time"].forEach((name, k) => slider("factors", name, { min: -3, max: 3 }, names.effort.rest[k].toFixed(2)));
    $("method").textContent = "";
    names.methods.forEach((name) => $("method").add(new Option(name, name)));
    options("action", names.actions, "not known");
    options("inputstyle", names.styles, "not known");
    makePolygon();
  }

  function settings() {
    const label = (id) => ($(id).value === "" ? null : Number($(id).value));
    return {
      style: mix,
      effort: $("useeffort").checked ? sliders.factors.map((s) => Number(s.value)) : null,
      strength: sliders.groups.map((s) => Number(s.value)),
      method: $("method").value,
      sync: $("timing").value === "sync",
      action: label("action"),
      input_style: label("inputstyle"),
    };
  }

  // ---- clip and result ----
  const floats = (data) => new Float32Array(data.buffer, data.byteOffset, data.byteLength / 4);

  async function openFile(file) {
    try {
      const content = new Uint8Array(await file.arrayBuffer());
      if (!/\.gestus$/i.test(file.name)) { await useClip(content, file.name); return; }
      try {
        useDatabase(content);
      } catch (error) {
        throw new Error(`${file.name}: ${error.message || error}`);
      }
      if (clip) await useClip(clip.content, clip.name, clip.told);
    } catch (error) {
      failed(error);
      // The clip before is taken up again.
      if (clip) load(clip.content, clip.name, clip.told);
    }
  }

  // What is told about a clip; nothing, at first.
  const told = () => ({
    index: Number($("animation").value), unit: $("unit").value.trim() || null, floor: $("floor").value === "" ? null : Number($("floor").value),
    up: $("up").value || null, root: $("root").value || null, loop: $("loop").checked,
  });
  const UNTOLD = { index: 0, unit: null, floor: null, up: null, root: null, loop: false };
  function tell({ index, unit, floor, up, root, loop }) {
    $("animation").value = index;
    $("unit").value = unit ?? "";
    $("floor").value = floor ?? "";
    $("up").value = up ?? "";
    $("root").value = root ?? "";
    $("loop").checked = loop;
  }

  // Gives the module a clip and what is told about it; returns what it says about it.
  function load(content, name, told) {
    const { animations } = module.call("clip", { name }, content).json;
    return { animations, content, name, ...animation(told) };
  }

  function animation(told) {
    const { json, bytes: data } = module.call("animation", told);
    return { ...json, floor: json.ground.floor_m, told, places: floats(data) };
  }

  async function useClip(content, name, told = UNTOLD) {
    const next = load(content, name, told);
    if (/\.(glb|gltf)$/i.test(name)) {
      const model = new Model(content, (packed) => module.call("unpacked", { name }, packed).bytes);
      for (const part of model.parts) {
        if (part.image && stage.gl) part.texture = await createImageBitmap(part.image).then((image) => stage.texture(image), () => null);
      }
      if (model.parts.length) next.model = model;
    }
    options("animation", next.animations.map((a) => a || name));
    tell(told);
    $("animation").disabled = next.animations.length < 2;
    $("meshlabel").hidden = !next.model;
    $("skeleton").checked = !next.model;
    $("body").checked = next.retargeted;
    take(next);
  }

  function take(next) {
    clip = next;
    let low = Infinity, high = -Infinity;
    for (let i = 1; i < clip.places.length; i += 3) { low = Math.min(low, clip.places[i]); high = Math.max(high, clip.places[i]); }
    Object.assign(clip, { tall: Math.max(0.1, high - low) });
    $("name").textContent = clip.name;
    $("unit").placeholder = `${Number(clip.metres.toPrecision(3))} m`;
    $("floor").placeholder = `${clip.floor.toFixed(2)} (${clip.ground.floor_from})`;
    $("notes").textContent = "";
    for (const note of clip.notes) { const item = document.createElement("li"); item.textContent = note; $("notes").append(item); }
    time = 0;
    work();
  }

  function work() {
    if (!clip || !names) return;
    try {
      const start = performance.now();
      const { json, bytes: data } = module.call("translate", settings());
      const all = floats(data), own = 3 * json.output_frames * clip.joints.length;
      result = { ...json, places: all.subarray(0, own), body: all.subarray(own), seconds: Math.max(1e-3, (json.output_frames - 1) / json.output_rate) };
      if (clip.model) clip.model.animate(module.call("file").bytes, clip.animations[clip.told.index]);
      result.bodyScale = bodyScale();
      $("verdict").textContent = json.verdict.text;
      facts(performance.now() - start);
      show(drawn);
      page.dataset.state = "ready";
      page.dataset.digest = json.digest;
      page.dataset.frames = json.frames;
      page.dataset.verdict = $("verdict").textContent;
      page.dataset.body = result.body.length / (3 * json.body_parents.length);
      page.dataset.mix = JSON.stringify(mix);
    } catch (error) { failed(error); }
  }

  // One translation for many changes in a row.
  let waiting = 0;
  function soon() {
    clearTimeout(waiting);
    waiting = setTimeout(work, 60);
  }

  function facts(millis) {
    const list = [
      ["Frames in, out", `${result.frames}, ${result.output_frames}`],
      ["Skeleton", clip.retargeted ? "retargeted, and back" : "the database's own"],
      ["Floor", `${clip.floor.toFixed(2)} m, ${clip.ground.floor_from}`],
      ["Hips", `${clip.ground.root === "in-place" ? "in place" : "move"}, ${clip.ground.root_from}; ${clip.ground.speed_m_s.toFixed(2)} m/s`],
      ...(clip.ground.loop ? [["Loop", `${clip.ground.loop.frames} frames from ${clip.ground.loop.first_frame}`]] : []),
      ["Unlike the database", `${Math.round(100 * result.passed_mean)}% passed through`],
      ["Degraded", result.degraded_words],
      ["Classes a frame", result.classes_mean.toFixed(1)],
      ["Took", `${millis.toFixed(0)} ms`],
      ["Database", `${names.frames} frames at ${names.rate} Hz`],
      ["Digest", result.digest],
    ];
    $("facts").textContent = "";
    for (const [name, value] of list) {
      const cell = document.createElement("div"), key = document.createElement("dt"), text = document.createElement("dd");
      key.textContent = name;
      text.textContent = value;
      cell.append(key, text);
      $("facts").append(cell);
    }
  }

  function download() {
    try {
      const { bytes: data } = module.call("file");
      const [, stem, ending] = clip.name.match(/^(.*?)(\.[^.]*)?$/);
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([data]));
      link.download = `${stem}-styled${ending || ".bvh"}`;
      page.dataset.saved = data.length;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    } catch (error) { failed(error); }
  }

  // ---- drawing ----
  const css = (name) => {
    const text = getComputedStyle(page).getPropertyValue(name).trim();
    return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
  };

  // Mean height of the output's hips over that of the database's body.
  function bodyScale() {
    const height = (places, joints, floor) => {
      let sum = 0;
      for (let i = 1; i < places.length; i += 3 * joints) sum += places[i] - floor;
      return 3 * joints * sum / places.length;
    };
    const scale = height(result.places, clip.joints.length, clip.floor) / height(result.body, result.body_parents.length, 0);
    return scale > 0 && scale < Infinity ? scale : 1;
  }

  // The joints' places at a time, between the two frames beside it.
  function at(places, joints, rate, t) {
    const last = places.length / (3 * joints) - 1, f = Math.min(last, Math.max(0, t * rate)), i = Math.floor(f), u = f - i;
    const a = places.subarray(3 * joints * i, 3 * joints * (i + 1)), next = Math.min(last, i + 1);
    const b = places.subarray(3 * joints * next, 3 * joints * (next + 1));
    return a.map((x, k) => x + (b[k] - x) * u);
  }

  function draw() {
    if (!stage.gl || !clip || !result) return;
    const joints = clip.joints.length, now = at(result.places, joints, result.output_rate, time);
    const then = at(clip.places, joints, clip.rate, time), thick = 0.02 * clip.tall;
    const target = [now[0], clip.floor + 0.5 * clip.tall, now[2]];
    const shapes = [Stage.floor(target, clip.floor, [...css("--grid"), 1])];
    if (clip.model && $("mesh").checked) {
      clip.model.pose(time, clip.metres);
      for (const part of clip.model.parts) {
        shapes.push({ positions: part.outPositions, normals: part.outNormals, uvs: part.uvs, indices: part.indices, color: part.color, texture: part.texture });
      }
    }
    if ($("skeleton").checked || !clip.model) shapes.push(Stage.bones(now, clip.parents, [...css("--accent"), 1], thick));
    if ($("input").checked) {
      // Beside the output: drawn into it, neither could be seen.
      const side = 0.6 * clip.tall, cos = Math.cos(stage.camera.yaw), sin = Math.sin(stage.camera.yaw);
      const moved = then.map((x, k) => x + (k % 3 === 0 ? now[0] - then[0] - side * cos : k % 3 === 2 ? now[2] - then[2] + side * sin : 0));
      shapes.push(Stage.bones(moved, clip.parents, [...css("--dim"), 1], thick));
    }
    if ($("body").checked) {
      // Over the output: its hips where those are, on the same floor, as tall.
      const bones = result.body_parents.length, body = at(result.body, bones, result.output_rate, time);
      const from = [body[0], 0, body[2]], to = [now[0], clip.floor, now[2]];
      const over = body.map((x, k) => to[k % 3] + result.bodyScale * (x - from[k % 3]));
      shapes.push(Stage.bones(over, result.body_parents, [...css("--dim").map((c) => 0.45 * c), 0.45], 0.7 * thick));
    }
    stage.draw(target, 2.2 * clip.tall, shapes);
  }

  let before = performance.now();
  function tick(now) {
    if (result) {
      if (playing) time = (time + Math.min(0.1, (now - before) / 1000)) % result.seconds;
      $("scrub").value = Math.round(1000 * time / result.seconds);
      $("clock").textContent = `${time.toFixed(2)} of ${result.seconds.toFixed(2)} s`;
      $("play").textContent = playing ? "Pause" : "Play";
      draw();
    }
    before = now;
    requestAnimationFrame(tick);
  }

  $("play").onclick = () => { playing = !playing; };
  $("scrub").oninput = () => { playing = false; time = (result?.seconds || 0) * Number($("scrub").value) / 1000; };
  $("download").onclick = download;
  $("open").onchange = (e) => { if (e.target.files[0]) openFile(e.target.files[0]); };
  for (const id of ["animation", "unit", "floor", "up", "root", "loop"]) {
    $(id).onchange = () => {
      try {
        take({ ...clip, ...animation(told()) });
      } catch (error) {
        // The clip stays as it was told before.
        tell(clip.told);
        failed(error);
      }
    };
  }
  for (const id of ["method", "timing", "action", "inputstyle", "useeffort"]) $(id).onchange = soon;
  addEventListener("dragover", (e) => { e.preventDefault(); document.body.classList.add("over"); });
  addEventListener("dragleave", (e) => { if (!e.relatedTarget) document.body.classList.remove("over"); });
  addEventListener("drop", (e) => {
    e.preventDefault();
    document.body.classList.remove("over");
    const files = [...(e.dataTransfer?.files || [])];
    const endings = $("open").accept.split(",");
    const file = files.find((f) => endings.some((e) => f.name.toLowerCase().endsWith(e))) || files[0];
    if (file) openFile(file);
  });
  addEventListener("keydown", (e) => {
    if (e.key !== " " || ["BUTTON", "SELECT", "INPUT", "text"].includes(e.target.tagName)) return;
    e.preventDefault();
    playing = !playing;
  });

  useDatabase(bytes(GESTUS.database));
  await useClip(bytes(GESTUS.sample), "sample.glb");
  requestAnimationFrame(tick);
})();
