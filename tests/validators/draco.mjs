// Every .drc, and the Draco part of every .glb, decoded by Draco's own build for JavaScript.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import draco3d from "draco3d";

import { files_below } from "./files.mjs";

const kExtension = "KHR_draco_mesh_compression";

// {faces, points} or a failure with Draco's words; of a .drc also its positions, integers (lattice u, v and height), and its side.
function decode(draco, bytes, with_positions) {
  const decoder = new draco.Decoder(), mesh = new draco.Mesh();
  try {
    const status = decoder.DecodeArrayToMesh(new Int8Array(bytes), bytes.length, mesh);
    if (!status.ok()) throw new Error(status.error_msg());
    return {
      faces: mesh.num_faces(), points: mesh.num_points(),
      ...(with_positions && { positions: positions_of(draco, decoder, mesh), side: side_of(draco, decoder, mesh) }),
    };
  } finally {
    draco.destroy(mesh);
    draco.destroy(decoder);
  }
}

function positions_of(draco, decoder, mesh) {
  const values = new draco.DracoInt32Array();
  decoder.GetAttributeInt32ForAllPoints(mesh, decoder.GetAttributeByUniqueId(mesh, 0), values);
  const found = Array.from({ length: values.size() }, (_, i) => values.GetValue(i));
  draco.destroy(values);
  return found;
}

function side_of(draco, decoder, mesh) {
  return new draco.MetadataQuerier().GetIntEntry(decoder.GetMetadata(mesh), "side");
}

// The tiles of a level together have the triangles that the manifest says, and none leaves its side.
function check_tiles(draco, folder, { levels }) {
  const files = files_below(`${folder}/tiles`, ".drc"), triangles = {};
  for (const file of files) {
    const level = Number(file.slice(`${folder}/tiles/`.length).split("/")[0]);
    const { faces, positions, side } = decode(draco, readFileSync(file), true);
    assert.ok(positions.every((unit, i) => i % 3 === 2 || (unit >= 0 && unit <= side)), `${file} leaves its tile`);
    triangles[level] = (triangles[level] ?? 0) + faces;
  }
  for (const { level, triangles: wanted } of levels) assert.equal(triangles[level], wanted, `triangles of level ${level}`);
  return files;
}

// As many triangles and vertices as the accessors of its primitive say.
function check_glb(draco, file) {
  const bytes = readFileSync(file), length = bytes.readUInt32LE(12);
  const { meshes, accessors, bufferViews } = JSON.parse(bytes.toString("utf8", 20, 20 + length));
  const primitives = meshes.flatMap(({ primitives }) => primitives).filter(({ extensions }) => extensions?.[kExtension]);
  for (const { attributes, indices, extensions } of primitives) {
    const { byteOffset = 0, byteLength } = bufferViews[extensions[kExtension].bufferView], start = 20 + length + 8 + byteOffset;
    const { faces, points } = decode(draco, bytes.subarray(start, start + byteLength), false);
    assert.equal(3 * faces, accessors[indices].count, `indices of ${file}`);
    assert.equal(points, accessors[attributes.POSITION].count, `vertices of ${file}`);
  }
  return primitives.length;
}

export async function check_draco(folder) {
  const draco = await draco3d.createDecoderModule({});
  const files = check_tiles(draco, folder, JSON.parse(readFileSync(`${folder}/manifest.json`, "utf8")));
  const primitives = files_below(`${folder}/tiles`, ".glb").reduce((sum, file) => sum + check_glb(draco, file), 0);
  assert.ok(files.length > 20 && primitives >= files.length, `only ${files.length} tiles, ${primitives} primitives`);
  const bytes = readFileSync(files[0]);
  assert.throws(() => decode(draco, bytes.subarray(0, bytes.length / 2), false), "half of a tile is decoded (control)");
  return `${files.length} .drc, ${primitives} primitives of .glb`;
}
