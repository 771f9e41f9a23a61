"use strict";
// Replays a recording through the wasm module in node: node run.js MODULE.wasm DB.gestus RECORDING
// Prints the digest, and fails if it differs from the recording's.
const fs = require("fs");
const { Gestus } = require("./gestus.js");

(async () => {
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
  let degraded = 0;
  const digest = Gestus.replay(gestus, recording, (g) => { if (g.reportWords[5]) degraded++; });
  const micros = Number(process.hrtime.bigint() - start) / 1e3 / recording.frames.length;
  const again = Gestus.replay(gestus, recording);
  console.log(`${recording.frames.length} frames, ${micros.toFixed(0)} us each, ${degraded} degraded, ` +
    `${wasm.length} bytes of module, digest ${digest}`);
  if (digest !== recording.digest || again !== digest) {
    console.error(`the host's digest is ${recording.digest}, the second run's ${again}`);
    process.exit(1);
  }
})().catch((error) => { console.error(error.message); process.exit(1); });
