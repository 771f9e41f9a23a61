"use strict";
// A regular polygon with a style at each corner: a point in it is a mix (Xia 2015, figure 5).

const STYLE_POLYGON = {
  // Corners on the unit circle, the first on top. Two styles lie on a line, one in the middle.
  corners(count) {
    if (count === 1) return [[0, 0]];
    return Array.from({ length: count }, (_, i) => {
      const turn = 2 * Math.PI * i / count - Math.PI / 2 + (count === 2 ? Math.PI / 2 : 0);
      return [Math.cos(turn), Math.sin(turn)];
    });
  },

  // The point of the polygon nearest to `p`.
  inside(corners, p) {
    const n = corners.length;
    if (n === 1) return corners[0];
    const between = (a, b) => {
      const d = [b[0] - a[0], b[1] - a[1]];
      const t = ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / (d[0] * d[0] + d[1] * d[1]);
      const s = Math.min(1, Math.max(0, t));
      return [a[0] + s * d[0], a[1] + s * d[1]];
    };
    if (n === 2) return between(corners[0], corners[1]);
    const area = (a, b) => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    const edges = corners.map((a, i) => [a, corners[(i + 1) % n]]);
    if (edges.every(([a, b]) => area(a, b) >= 0)) return p;
    const far = (q) => Math.hypot(q[0] - p[0], q[1] - p[1]);
    return edges.map(([a, b]) => between(a, b)).reduce((best, q) => (far(q) < far(best) ? q : best));
  },

  // Barycentric coordinates of a point of the polygon (Wachspress 1975): from 0 to 1, sum 1, linear on the edges.
  weights(corners, p) {
    const n = corners.length;
    if (n === 1) return [1];
    const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    if (n === 2) {
      const t = distance(corners[0], p) / distance(corners[0], corners[1]);
      return [Math.fround(1 - t), Math.fround(t)];
    }
    const area = (a, b) => Math.abs((a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0]));
    const areas = corners.map((a, i) => area(a, corners[(i + 1) % n]));
    // The product of the areas that a corner does not touch: the fraction's denominators multiplied out, for the edges.
    const raw = corners.map((_, i) => areas.reduce((product, a, k) => (k === i || k === (i + n - 1) % n ? product : product * a), 1));
    const sum = raw.reduce((a, b) => a + b, 0);
    return raw.map((w) => (w / sum < 1e-4 ? 0 : Math.fround(w / sum)));
  },
};
