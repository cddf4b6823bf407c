// Documents against the schemas beside this file, and what a schema cannot say.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import Ajv2020 from "ajv/dist/2020.js";

const read = (path) => JSON.parse(readFileSync(path, "utf8"));
const ajv = new Ajv2020({ allErrors: true, strictTuples: false });
const schema = (name) => ajv.compile(read(new URL(`./schemas/${name}.schema.json`, import.meta.url)));
const is_layer = schema("layer"), is_tilejson = schema("tilejson");
const kPictures = ["terrain-rgb", "terrarium", "hillshade"];

function accept(validate, document, where) {
  assert.ok(validate(document), `${where}: ${ajv.errorsText(validate.errors)}`);
}

// Each level's rectangles are of tiles that there are: two at level 0, one on Web Mercator's map, and none beyond maxzoom.
function check_availability({ available, maxzoom, projection }) {
  const roots = projection === "EPSG:3857" ? 1 : 2;
  assert.equal(available.length, maxzoom + 1, "available does not end with maxzoom");
  available.forEach((rectangles, z) => rectangles.forEach(({ startX, startY, endX, endY }) => {
    assert.ok(startX <= endX && endX < roots * 2 ** z && startY <= endY && endY < 2 ** z, `no such tiles at level ${z}`);
  }));
  assert.deepEqual(available[0], [{ startX: 0, startY: 0, endX: roots - 1, endY: 0 }], "all roots");
}

function check_ranges({ minzoom, maxzoom, center: [lon, lat, zoom], bounds: [west, south, east, north] }) {
  assert.ok(lon >= west && lon <= east && lat >= south && lat <= north && zoom >= minzoom && zoom <= maxzoom && minzoom <= maxzoom);
}

async function fetched(address) {
  const response = await fetch(address);
  assert.equal(response.status, 200, address);
  return response.json();
}

export async function check_schemas(folder, dataset) {
  const layers = [read(`${folder}/layer.json`), await fetched(`${dataset}/layer.json`), await fetched(`${dataset}/web-mercator/layer.json`)];
  for (const layer of layers) {
    accept(is_layer, layer, "layer.json");
    check_availability(layer);
  }
  assert.ok(!is_layer({ ...layers[0], scheme: "xyz" }), "rows from the north pass (control)");
  assert.throws(() => check_availability({ ...layers[0], maxzoom: 3 }), "a level too many passes (control)");
  const pictures = kPictures.map((name) => read(`${folder}/${name}.json`));
  const served = [...kPictures, "terrain-rgb-webp", "terrarium-webp", "web-mercator", "contours"].map((name) => `${dataset}/${name}.json`);
  for (const address of served) {
    const document = await fetched(address);
    // Absolute, as the specification wants it; a static folder cannot know where it lies.
    assert.ok(document.tiles.every((tile) => tile.startsWith(`${dataset}/`)), `${address} has relative addresses`);
    pictures.push(document);
  }
  for (const document of pictures) {
    accept(is_tilejson, document, document.tiles[0]);
    check_ranges(document);
  }
  assert.ok(!is_tilejson({ ...pictures[0], tiles: [] }), "a document without tiles passes (control)");
  return `${layers.length} layer.json, ${pictures.length} TileJSON`;
}
