"use strict";
// What `cargo xtask wasm` adds to a copy of the page: drops files on it, uses its settings, and lists what came of it in
// `data-results`. CHECKS: files, [{ name, bytes }].
(async () => {
  const page = document.documentElement, $ = (id) => document.getElementById(id);
  // Reads a file first, as the page does: the browser's time for checks runs on while the page waits for a file.
  const wait = async (ms) => {
    await new Blob(["."]).arrayBuffer();
    await new Promise((done) => setTimeout(done, ms));
  };
  const results = [];

  // Waits for the next translation, and keeps what it says.
  async function settled(what, change) {
    delete page.dataset.digest;
    change();
    for (let i = 0; i < 400 && !page.dataset.digest && page.dataset.state !== "error"; i++) await wait(10);
    results.push({ what, state: page.dataset.state, error: page.dataset.error, digest: page.dataset.digest, mix: page.dataset.mix, verdict: page.dataset.verdict, body: page.dataset.body });
    page.dataset.results = JSON.stringify(results);
    page.dataset.state = "checked";
  }

  const choose = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event("change")); };
  const corner = (name) => [...document.querySelectorAll("#polygon text")].find((t) => t.textContent === name).dispatchEvent(new Event("click"));
  // Drags the point to a place of the polygon, in units of its radius.
  function drag(x, y) {
    const view = $("polygon"), at = new DOMPoint(x, y).matrixTransform(view.getScreenCTM());
    for (const kind of ["pointerdown", "pointermove", "pointerup"]) {
      view.dispatchEvent(new PointerEvent(kind, { clientX: at.x, clientY: at.y, bubbles: true }));
    }
  }
  function drop({ name, bytes }) {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(bytes)], name));
    dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
  }

  for (let i = 0; i < 1000 && page.dataset.state === "loading"; i++) await wait(10);
  // The page translates once more after the point was put.
  await wait(500);
  const saved = [];
  for (const file of CHECKS) {
    await settled(`${file.name}: as it is`, () => drop(file));
    await settled(`${file.name}: dragged`, () => drag(0.25, -0.4));
    await settled(`${file.name}: phase, sync`, () => { choose("method", "phase"); choose("timing", "sync"); });
    await settled(`${file.name}: corner`, () => { choose("method", "mar"); choose("timing", "free"); corner("proud"); });
    await settled(`${file.name}: floor, in place`, () => {
      $("floor").value = "0.12";
      choose("root", "in-place");
    });
    await settled(`${file.name}: unit`, () => {
      $("floor").value = "";
      $("root").value = "";
      choose("unit", file.name.endsWith(".bvh") ? "inch" : "0.5");
    });
    await settled(`${file.name}: up`, () => {
      $("unit").value = "";
      choose("up", "z");
    });
    await settled(`${file.name}: loop`, () => {
      choose("up", "");
      $("loop").checked = true;
      $("loop").dispatchEvent(new Event("change"));
    });
    $("download").dispatchEvent(new Event("click"));
    saved.push(Number(page.dataset.saved));
  }
  drop({ name: "broken.bvh", bytes: [...new TextEncoder().encode("HIERARCHY\nROOT")] });
  for (let i = 0; i < 400 && !page.dataset.error; i++) await wait(10);
  results.push({ what: "broken", error: page.dataset.error });
  page.dataset.saved = JSON.stringify(saved);
  page.dataset.results = JSON.stringify(results);
})();
