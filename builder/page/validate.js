"use strict";
// Checks glTF files with the Khronos validator (npm gltf-validator): node validate.js FOLDER_OF_THE_VALIDATOR FILE...
// Prints what it found of each file, and fails if there is an error or a warning.
const fs = require("fs");
const path = require("path");
const [folder, ...files] = process.argv.slice(2);
const validator = require(path.resolve(folder));

(async () => {
  let bad = false;
  for (const file of files) {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 50 });
    console.log(`${path.basename(file)}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos + issues.numHints} notes`);
    for (const { code, message, pointer, severity } of issues.messages.filter((m) => m.severity < 2)) {
      console.log(`  ${severity ? "warning" : "error"} ${code} at ${pointer}: ${message}`);
      bad = true;
    }
  }
  process.exit(bad ? 1 : 0);
})().catch((error) => { console.error(error); process.exit(1); });
