"use strict";
// Replays a recording through the wasm module in node: node run.js MODULE.wasm DB.gestus RECORDING
// Prints the digest, and fails if it differs from the recording's, or if gestus.js assumes another layout than the header's.
const assert = require("assert");
const fs = require("fs");
const path = require("path");
const { Gestus } = require("./gestus.js");

function checkLayout() {
  const header = fs.readFileSync(path.join(__dirname, "../capi/include/gestus.h"), "utf8").replace(/^ *\/\/.*$/gm, "");
  const flags = [...header.matchAll(/GESTUS_DEGRADED_(\w+) (\d+)/g)].map(([, name, bit]) => [name.toLowerCase(), Number(bit)]);
  const [, fields] = header.match(/struct GestusReport \{([^}]*)\}/);
  assert.deepStrictEqual([...Gestus.REPORT, "classes"], [...fields.matchAll(/(\w+)(\[\w+\])?;/g)].map(([, name]) => name));
  assert.deepStrictEqual(Gestus.DEGRADED, Object.fromEntries(flags));
}

(async () => {
  checkLayout();
  const [wasm, blob, stream] = process.argv.slice(2).map((name) => new Uint8Array(fs.readFileSync(name)));
  const gestus = await Gestus.load(wasm, blob);
  // A refused setting throws an error with a message.
  for (const [what, wrong] of [["a style", () => gestus.setStyle([[99, 1]])], ["weights", () => gestus.setStyle([[0, NaN]])]]) {
    let message = "";
    try { wrong(); } catch (e) { message = e.message; }
    if (!message) throw new Error(`${what} out of range: no error`);
  }
  // The bytes in an ArrayBuffer, as `fetch` returns them.
  const fetched = await Gestus.load(wasm, blob.buffer.slice(blob.byteOffset, blob.byteOffset + blob.length));
  if (fetched.joints !== gestus.joints) throw new Error("a database in an ArrayBuffer opens differently");
  // A database that was cut to its models does not support the mixture; the next method that it supports is used.
  const { exports } = (await WebAssembly.instantiate(wasm, {})).instance;
  const methodOf = (config) => new Uint32Array(exports.memory.buffer, config, 5)[4];
  const init = (...given) => (methodOf(given[4]) === 0 ? 39 : exports.gestus_stylizer_init(...given));
  const cut = new Gestus({ ...exports, gestus_stylizer_init: init }, blob);
  cut.step();
  if (cut.method !== 1) throw new Error(`a database without frames is streamed with method ${cut.method}`);
  const recording = Gestus.recording(stream.buffer.slice(stream.byteOffset, stream.byteOffset + stream.length));
  const start = process.hrtime.bigint();
  for (const _ of Gestus.replay(gestus, recording));
  const micros = Number(process.hrtime.bigint() - start) / 1e3 / recording.frames.length;
  const { digest } = gestus;
  let degraded = 0;
  for (const _ of Gestus.replay(gestus, recording)) {
    const report = gestus.report(), sum = report.classes.reduce((sum, c) => sum + c.proportion, 0);
    if (report.degraded.length) degraded++;
    else assert(report.step > 0 && report.bytes > 0 && Math.abs(sum - 1) < 1e-5, JSON.stringify(report));
  }
  const again = gestus.digest;
  console.log(`${recording.frames.length} frames, ${micros.toFixed(0)} us each, ${degraded} degraded, ` +
    `${wasm.length} bytes of module, digest ${digest}`);
  if (digest !== recording.digest || again !== digest) {
    console.error(`the host's digest is ${recording.digest}, the second run's ${again}`);
    process.exit(1);
  }
})().catch((error) => { console.error(error.message); process.exit(1); });
