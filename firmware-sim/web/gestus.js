"use strict";
// Gestus for JavaScript: calls the functions of the C interface (firmware-sim/capi/include/gestus.h) with memory that is
// added to the module's own. One database, one stylizer.
//
// A plain script that defines `Gestus`, so that a page can embed it; node loads it with `require`.

const Gestus = (() => {
  const KINDS = { jointNames: 0, styles: 1, actions: 2, groups: 3 };
  // The header's GestusReport before its classes, and its flags: run.js compares them with the header.
  const REPORT = ["step_s", "predicted_step_s", "distance2", "passed", "visits", "bytes_read", "degraded", "left_contact",
    "right_contact", "class_count"];
  const DEGRADED = { input: 1, visits: 2, classes: 4, prediction: 8, jump: 16, leap: 128, far: 256, spike: 512 };
  const PROFILES = [0, 2], JOINTS = 32, CLASSES = 33, PARAMETER = 38, METHOD = 39;
  const PAGE = 65536, NAME_BYTES = 256, CONFIG_BYTES = 20, MAX_CLASSES = 8, REPORT_WORDS = REPORT.length + 2 * MAX_CLASSES;

  // The bytes of a Uint8Array, or of an ArrayBuffer as `fetch` returns it.
  const bytesOf = (data) => (ArrayBuffer.isView(data) ? data : new Uint8Array(data));

  class Gestus {
    // `module` is a WebAssembly.Module or the bytes of one, `blob` the bytes of a database, each a Uint8Array or an
    // ArrayBuffer.
    static async load(module, blob) {
      const made = await WebAssembly.instantiate(module, {});
      return new Gestus((made.instance || made).exports, blob);
    }

    constructor(exports, blob) {
      this.c = exports;
      blob = bytesOf(blob);
      const size = [exports.gestus_database_size(), Math.max(...PROFILES.map((p) => exports.gestus_stylizer_size(p)))];
      // The module never allocates, so the pages added here are not used by anything else.
      this.free = exports.memory.grow(Math.ceil((blob.length + size[0] + size[1] + 32768) / PAGE)) * PAGE;
      const blobAt = this.take(blob.length);
      new Uint8Array(exports.memory.buffer).set(blob, blobAt);
      this.out = this.take(8);
      this.text = this.take(NAME_BYTES);
      this.detail = this.take(16);
      const database = this.take(size[0]), stylizer = this.take(size[1]);
      this.check(exports.gestus_database_open(database, size[0], blobAt, blob.length, this.detail, this.out));
      this.database = database;
      // The smallest profile that fits the database, and the first method that the database supports: one that was cut to
      // its models has no frames for the mixture.
      const config = this.take(CONFIG_BYTES);
      let status;
      for (const profile of PROFILES) {
        this.check(exports.gestus_config_default(profile, config));
        for (let method = 0, found = METHOD; found === METHOD; method++) {
          new Uint32Array(exports.memory.buffer, config, CONFIG_BYTES / 4)[4] = method;
          found = exports.gestus_stylizer_init(stylizer, size[1], profile, database, config, this.out);
          // Behind the last method the number is refused, and the status is that of the methods.
          if (found !== PARAMETER) [status, this.method] = [found, method];
        }
        this.stylizerBytes = exports.gestus_stylizer_size(profile);
        if (status !== JOINTS && status !== CLASSES) break;
      }
      this.check(status);
      this.stylizer = stylizer;

      const counts = this.take(28);
      this.check(exports.gestus_database_counts(database, counts));
      const words = new Uint32Array(exports.memory.buffer, counts, 7);
      [this.joints, this.styleCount, this.actionCount, this.classCount, this.groupCount, this.frames] = words;
      this.rate = new Float32Array(exports.memory.buffer, counts + 24, 1)[0];
      for (const [kind, number] of Object.entries(KINDS)) {
        const count = [this.joints, this.styleCount, this.actionCount, this.groupCount][number];
        this[kind] = Array.from({ length: count }, (_, i) => this.name(number, i));
      }
      this.skeleton = Array.from({ length: this.joints }, (_, i) => this.joint(i));
      this.classes = Array.from({ length: this.classCount }, (_, i) => this.classAt(i));

      const numbers = 3 + 4 * this.joints;
      const input = this.take(4 * numbers), output = this.take(4 * numbers);
      this.inputAt = input;
      this.outputAt = output;
      this.reportAt = this.take(4 * REPORT_WORDS);
      this.digestAt = this.take(4);
      this.stylesAt = this.take(2 * 32);
      this.weightsAt = this.take(4 * 32);
      // Memory does not grow from here on, so these views stay valid.
      const buffer = exports.memory.buffer;
      this.input = new Float32Array(buffer, input, numbers);
      this.output = new Float32Array(buffer, output, numbers);
      this.reportFloats = new Float32Array(buffer, this.reportAt, REPORT_WORDS);
      this.reportWords = new Uint32Array(buffer, this.reportAt, REPORT_WORDS);
      this.digestWord = new Uint32Array(buffer, this.digestAt, 1);
    }

    take(bytes) {
      const at = this.free;
      this.free = (at + bytes + 15) & ~15;
      return at;
    }

    string(at) {
      const bytes = new Uint8Array(this.c.memory.buffer, at, NAME_BYTES);
      return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
    }

    check(status) {
      if (status !== 0) throw new Error(this.string(this.c.gestus_error_message(status)));
    }

    name(kind, index) {
      this.check(this.c.gestus_database_name(this.database, kind, index, this.text, NAME_BYTES, 0));
      return this.string(this.text);
    }

    joint(index) {
      this.check(this.c.gestus_database_joint(this.database, index, this.text));
      const [parent, group] = new Int32Array(this.c.memory.buffer, this.text, 2);
      return { parent, group, offset: Array.from(new Float32Array(this.c.memory.buffer, this.text + 8, 3)) };
    }

    classAt(index) {
      this.check(this.c.gestus_database_class(this.database, index, this.text));
      const [action, style, frames] = new Uint32Array(this.c.memory.buffer, this.text, 3);
      return { action, style, frames };
    }

    // Weights of styles: a list of [number, weight].
    setStyle(pairs) {
      const buffer = this.c.memory.buffer;
      new Uint16Array(buffer, this.stylesAt, pairs.length).set(pairs.map((p) => p[0]));
      new Float32Array(buffer, this.weightsAt, pairs.length).set(pairs.map((p) => p[1]));
      this.check(this.c.gestus_stylizer_set_style(this.stylizer, this.stylesAt, this.weightsAt, pairs.length));
    }

    // Style of a joint group, -1 for the body's.
    setGroupStyle(group, style) {
      const buffer = this.c.memory.buffer;
      new Uint16Array(buffer, this.stylesAt, 1)[0] = Math.max(style, 0);
      new Float32Array(buffer, this.weightsAt, 1)[0] = 1;
      this.check(this.c.gestus_stylizer_set_group_style(this.stylizer, group, this.stylesAt, this.weightsAt,
        style < 0 ? 0 : 1));
    }

    // Labels, -1 for none. Both are cleared first, since a database need not have every action in every style.
    setLabels(action, style) {
      this.check(this.c.gestus_stylizer_set_labels(this.stylizer, action, style));
    }

    setMask(group, searched) {
      this.check(this.c.gestus_stylizer_set_mask(this.stylizer, group, searched ? 1 : 0));
    }

    setStrength(group, strength) {
      this.check(this.c.gestus_stylizer_set_strength(this.stylizer, group, strength));
    }

    // Resets the stream and the digest.
    reset() {
      this.check(this.c.gestus_stylizer_reset(this.stylizer));
      this.digestWord[0] = 0;
    }

    // Steps from `input` to `output`, and adds the output to the digest.
    step() {
      this.check(this.c.gestus_stylizer_step(this.stylizer, this.inputAt, this.inputAt + 12, this.joints,
        this.outputAt, this.outputAt + 12, this.reportAt));
    }

    addToDigest() {
      this.check(this.c.gestus_digest(this.digestAt, this.outputAt, this.outputAt + 12, this.joints, this.reportFloats[0]));
    }

    get digest() {
      return this.digestWord[0].toString(16).padStart(8, "0");
    }

    // Report of the last step.
    report() {
      const float = (name) => this.reportFloats[REPORT.indexOf(name)], word = (name) => this.reportWords[REPORT.indexOf(name)];
      const classes = Array.from({ length: word("class_count") }, (_, i) => {
        const at = REPORT.length + 2 * i;
        return { index: this.reportWords[at], proportion: this.reportFloats[at + 1] };
      });
      return {
        step: float("step_s"), predicted: float("predicted_step_s"), distance2: float("distance2"), passed: float("passed"),
        visits: word("visits"), bytes: word("bytes_read"), contacts: [word("left_contact"), word("right_contact")], classes,
        degraded: Object.keys(DEGRADED).filter((name) => word("degraded") & DEGRADED[name]),
      };
    }
  }

  // A recording (firmware-sim/src/recording.rs): poses, settings and the host's digest. A Uint8Array or an ArrayBuffer.
  Gestus.recording = (data) => {
    const bytes = bytesOf(data);
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    if (String.fromCharCode(...bytes.slice(0, 8)) !== "GSTREAM1") throw new Error("this is not a recording");
    const count = view.getUint32(8, true), joints = view.getUint32(12, true);
    const size = 16 + 4 * (3 + 4 * joints);
    const frames = Array.from({ length: count }, (_, i) => {
      const at = 24 + i * size;
      const pose = Float32Array.from({ length: 3 + 4 * joints }, (_, k) => view.getFloat32(at + 16 + 4 * k, true));
      const styles = [0, 1].map((k) => [view.getUint16(at + 4 + 2 * k, true), view.getFloat32(at + 8 + 4 * k, true)]);
      return { action: view.getInt16(at, true), inputStyle: view.getInt16(at + 2, true), styles, pose };
    });
    return { joints, digest: view.getUint32(16, true).toString(16).padStart(8, "0"), frames };
  };

  // Replays a recording, a frame at each `next()`; `gestus.digest` is that of the output so far.
  Gestus.replay = function* replay(gestus, recording) {
    gestus.reset();
    let before = "";
    for (const frame of recording.frames) {
      const settings = JSON.stringify([frame.action, frame.inputStyle, frame.styles]);
      if (settings !== before) {
        gestus.setStyle(frame.styles);
        gestus.setLabels(frame.action, frame.inputStyle);
        before = settings;
      }
      gestus.input.set(frame.pose);
      gestus.step();
      gestus.addToDigest();
      yield;
    }
  };

  Object.assign(Gestus, { REPORT, DEGRADED });
  return Gestus;
})();

if (typeof module !== "undefined") module.exports = { Gestus };
