// Every .glb against Khronos's validator.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

import { files_below } from "./files.mjs";

const kMostSevere = 3;  // 0 errors, 1 warnings, 2 information, 3 hints
// What it may tell, and why that is no fault:
const kExplained = {
  UNSUPPORTED_EXTENSION: /KHR_draco_mesh_compression|CESIUM_tile_edges/,  // it has no decoder of the one, and does not know the other
  IMAGE_NPOT_DIMENSIONS: /257x257/,  // a pixel at each vertex of the lattice, both sides included
  UNUSED_OBJECT: /^/,  // so it cannot see that these use an accessor or a view of the buffer
};

async function issues_of(bytes) {
  const { issues } = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 0 });
  return issues.messages.filter(({ severity }) => severity <= kMostSevere);
}

const unexplained = (issues) => issues.filter(({ code, message, severity }) => severity < 2 || !kExplained[code]?.test(message));

export async function check_gltf(folders) {
  const files = folders.flatMap((folder) => files_below(folder, ".glb"));
  assert.ok(files.length > 50, `only ${files.length} files`);
  for (const file of files) {
    const found = unexplained(await issues_of(readFileSync(file)));
    assert.deepEqual(found, [], `${file}: ${JSON.stringify(found)}`);
  }
  const broken = Buffer.from(readFileSync(files[0]).toString("latin1").replace('"componentType":5126', '"componentType":5127'), "latin1");
  assert.ok(unexplained(await issues_of(broken)).length > 0, "a component type that does not exist passes (control)");
  return `${files.length} files without errors and warnings`;
}
