// Two clients of a server: npm's pmtiles on …/ID.pmtiles, and a reader of catalogs that follows the links from /stac, each document held against
// what STAC 1.0.0 demands (schemas/). No package has the specification's own schemas: where CORDILLERA_STAC_SPEC names a clone of
// github.com/radiantearth/stac-spec at v1.0.0, documents are held against those, too.   node check.mjs --url URL --dataset ID --datasets COUNT
import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { parseArgs } from "node:util";
import Ajv from "ajv";
import Ajv2020 from "ajv/dist/2020.js";
import formats from "ajv-formats";
import { PMTiles } from "pmtiles";

const { values: given } = parseArgs({ options: Object.fromEntries(["url", "dataset", "datasets"].map((name) => [name, { type: "string" }])) });
const base = `${given.url}/v1/datasets/${given.dataset}`;

// An archive is made when it is first asked for. Where that takes long, the answer says when to ask again.
async function answer_of(address) {
  for (;;) {
    const response = await fetch(address);
    if (response.status !== 503 || !response.headers.has("retry-after")) return response;
    await response.arrayBuffer();
    await new Promise((then) => setTimeout(then, 1000 * response.headers.get("retry-after")));
  }
}

async function bytes_of(address) {
  const response = await answer_of(address);
  assert.equal(response.status, 200, address);
  return Buffer.from(await response.arrayBuffer());
}

// The client reads by ranges alone; what it finds are the bytes of the tiles' own addresses.
async function check_archive() {
  await bytes_of(`${base}.pmtiles`);
  const archive = new PMTiles(`${base}.pmtiles`);
  const { minZoom, maxZoom, numAddressedTiles } = await archive.getHeader();
  const { name, encoding, manifest } = await archive.getMetadata();
  assert.ok(name && encoding === "mapbox" && manifest.levels.length > 0, "metadata");
  const [west, south, east, north] = manifest.bounds, lat = (Math.PI * (south + north)) / 360;
  let tiles = 0;
  for (let z = minZoom; z <= maxZoom; ++z) {
    const x = Math.floor(((west + east) / 720 + 0.5) * 2 ** z), y = Math.floor((0.5 - Math.asinh(Math.tan(lat)) / (2 * Math.PI)) * 2 ** z);
    const { data } = await archive.getZxy(z, x, y);
    assert.deepEqual(Buffer.from(data), await bytes_of(`${base}/terrain-rgb/${z}/${x}/${y}.png`), `tile ${z}/${x}/${y}`);
    ++tiles;
  }
  assert.ok(tiles > 3 && numAddressedTiles >= tiles);
  assert.equal(await archive.getZxy(maxZoom, 0, 0), undefined, "a tile beside the data");
  return `${tiles} tiles of ${numAddressedTiles}`;
}

const ajv = new Ajv2020({ allErrors: true, strict: false });
formats(ajv);
ajv.addSchema(JSON.parse(readFileSync(new URL("schemas/stac.schema.json", import.meta.url), "utf8")));
const conforms = (kind, document) => ajv.validate(`stac#/$defs/${kind}`, document);

const kOfficial = { landing: "catalog-spec/json-schema/catalog.json", collection: "collection-spec/json-schema/collection.json", item: "item-spec/json-schema/item.json" };
function official_schemas(folder) {
  const all = new Ajv({ allErrors: true, strict: false }), require = createRequire(import.meta.url);
  formats(all);
  for (const name of ["iri", "iri-reference"]) all.addFormat(name, true);
  for (const name of ["Feature", "Geometry"]) all.addSchema({ ...require(`geojson-schema/${name}.json`), $id: `https://geojson.org/schema/${name}.json` });
  for (const part of ["catalog-spec", "collection-spec", "item-spec"]) {
    for (const file of readdirSync(`${folder}/${part}/json-schema`)) all.addSchema(require(`${folder}/${part}/json-schema/${file}`));
  }
  return all;
}
const official = process.env.CORDILLERA_STAC_SPEC ? official_schemas(process.env.CORDILLERA_STAC_SPEC) : null;
function expect_official(kind, document) {
  if (!official || !(kind in kOfficial)) return;
  const valid = official.validate(`https://schemas.stacspec.org/v1.0.0/${kOfficial[kind]}#`, document);
  assert.ok(valid, `${kind}: ${official.errorsText(official.errors)}`);
}

async function read(kind, address) {
  const response = await fetch(address);
  assert.equal(response.status, 200, address);
  const document = await response.json();
  assert.ok(conforms(kind, document), `${address}: ${ajv.errorsText(ajv.errors)}`);
  expect_official(kind, document);
  return document;
}
const linked = ({ links }, rel) => links.find((link) => link.rel === rel)?.href;

async function check_catalog() {
  const landing = await read("landing", `${given.url}/stac`);
  const { conformsTo } = await read("conformance", linked(landing, "conformance"));
  assert.deepEqual(conformsTo, landing.conformsTo);
  for (const rel of ["service-desc", "service-doc"]) await bytes_of(linked(landing, rel));
  const { collections: [collection] } = await read("collections", linked(landing, "data"));
  assert.deepEqual(await read("collection", linked(landing, "child")), collection);
  const found = [];
  for (let page = `${linked(collection, "items")}?limit=1`; page;) {
    const items = await read("items", page);
    assert.ok(items.features.length <= 1, "a page has more than its limit");
    found.push(...items.features);
    page = linked(items, "next");
  }
  assert.equal(found.length, Number(given.datasets), "items of all datasets, a page at a time");
  for (const item of found) {
    assert.deepEqual(await read("item", linked(item, "self")), item);
    for (const { href } of Object.values(item.assets)) await bytes_of(href);
  }
  const [item] = found;
  for (const broken of [{ ...item, bbox: [0, 0, 1] }, { ...item, properties: {} }, { ...item, geometry: null }, { ...item, links: [] }]) {
    assert.ok(!conforms("item", broken), "a broken item passes (control)");
  }
  if (official) assert.throws(() => expect_official("item", { ...item, properties: {} }), "the official schemas pass a broken item (control)");
  return `${found.length} items${official ? ", by the official schemas, too" : ""}`;
}

console.log(`ok  pmtiles: ${await check_archive()}`);
console.log(`ok  stac: ${await check_catalog()}`);
