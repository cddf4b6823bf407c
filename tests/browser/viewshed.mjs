// What is seen from a place: the button, the picture and the link of it, its heights against the service's, its cells against lines of
// sight and GDAL's.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { open_page, tiles_loaded } from "./browser.mjs";
import { kTiny } from "./controls.mjs";
import { lines_of_sight } from "./lines_of_sight.mjs";
import { focused, hear, heard } from "./unseen.mjs";
import { look_straight_down, mean_colour } from "./views.mjs";

const kLeastAgreement = 0.97;
// Of cells that one or the other sees. Most cells are hidden to both, and would agree whatever was seen.
const kLeastCommon = 0.8;
// GDAL derives each ring of cells from the one inside. From a person's height, over ground of large triangles, it sees half of what lines of
// sight do; from a tower the two agree.
const kPerson_m = 2, kTower_m = 30;
// Terrarium has steps of 1/256 m; the place of a pixel's middle is asked for with seven digits.
const kHeightTolerance_m = 0.1;
const kSeen = 1;
const kView = { share: 0.7, error_px: 2 };

// The page's own grid. Typed arrays do not come over as they are.
const found_of = (page) => page.evaluate(() => {
  const { window: grid, heights, cells, area } = window.cordillera.viewshed.found;
  return { ...grid, heights: [...heights], cells: [...cells], area, words: document.getElementById("viewshed-words").textContent };
});
const found = (page) => page.waitForFunction(() => window.cordillera.viewshed.found && !document.getElementById("viewshed").hidden);

// The same heights, with a cell's side in metres of the ground as the grid's step: Web Mercator's are longer.
function seen_by_gdal({ heights, side, cell_m }, eye_m) {
  const folder = mkdtempSync(join(tmpdir(), "viewshed-")), file = (name) => join(folder, name);
  const run = (program, ...given) => execFileSync(program, ["-q", ...given.map(String)], { env: { ...process.env, GDAL_PAM_ENABLED: "NO" } });
  try {
    const middle = (side / 2) * cell_m;
    writeFileSync(file("heights"), Float32Array.from(heights));
    writeFileSync(file("heights.hdr"), `ENVI\nsamples = ${side}\nlines = ${side}\nbands = 1\ndata type = 4\ninterleave = bsq\nbyte order = 0\n`);
    run("gdal_translate", "-a_srs", "EPSG:32619", "-a_ullr", 0, side * cell_m, side * cell_m, 0, file("heights"), file("heights.tif"));
    run("gdal_viewshed", "-ox", middle, "-oy", middle, "-oz", eye_m, "-cc", 0.87, "-md", side * cell_m, file("heights.tif"), file("seen.tif"));
    run("gdal_translate", "-of", "ENVI", file("seen.tif"), file("seen"));
    return readFileSync(file("seen"));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

function assert_alike({ side, cells }, other, whose) {
  const middle = (side - 1) / 2, percent = (part, whole) => `${((100 * part) / whole).toFixed(1)} %`;
  let alike = 0, both = 0, either = 0, all = 0;
  cells.forEach((cell, k) => {
    if (Math.hypot((k % side) - middle, Math.floor(k / side) - middle) > middle - 1) return;
    const [here, there] = [cell === kSeen, other[k] > 0];
    ++all;
    alike += here === there;
    both += here && there;
    either += here || there;
  });
  console.log(`    ${whose}: ${percent(alike, all)} of ${all} cells alike, ${percent(both, either)} of the ${either} that one of the two sees`);
  assert.ok(either > 0.01 * all, "nothing is seen");
  assert.ok(alike >= kLeastAgreement * all && both >= kLeastCommon * either, `what is seen is not as ${whose} has it`);
}

// The grid's heights are the service's, at the places where the page takes them to be.
async function assert_heights(page, url, id, { heights, side, zoom, west, north }) {
  const around = 256 * 2 ** zoom, picks = [0.1, 0.37, 0.5, 0.63, 0.9].map((share) => Math.floor(share * side));
  const places = picks.map((k) => {
    const longitude = ((west + k + 0.5) / around) * 360 - 180;
    const latitude = (Math.atan(Math.sinh(Math.PI * (1 - (2 * (north + k + 0.5)) / around))) * 180) / Math.PI;
    return `${longitude.toFixed(7)},${latitude.toFixed(7)}`;
  });
  const { points } = await (await page.request.get(`${url}/v1/datasets/${id}/elevation?points=${places.join(";")}`)).json();
  points.forEach(({ orthometric_height: wanted }, n) => {
    const height = heights[picks[n] * side + picks[n]];
    assert.ok(Math.abs(height - wanted) <= kHeightTolerance_m, `at ${places[n]} the grid has ${height} m, the service ${wanted} m`);
  });
}

const layers = (page) => page.evaluate(() => {
  const { tileset, looks } = window.cordillera;
  return [tileset.imageryLayers.length, looks.overlay.length > 0 ? tileset.imageryLayers.indexOf(looks.overlay[0]) : null];
});

// A window over the antimeridian is two pictures: the map's last columns and its first.
async function assert_parts(page) {
  const parts_of = (given) => page.evaluate(async (window) => (await import("./viewshed_picture.js")).parts_of(window), given);
  const last = 256 * 2 ** 8 - 1;
  assert.deepEqual(await parts_of({ zoom: 8, west: 100, side: 7 }), [{ first: 0, count: 7, column: 100 }]);
  for (const west of [-3, last - 2]) assert.deepEqual(await parts_of({ zoom: 8, west, side: 7 }), [{ first: 0, count: 3, column: last - 2 }, { first: 3, count: 4, column: 0 }]);
}

// How much of the picture's colour is on the screen.
async function violet(page) {
  await tiles_loaded(page);
  const [red, green, blue] = await mean_colour(page);
  return (red + blue) / 2 - green;
}

// CesiumJS takes several frames to lay a picture on the terrain, and shows none of it meanwhile: they are drawn, though nothing moves.
const kFrames = 10;
const drawn_by_itself = (page) => page.evaluate((wanted) => new Promise((done) => {
  const { scene, looks } = window.cordillera;
  let frames = 0;
  const stop = scene.postRender.addEventListener(() => { if (++frames === wanted) { stop(); done(); } });
  looks.lay_over(looks.laid);
}), kFrames);

export async function try_viewshed(browser, page, url, id) {
  const { width, height } = page.viewportSize();
  await page.click("#fold");
  await page.selectOption("#look", "relief", { force: true });
  await tiles_loaded(page);
  await look_straight_down(page, kView);
  await page.selectOption("#viewshed-radius", "5", { force: true });
  const bare = await violet(page);
  await page.click("#look-around");
  assert.equal(await page.getAttribute("#look-around", "aria-pressed"), "true");
  await page.mouse.click(width * 0.55, height * 0.45);
  await found(page);
  await drawn_by_itself(page);
  const grid = await found_of(page);
  const once = await violet(page);
  assert.ok(once > bare + 0.5, `what is seen has no colour: ${bare}, ${once}`);
  assert_alike(grid, lines_of_sight(grid, kPerson_m), "lines of sight");
  await assert_parts(page);
  await assert_heights(page, url, id, grid);
  assert.match(grid.words, /^[\d.,]+ km² are seen within 5 km$/);
  assert.ok(Math.abs(parseFloat(grid.words) * 1e6 - grid.area) <= 0.01 * grid.area, `${grid.words}: not ${grid.area} m²`);
  assert.match(await page.textContent("#viewshed-error"), /cells of \d+ m, heights ± [\d.]+ m$/);

  const before = grid.area;
  await page.fill("#viewshed-eye", String(kTower_m));
  await page.press("#viewshed-eye", "Enter");
  await page.waitForFunction((area) => window.cordillera.viewshed.found?.area > area, before);  // from a tower more is seen
  assert.ok((await violet(page)) > once, "the picture is still that of a person");
  const from_tower = await found_of(page), { words } = from_tower;
  assert_alike(from_tower, lines_of_sight(from_tower, kTower_m), "lines of sight, from a tower");
  assert_alike(from_tower, seen_by_gdal(from_tower, kTower_m), "GDAL, from a tower");

  const link = await page.evaluate(() => window.location.href);
  for (const look of ["slope", "levels", "relief"]) {
    await page.selectOption("#look", look, { force: true });
    await tiles_loaded(page);
    const pictures = look === "levels" ? 1 : 2;
    assert.deepEqual(await layers(page), [pictures, pictures - 1], `the picture of what is seen is not above ${look}`);
  }
  const { page: other } = await open_page(browser, link, kTiny);
  await found(other);
  assert.equal((await found_of(other)).words, words, "the link leads to another viewshed");
  const another = await other.evaluate(() => [...document.getElementById("datasets").options].map(({ value }) => value).find((value) => value !== window.cordillera.id));
  await other.selectOption("#datasets", another, { force: true });
  await other.waitForFunction((wanted) => window.cordillera.id === wanted && document.getElementById("viewshed").hidden, another);
  await other.goBack();
  await found(other);
  assert.deepEqual([(await found_of(other)).words, new URL(other.url()).searchParams.get("dataset")], [words, id], "Back does not come back to what is seen");
  await other.close();

  await page.click("#viewshed-close");
  assert.deepEqual(await layers(page), [1, null], "the picture is still there");
  await look_straight_down(page, kView);  // another look has another error
  assert.ok(Math.abs((await violet(page)) - bare) < 0.1, "its colour is still there");
  assert.equal(await page.getAttribute("#look-around", "aria-pressed"), "false");
  assert.equal(await page.evaluate(() => new URL(window.location.href).searchParams.get("seen_from")), null);

  await hear(page);
  await page.focus("#look-around");  // without a mouse
  await page.keyboard.press("Enter");
  await page.focus("#globe");
  await page.keyboard.press("Enter");
  await found(page);
  await page.focus("#viewshed-close");
  await page.keyboard.press("Enter");
  assert.equal(await page.isVisible("#viewshed"), false);
  assert.equal(await focused(page), "look-around", "the focus went with it");
  await heard(page, "^[\\d.,]+ km² are seen within 5 km · cells of");
  await page.click("#fold");
}
