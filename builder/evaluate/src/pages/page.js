"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const scenes = JSON.parse($("data").textContent).scenes.map(unpack);
  const view = $("view"), lines = $("lines");
  const home = { yaw: 0.75, pitch: 0.2, zoom: 1 };
  const camera = { ...home };
  let scene = null, time = 0, playing = false, last = 0, layer = null, dirty = true;
  const { colors, theme, font, fit, floor, hue, clipText } = Draw;

  // ---- data: differences back to values ----
  function undo(values, width) {
    const out = Float32Array.from(values.slice(0, width));
    const all = new Float32Array(values.length);
    const sum = Array.from(out);
    for (let i = 0; i < values.length; i++) {
      const k = i % width;
      if (i >= width) sum[k] += values[i];
      all[i] = sum[k];
    }
    return all;
  }

  function unpack(raw) {
    const tracks = raw.tracks.map((t) => {
      const width = 3 * t.names.length;
      const times = Array.from(undo(t.times, 1), (x) => x * 1e-4);
      const p = width ? undo(t.positions, width).map((x) => x * 1e-3) : new Float32Array(0);
      let top = 0;
      for (let j = 0; j < t.names.length; j++) if (p.length) top = Math.max(top, p[3 * j + 1]);
      return { ...t, ...Draw.rig(t.names, t.parents), times, p, width, count: times.length, height: top || 1.7 };
    });
    const starts = tracks.filter((t) => t.count).map((t) => t.times[0]);
    const ends = tracks.filter((t) => t.count).map((t) => t.times[t.count - 1]);
    const begin = starts.length ? Math.min(...starts) : 0;
    const end = ends.length ? Math.max(...ends) : 0;
    const outer = [tracks[0], tracks[tracks.length - 1]];
    const same = tracks.length > 1 && outer[0].count === outer[1].count;
    const timed = same && outer[1].times.some((x, i) => Math.abs(x - outer[0].times[i]) > 2e-3);
    let shares = null;
    if (raw.proportions && raw.proportions.labels.length) {
      const n = raw.proportions.labels.length, v = raw.proportions.values;
      const mean = new Array(n).fill(0);
      v.forEach((x, i) => { mean[i % n] += x; });
      const order = mean.map((m, k) => [m, k]).sort((a, b) => b[0] - a[0] || a[1] - b[1]).map((x) => x[1]);
      shares = { n, v, labels: raw.proportions.labels, order, count: Math.floor(v.length / n) };
    }
    return { ...raw, tracks, begin, end: Math.max(end, begin + 1e-3), timed, shares };
  }

  // ---- time to frames ----
  const output = () => scene.tracks[scene.tracks.length - 1];
  function index(track, t) {
    const a = track.times;
    if (!track.count) return 0;
    if (t <= a[0]) return 0;
    let lo = 0, hi = track.count - 1;
    if (t >= a[hi]) return hi;
    while (hi - lo > 1) { const m = (lo + hi) >> 1; if (a[m] <= t) lo = m; else hi = m; }
    return lo + (t - a[lo]) / Math.max(1e-6, a[hi] - a[lo]);
  }
  // Only the input has other times than the output.
  const frameOf = (track) => index($("match").checked && scene.timed && track === scene.tracks[0] ? output() : track, time);

  function pose(track, at) {
    const out = new Float32Array(track.width);
    if (!track.count) return out;
    const i = Math.min(track.count - 1, Math.floor(at)), n = Math.min(track.count - 1, i + 1), u = at - i;
    for (let k = 0; k < track.width; k++) {
      const a = track.p[i * track.width + k];
      out[k] = a + u * (track.p[n * track.width + k] - a);
    }
    return out;
  }

  // ---- drawing ----
  const tints = () => [colors.dim, colors.accent, colors.left, colors.mid];

  function trail(g, see, track, shift) {
    const now = frameOf(track), from = Math.max(0, Math.floor(now) - 240), to = Math.min(track.count - 1, Math.floor(now) + 240);
    g.strokeStyle = colors.axis;
    g.lineWidth = 1.5;
    g.beginPath();
    let open = false;
    for (let i = from; i <= to; i += 2) {
      const k = i * track.width, q = see(track.p[k] - shift[0], 0, track.p[k + 2] - shift[1]);
      if (q && open) g.lineTo(q[0], q[1]); else if (q) g.moveTo(q[0], q[1]);
      open = !!q;
    }
    g.stroke();
  }

  function bounds(tracks) {
    const lo = [Infinity, Infinity], hi = [-Infinity, -Infinity];
    for (const t of tracks) for (let i = 0; i < t.count; i++) for (const [k, o] of [[0, 0], [1, 2]]) {
      const x = t.p[i * t.width + o];
      lo[k] = Math.min(lo[k], x); hi[k] = Math.max(hi[k], x);
    }
    if (!(hi[0] >= lo[0])) return { c: [0, 0], r: 0 };
    return { c: [(lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2], r: Math.hypot(hi[0] - lo[0], hi[1] - lo[1]) / 2 };
  }

  function drawView() {
    const [g, w, h] = fit(view);
    g.clearRect(0, 0, w, h);
    if (!scene || !scene.tracks.length) return;
    const over = $("overlay").checked, follow = $("follow").checked;
    const panels = [];
    for (const t of scene.tracks) {
      if (panels.length && (over || t.over)) panels[panels.length - 1].push(t); else panels.push([t]);
    }
    panels.forEach((tracks, i) => {
      const pw = w / panels.length, x = i * pw;
      g.save();
      g.beginPath(); g.rect(x, 0, pw, h); g.clip();
      const box = scene.box || (scene.box = bounds(scene.tracks));
      const poses = tracks.map((t) => pose(t, frameOf(t)));
      const tall = Math.max(...tracks.map((t) => t.height));
      const lead = poses[0], root = follow ? [lead[0], lead[2]] : box.c;
      const reach = follow ? tall : Math.max(tall, 0.75 * (box.r + 0.6 * tall));
      const see = Draw.projector(camera, [root[0], 0.5 * tall, root[1]], x, 0, pw, h, reach);
      floor(g, see, root[0], root[1], reach);
      // What is laid over another body is drawn behind it, so that it hides nothing.
      const order = [...tracks.keys()].sort((a, b) => tracks[b].over - tracks[a].over);
      for (const k of order) {
        const t = tracks[k];
        // In one view that follows, the roots are laid over one another, so that the poses compare.
        // A body that is laid over another one goes where that one goes.
        const on = over && follow && k ? lead : t.over && k ? poses[k - 1] : null;
        const shift = on ? [poses[k][0] - on[0], poses[k][2] - on[2]] : [0, 0];
        if (!on) trail(g, see, t, shift);
        const touch = Number(t.contacts[Math.min(t.count - 1, Math.floor(frameOf(t) + 1e-6))] || 0);
        Draw.skeleton(g, see, t, poses[k], shift, touch, over ? tints()[k % 4] : t.over ? colors.dim : null, t.over || (over && k === 0));
      }
      g.font = font(14, 600);
      g.textBaseline = "top";
      tracks.forEach((t, k) => {
        g.fillStyle = over ? tints()[k % 4] : t.over ? colors.dim : colors.ink;
        g.fillText(t.label, x + 16, 14 + 21 * k, pw - 32);
      });
      g.restore();
      if (i) { g.fillStyle = colors.rule; g.fillRect(x, 0, 1, h); }
    });
  }

  // ---- timeline ----
  const left = 172, rightPad = 18;
  const toX = (t, w) => left + (w - left - rightPad) * (t - scene.begin) / (scene.end - scene.begin);

  function layout() {
    let y = 12;
    const rows = [];
    // Without contacts there is no lane: an empty one would say that no foot ever stands.
    for (const t of scene.tracks) if (t.contacts) { rows.push({ kind: "contacts", track: t, y, h: 26 }); y += 36; }
    if (scene.shares) { rows.push({ kind: "shares", y, h: 96 }); y += 108; }
    if (scene.steps && scene.steps.length) { rows.push({ kind: "steps", y, h: 52 }); y += 64; }
    return { rows, axis: y, height: y + 24 };
  }

  function drawLayer() {
    const plan = layout();
    const [, w, h] = fit(lines, plan.height);
    const canvas = document.createElement("canvas");
    canvas.width = lines.width; canvas.height = lines.height;
    const g = canvas.getContext("2d");
    g.scale(lines.width / w, lines.height / h);
    const out = output();
    const stamp = (i) => out ? out.times[Math.min(i, out.count - 1)] || 0 : 0;
    g.textBaseline = "middle";
    for (const row of plan.rows) {
      const { y, h: rh } = row;
      g.textAlign = "left";
      g.fillStyle = colors.ink;
      g.font = font(12, 600);
      if (row.kind === "contacts") {
        const t = row.track;
        g.fillText(clipText(g, t.label, left - 42), 14, y + rh / 2);
        for (let s = 0; s < 2; s++) {
          const by = y + s * 14;
          g.globalAlpha = 1;
          g.font = font(10, 600);
          g.fillStyle = colors.dim;
          g.fillText(s ? "R" : "L", left - 18, by + 6);
          g.fillStyle = colors.floor;
          if (t.count) g.fillRect(toX(t.times[0], w), by, toX(t.times[t.count - 1], w) - toX(t.times[0], w), 12);
          g.fillStyle = s ? colors.right : colors.left;
          for (let i = 0; i < t.count;) {
            if (!(Number(t.contacts[i]) & (1 << s))) { i++; continue; }
            let n = i;
            while (n < t.count && Number(t.contacts[n]) & (1 << s)) n++;
            const a = toX(t.times[i], w), b = toX(t.times[Math.min(n, t.count - 1)], w);
            g.fillRect(a, by, Math.max(1, b - a), 12);
            i = n;
          }
        }
      } else if (row.kind === "shares") {
        g.fillText("Classes", 14, y + 8);
        g.font = font(10);
        g.fillStyle = colors.dim;
        g.fillText("mixing proportion", 14, y + 24);
        g.textAlign = "right";
        g.fillText("1", left - 8, y + 5);
        g.fillText("0", left - 8, y + rh - 4);
        const { n, v, order, count } = scene.shares;
        const base = new Float64Array(count);
        const stepsize = Math.max(1, Math.floor(count / (2 * w)));
        order.forEach((k, rank) => {
          g.fillStyle = hue(rank, n);
          g.beginPath();
          const line = [];
          for (let i = 0; i < count; i += stepsize) {
            const px = toX(stamp(i), w), lo = base[i];
            base[i] = lo + v[i * n + k] / 1000;
            line.push([px, y + rh * (1 - Math.min(1, lo))]);
            g.lineTo(px, y + rh * (1 - Math.min(1, base[i])));
          }
          for (let i = line.length - 1; i >= 0; i--) g.lineTo(line[i][0], line[i][1]);
          g.closePath();
          g.fill();
        });
        g.strokeStyle = colors.rule;
        g.strokeRect(left + 0.5, y + 0.5, w - left - rightPad - 1, rh - 1);
      } else {
        const s = scene.steps.map((x) => x / 100);
        let lo = Infinity, hi = -Infinity;
        for (const x of s) { lo = Math.min(lo, x); hi = Math.max(hi, x); }
        const mid = (lo + hi) / 2, half = Math.max((hi - lo) / 2, 0.05 * Math.abs(mid), 0.01) * 1.12;
        g.fillText("Time step", 14, y + 8);
        g.font = font(10);
        g.fillStyle = colors.dim;
        g.fillText("milliseconds", 14, y + 24);
        g.textAlign = "right";
        g.fillText((mid + half).toFixed(1), left - 8, y + 5);
        g.fillText((mid - half).toFixed(1), left - 8, y + rh - 4);
        g.strokeStyle = colors.rule;
        g.strokeRect(left + 0.5, y + 0.5, w - left - rightPad - 1, rh - 1);
        g.strokeStyle = colors.accent;
        g.lineWidth = 1.5;
        g.beginPath();
        s.forEach((x, i) => g.lineTo(toX(stamp(i), w), y + rh * (0.5 - (x - mid) / (2 * half))));
        g.stroke();
        g.lineWidth = 1;
      }
    }
    const span = scene.end - scene.begin;
    const tick = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find((x) => span / x <= Math.max(4, w / 110)) || 1200;
    g.font = font(11);
    g.textAlign = "center";
    for (let t = Math.ceil(scene.begin / tick - 1e-6) * tick; t <= scene.end + 1e-6; t += tick) {
      const x = toX(t, w);
      g.fillStyle = colors.axis;
      g.fillRect(x, plan.axis - 2, 1, 5);
      g.fillStyle = colors.dim;
      g.fillText((tick < 1 ? t.toFixed(1) : t.toFixed(0)) + " s", x, plan.axis + 12);
    }
    layer = { canvas, w, h, plan };
  }

  function drawLines() {
    if (!scene) return;
    if (!layer) drawLayer();
    const [g, w, h] = fit(lines);
    g.clearRect(0, 0, w, h);
    g.drawImage(layer.canvas, 0, 0, w, h);
    const x = toX(time, w);
    g.fillStyle = colors.ink;
    g.fillRect(x - 0.75, 4, 1.5, layer.plan.axis - 4);
    g.beginPath(); g.moveTo(x - 5, 2); g.lineTo(x + 5, 2); g.lineTo(x, 9); g.fill();
  }

  // ---- text ----
  function buildLegend() {
    const legend = $("legend");
    legend.textContent = "";
    scene.legend = [];
    legend.hidden = !scene.shares;
    if (!scene.shares) return;
    const { n, v, order, labels } = scene.shares;
    const peak = new Array(n).fill(0);
    v.forEach((x, i) => { peak[i % n] = Math.max(peak[i % n], x); });
    order.forEach((k, rank) => {
      if (peak[k] < 10) return;
      const item = document.createElement("span"), chip = document.createElement("i"), value = document.createElement("b");
      chip.style.background = hue(rank, n);
      item.append(chip, labels[k], value);
      legend.append(item);
      scene.legend.push([k, value]);
    });
  }

  function texts() {
    const out = output();
    const i = out ? Math.round(index(out, time)) : 0;
    const ms = (scene.steps && i < scene.steps.length) ? ` · ${(scene.steps[i] / 100).toFixed(1)} ms` : "";
    $("clock").textContent = `${time.toFixed(2)} s · frame ${i}${ms}`;
    const scrub = $("scrub");
    scrub.value = Math.round(1000 * (time - scene.begin) / (scene.end - scene.begin));
    scrub.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
    if (scene.shares && scene.shares.count) {
      const f = Math.min(i, scene.shares.count - 1);
      for (const [k, node] of scene.legend) node.textContent = `${Math.round(scene.shares.v[f * scene.shares.n + k] / 10)}%`;
    }
  }

  function show(k) {
    scene = scenes[k];
    layer = null;
    $("title").textContent = scene.title || document.title;
    $("subtitle").textContent = scene.subtitle;
    const body = $("facts").tBodies[0];
    body.textContent = "";
    $("facts").hidden = !scene.facts.length;
    for (const [name, value] of scene.facts) {
      const row = body.insertRow(), head = document.createElement("th");
      head.scope = "row";
      head.textContent = name;
      row.append(head);
      row.insertCell().textContent = value;
    }
    $("matchbox").hidden = !scene.timed;
    time = scene.begin;
    buildLegend();
    dirty = true;
  }

  // ---- control ----
  function setPlaying(on) {
    playing = on;
    if (on && time >= scene.end - 1e-6) time = scene.begin;
    $("play").textContent = on ? "Pause" : "Play";
    $("play").setAttribute("aria-label", on ? "Pause" : "Play");
  }
  function seek(t) { time = Math.min(scene.end, Math.max(scene.begin, t)); dirty = true; }
  function step(n) {
    setPlaying(false);
    // Along the track that is still moving at this time.
    const t = scene.tracks.find((x) => x.count && time < x.times[x.count - 1] - 1e-6) || output();
    const longest = scene.tracks.reduce((a, b) => (b.count && b.times[b.count - 1] >= (a.count ? a.times[a.count - 1] : -1) ? b : a), t);
    if (!longest.count) return;
    const i = n > 0 ? Math.floor(index(longest, time) + 1e-3) : Math.ceil(index(longest, time) - 1e-3);
    seek(longest.times[Math.min(longest.count - 1, Math.max(0, i + n))]);
  }
  function resetView() { Object.assign(camera, home); dirty = true; }
  function toggle(id) { $(id).checked = !$(id).checked; dirty = true; }

  function tick(now) {
    const dt = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (playing) {
      time += dt * Number($("speed").value);
      if (time > scene.end) time = scene.begin;
      dirty = true;
    }
    if (dirty) { dirty = false; drawView(); drawLines(); texts(); }
    requestAnimationFrame(tick);
  }

  function listen() {
    $("play").onclick = () => setPlaying(!playing);
    $("back").onclick = () => step(-1);
    $("next").onclick = () => step(1);
    $("reset").onclick = resetView;
    $("scrub").oninput = (e) => { setPlaying(false); seek(scene.begin + (scene.end - scene.begin) * e.target.value / 1000); };
    for (const id of ["follow", "overlay", "match"]) $(id).onchange = () => { dirty = true; };
    $("scene").onchange = (e) => show(Number(e.target.value));
    const pointers = new Map();
    view.onpointerdown = (e) => { view.setPointerCapture(e.pointerId); pointers.set(e.pointerId, e); };
    view.onpointerup = view.onpointercancel = (e) => pointers.delete(e.pointerId);
    view.onpointermove = (e) => {
      const was = pointers.get(e.pointerId);
      if (!was) return;
      if (pointers.size === 1) {
        camera.yaw += 0.008 * (e.clientX - was.clientX);
        camera.pitch = Math.min(1.5, Math.max(-0.05, camera.pitch + 0.008 * (e.clientY - was.clientY)));
      } else {
        const other = [...pointers.values()].find((p) => p.pointerId !== e.pointerId);
        const gap = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
        zoom(gap(e) / gap(was));
      }
      pointers.set(e.pointerId, e);
      dirty = true;
    };
    const zoom = (by) => { camera.zoom = Math.min(8, Math.max(0.2, camera.zoom * by)); dirty = true; };
    view.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-0.0015 * e.deltaY)); }, { passive: false });
    const scrubTo = (e) => {
      const box = lines.getBoundingClientRect();
      const u = (e.clientX - box.left - left) / (box.width - left - rightPad);
      setPlaying(false);
      seek(scene.begin + u * (scene.end - scene.begin));
    };
    lines.onpointerdown = (e) => { lines.setPointerCapture(e.pointerId); scrubTo(e); };
    lines.onpointermove = (e) => { if (e.buttons) scrubTo(e); };
    document.addEventListener("keydown", (e) => {
      if (e.ctrlKey || e.altKey || e.metaKey || e.target.tagName === "SELECT") return;
      const on = e.target.tagName, n = e.shiftKey ? 10 : 1;
      const act = {
        " ": () => setPlaying(!playing), ArrowLeft: () => step(-n), ArrowRight: () => step(n),
        Home: () => seek(scene.begin), End: () => seek(scene.end),
        f: () => toggle("follow"), o: () => toggle("overlay"), r: resetView,
      }[e.key.length === 1 ? e.key.toLowerCase() : e.key];
      if (!act || (e.key === " " && (on === "BUTTON" || e.target.type === "checkbox"))) return;
      e.preventDefault();
      act();
    });
    const redo = () => { theme(); layer = null; if (scene) buildLegend(); dirty = true; };
    addEventListener("resize", redo);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redo);
  }

  if (!scenes.length) { $("title").textContent = document.title; return; }
  scenes.forEach((s, k) => $("scene").add(new Option(s.title || `clip ${k + 1}`, k)));
  $("pick").hidden = scenes.length < 2;
  theme();
  // A link can name a place: page.html#scene=1&t=2.5&overlay=1&play=0
  const place = new URLSearchParams(location.hash.slice(1));
  const first = Math.min(scenes.length - 1, Math.max(0, Number(place.get("scene")) || 0));
  $("scene").value = first;
  show(first);
  for (const id of ["follow", "overlay", "match"]) if (place.has(id)) $(id).checked = place.get(id) === "1";
  listen();
  if (place.has("t")) seek(Number(place.get("t")) || 0);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  setPlaying(place.has("play") ? place.get("play") === "1" : !still && !place.has("t"));
  requestAnimationFrame((now) => { last = now; tick(now); });
})();
