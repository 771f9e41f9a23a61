"use strict";
// The wasm module (builder/page/src): calls with JSON and bytes, answers with JSON and bytes.

const FUNCTIONS = ["database", "clip", "animation", "translate", "file", "unpacked"];

class Module {
  static async load(wasm) {
    const { instance } = await WebAssembly.instantiate(wasm, {});
    return new Module(instance.exports);
  }

  constructor(exports) { this.exports = exports; }

  // Calls a function by its name. Returns its JSON and a copy of its bytes; throws with the module's message.
  call(name, json = {}, bytes = new Uint8Array()) {
    const { text, data, text_at, text_length, data_at, data_length, call, memory } = this.exports;
    const put = (make, content) => {
      const at = make(content.length);
      new Uint8Array(memory.buffer, at, content.length).set(content);
    };
    put(text, new TextEncoder().encode(JSON.stringify(json)));
    put(data, bytes);
    let failed;
    try {
      failed = call(FUNCTIONS.indexOf(name));
    } catch (error) {
      throw new Error(`the module has stopped (${error.message}): reload the page`);
    }
    const get = (at, length) => new Uint8Array(memory.buffer, at, length).slice();
    const answer = new TextDecoder().decode(get(text_at(), text_length()));
    if (failed) throw new Error(answer);
    return { json: JSON.parse(answer), bytes: get(data_at(), data_length()) };
  }
}
