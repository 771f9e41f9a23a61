"use strict";
// The live page: runs the core in the browser on the database in this file, with sliders for its settings.
(() => {
  const $ = (id) => document.getElementById(id);
  const page = document.documentElement;
  const say = (error) => {
    page.dataset.state = "error";
    page.dataset.error = error.message;
    $("proof").className = "proof other";
    $("proof").textContent = error.message;
  };
  const data = JSON.parse($("data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  $("title").textContent = document.title;
  $("subtitle").textContent = data.about;

  async function begin() {
    if (typeof WebAssembly !== "object") throw new Error("this browser has no WebAssembly");
    const [wasm, blob] = [bytes(data.wasm), bytes(data.blob)];
    const module = await WebAssembly.compile(wasm);
    const recording = Gestus.recording(bytes(data.recording));
    const live = await Gestus.load(module, blob);
    // A second stylizer recomputes the host's digest while the first one plays.
    const checker = await Gestus.load(module, blob);
    run(live, checker, recording, { wasm: wasm.length, blob: blob.length });
  }

  function run(core, checker, recording, sizes) {
    const { colors, theme, font, fit, floor, hue, clipText } = Draw;
    const frames = recording.frames, count = frames.length, period = 1 / core.rate;
    const body = Draw.rig(core.jointNames, core.skeleton.map((j) => j.parent));
    const home = { yaw: 0.75, pitch: 0.2, zoom: 1 }, camera = { ...home };
    const LENGTH = Math.round(8 * core.rate);
    let at = 0, playing = false, owed = 0, last = 0, dirty = true, total = 0, degraded = 0;
    // Reports and durations of the steps of the last seconds, newest last.
    let history = [], input = null, output = null;

    // ---- recomputes the host's digest, a few milliseconds at a time ----
    const checks = Gestus.replay(checker, recording);
    let checked = 0;
    function check() {
      const until = performance.now() + 6;
      while (performance.now() < until && !checks.next().done) checked++;
      if (checked < count) { $("proof").textContent = `checking the digest: ${Math.round(100 * checked / count)}%`; return; }
      const same = checker.digest === recording.digest;
      page.dataset.digest = checker.digest;
      page.dataset.expected = recording.digest;
      $("proof").className = same ? "proof same" : "proof other";
      $("proof").textContent = "";
      const digest = document.createElement("b");
      digest.textContent = checker.digest;
      $("proof").append("digest ", digest, same ? ": bit for bit what the host computes" : `, and the host's is ${recording.digest}`);
    }

    // ---- settings ----
    const weights = new Array(core.styleCount).fill(0), strengths = new Array(core.groupCount).fill(1);
    const searched = new Array(core.groupCount).fill(true);
    const told = (change) => {
      try { change(); $("said").textContent = ""; return true; } catch (error) { $("said").textContent = error.message; return false; }
    };
    const rows = { style: [], group: [] }, own = [];

    function slider(kind, k, name, most, element) {
      const row = document.createElement("div"), range = document.createElement("input"), value = document.createElement("output");
      row.className = "slider";
      Object.assign(range, { type: "range", min: 0, max: most, step: 0.01 });
      range.setAttribute("aria-label", name);
      row.append(element, range, value);
      $(kind + "s").append(row);
      rows[kind][k] = { row, range, value };
      return range;
    }

    function setWeights(change) {
      const kept = weights.slice();
      change();
      // A setting that the core refuses (all zero) is undone, and its message shown.
      if (!told(() => core.setStyle(weights.map((w, k) => [k, w])))) kept.forEach((w, k) => { weights[k] = w; });
      showSettings();
    }

    function showSettings() {
      const sum = weights.reduce((a, b) => a + b, 0) || 1;
      rows.style.forEach(({ row, range, value }, k) => {
        range.value = weights[k];
        value.textContent = weights[k] ? `${Math.round(100 * weights[k] / sum)}%` : "";
        row.classList.toggle("on", weights[k] > 0);
      });
      rows.group.forEach(({ row, range, value, box }, k) => {
        range.value = strengths[k];
        value.textContent = strengths[k].toFixed(2);
        box.checked = searched[k];
        row.classList.toggle("on", strengths[k] > 0);
      });
      dirty = true;
    }

    function makeSettings() {
      core.styles.forEach((name, k) => {
        const solo = document.createElement("button");
        solo.type = "button";
        solo.textContent = name;
        solo.title = `${name} alone`;
        solo.onclick = () => setWeights(() => weights.fill(0).splice(k, 1, 1));
        slider("style", k, name, 1, solo).oninput = (e) => setWeights(() => { weights[k] = Number(e.target.value); });
      });
      core.groups.forEach((name, k) => {
        const label = document.createElement("label"), box = document.createElement("input");
        box.type = "checkbox";
        box.title = `${name} is searched`;
        label.append(box, name);
        const range = slider("group", k, `strength of ${name}`, 2, label);
        rows.group[k].box = box;
        range.oninput = () => {
          const wanted = Number(range.value);
          if (told(() => core.setStrength(k, wanted))) strengths[k] = wanted;
          showSettings();
        };
        box.onchange = () => {
          if (told(() => core.setMask(k, box.checked))) searched[k] = box.checked;
          showSettings();
        };
      });
      core.groups.forEach((name, k) => {
        const line = document.createElement("label"), select = document.createElement("select");
        line.className = "line";
        line.append(`${name} `, select);
        select.add(new Option("as the body", -1));
        core.styles.forEach((style, s) => select.add(new Option(style, s)));
        select.onchange = () => {
          if (!told(() => core.setGroupStyle(k, Number(select.value)))) select.value = -1;
          dirty = true;
        };
        $("own").append(line);
        own[k] = select;
      });
      for (const [id, names] of [["action", core.actions], ["inputstyle", core.styles]]) {
        $(id).add(new Option("not known", -1));
        names.forEach((name, k) => $(id).add(new Option(name, k)));
        $(id).onchange = () => told(() => core.setLabels(Number($("action").value), Number($("inputstyle").value)));
      }
      $("defaults").onclick = defaults;
    }

    function defaults() {
      const first = frames[0];
      told(() => {
        weights.fill(0);
        for (const [style, weight] of first.styles) weights[style] += weight;
        core.setStyle(weights.map((w, k) => [k, w]));
        core.setLabels(first.action, first.inputStyle);
        strengths.fill(1).forEach((s, k) => core.setStrength(k, s));
        searched.fill(true).forEach((s, k) => core.setMask(k, s));
        own.forEach((select, k) => { core.setGroupStyle(k, -1); select.value = -1; });
      });
      $("action").value = first.action;
      $("inputstyle").value = first.inputStyle;
      showSettings();
    }

    // ---- the stream ----
    function step() {
      const start = performance.now();
      core.input.set(frames[at].pose);
      core.step();
      const micros = 1e3 * (performance.now() - start);
      core.addToDigest();
      const report = core.report();
      history.push({ ...report, micros, at });
      if (history.length > LENGTH) history.shift();
      input = positions(core.input);
      output = positions(core.output);
      total++;
      if (report.degraded.length) degraded++;
      at++;
      if (at >= count) { at = 0; core.c.gestus_stylizer_reset(core.stylizer); }
      page.dataset.frames = total;
      dirty = true;
    }

    // Continues from another frame: the half second before it is streamed first.
    function seek(frame) {
      core.reset();
      history = [];
      at = Math.max(0, frame - Math.round(core.rate / 2));
      while (at < frame) step();
      step();
    }

    function rotate(q, v) {
      const [x, y, z, w] = q;
      const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
      return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
    }
    function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
      return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz];
    }
    // Forward kinematics: parents come before their children.
    function positions(pose) {
      const turns = [], p = new Float32Array(3 * core.joints);
      core.skeleton.forEach(({ parent, offset }, j) => {
        const own = pose.subarray(3 + 4 * j, 7 + 4 * j);
        if (parent < 0) { turns[j] = own; p.set(pose.subarray(0, 3), 3 * j); return; }
        turns[j] = multiply(turns[parent], own);
        const arm = rotate(turns[parent], offset);
        for (let k = 0; k < 3; k++) p[3 * j + k] = p[3 * parent + k] + arm[k];
      });
      return p;
    }

    // ---- drawing ----
    const tall = (() => {
      let top = 0;
      for (const i of [0, count >> 1]) { const p = positions(frames[i].pose); for (let j = 0; j < core.joints; j++) if (p[3 * j + 1] < 3) top = Math.max(top, p[3 * j + 1]); }
      return top || 1.7;
    })();

    function drawView() {
      const [g, w, h] = fit($("view"));
      g.clearRect(0, 0, w, h);
      if (!output) return;
      const now = history[history.length - 1], touch = now.contacts[0] + 2 * now.contacts[1];
      const over = $("overlay").checked;
      const bodies = [["input", input, 0], [`output: ${styleText()}`, output, touch]];
      const panels = over ? [bodies] : bodies.map((b) => [b]);
      panels.forEach((shown, i) => {
        const pw = w / panels.length, x = i * pw, lead = shown[0][1];
        g.save();
        g.beginPath(); g.rect(x, 0, pw, h); g.clip();
        const see = Draw.projector(camera, [lead[0], 0.5 * tall, lead[2]], x, 0, pw, h, tall);
        floor(g, see, lead[0], lead[2], tall);
        shown.forEach(([label, p, feet], k) => {
          const shift = [p[0] - lead[0], p[2] - lead[2]];
          const tint = over ? [colors.dim, colors.accent][k] : null;
          Draw.skeleton(g, see, body, p, shift, feet, tint, over && !k);
          g.font = font(14, 600);
          g.textBaseline = "top";
          g.textAlign = "left";
          g.fillStyle = tint || colors.ink;
          g.fillText(clipText(g, label, pw - 32), x + 16, 14 + 21 * k);
        });
        g.restore();
        if (i) { g.fillStyle = colors.rule; g.fillRect(x, 0, 1, h); }
      });
    }

    function styleText() {
      const sum = weights.reduce((a, b) => a + b, 0) || 1;
      const parts = core.styles.map((name, k) => [name, weights[k] / sum]).filter((p) => p[1] > 0.005).sort((a, b) => b[1] - a[1]);
      return parts.length === 1 ? parts[0][0] : parts.map(([name, w]) => `${Math.round(100 * w)}% ${name}`).join(", ");
    }

    const quantile = (values, q) => values.slice().sort((a, b) => a - b)[Math.floor(q * (values.length - 1))] || 0;
    const LEFT = 172, RIGHT = 18;
    function drawLines() {
      const strips = [["Time step", "milliseconds", (s) => 1e3 * s.step, 1], ["Visits", "distances a frame", (s) => s.visits, 0],
        ["Time a step", "microseconds here", (s) => s.micros, 0]];
      const [g, w, h] = fit($("lines"), 12 + 20 + 36 + 96 + strips.length * 50 + 8);
      g.clearRect(0, 0, w, h);
      const x = (i) => w - RIGHT - (w - LEFT - RIGHT) * (history.length - i) / LENGTH, wide = x(1) - x(0) + 0.5;
      let y = 12;
      const title = (text, unit, from) => {
        g.textAlign = "left"; g.textBaseline = "middle"; g.fillStyle = colors.ink; g.font = font(12, 600);
        g.fillText(text, 14, from);
        g.fillStyle = colors.dim; g.font = font(10);
        g.fillText(unit, 14, from + 16);
      };
      g.textAlign = "left"; g.textBaseline = "middle"; g.fillStyle = colors.ink; g.font = font(12, 600);
      g.fillText("Degraded", 14, y + 5);
      g.fillStyle = "#d23f3f";
      history.forEach((r, i) => { if (r.degraded.length) g.fillRect(x(i), y + 2, Math.max(2, wide), 6); });
      y += 20;
      title("Contacts", "of the output's feet", y + 6);
      for (let s = 0; s < 2; s++) {
        g.fillStyle = colors.dim; g.font = font(10, 600); g.textAlign = "left";
        g.fillText("LR"[s], LEFT - 18, y + 14 * s + 6);
        g.fillStyle = colors.floor; g.fillRect(LEFT, y + 14 * s, w - LEFT - RIGHT, 12);
        g.fillStyle = s ? colors.right : colors.left;
        history.forEach((r, i) => { if (r.contacts[s]) g.fillRect(x(i), y + 14 * s, wide, 12); });
      }
      y += 36;
      title("Classes", "mixing proportion", y + 8);
      history.forEach((r, i) => {
        let base = 0;
        for (const { index, proportion } of r.classes.slice().sort((a, b) => a.index - b.index)) {
          g.fillStyle = hue(index, core.classCount);
          g.fillRect(x(i), y + 84 * (1 - base - proportion), wide, 84 * proportion + 0.5);
          base += proportion;
        }
      });
      g.strokeStyle = colors.rule; g.lineWidth = 1;
      g.strokeRect(LEFT + 0.5, y + 0.5, w - LEFT - RIGHT - 1, 83);
      y += 96;
      for (const [name, unit, value, digits] of strips) {
        title(name, unit, y + 8);
        const values = history.map(value);
        let lo = values.length ? Math.min(...values) : 0, hi = values.length ? Math.max(...values) : 1;
        // The axis starts at 0, except for the time step, whose axis is its own range.
        if (digits) { const half = Math.max(0.05 * (lo + hi) / 2, (hi - lo) / 2) * 1.1, mid = (lo + hi) / 2; lo = mid - half; hi = mid + half; } else { lo = 0; hi = 1.3 * quantile(values, 0.95) || 1; }
        g.textAlign = "right"; g.fillStyle = colors.dim; g.font = font(10);
        g.fillText(hi.toFixed(digits), LEFT - 8, y + 5);
        g.fillText(lo.toFixed(digits), LEFT - 8, y + 34);
        g.strokeStyle = colors.rule; g.strokeRect(LEFT + 0.5, y + 0.5, w - LEFT - RIGHT - 1, 37);
        g.strokeStyle = colors.accent; g.lineWidth = 1.5;
        g.beginPath();
        values.forEach((v, i) => g.lineTo(x(i + 0.5), y + 38 * (1 - Math.min(1, (v - lo) / (hi - lo || 1)))));
        g.stroke();
        g.lineWidth = 1;
        y += 50;
      }
    }

    const kib = (n) => (n >= 1 << 20 ? `${(n / (1 << 20)).toFixed(2)} MiB` : `${(n / 1024).toFixed(1)} KiB`);
    function texts() {
      $("clock").textContent = `frame ${at} of ${count}`;
      $("scrub").value = at;
      if (!history.length) return;
      const now = history[history.length - 1], recent = history.slice(-64);
      const legend = $("legend");
      legend.textContent = "";
      for (const { index, proportion } of now.classes) {
        const { action, style } = core.classes[index];
        const item = document.createElement("span"), chip = document.createElement("i"), value = document.createElement("b");
        chip.style.background = hue(index, core.classCount);
        value.textContent = `${Math.round(100 * proportion)}%`;
        item.append(chip, `${core.actions[action]} ${core.styles[style]}`, value);
        legend.append(item);
      }
      const facts = [
        ["A step here", `${quantile(recent.map((r) => r.micros), 0.5).toFixed(0)} µs (median)`],
        ["Visits", `${now.visits} distances`],
        ["Read from the blob", kib(now.bytes)],
        ["Distance to the data", Math.sqrt(now.distance2).toFixed(3)],
        ["Output's step", `${(1e3 * now.step).toFixed(1)} ms (input ${(1e3 * period).toFixed(1)})`],
        ["Contacts", ["none", "left", "right", "both"][now.contacts[0] + 2 * now.contacts[1]]],
        ["Degraded", now.degraded.length ? now.degraded.join(", ") : `no; ${degraded} of ${total} were`],
        ["Digest of this stream", core.digest],
        ["Stylizer's RAM", kib(core.stylizerBytes)],
        ["Core as wasm", kib(sizes.wasm)],
        ["Database", `${kib(sizes.blob)}, ${core.frames} frames`],
        ["Classes", `${core.actionCount} actions, ${core.styleCount} styles`],
      ];
      const list = $("facts");
      while (list.children.length < facts.length) list.append(document.createElement("div"));
      facts.forEach(([name, value], i) => {
        const cell = list.children[i];
        if (!cell.children.length) cell.append(document.createElement("dt"), document.createElement("dd"));
        cell.children[0].textContent = name;
        cell.children[1].textContent = value;
      });
    }

    // ---- control ----
    function setPlaying(on) {
      playing = on;
      owed = 0;
      $("play").textContent = on ? "Pause" : "Play";
      page.dataset.state = on ? "playing" : "paused";
    }

    function tick(now) {
      const dt = Math.min(0.1, Math.max(0, (now - last) / 1000));
      last = now;
      try {
        if (checked <= count && !page.dataset.digest) check();
        if (playing) {
          owed += dt * Number($("speed").value);
          const pace = () => ($("pace").value === "output" && history.length ? history[history.length - 1].step : period);
          for (let n = 0; owed >= pace() && n < 30; n++) { owed -= pace(); step(); }
        }
        if (dirty) { dirty = false; drawView(); drawLines(); texts(); }
      } catch (error) { say(error); return; }
      next(tick);
    }

    function listen() {
      $("play").onclick = () => setPlaying(!playing);
      $("once").onclick = () => { setPlaying(false); step(); };
      $("restart").onclick = () => { history = []; total = degraded = 0; at = 0; core.reset(); step(); };
      $("scrub").max = count - 1;
      $("scrub").oninput = () => seek(Number($("scrub").value));
      $("overlay").onchange = () => { dirty = true; };
      const view = $("view");
      let drag = null;
      view.onpointerdown = (e) => { view.setPointerCapture(e.pointerId); drag = e; };
      view.onpointerup = view.onpointercancel = () => { drag = null; };
      view.onpointermove = (e) => {
        if (!drag) return;
        camera.yaw += 0.008 * (e.clientX - drag.clientX);
        camera.pitch = Math.min(1.5, Math.max(-0.05, camera.pitch + 0.008 * (e.clientY - drag.clientY)));
        drag = e;
        dirty = true;
      };
      view.addEventListener("wheel", (e) => {
        e.preventDefault();
        camera.zoom = Math.min(8, Math.max(0.2, camera.zoom * Math.exp(-0.0015 * e.deltaY)));
        dirty = true;
      }, { passive: false });
      document.addEventListener("keydown", (e) => {
        if (e.ctrlKey || e.altKey || e.metaKey || ["SELECT", "INPUT"].includes(e.target.tagName)) return;
        const act = {
          " ": () => setPlaying(!playing), ArrowRight: () => $("once").onclick(), Home: () => $("restart").onclick(),
          o: () => { $("overlay").checked = !$("overlay").checked; dirty = true; },
          r: () => { Object.assign(camera, home); dirty = true; },
        }[e.key.length === 1 ? e.key.toLowerCase() : e.key];
        if (!act || (e.key === " " && e.target.tagName === "BUTTON")) return;
        e.preventDefault();
        act();
      });
      const redo = () => { theme(); dirty = true; };
      addEventListener("resize", redo);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redo);
    }

    // A headless browser may not draw at a steady rate, so checks run on a timer.
    const place = new URLSearchParams(location.hash.slice(1));
    const next = place.has("check") ? (f) => setTimeout(() => f(performance.now()), 16) : requestAnimationFrame;

    theme();
    makeSettings();
    defaults();
    listen();
    // For `cargo xtask wasm`: uses controls while the page plays, and lists those that worked.
    function tryControls() {
      const tried = [], use = (element, event) => element.dispatchEvent(new Event(event));
      const style = rows.style[0].range, group = rows.group[0].range;
      style.value = 0.5;
      use(style, "input");
      if (weights[0] === 0.5 && $("said").textContent === "") tried.push("style");
      group.value = 1.5;
      use(group, "input");
      if (strengths[0] === 1.5 && $("said").textContent === "") tried.push("strength");
      $("action").value = 0;
      use($("action"), "change");
      if ($("said").textContent === "") tried.push("label");
      page.dataset.tried = tried.join(", ");
    }

    // A link can set the time and the display: page.html#t=2.5&overlay=1&play=0&style=old
    if (place.has("style")) { const k = core.styles.indexOf(place.get("style")); if (k >= 0) setWeights(() => weights.fill(0).splice(k, 1, 1)); }
    $("overlay").checked = place.get("overlay") === "1";
    seek(Math.min(count - 1, Math.round((Number(place.get("t")) || 0) * core.rate)));
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    setPlaying(place.has("play") ? place.get("play") === "1" : place.has("check") || !still);
    if (place.has("check")) setTimeout(tryControls, 4000);
    next((now) => { last = now; tick(now); });
  }

  addEventListener("error", (event) => say(event.error || new Error(event.message)));
  begin().catch(say);
})();
