// node meshoptimizer_wasm.mjs IN.ply OUT.ply TRIANGLES MODULE: meshoptimizer's WebAssembly build, from the folder of its npm package. Reads and
// writes the binary PLY that terrain_mesh and `cordillera simplify` write: doubles, or floats; uchar and int.
import { readFileSync, writeFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const [input, output, target, module] = process.argv.slice(2);
const { MeshoptSimplifier } = await import(pathToFileURL(resolve(module, 'index.js')));
await MeshoptSimplifier.ready;

const bytes = readFileSync(input);
const body = bytes.indexOf('end_header\n') + 11;
const header = bytes.toString('latin1', 0, body);
if (!header.includes('binary_little_endian')) throw new Error(`${input}: only binary little endian here`);
const vertices = Number(/element vertex (\d+)/.exec(header)[1]);
const faces = Number(/element face (\d+)/.exec(header)[1]);
const size = header.includes('double x') ? 8 : 4;
const view = new DataView(bytes.buffer, bytes.byteOffset + body);

const positions = new Float32Array(3 * vertices);
for (let k = 0; k < positions.length; ++k) positions[k] = size === 8 ? view.getFloat64(8 * k, true) : view.getFloat32(4 * k, true);
const indices = new Uint32Array(3 * faces);
for (let f = 0; f < faces; ++f) {
  for (let k = 0; k < 3; ++k) indices[3 * f + k] = view.getInt32(3 * size * vertices + 13 * f + 1 + 4 * k, true);
}

const start = process.hrtime.bigint();
const [left] = MeshoptSimplifier.simplify(indices, positions, 3, 3 * Number(target), 1e10);
const seconds = Number(process.hrtime.bigint() - start) / 1e9;

const place = new Map();
for (const vertex of left) if (!place.has(vertex)) place.set(vertex, place.size);
const text = `ply\nformat binary_little_endian 1.0\nelement vertex ${place.size}\nproperty float x\nproperty float y\nproperty float z\n` +
    `element face ${left.length / 3}\nproperty list uchar int vertex_indices\nend_header\n`;
const out = Buffer.alloc(text.length + 12 * place.size + 13 * (left.length / 3));
let at = out.write(text, 'latin1');
for (const vertex of place.keys()) for (let k = 0; k < 3; ++k) at = out.writeFloatLE(positions[3 * vertex + k], at);
for (let k = 0; k < left.length; ++k) {
  if (k % 3 === 0) at = out.writeUInt8(3, at);
  at = out.writeInt32LE(place.get(left[k]), at);
}
writeFileSync(output, out);
console.log(JSON.stringify({ simplify_seconds: seconds, simplify_cpu_seconds: seconds }));
