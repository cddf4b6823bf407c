// The blocks for Node.js, run as modules of their own, and what became of their tiles.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { writeFileSync } from "node:fs";
import { promisify } from "node:util";

import { assert_heights, assert_no_relief } from "./checks.mjs";
import { highest_in } from "./drivers/lonlat_mesh.js";
import { with_addresses } from "./snippets.mjs";

const entry = (name) => new URL(`./entries/${name}`, import.meta.url);

// As a reader's main.mjs, with the names that the test needs given out at its end.
function run_block({ name, snippet, names }, dataset, addresses) {
  const file = entry(`${name}-${dataset}.mjs`);
  writeFileSync(file, `${with_addresses(snippet, addresses)}\nexport { ${names.join(", ")} };\n`);
  return import(file);
}

// The known places that the block's tile holds, and what it says of them.
function heights_of({ vertices, triangles, x, y, degrees }, known) {
  const places = known.filter(({ lon, lat }) => Math.floor((lon + 180) / degrees) === x && Math.floor((lat + 90) / degrees) === y);
  assert.ok(places.length > 0, "no known place lies in the tile");
  return [places.map((place) => highest_in([{ vertices, triangles }], place)), places];
}

export async function try_mesh_block(client, { addresses_of, known, allowed_m }) {
  const tile = await run_block(client, "terrain", addresses_of("terrain"));
  const [found, places] = heights_of(tile, known);
  const worst_m = assert_heights(found, places, "height", allowed_m);
  const beyond = await run_block(client, "across", addresses_of("across"));
  assert.ok(beyond.vertices.length > 0, "no tile of data over the antimeridian");
  assert_no_relief(...heights_of(await run_block(client, "flat", addresses_of("flat")), known), "height", allowed_m);
  return `${tile.vertices.length / 3} vertices, ${places.length} places within ${worst_m.toFixed(2)} of ${allowed_m.toFixed(2)} m`;
}

// An archive's tile is the server's, byte for byte.
export async function try_archive_block(client, { addresses_of }) {
  const { data, z, x, y } = await run_block(client, "terrain", addresses_of("terrain"));
  const served = await fetch(`${addresses_of("terrain").dataset}/tiles/${z}/${x}/${y}.drc`);
  assert.equal(served.status, 200);
  assert.deepEqual(Buffer.from(data), Buffer.from(await served.arrayBuffer()));
  const other = await run_block(client, "flat", addresses_of("flat"));
  assert.notDeepEqual(Buffer.from(other.data), Buffer.from(data), "a flat raster's tile is the same (control)");
  return `tile ${z}/${x}/${y} of ${data.byteLength} bytes is the server's`;
}

export async function try_tileset_block(client, { addresses_of, manifest }) {
  const { tileset } = await run_block(client, "terrain", addresses_of("terrain"));
  const [west, south, east, north] = manifest.bounds.slice(0, 4).map((degrees) => (degrees * Math.PI) / 180);
  const [w, s, e, n] = tileset.root.boundingVolume.region;
  assert.ok(w <= west && s <= south && e >= east && n >= north, "the tileset does not hold the data");
  return `root of ${tileset.root.children.length} children`;
}

// The program of formats/drc.md: it is saved as a file, and run with a tile as its argument.
export async function try_drc_program(program, { addresses_of, manifest }) {
  const [west, south, east, north] = manifest.bounds, [{ level }] = manifest.levels, degrees = 180 / 2 ** level;
  const [x, y] = [Math.floor(((west + east) / 2 + 180) / degrees), Math.floor(((south + north) / 2 + 90) / degrees)];
  const tile = await fetch(`${addresses_of("terrain").dataset}/tiles/${level}/${x}/${y}.drc`);
  assert.equal(tile.status, 200);
  const [read, drc] = [entry("read.cjs").pathname, entry("tile.drc").pathname];
  writeFileSync(read, program);
  writeFileSync(drc, Buffer.from(await tile.arrayBuffer()));
  const { stdout } = await promisify(execFile)(process.execPath, [read, drc]);
  const [vertices, lon, lat, height] = stdout.match(/^(\d+) vertices; the first: (\S+) (\S+) (\S+)$/m).slice(1).map(Number);
  const [, , , , low, high] = manifest.bounds, column = (lon + 180) / degrees, row = (lat + 90) / degrees;
  assert.ok(vertices > 3 && column >= x && column <= x + 1 && row >= y && row <= y + 1 && height >= low && height <= high, stdout);
  return stdout.trim();
}
