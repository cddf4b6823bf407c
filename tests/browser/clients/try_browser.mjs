// One client page in the browser: loaded, at the right height, without cracks; and not so with a flat raster in the same place.
import assert from "node:assert/strict";

import { come_to, look_down, picture_of, settle } from "./browser_page.mjs";
import { assert_heights, assert_no_relief } from "./checks.mjs";

const kLeastSpread = 20;  // of shades, of 255; a slope that fills the picture has 13
const kAll = 1.2;  // of the data's extent, with a rim

// From above, with so little error allowed that no other level than the finest will do.
async function heights_of(opened, { bounds, share }, known) {
  await look_down(opened, { bounds, share, error_px: 0.001, finest: true });
  return opened.page.evaluate((places) => globalThis.client.heights(places), known.map(({ lon, lat }) => ({ lon, lat })));
}

function places_in({ bounds: [west, south, east, north], share }, known) {
  const near = (degrees, from, to) => Math.abs(degrees - (from + to) / 2) <= (share * (to - from)) / 2;
  return known.filter(({ lon, lat }) => near(lon, west, east) && near(lat, south, north));
}

// From above, inside of the data: coarse, and the finest that there is.
async function look_at_cracks(opened, client, bounds, picture) {
  for (const error_px of [24, 0.001]) {
    await look_down(opened, { bounds, share: 0.6, error_px });
    const { magenta } = await picture_of(opened, picture);
    assert.ok(magenta <= client.cracks, `background shows through at ${error_px} px: ${magenta} of the picture`);
  }
  await opened.page.evaluate(() => globalThis.client.hide());
  const bare = async () => (await picture_of(opened)).magenta > 0.9;
  await come_to(opened, bare, "the background is not seen where there is no terrain (control)");
}

// Of a picture that shows nothing but data.
async function shades_inside(opened, bounds) {
  await look_down(opened, { bounds, share: 0.3 });
  return (await picture_of(opened)).deviation;
}

// A raster of one height in the same place: what the test looks at must not be seen there.
async function try_flat(client, { open, view, bounds, known, allowed_m }) {
  const flat = await open("flat");
  await settle(flat);
  if (client.relief) assert.ok((await shades_inside(flat, bounds)) < client.relief, "a flat raster has relief (control)");
  assert_no_relief(await heights_of(flat, view, known), known, client.heights, allowed_m);
  assert.deepEqual(flat.complaints, [], "the browser complained");
  await flat.page.close();
}

// What somebody sees who only opens the page: terrain of other datasets.
async function try_elsewhere(client, dataset, { open, pictures }) {
  const opened = await open(dataset);
  await settle(opened);
  const { deviation } = await picture_of(opened, `${pictures}/${client.name}-${dataset}.png`);
  assert.ok(deviation > kLeastSpread, `there is no terrain of ${dataset}: shades deviate by ${deviation.toFixed(1)} of 255`);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();
}

// Given: how to open a dataset's page, where pictures go, the known places, the dataset's bounds, the error that is allowed; control: whether
// the flat raster is tried too.
export async function try_browser_client(client, { open, pictures, known: all, bounds, allowed_m, control }) {
  const view = { bounds, share: client.share ?? kAll };
  const known = places_in(view, all).filter((_, i) => i % (client.every ?? 1) === 0);
  const opened = await open("terrain");
  const shown = await settle(opened);
  const { deviation } = await picture_of(opened, `${pictures}/${client.name}.png`);
  assert.match(await opened.page.textContent("body"), /Surveyors/, "the page does not say whose the data is");
  if (client.relief) assert.ok((await shades_inside(opened, bounds)) >= client.relief, "there is no relief");
  assert.ok(known.length >= 5, "too few known places");
  const worst_m = assert_heights(await heights_of(opened, view, known), known, client.heights, allowed_m);
  if (client.cracks !== undefined) await look_at_cracks(opened, client, bounds, `${pictures}/${client.name}-above.png`);
  const is_tile = ({ pathname, search }) => client.tiles.test(pathname) && search.includes(client.query ?? "");
  const fetched = opened.answered.filter((url) => is_tile(new URL(url))).length;
  assert.ok(!client.also || opened.answered.some((url) => client.also.test(new URL(url).pathname)), `nothing of ${client.also} was fetched`);
  assert.ok(shown > 0 && fetched > 0, `${shown} tiles shown, ${fetched} fetched`);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();

  for (const dataset of client.seen ?? []) await try_elsewhere(client, dataset, { open, pictures });
  if (control) await try_flat(client, { open, view, bounds, known, allowed_m });
  return `${shown} tiles shown, ${fetched} answers with tiles, ` +
    `${known.length} heights within ${worst_m.toFixed(2)} of ${allowed_m.toFixed(2)} m, shades deviate by ${deviation.toFixed(1)} of 255`;
}
