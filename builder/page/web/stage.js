"use strict";
// Draws triangles and lines with one light: WebGL 2, and a camera that orbits.

class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.camera = { yaw: 0.6, pitch: 0.15, zoom: 1 };
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) return;
    const shader = (kind, text) => {
      const made = gl.createShader(kind);
      gl.shaderSource(made, "#version 300 es\nprecision highp float;\n" + text);
      gl.compileShader(made);
      return made;
    };
    const program = this.program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, `
      in vec3 place; in vec3 normal; in vec2 uv; uniform mat4 view; out vec3 n; out vec2 t;
      void main() { gl_Position = view * vec4(place, 1.0); n = normal; t = uv; }`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
      in vec3 n; in vec2 t; uniform vec4 color; uniform sampler2D picture; uniform float lit; out vec4 result;
      void main() {
        float light = mix(1.0, 0.55 + 0.45 * dot(normalize(n + vec3(0.0, 1e-6, 0.0)), normalize(vec3(0.4, 0.8, 0.5))), lit);
        vec4 c = color * texture(picture, t);
        result = vec4(c.rgb * light * c.a, c.a);
      }`));
    ["place", "normal", "uv"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    this.at = (name) => gl.getUniformLocation(program, name);
    this.buffers = [0, 1, 2, 3].map(() => gl.createBuffer());
    this.white = this.texture(new Uint8Array([255, 255, 255, 255]));
    canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); this.drag = e; };
    canvas.onpointerup = canvas.onpointercancel = () => { this.drag = null; };
    canvas.onpointermove = (e) => {
      if (!this.drag) return;
      this.camera.yaw -= 0.008 * (e.clientX - this.drag.clientX);
      this.camera.pitch = Math.min(1.5, Math.max(-0.1, this.camera.pitch + 0.008 * (e.clientY - this.drag.clientY)));
      this.drag = e;
    };
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.camera.zoom = Math.min(8, Math.max(0.2, this.camera.zoom * Math.exp(-0.0015 * e.deltaY)));
    }, { passive: false });
  }

  // A texture of a pixel's bytes or of a picture.
  texture(source) {
    const { gl } = this, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    if (source instanceof Uint8Array) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, source);
    else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, source);
    gl.generateMipmap(gl.TEXTURE_2D);
    return made;
  }

  // Projection and view on a point, from a distance.
  view(target, distance) {
    const { yaw, pitch } = this.camera, aspect = this.canvas.width / this.canvas.height;
    const back = [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
    const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
    const eye = target.map((x, k) => x + distance * back[k]);
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const look = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const near = distance / 50, far = distance * 50, f = 2.2;
    return MATRIX.times([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0], look);
  }

  // Draws shapes: { positions, normals, uvs, indices, color, texture, lines }.
  draw(target, distance, shapes) {
    const { gl, canvas } = this;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * devicePixelRatio));
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.at("view"), false, this.view(target, distance / this.camera.zoom));
    for (const { positions, normals, uvs, indices, color, texture, lines } of shapes) {
      const attribute = (i, values, size) => {
        if (!values) { gl.disableVertexAttribArray(i); gl.vertexAttrib3f(i, 0, i === 1 ? 1 : 0, 0); return; }
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[i]);
        gl.bufferData(gl.ARRAY_BUFFER, values, gl.STREAM_DRAW);
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, size, gl.FLOAT, false, 0, 0);
      };
      attribute(0, positions, 3);
      attribute(1, normals, 3);
      attribute(2, uvs, 2);
      gl.uniform4fv(this.at("color"), color);
      gl.uniform1f(this.at("lit"), lines ? 0 : 1);
      gl.bindTexture(gl.TEXTURE_2D, texture || this.white);
      if (lines) { gl.drawArrays(gl.LINES, 0, positions.length / 3); continue; }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[3]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STREAM_DRAW);
      gl.drawElements(gl.TRIANGLES, indices.length, gl.UNSIGNED_INT, 0);
    }
  }

  // A grid on the floor around a point, a line a metre.
  static floor([x, , z], y, color) {
    const lines = [], reach = 6;
    for (let i = -reach; i <= reach; i++) {
      const [cx, cz] = [Math.round(x), Math.round(z)];
      lines.push(cx + i, y, cz - reach, cx + i, y, cz + reach, cx - reach, y, cz + i, cx + reach, y, cz + i);
    }
    return { positions: new Float32Array(lines), color, lines: true };
  }

  // The bones of a skeleton as slim double pyramids. `places`: the joints', 3 numbers each.
  static bones(places, parents, color, thickness) {
    const corners = [], normals = [], indices = [];
    const at = (j) => [places[3 * j], places[3 * j + 1], places[3 * j + 2]];
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };
    parents.forEach((parent, j) => {
      if (parent === null || parent < 0) return;
      const from = at(parent), to = at(j), along = to.map((x, k) => x - from[k]), length = Math.hypot(...along);
      if (length < 1e-4) return;
      const side = unit(cross(along, Math.abs(along[1]) > 0.8 * length ? [1, 0, 0] : [0, 1, 0])), other = unit(cross(along, side));
      const wide = Math.min(thickness, 0.25 * length);
      const ring = [side, other, side.map((x) => -x), other.map((x) => -x)].map((out) => [out, from.map((x, k) => x + 0.2 * along[k] + wide * out[k])]);
      for (let i = 0; i < 4; i++) {
        const [[a, p], [b, q]] = [ring[i], ring[(i + 1) % 4]], normal = unit(a.map((x, k) => x + b[k]));
        for (const tip of [from, to]) {
          const first = corners.length / 3;
          corners.push(...p, ...q, ...tip);
          for (let n = 0; n < 3; n++) normals.push(...normal);
          indices.push(first, first + 1, first + 2);
        }
      }
    });
    return { positions: new Float32Array(corners), normals: new Float32Array(normals), indices: new Uint32Array(indices), color };
  }
}
