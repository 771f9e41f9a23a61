"use strict";
// A character of a glTF file: its meshes, skinned, in the pose of one of its animations. What the page needs of glTF 2.0.

const MATRIX = {
  // Column by column, as glTF and WebGL have them.
  of([x, y, z], [qx, qy, qz, qw], [sx, sy, sz]) {
    const xx = qx * qx, yy = qy * qy, zz = qz * qz, xy = qx * qy, xz = qx * qz, yz = qy * qz, wx = qw * qx, wy = qw * qy, wz = qw * qz;
    return [
      (1 - 2 * (yy + zz)) * sx, 2 * (xy + wz) * sx, 2 * (xz - wy) * sx, 0,
      2 * (xy - wz) * sy, (1 - 2 * (xx + zz)) * sy, 2 * (yz + wx) * sy, 0,
      2 * (xz + wy) * sz, 2 * (yz - wx) * sz, (1 - 2 * (xx + yy)) * sz, 0,
      x, y, z, 1,
    ];
  },
  times(a, b) {
    const out = new Array(16);
    for (let c = 0; c < 4; c++) {
      for (let r = 0; r < 4; r++) {
        out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
      }
    }
    return out;
  },
};

class Model {
  // `bytes`: a .glb, or a .gltf whose buffers are data URIs. `unpack`: makes one whose data is not packed of one whose data is.
  constructor(bytes, unpack) {
    this.unpack = unpack;
    this.read(bytes);
    this.parents = this.json.nodes.map(() => -1);
    this.json.nodes.forEach((node, i) => (node.children || []).forEach((c) => { this.parents[c] = i; }));
    this.parts = [];
    this.json.nodes.forEach((node, i) => {
      if (node.mesh === undefined) return;
      for (const primitive of this.json.meshes[node.mesh].primitives) {
        if ((primitive.mode ?? 4) === 4 && primitive.attributes.POSITION !== undefined) this.parts.push(this.part(primitive, i, node.skin));
      }
    });
  }

  read(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const text = (part) => JSON.parse(new TextDecoder().decode(part));
    let bin = null;
    if (view.getUint32(0, true) === 0x46546c67) {
      const length = view.getUint32(12, true);
      this.json = text(bytes.subarray(20, 20 + length));
      const at = 20 + length;
      if (at + 8 <= bytes.length) bin = bytes.subarray(at + 8, at + 8 + view.getUint32(at, true));
    } else {
      this.json = text(bytes);
    }
    const isPacked = ({ extensions = {} }) => extensions.EXT_meshopt_compression || extensions.KHR_meshopt_compression;
    if ((this.json.bufferViews || []).some(isPacked)) return this.read(this.unpack(bytes));
    this.buffers = (this.json.buffers || []).map((buffer) => {
      if (!buffer.uri) return bin;
      const data = buffer.uri.split(";base64,")[1];
      return data ? Uint8Array.from(atob(data), (c) => c.charCodeAt(0)) : null;
    });
  }

  // Numbers of an accessor, row by row; normalised integers become fractions.
  numbers(index) {
    const accessor = this.json.accessors[index];
    const size = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 }[accessor.type];
    const [bytes, read, most] = {
      5120: [1, "getInt8", 127], 5121: [1, "getUint8", 255], 5122: [2, "getInt16", 32767],
      5123: [2, "getUint16", 65535], 5125: [4, "getUint32", 4294967295], 5126: [4, "getFloat32", 1],
    }[accessor.componentType];
    const out = new Float32Array(accessor.count * size);
    const part = this.json.bufferViews[accessor.bufferView];
    if (!part || !this.buffers[part.buffer]) return out;
    const buffer = this.buffers[part.buffer];
    const view = new DataView(buffer.buffer, buffer.byteOffset, buffer.byteLength);
    const start = (part.byteOffset || 0) + (accessor.byteOffset || 0), stride = part.byteStride || size * bytes;
    const unit = accessor.normalized ? 1 / most : 1;
    for (let i = 0; i < accessor.count; i++) {
      for (let k = 0; k < size; k++) out[i * size + k] = view[read](start + i * stride + k * bytes, true) * unit;
    }
    return out;
  }

  part({ attributes, indices, material }, node, skin) {
    const at = (name) => (attributes[name] === undefined ? null : this.numbers(attributes[name]));
    const positions = at("POSITION"), count = positions.length / 3;
    const look = this.json.materials?.[material]?.pbrMetallicRoughness || {};
    const picture = this.json.textures?.[look.baseColorTexture?.index];
    const uvs = at("TEXCOORD_0");
    if (uvs) Model.place(uvs, look.baseColorTexture?.extensions?.KHR_texture_transform);
    return {
      node, skin, positions, normals: at("NORMAL") || new Float32Array(3 * count), uvs,
      joints: at("JOINTS_0"), weights: at("WEIGHTS_0"),
      indices: indices === undefined ? Uint32Array.from({ length: count }, (_, i) => i) : Uint32Array.from(this.numbers(indices)),
      color: look.baseColorFactor || [0.8, 0.8, 0.8, 1],
      image: this.image(picture?.extensions?.EXT_texture_webp?.source ?? picture?.source),
      outPositions: new Float32Array(3 * count), outNormals: new Float32Array(3 * count),
      binds: skin === undefined ? null : this.binds(this.json.skins[skin]),
    };
  }

  // Places on a picture as they are meant: files that are packed have them as fractions of a part of it.
  static place(uvs, { offset: [x, y] = [0, 0], rotation = 0, scale: [sx, sy] = [1, 1] } = {}) {
    const c = Math.cos(rotation), s = Math.sin(rotation);
    for (let i = 0; i < uvs.length; i += 2) {
      const u = uvs[i] * sx, v = uvs[i + 1] * sy;
      uvs[i] = c * u + s * v + x;
      uvs[i + 1] = c * v - s * u + y;
    }
  }

  binds({ joints, inverseBindMatrices }) {
    if (inverseBindMatrices !== undefined) return this.numbers(inverseBindMatrices);
    return Float32Array.from(joints.flatMap(() => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]));
  }

  // A picture that is stored in the file, as a Blob.
  image(source) {
    const image = this.json.images?.[source];
    const part = image && this.json.bufferViews[image.bufferView];
    if (part && this.buffers[part.buffer]) {
      const start = part.byteOffset || 0;
      return new Blob([this.buffers[part.buffer].slice(start, start + part.byteLength)], { type: image.mimeType });
    }
    const data = image?.uri?.startsWith("data:") && image.uri.split(";base64,")[1];
    return data ? new Blob([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))]) : null;
  }

  // Takes the animation of that name from another version of the file, with the same nodes.
  animate(bytes, name) {
    const other = Object.create(Model.prototype);
    other.unpack = this.unpack;
    other.read(bytes);
    const animations = other.json.animations || [];
    const found = animations.find((a, i) => (a.name?.trim() || `animation${i}`) === name) || animations[0];
    this.curves = found.channels.filter((c) => c.target.node !== undefined && c.target.path !== "weights").map((c) => {
      const { input, output, interpolation = "LINEAR" } = found.samplers[c.sampler];
      return { node: c.target.node, path: c.target.path, times: other.numbers(input), values: other.numbers(output), interpolation };
    });
    this.start = Math.min(...this.curves.map((c) => c.times[0]));
  }

  // A curve's value; cubic splines pass through their keys in straight lines, which is near enough to look at.
  static value({ times, values, interpolation, path }, t) {
    const size = path === "rotation" ? 4 : 3, cubic = interpolation === "CUBICSPLINE";
    let low = 0, high = times.length - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (times[middle] <= t) low = middle; else high = middle - 1; }
    const key = (i) => { const at = cubic ? (3 * i + 1) * size : i * size; return values.subarray(at, at + size); };
    const a = key(low);
    if (low + 1 >= times.length || t <= times[low] || interpolation === "STEP") return a;
    const b = key(low + 1), u = (t - times[low]) / (times[low + 1] - times[low]);
    const dot = size === 4 ? a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] : 1;
    const mixed = Array.from(a, (x, k) => x + ((dot < 0 ? -b[k] : b[k]) - x) * u);
    if (size === 3) return mixed;
    const norm = Math.hypot(...mixed) || 1;
    return mixed.map((x) => x / norm);
  }

  // Poses the meshes at a time, seconds from the animation's start. The file's unit of length is so many metres.
  pose(t, metres) {
    const unit = MATRIX.of([0, 0, 0], [0, 0, 0, 1], [metres, metres, metres]);
    const local = this.json.nodes.map((n) => ({ translation: n.translation || [0, 0, 0], rotation: n.rotation || [0, 0, 0, 1], scale: n.scale || [1, 1, 1], matrix: n.matrix }));
    for (const curve of this.curves || []) { local[curve.node][curve.path] = Model.value(curve, this.start + t); local[curve.node].matrix = undefined; }
    const world = [];
    const place = (i) => {
      if (world[i]) return world[i];
      const { translation, rotation, scale, matrix } = local[i];
      const own = matrix || MATRIX.of(translation, rotation, scale);
      world[i] = MATRIX.times(this.parents[i] < 0 ? unit : place(this.parents[i]), own);
      return world[i];
    };
    for (const part of this.parts) {
      const matrices = part.binds
        ? this.json.skins[part.skin].joints.map((j, i) => MATRIX.times(place(j), part.binds.subarray(16 * i, 16 * i + 16)))
        : [place(part.node)];
      Model.skin(part, matrices);
    }
  }

  static skin(part, matrices) {
    const { positions: p, normals: n, joints, weights, outPositions: q, outNormals: m } = part;
    const bound = joints && weights && part.binds;
    const sum = new Array(16);
    for (let v = 0; v < p.length / 3; v++) {
      let matrix = matrices[0];
      if (bound) {
        sum.fill(0);
        for (let k = 0; k < 4; k++) {
          const w = weights[4 * v + k];
          if (w === 0) continue;
          const one = matrices[joints[4 * v + k]];
          for (let i = 0; i < 16; i++) sum[i] += w * one[i];
        }
        matrix = sum;
      }
      const x = p[3 * v], y = p[3 * v + 1], z = p[3 * v + 2], nx = n[3 * v], ny = n[3 * v + 1], nz = n[3 * v + 2];
      for (let k = 0; k < 3; k++) {
        q[3 * v + k] = matrix[k] * x + matrix[4 + k] * y + matrix[8 + k] * z + matrix[12 + k];
        m[3 * v + k] = matrix[k] * nx + matrix[4 + k] * ny + matrix[8 + k] * nz;
      }
    }
  }
}
