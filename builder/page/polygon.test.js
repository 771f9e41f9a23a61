"use strict";
// The style polygon's arithmetic: weights are barycentric coordinates. Run by `cargo xtask wasm`.
const assert = require("assert");
const fs = require("fs");
const path = require("path");
const source = fs.readFileSync(path.join(__dirname, "web", "polygon.js"), "utf8");
const polygon = new Function(`${source}; return STYLE_POLYGON;`)();

const close = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) < 2e-3;
for (const count of [1, 2, 3, 5, 8, 12]) {
  const corners = polygon.corners(count);
  // A corner is its style alone.
  corners.forEach((corner, i) => assert(Math.abs(polygon.weights(corners, corner)[i] - 1) < 1e-6, `corner ${i} of ${count}`));
  // Any point, moved into the polygon, is the mean of the corners by its weights.
  for (let x = -1.5; x <= 1.5; x += 0.13) {
    for (let y = -1.5; y <= 1.5; y += 0.17) {
      const point = polygon.inside(corners, [x, y]), weights = polygon.weights(corners, point);
      const mean = [0, 1].map((k) => corners.reduce((sum, corner, i) => sum + weights[i] * corner[k], 0));
      assert(weights.every((w) => w >= 0) && Math.abs(weights.reduce((a, b) => a + b) - 1) < 1e-3, `${count}: ${weights}`);
      assert(close(mean, point), `${count} corners, ${x}, ${y}: ${mean} for ${point}`);
    }
  }
  // A point inside stays where it is.
  if (count > 2) assert.deepStrictEqual(polygon.inside(corners, [0.1, 0.2]), [0.1, 0.2]);
}
console.log("the style polygon's weights are barycentric");
