// Looks at the viewer as a person would: does it load, is there relief, are there cracks, is it in the right place?
//   node look.mjs --chromium PATH --url URL --empty URL --terrain ID --flat ID --across ID --polar ID --failed ID,ID --known known.json
//     --folder ID --raster FILE --bad FILE --held ID --job PROCESS --lazy ID --lazy-url URL --fine FILE --pictures FOLDER
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { parseArgs } from "node:util";

import { kTerrainAlone, open_dataset, with_browser } from "./browser.mjs";
import { kSmall, try_bad_upload, try_draft, try_folder, try_imagery, try_keys, try_link, try_link_of_controls, try_looks, try_phone, try_pointer, try_profile, try_refusals, try_sample, try_snippets, try_upload } from "./controls.mjs";
import { try_cancel, try_delete, try_delete_of_last, try_delete_of_unfinished, try_mounted, try_rename } from "./change.mjs";
import { try_asleep, try_choice, try_deleted, try_deleted_version, try_interrupted, try_last_choice, try_lazy, try_new_version } from "./following.mjs";
import { try_live } from "./live.mjs";
import { try_credits, try_failed_uploads, try_folding, try_low_window, try_polar, try_uncovered, try_without_webgl } from "./panel.mjs";
import { try_relief, try_relief_of_folder } from "./relief.mjs";
import { try_antimeridian, try_frame, try_rims_of_demo, try_scale, try_turns } from "./framing.mjs";
import { try_contrast, try_docs, try_files_before_token, try_heights_by_keys, try_ring, try_token, try_zoomed } from "./unseen.mjs";
import { try_viewshed } from "./viewshed.mjs";
import { crack_share, heights_at, load_everything, luminance_deviation, look_straight_down, set_background } from "./views.mjs";

// Shades of a hillshade spread; a flat raster has one shade. Of 255; the sample has 12, the flat raster 0.
const kLeastRelief = 6;
// Geoid interpolation, float32 positions, and steps of 2^-10 m.
const kHeightTolerance_m = 0.2;

const names = ["chromium", "url", "empty", "terrain", "flat", "across", "polar", "failed", "known", "folder", "raster", "bad", "held", "job", "lazy", "lazy-url", "fine", "pictures"];
const { values: given } = parseArgs({ options: Object.fromEntries(names.map((name) => [name, { type: "string" }])) });

// What others of these prove in part is left to tests/run.sh --all: drawing in software takes most of the time of all tests.
const all = process.env.CORDILLERA_ALL_TESTS === "1";
let last = Date.now();
const check_if = async (wanted, what, body) => {
  if (wanted) await check(what, body);
};
const check = async (what, body) => {
  await body();
  console.log(`ok  ${what}; ${((Date.now() - last) / 1000).toFixed(1)} s`);
  last = Date.now();
};

function assert_relief(deviation) {
  assert.ok(deviation >= kLeastRelief, `shades deviate by ${deviation.toFixed(2)} of 255, less than ${kLeastRelief}`);
}

// Every height within what the manifest states for the finest level: its promise holds at every vertex of the finest lattice.
function assert_heights(found, known, manifest) {
  const allowed_m = manifest.levels[0].stated_max_error + kHeightTolerance_m;
  known.forEach(({ lon, lat, height }, i) => {
    assert.ok(found[i] !== null, `no terrain at ${lon}, ${lat}`);
    const off_m = Math.abs(found[i] - height);
    assert.ok(off_m <= allowed_m, `${off_m.toFixed(2)} m off at ${lon}, ${lat}, more than ${allowed_m.toFixed(2)} m`);
  });
  return allowed_m;
}

async function look_at_terrain(browser) {
  const { page, complaints } = await open_dataset(browser, given.url, given.terrain);
  const manifest = await page.evaluate(() => window.cordillera.manifest);
  await page.screenshot({ path: `${given.pictures}/terrain.png` });

  await check("cracks: none from above, at three distances and two refinements", async () => {
    await set_background(page, "#ff00ff");
    for (const share of [0.9, 0.4, 0.1]) {
      for (const error_px of [2, 24]) {
        await look_straight_down(page, { share, error_px });
        assert.equal(await crack_share(page), 0, `background shows through at ${share} of the data's extent, ${error_px} px`);
      }
    }
  });
  await check("cracks: the background is seen where there is no terrain (control)", async () => {
    await page.evaluate(() => { window.cordillera.tileset.show = false; });
    assert.equal(await crack_share(page), 1);
    await page.evaluate(() => { window.cordillera.tileset.show = true; });
  });
  await check("relief: shades spread", async () => {
    await look_straight_down(page, { share: 0.7, error_px: 0.5 });
    await page.screenshot({ path: `${given.pictures}/relief.png` });
    const deviation = await luminance_deviation(page);
    assert_relief(deviation);
    console.log(`    ${deviation.toFixed(1)} of 255`);
  });

  const known = JSON.parse(readFileSync(given.known, "utf8"));
  await load_everything(page);
  await check(`place: heights at ${known.length} vertices of the finest lattice`, async () => {
    const allowed_m = assert_heights(await heights_at(page, known), known, manifest);
    console.log(`    within ${allowed_m.toFixed(2)} m`);
  });
  await check("place: heights 300 m to the north do not fit (control)", async () => {
    const shifted = known.map((place) => ({ ...place, lat: place.lat + 0.0027 }));
    const found = await heights_at(page, shifted);
    assert.throws(() => assert_heights(found, known, manifest), /m off at/);
  });
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

async function look_at_flat(browser) {
  const { page, complaints } = await open_dataset(browser, given.url, given.flat, kTerrainAlone);
  await check("relief: a flat raster has none (control)", async () => {
    await set_background(page, "#ff00ff");
    await look_straight_down(page, { share: 0.7, error_px: 0.5 });
    await page.screenshot({ path: `${given.pictures}/flat.png` });
    assert.equal(await crack_share(page), 0);
    const deviation = await luminance_deviation(page);
    assert.throws(() => assert_relief(deviation), /shades deviate/);
    console.log(`    ${deviation.toFixed(1)} of 255`);
  });
  await check("scale: is of the ground that is seen", () => try_scale(page));
  await check("antimeridian: pictures lie on both sides; a look takes the place of another without a flash; Back goes back", () => try_antimeridian(page, given.flat, given.across));
  assert.deepEqual(complaints, [], "the browser complained");

  const failed = given.failed.split(",");
  await page.evaluate(() => { document.getElementById("panel").hidden = false; });
  await page.click("#fold");  // on a small window the controls are folded away at first
  await check("panel: failed uploads stand apart, with their reason, and can be deleted", () => try_failed_uploads(page, given.url, failed));
  await page.screenshot({ path: `${given.pictures}/failed.png` });
  await check("version: another one takes the place of the one that is shown", () => try_new_version(page, given.url, given.flat, "flat_ground_at_500_metres_in_the_alps_again"));
  await check("panel: folds, and is small on a small window", () => try_folding(page));
  await check("panel: nothing covers the tools", () => try_uncovered(page));
  await check_if(all, "panel: a window of 750 px holds all of it", () => try_low_window(page));
  await page.close();
}

async function use_controls(browser) {
  const { page, complaints } = await open_dataset(browser, given.url, given.terrain, kSmall);
  await page.click("#fold");
  await check("controls: looks are different pictures", () => try_looks(page));
  await check("controls: height and stated error under the pointer, however exaggerated", () => try_pointer(page));
  await check_if(all, "controls: two clicks give a profile, with its error", () => try_profile(page));
  await check("controls: one click says what is seen, as lines of sight and GDAL have it", () => try_viewshed(browser, page, given.url, given.terrain));
  await check("controls: a link leads to the same view", () => try_link(browser, page));
  await check_if(all, "controls: a link has the look, its colours and the sliders", () => try_link_of_controls(browser, page));
  await check("controls: keys move the camera", () => try_keys(page));
  await check("keys: heights in the middle and along a profile, and both are read out", () => try_heights_by_keys(page));
  await check("keys: the terrain has a ring that is seen", () => try_ring(page));
  await check("panel: contrast of text, fields and rings, in dark and light", () => try_contrast(page));
  await check("panel: enlarged to 400 %, all of it can be come to", () => try_zoomed(page));
  await check("controls: Home has all of the data in the window, and the camera stays above the ground", () => try_frame(page));
  await check("controls: turns, tilts and another middle by single clicks", () => try_turns(page));
  await check("controls: snippets have this dataset's address", () => try_snippets(page, given.url, given.terrain));
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
  await check_if(all, "controls: a phone, in light colours", () => try_phone(browser, given.url, given.terrain, `${given.pictures}/phone.png`));
  await check("welcome: an empty service opens the sample", () => try_sample(browser, given.empty));
  await check("polar: has no pictures, and none is asked for", () => try_polar(browser, given.url, given.polar));
  await check("without WebGL: the list and all else that is no picture", () => try_without_webgl(browser, given.url, { terrain: given.terrain, other: given.flat }));
  await check("credits: an attribution is text, whatever it has of HTML", () => try_credits(browser, given.url, given.flat));
  await check("pictures: reach the rims of tiles on the page for CesiumJS", () => try_rims_of_demo(browser, given.url, given.terrain));
  await check_if(all, "imagery: pictures that a dataset names are its first look", () => try_imagery(browser, given.url, given.flat, given.terrain));
  await check("delete: of the only dataset leaves the empty service", () => try_delete_of_last(browser, given.empty));
  await check("rename, delete: a dialog says what becomes of the dataset that is shown, by keys alone", async () => {
    const changing = await try_rename(browser, given.url, given.raster);
    await try_delete(changing, given.url);
  });
  await check("rename, delete: are not there for a folder", () => try_mounted(browser, given.url, given.folder));
  let uploading;
  await check("upload: a GeoTIFF given to the page is shown", async () => { uploading = await try_upload(browser, given.url, given.raster); });
  await check_if(all, "upload: options, with an estimate first, and two rasters as one dataset", () => try_draft(uploading, given.url, given.raster));
  await check("upload: what is no raster is answered with what would be", () => try_bad_upload(uploading, given.bad));
  await check("upload: a folder cannot be read, and that is said", () => try_folder(uploading));
  await check("docs: a narrow window has all of it", () => try_docs(browser, given.url));
  await check("token: files that wait for it stay", () => try_token(browser, given.url));
  await check("token: files that are refused without one wait for it", () => try_files_before_token(browser, given.url));
  await check("token, imagery: what is wanted is said to people", () => try_refusals(uploading, given.url));
  await check("upload: a build that was begun on the page is cancelled there", () => try_cancel(uploading, given.url, given.fine));
}

await with_browser(given.chromium, async (browser) => {
  let still_chosen;
  await check("choice: what somebody chose stays, and its build is listened to", async () => { still_chosen = await try_choice(browser, given.url, { held: given.held, terrain: given.terrain }); });
  await check("live: final tiles take the place of provisional ones without a flash", () => try_live(browser, given.url, given.held, Number(given.job)));
  await check("choice: it stays when the build of another one is done", () => still_chosen());
  await check("choice: the last dataset and the last look are seen, however late they come", () => try_last_choice(browser, given.url, { terrain: given.terrain, other: given.flat }));
  await check("lazy: says how much is made, and sharpens where somebody looks", () => try_lazy(browser, given["lazy-url"], given.lazy));
  await check("lazy: is listened to again after a proxy has answered for the service", () => try_interrupted(browser, given["lazy-url"], given.lazy));
  await check("delete: of what is being built is told as such", () => try_delete_of_unfinished(browser, given["lazy-url"], given.lazy));
  await check("asleep: is woken by whoever opens it", () => try_asleep(browser, given.url, given.terrain));
  await check("deleted, or not answered for: is said of the dataset that is shown", () => try_deleted(browser, given.url, given.raster));
  await check("deleted: while another version is on its way", () => try_deleted_version(browser, given.url, given.raster));
  await check("relief: shaded from normal maps, as the service's picture is", () => try_relief(browser, given.url, given.terrain));
  await check_if(all, "relief: a folder of finished tiles has the picture", () => try_relief_of_folder(browser, given.url, given.folder));
  await look_at_terrain(browser);
  await look_at_flat(browser);
  await use_controls(browser);
});
