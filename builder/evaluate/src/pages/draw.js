"use strict";
// What pages with skeletons share: a pinhole camera on a 2D canvas, a floor, a body, colours.
const Draw = (() => {
  const colors = {};

  // What drawing needs to know of a skeleton: names of its joints, and their parents (-1: none).
  function rig(names, parents) {
    const side = names.map((n) => /(_|\b)(l|left)$|^left|\.l$/i.test(n) ? 1 : /(_|\b)(r|right)$|^right|\.r$/i.test(n) ? 2 : 0);
    const feet = [1, 2].map((s) => {
      const of = (re) => names.findIndex((n, j) => side[j] === s && re.test(n));
      return [of(/toe/i), of(/foot|ankle/i)].filter((j) => j >= 0);
    });
    return { names, parents, side, feet, head: names.findIndex((n) => /^head/i.test(n)) };
  }

  function theme() {
    const css = getComputedStyle(document.documentElement);
    for (const k of ["card", "ink", "dim", "rule", "accent", "left", "right", "mid", "shadow", "floor", "axis"]) {
      colors[k] = css.getPropertyValue("--" + k).trim();
    }
  }
  const font = (px, weight) => `${weight || 400} ${px}px ${getComputedStyle(document.body).fontFamily}`;

  function fit(canvas, height) {
    const ratio = Math.min(3, window.devicePixelRatio || 1);
    if (height) canvas.style.height = height + "px";
    const w = canvas.clientWidth, h = canvas.clientHeight;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    return [g, w, h];
  }

  function projector(camera, target, x, y, w, h, reach) {
    const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw), cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
    const distance = reach * 2.45 / camera.zoom;
    const focal = 1.25 * Math.min(h, w * 1.3);
    return (px, py, pz) => {
      const dx = px - target[0], dy = py - target[1], dz = pz - target[2];
      const a = cy * dx - sy * dz, b = sy * dx + cy * dz;
      const up = cp * dy - sp * b, depth = distance - (sp * dy + cp * b);
      if (depth < 0.15) return null;
      const s = focal / depth;
      return [x + w / 2 + a * s, y + h / 2 - up * s, s, depth];
    };
  }

  function segment(g, see, a, b) {
    const p = see(...a), q = see(...b);
    if (p && q) { g.moveTo(p[0], p[1]); g.lineTo(q[0], q[1]); }
  }

  function floor(g, see, cx, cz, reach) {
    const n = Math.ceil(4 + reach), bx = Math.round(cx), bz = Math.round(cz);
    g.lineWidth = 1;
    for (let i = -n; i <= n; i++) {
      g.globalAlpha = 1 - 0.75 * Math.abs(i) / n;
      g.strokeStyle = colors.floor;
      g.beginPath();
      // In pieces, so that a line behind the camera loses only its hidden part.
      for (let k = -n; k < n; k++) {
        segment(g, see, [bx + i, 0, bz + k], [bx + i, 0, bz + k + 1]);
        segment(g, see, [bx + k, 0, bz + i], [bx + k + 1, 0, bz + i]);
      }
      g.stroke();
    }
    g.globalAlpha = 1;
  }

  // A body: `p` are the joints' positions, `shift` is taken off on the ground, `touch` tells which feet stand (left 1,
  // right 2).
  function skeleton(g, see, rig, p, shift, touch, tint, ghost) {
    const at = (j) => [p[3 * j] - shift[0], p[3 * j + 1], p[3 * j + 2] - shift[1]];
    const bones = [];
    g.lineCap = "round";
    g.strokeStyle = colors.shadow;
    for (let j = 0; j < rig.names.length; j++) {
      const parent = rig.parents[j];
      if (parent < 0) continue;
      const a = at(parent), b = at(j);
      const s = see(a[0], 0, a[2]), t = see(b[0], 0, b[2]);
      if (s && t) {
        g.lineWidth = Math.max(1.5, 0.05 * s[2]);
        g.globalAlpha = ghost ? 0.35 : 0.7;
        g.beginPath(); g.moveTo(s[0], s[1]); g.lineTo(t[0], t[1]); g.stroke();
      }
      const q = see(...a), r = see(...b);
      if (q && r) bones.push({ q, r, depth: (q[3] + r[3]) / 2, side: rig.side[j] });
    }
    if (rig.head >= 0) {
      const h = at(rig.head), base = rig.parents[rig.head] >= 0 ? at(rig.parents[rig.head]) : h;
      const d = [h[0] - base[0], h[1] - base[1], h[2] - base[2]], l = Math.hypot(...d) || 1;
      const c = see(h[0] + 0.09 * d[0] / l, h[1] + 0.09 * d[1] / l, h[2] + 0.09 * d[2] / l);
      if (c) bones.push({ ball: c, depth: c[3] });
    }
    g.globalAlpha = 0.85;
    rig.feet.forEach((joints, s) => {
      if (!(touch & (1 << s)) || !joints.length) return;
      const f = joints.map(at), x = f.reduce((a, b) => a + b[0], 0) / f.length, z = f.reduce((a, b) => a + b[2], 0) / f.length;
      g.fillStyle = s ? colors.right : colors.left;
      g.globalAlpha = 0.3;
      g.beginPath();
      for (let k = 0; k <= 24; k++) {
        const c = see(x + 0.16 * Math.cos(k * Math.PI / 12), 0, z + 0.16 * Math.sin(k * Math.PI / 12));
        if (c) g.lineTo(c[0], c[1]);
      }
      g.fill();
    });
    bones.sort((a, b) => b.depth - a.depth);
    g.globalAlpha = ghost ? 0.55 : 1;
    for (const b of bones) {
      const color = tint || [colors.mid, colors.left, colors.right][b.side || 0];
      if (b.ball) {
        g.fillStyle = color;
        g.beginPath(); g.arc(b.ball[0], b.ball[1], Math.max(2, 0.105 * b.ball[2]), 0, 7); g.fill();
        continue;
      }
      g.strokeStyle = colors.card;
      g.lineWidth = Math.max(3, 0.066 * b.q[2]) + 2;
      g.beginPath(); g.moveTo(b.q[0], b.q[1]); g.lineTo(b.r[0], b.r[1]); g.stroke();
      g.strokeStyle = color;
      g.lineWidth = Math.max(2.5, 0.062 * b.q[2]);
      g.beginPath(); g.moveTo(b.q[0], b.q[1]); g.lineTo(b.r[0], b.r[1]); g.stroke();
    }
    g.globalAlpha = 1;
  }

  const hue = (k, n) => {
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    return `hsl(${(212 + k * 137.508) % 360} ${k % 2 ? 52 : 60}% ${dark ? 60 : 54}%)`;
  };

  function clipText(g, text, width) {
    if (g.measureText(text).width <= width) return text;
    let n = text.length;
    while (n > 1 && g.measureText(text.slice(0, n) + "…").width > width) n--;
    return text.slice(0, n) + "…";
  }

  return { colors, rig, theme, font, fit, projector, segment, floor, skeleton, hue, clipText };
})();
