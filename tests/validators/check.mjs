// Runs all validators, and for each one a control: something broken that it has to find.
//   node check.mjs --static FOLDER --lit FOLDER --dark FOLDER --archive FILE.3tz --meshes FOLDER --dataset URL --tiles-validator FOLDER or nothing
import { parseArgs } from "node:util";

import { check_draco } from "./draco.mjs";
import { check_gltf } from "./gltf.mjs";
import { check_schemas } from "./schemas.mjs";
import { check_tilesets } from "./tilesets.mjs";

const options = ["static", "lit", "dark", "archive", "meshes", "dataset", "tiles-validator"];
const { values: given } = parseArgs({ options: Object.fromEntries(options.map((name) => [name, { type: "string" }])) });

let failures = 0;
async function check(name, body) {
  const start = Date.now();
  try {
    console.log(`ok  ${name}: ${await body()}; ${((Date.now() - start) / 1000).toFixed(1)} s`);
  } catch (error) {
    ++failures;
    console.error(`FAILED  ${name}: ${error.message}`);
  }
}

await check("gltf-validator", () => check_gltf([given.static, given.meshes, given.lit, given.dark]));
await check("Draco's decoder", () => check_draco(given.static));
await check("schemas", () => check_schemas(given.static, given.dataset));
if (given["tiles-validator"]) await check("3d-tiles-validator", () => check_tilesets(given["tiles-validator"], given.static, given.archive));
process.exit(failures > 0 ? 1 : 0);
