// Every tileset against the validator of its specification's authors.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

// What it may tell, and why that is no fault: gltf.mjs, whose validator it calls for the tiles.
const kExplained = /^This object may be unused\.$|extension as it is not supported by the validator: '(KHR_draco_mesh_compression|CESIUM_tile_edges)'|caused validation infos$/;

const all_of = (issue) => [issue, ...(issue.causes ?? []).flatMap(all_of)];

export async function check_tilesets(validator, folder, archive) {
  const { Validators } = createRequire(import.meta.url)(`${validator}/build/index.js`);
  const report = async (file) => JSON.parse((await Validators.validateTilesetFile(file)).serialize());
  const tilesets = [`${folder}/tileset.json`, `${folder}/tileset-explicit.json`, `${folder}/terrain3d/tileset.json`, archive];
  for (const file of tilesets) {
    const { numErrors, numWarnings, issues } = await report(file);
    const odd = issues.flatMap(all_of).filter(({ message }) => !kExplained.test(message));
    assert.ok(numErrors === 0 && numWarnings === 0 && odd.length === 0, `${file}: ${JSON.stringify(odd.slice(0, 3))}`);
  }
  const broken = `${folder}/broken-tileset.json`;
  writeFileSync(broken, readFileSync(tilesets[0], "utf8").replace('"geometricError"', '"geometric"'));
  assert.ok((await report(broken)).numErrors > 0, "a tileset without a geometric error passes (control)");
  return `${tilesets.length} tilesets without errors and warnings`;
}
