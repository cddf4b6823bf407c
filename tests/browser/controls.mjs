// The page's controls: an upload from the page itself, looks, heights under the pointer, links, keys, a phone.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { dirname } from "node:path";
import { fileURLToPath } from "node:url";

import { kTerrainAlone, open_dataset, open_page, some_frames, tiles_loaded, was_said } from "./browser.mjs";
import { focused, hear, heard } from "./unseen.mjs";
import { look_straight_down, mean_colour } from "./views.mjs";

const camera_of = (page) => page.evaluate(() => {
  const { longitude, latitude, height } = window.cordillera.scene.camera.positionCartographic;
  return { longitude, latitude, height };
});

// Drawing in software takes as long as there are pixels.
export const kSmall = { viewport: { width: 480, height: 320 }, ...kTerrainAlone };
export const kTiny = { viewport: { width: 240, height: 180 }, ...kTerrainAlone };

const apart = (a, b) => Math.hypot(...a.map((value, k) => value - b[k]));

// From a file to the terrain, all of it by the page, which shows another dataset before. Gives the page.
export async function try_upload(browser, url, raster) {
  const { page, complaints } = await open_page(browser, url, kTiny);
  const shown = await (await page.waitForFunction(() => window.cordillera?.id)).jsonValue();
  await page.evaluate(() => document.getElementById("link").click());
  assert.equal(new URL(await page.evaluate(() => window.location.href)).searchParams.get("dataset"), shown, "a link to the page's view does not name the dataset");
  const before = await page.$$eval("#datasets option", (options) => options.map(({ value }) => value));
  await page.route("**/v1/datasets?limit=500", (route) => route.continue({ url: route.request().url().replace("500", "1") }));  // a list of many pages
  await hear(page);
  const stray = { name: "readme.pdf", mimeType: "application/pdf", buffer: Buffer.from("no raster") };
  await page.setInputFiles("#file", [{ name: "part.tif", mimeType: "image/tiff", buffer: readFileSync(raster) }, stray]);
  await page.waitForFunction((count) => document.querySelectorAll("#datasets option").length === count + 1, before.length);
  const id = await page.evaluate(() => document.getElementById("datasets").value);
  assert.ok(!before.includes(id), "the new dataset is not the one that is shown");
  await page.waitForFunction((wanted) => new URL(window.location.href).searchParams.get("dataset") === wanted, id);
  for (const words of ["^sending part.tif, ", "^part.tif is ready"]) await heard(page, words);
  await tiles_loaded(page);
  assert.equal(await page.isHidden("#going"), true, "the progress is still there");
  assert.equal(await page.textContent("#left-out"), "Left out: readme.pdf is no raster.", "what was left out is not said any more");
  assert.match(await page.textContent("#drawn"), /[1-9][\d,]* triangles on screen · [\d.]+ MB/);
  assert.deepEqual(complaints, [], "the browser complained");
  return page;
}

// Two rasters wait in the open drawer of options: what a build would make of them is said, again when an option changes, and is built then.
export async function try_draft(page, url, raster) {
  const buffer = readFileSync(raster), count = () => page.$$eval("#datasets option", ({ length }) => length), before = await count();
  const said = (words) => page.waitForFunction((wanted) => new RegExp(wanted).test(document.getElementById("estimate").textContent), words);
  await page.setViewportSize(kSmall.viewport);  // a smaller one has no room for the panel's buttons
  await page.click("#fold");
  await page.click("#upload > summary");
  await page.click("#options > summary");
  await page.click("#upload > summary");
  const empty = Buffer.alloc(0);
  await page.setInputFiles("#file", [["north.tif", buffer], ["empty.tif", empty], ["south.tif", buffer]].map(([name, content]) => ({ name, mimeType: "image/tiff", buffer: content })));
  assert.equal(await page.textContent("#left-out"), "Left out: empty.tif is empty.");
  await page.waitForFunction(() => {
    const { top, bottom } = document.getElementById("build").getBoundingClientRect(), panel = document.getElementById("panel").getBoundingClientRect();
    return bottom > top && top >= panel.top && bottom <= panel.bottom;
  });
  await said("^(Of north.tif alone: )?levels 0 to \\d+, at most [\\d.]+ m off · about [\\d,]+ tiles .* [kM]B, \\d+ seconds?");
  assert.equal(await count(), before, "it is built before somebody says so");
  assert.equal(await page.textContent("#draft-files"), "north.tif, south.tif");
  assert.match(await page.getAttribute("#option-error", "placeholder"), /^[\d.]+$/);
  await page.fill("#option-error", "77");
  await page.press("#option-error", "Enter");
  await said("at most 77 m off");
  await page.fill("#option-nodata", "none");
  await page.press("#option-nodata", "Enter");
  await said("nodata='none'.* On this page: “No data”, under ");
  await page.fill("#option-nodata", "");
  await page.press("#option-nodata", "Enter");
  await said("at most 77 m off");
  await page.click("#build");
  assert.equal(await page.isVisible("#draft"), false, "what is posted is still to be built");
  await page.waitForFunction((wanted) => document.querySelectorAll("#datasets option").length === wanted, before + 1);
  const id = await page.evaluate(() => document.getElementById("datasets").value);
  const manifest = await (await page.request.get(`${url}/v1/datasets/${id}/manifest.json`)).json();
  assert.equal(manifest.options.error, 77);
  assert.equal(manifest.sources.length, 2);
  await tiles_loaded(page);
  assert.match(await page.textContent("#facts"), /^2 rasters · /);
  assert.equal(await page.inputValue("#option-error"), "", "an option of one dataset is there for the next one");
  await page.fill("#option-error", "55");
  await page.click("#options > summary");
  await page.setInputFiles("#file", [{ name: "north.tif", mimeType: "image/tiff", buffer }]);
  await said("at most 55 m off");  // what nobody sees is not applied
  assert.equal(await page.textContent("#left-out"), "", "what other files lacked is still said");
  await page.click("#drop-draft");
  await page.fill("#option-error", "");
  await page.click("#options > summary");
  await page.setViewportSize(kTiny.viewport);
}

// A dataset that names pictures is seen with them, in a link without a look; one that names none has its relief again.
export async function try_imagery(browser, url, id, other) {
  const imagery = `${url}/v1/datasets/${id}/slope/{z}/{x}/{y}.png`;
  assert.equal((await fetch(`${url}/v1/datasets/${id}?imagery=${encodeURIComponent(imagery)}`, { method: "PATCH" })).status, 200);
  const { page, complaints, asked } = await open_page(browser, `${url}/?dataset=${id}`, kTiny);
  await tiles_loaded(page);
  assert.equal(await page.evaluate(() => document.getElementById("look").value), "imagery");
  assert.ok(asked.some((one) => one.includes("/slope/")) && !asked.some((one) => one.includes("/relief/")), "the pictures that it names are not shown");
  assert.equal(await page.evaluate(() => new URL(window.location.href).searchParams.get("look")), null, "what a dataset has at first is in the link");
  await page.selectOption("#datasets", other, { force: true });  // the panel is folded
  await page.waitForFunction((wanted) => window.cordillera.manifest.id === wanted, other);
  await tiles_loaded(page);
  assert.equal(await page.evaluate(() => document.getElementById("look").value), "relief");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// One that does not say where it lies: the service asks for a word of its query, and the page says which of its fields that is.
async function try_lost_raster(page) {
  const rows = "1 2 3 4\n".repeat(4), text = `ncols 4\nnrows 4\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n${rows}`;
  await page.setInputFiles("#file", { name: "lost.asc", mimeType: "text/plain", buffer: Buffer.from(text) });
  const field = /Accepted: .*crs=.*On this page: “CRS”, under “Options, with an estimate first”$/;
  await page.waitForFunction((wanted) => new RegExp(wanted).test(document.getElementById("message").textContent), field.source);
  await page.waitForFunction((wanted) => [...document.querySelectorAll("#failed-list p")].some(({ textContent }) => new RegExp(wanted).test(textContent)), field.source);
}

// A raster that is none: the reason, in the page.
export async function try_bad_upload(page, file) {
  await page.setInputFiles("#file", file);
  await page.waitForFunction(() => document.getElementById("message").className === "problem");
  const words = await page.textContent("#message");
  assert.match(words, /Accepted: .*GeoTIFF/, `what would be accepted is not said: ${words}`);
  await try_lost_raster(page);
  await page.setViewportSize({ width: 390, height: 740 });  // a phone, where legend and scale stand above the words
  if (await page.isVisible("#body")) await page.click("#fold");
  await page.waitForFunction(() => {
    const { top } = document.getElementById("panel").getBoundingClientRect();
    const parts = ["legend", "scale"].map((id) => document.getElementById(id).getBoundingClientRect()).filter(({ height }) => height > 0);
    return parts.length > 0 && parts.every(({ bottom }) => bottom <= top);
  });
}

// A folder that is dropped is a file that no browser can read.
export async function try_folder(page) {
  const session = await page.context().newCDPSession(page), data = { items: [], files: [dirname(fileURLToPath(import.meta.url))], dragOperationsMask: 1 };
  const drop = async () => { for (const type of ["dragEnter", "dragOver", "drop"]) await session.send("Input.dispatchDragEvent", { type, x: 100, y: 80, data }); };
  await drop();
  await page.waitForFunction(() => /cannot be read: it is a folder/.test(document.getElementById("message").textContent));
  await page.evaluate(() => { document.getElementById("options").open = true; });
  await drop();
  await page.waitForFunction(() => /cannot be read: it is a folder/.test(document.getElementById("estimate").textContent));
  await page.evaluate(() => { document.getElementById("drop-draft").click(); document.getElementById("options").open = false; });
}

// What the service and other hosts refuse: words for people, and the field that helps.
export async function try_refusals(page, url) {
  const said = (words) => page.waitForFunction((wanted) => new RegExp(wanted).test(document.getElementById("message").textContent), words);
  await page.route(/v1.datasets.name=/, (route) => route.fulfill({ status: 401, json: { detail: "Authorization: Bearer TOKEN is missing" } }), { times: 1 });
  await page.setInputFiles("#file", { name: "north.tif", mimeType: "image/tiff", buffer: Buffer.from("no raster") });
  await said("^The service asks for a token here. Enter yours in the field");
  assert.equal(await page.evaluate(() => document.activeElement.id), "token");
  assert.ok(await page.isVisible("#token"), "the field for the token is folded away");
  await page.evaluate(() => { document.getElementById("drop-draft").click(); document.getElementById("options").open = false; });
  await page.selectOption("#look", "imagery");
  const show = async (address) => { await page.fill("#imagery", address); await page.press("#imagery", "Tab"); };
  await show("not a url");
  await said("Imagery needs an address of tiles");
  await show(`${url}/nowhere/{z}/{x}/{y}.png`);
  await said("No imagery comes from 127.0.0.1");
  await page.selectOption("#look", "relief");
  await page.waitForFunction(() => document.getElementById("message").textContent === "");
}

// Every look is another picture.
export async function try_looks(page) {
  const colours = {};
  await look_straight_down(page, { share: 0.7, error_px: 2 });
  for (const look of ["relief", "height", "hillshade", "slope", "aspect", "levels", "plain"]) {
    await page.selectOption("#look", look);
    await tiles_loaded(page);
    colours[look] = await mean_colour(page);
    const explained = await page.isVisible("#legend");
    if (["levels", "plain"].includes(look)) assert.equal(explained, false, `${look} has the legend of another look`);
  }
  for (const [one, other] of [
    ["height", "hillshade"], ["height", "levels"], ["levels", "plain"], ["height", "plain"], ["relief", "hillshade"], ["relief", "slope"], ["slope", "aspect"]]) {
    assert.ok(apart(colours[one], colours[other]) > 3, `${one} and ${other} look the same: ${colours[one]}, ${colours[other]}`);
  }
  assert.equal(await page.textContent("#message"), "");
  await page.selectOption("#look", "height");
}

// Another page from the link has the same controls; what is as at first is not in the address.
export async function try_link_of_controls(browser, page) {
  await page.selectOption("#look", "slope");
  await page.selectOption("#ramp", "grey");
  await page.fill("#exaggeration", "2");
  const link = await page.evaluate(() => window.location.href);
  assert.deepEqual(["look", "ramp", "heights", "detail"].map((name) => new URL(link).searchParams.get(name)), ["slope", "grey", "2", null]);
  const { page: other } = await open_page(browser, link, kTiny);
  await tiles_loaded(other);
  assert.deepEqual(await other.evaluate(() => ["look", "ramp", "exaggeration"].map((id) => document.getElementById(id).value)), ["slope", "grey", "2"]);
  assert.equal(await other.evaluate(() => window.cordillera.looks.look), "slope");
  assert.equal(await other.evaluate(() => window.cordillera.scene.verticalExaggeration), 2);
  await other.close();
  await page.fill("#exaggeration", "1");
  await page.selectOption("#look", "height");
}

// An empty service offers the sample, and its button is all that it takes.
export async function try_sample(browser, url) {
  const { page, complaints } = await open_page(browser, url, kTiny);
  await page.click("#sample");
  await tiles_loaded(page);
  assert.equal(await focused(page), "globe", "the focus went with the welcome");
  assert.equal(await page.isVisible("#welcome"), false, "the welcome stands before the terrain");
  assert.match(await page.textContent("#title"), /white_mountains/);
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// Height and stated error under the pointer; exaggeration changes the picture, not the height.
export async function try_pointer(page) {
  const read = async () => {
    const { width, height } = page.viewportSize();
    await page.click("#fold");  // the panel is not to be in the middle
    await page.evaluate(() => { document.getElementById("place-error").textContent = ""; });  // of a place before
    await page.mouse.move(width / 2 - 1, height / 2);
    await page.mouse.move(width / 2, height / 2);
    await page.waitForFunction(() => /^± [\d.]+ m \(level \d+\)$/.test(document.getElementById("place-error").textContent));
    await page.click("#fold");
    return Number(/^(-?[\d.]+) m above the ellipsoid$/.exec(await page.textContent("#ellipsoid-height"))[1]);
  };
  await look_straight_down(page, { share: 0.7, error_px: 0.5 });  // so that the middle shows the same place, however high it is
  const once = await read();
  await page.fill("#exaggeration", "2");
  await tiles_loaded(page);
  assert.ok(Math.abs((await read()) - once) < 30, "the height follows the exaggeration");
  await page.fill("#exaggeration", "1");

  // The service itself says how far the sea's level is from the ellipsoid there.
  await page.waitForFunction(() => / m above sea level \(EGM96\)$/.test(document.getElementById("sea-height").textContent));
  const { undulation, wanted } = await page.evaluate(async () => {
    const number = (id) => parseFloat(document.getElementById(id).textContent);
    const [lat, lon] = document.getElementById("place").textContent.split(", ").map((text) => parseFloat(text) * (/[SW]$/.test(text) ? -1 : 1));
    const { points: [point] } = await (await fetch(`v1/datasets/${window.cordillera.manifest.id}/elevation?points=${lon},${lat}`)).json();
    return { undulation: number("ellipsoid-height") - number("sea-height"), wanted: point.ellipsoidal_height - point.orthometric_height };
  });
  assert.ok(Math.abs(undulation - wanted) < 0.3, `the sea's level is ${undulation} m above the ellipsoid, not ${wanted} m`);
}

// Two clicks: the heights along the line are the service's own, and so is the error that is said.
export async function try_profile(page) {
  const { width, height } = page.viewportSize(), at = (share) => [share * width, height / 2];
  await page.click("#fold");
  await look_straight_down(page, { share: 0.7, error_px: 2 });
  await page.click("#measure");
  await page.mouse.click(...at(0.35));
  await page.waitForFunction(() => /second place/.test(document.getElementById("message").textContent));
  await page.mouse.click(...at(0.65));
  await page.waitForSelector("#profile:not([hidden])");
  const { ends, drawn, words, error, id } = await page.evaluate(() => ({
    ends: window.cordillera.profile.ends, drawn: document.getElementById("profile-line").getAttribute("d").split("L").length,
    words: document.getElementById("profile-words").textContent, error: document.getElementById("profile-error").textContent, id: window.cordillera.manifest.id,
  }));
  const { points, length, stated_max_error } = await page.evaluate(async ([line, dataset]) => (await fetch(`v1/datasets/${dataset}/elevation?line=${line}&samples=256`)).json(),
    [ends.map((place) => place.join(",")).join(";"), id]);
  const heights = points.map(({ orthometric_height }) => orthometric_height), [low, high] = [Math.min(...heights), Math.max(...heights)];
  assert.ok(high - low > 50 && length > 1000, "the line has no relief");
  assert.ok(words.includes(` ${low.toFixed(0)} to ${high.toFixed(0)} m above sea level (EGM96)`), words);
  assert.ok(Math.abs(parseFloat(/± ([\d.]+) m/.exec(error)[1]) - stated_max_error) < 0.06, error);
  assert.equal(drawn, points.length, "the picture leaves places out");
  await page.hover("#profile-chart");
  await page.waitForFunction(() => /: [\d.]+ m$/.test(document.getElementById("profile-place").textContent));
  await page.click("#fold");
  await page.setViewportSize({ width: 1100, height: 650 });
  const [left, right] = await page.evaluate(() => [document.getElementById("foot").getBoundingClientRect().left, document.getElementById("panel").getBoundingClientRect().right]);
  assert.ok(left >= right, `the profile and what stands beside it cover ${right - left} px of the panel`);
  await page.setViewportSize({ width, height });
  await page.click("#profile-close");
  assert.equal(await page.isVisible("#profile"), false);
  assert.equal(await page.getAttribute("#measure", "aria-pressed"), "false");
}

// The page names its camera in the link when the movement has ended, which software graphics make as late as they like.
const link_names_the_camera = (page) => page.waitForFunction(() => {
  const [longitude, latitude, height] = window.location.hash.slice(1).split(",").map(Number);
  const { positionCartographic: here } = window.cordillera.scene.camera;
  const degrees = window.Cesium.Math.toDegrees;
  return Math.abs(height - here.height) < 0.5 && Math.abs(longitude - degrees(here.longitude)) < 1e-5 &&
    Math.abs(latitude - degrees(here.latitude)) < 1e-5;
});

export async function try_link(browser, page) {
  const before = await camera_of(page);
  await page.evaluate(() => window.cordillera.scene.camera.moveForward(3000));
  await link_names_the_camera(page);
  const [link, here] = [await page.evaluate(() => window.location.href), await camera_of(page)];
  const { page: other } = await open_page(browser, link, kTiny);
  await tiles_loaded(other);
  const there = await camera_of(other);
  assert.ok(Math.abs(here.height - before.height) > 100, "the camera did not move");
  assert.ok(Math.abs(here.height - there.height) < 1 && Math.abs(here.longitude - there.longitude) < 1e-6, "the link leads elsewhere");
  await other.close();
}

export async function try_keys(page) {
  await page.focus("#globe");
  const before = await camera_of(page);
  await page.keyboard.press("+");
  assert.ok((await camera_of(page)).height < before.height, "+ does not zoom in");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Home");
  await page.click("#measure");
  await page.keyboard.press("Escape");
  assert.equal(await page.getAttribute("#measure", "aria-pressed"), "false", "Escape does not end a tool");
  const named = (role, name) => page.getByRole(role, { name }).count();
  for (const [role, name] of [["slider", /^Heights ×/], ["slider", /^Error/], ["button", "fold the panel"], ["application", /^The terrain/]]) {
    assert.equal(await named(role, name), 1, `${role} ${name} has no such name`);
  }
}

// What an element says from now on, one after the other: a list that the page fills.
const words_of = (page, id) => page.evaluateHandle((one) => {
  const element = document.getElementById(one), words = [];
  new MutationObserver(() => words.push(element.textContent)).observe(element, { childList: true });
  return words;
}, id);

export async function try_snippets(page, url, id) {
  await page.click("#clients summary");
  const count = await page.$$eval("#client option", (options) => options.length);
  for (let k = 0; k < count; ++k) {
    await page.selectOption("#client", String(k));
    assert.ok((await page.textContent("#snippet")).includes(`${url}/v1/datasets/${id}`), `snippet ${k} has another address`);
  }
  await page.evaluate(() => Object.defineProperty(navigator, "clipboard", { value: undefined }));  // as over http from another machine
  const words = await words_of(page, "copy-snippet");
  await page.click("#copy-snippet");
  await page.waitForFunction((all) => all.join() === "copied,Copy", words);
  await page.evaluate(() => { document.execCommand = () => false; });
  await page.click("#link");
  await was_said(page, "does not let this page copy");
}

async function try_profile_by_touch(page) {
  await page.tap("#measure");
  await page.touchscreen.tap(50, 215);
  await page.waitForFunction(() => /second place/.test(document.getElementById("message").textContent));
  await page.touchscreen.tap(90, 215);
  await page.waitForSelector("#profile:not([hidden])");
  await page.tap("#profile-close");
  assert.equal(await page.isVisible("#profile"), false);
}

// Nothing lies over what a finger is to press, in the windows of small phones: with the panel open, and with a card.
async function try_reach(page) {
  const covered = (ids) => page.evaluate((all) => all.filter((id) => {
    const { left, top, width, height } = document.getElementById(id).getBoundingClientRect();
    return !document.getElementById(id).contains(document.elementFromPoint(left + width / 2, top + height / 2));
  }), ids);
  for (const height of [667, 640, 427]) {
    await page.setViewportSize({ width: 360, height });
    assert.deepEqual(await covered(["fold"]), [], `360 x ${height}: the open panel cannot be closed`);
    await page.tap("#fold");
    await some_frames(page);  // the foot follows the panel
    for (const card of ["profile", "viewshed"]) {
      await page.evaluate((id) => { document.getElementById(id).hidden = false; }, card);
      assert.deepEqual(await covered(["home", "measure", "look-around", "link", `${card}-close`]), [], `360 x ${height}: covered beside the ${card}`);
      await page.evaluate((id) => { document.getElementById(id).hidden = true; }, card);
    }
    await page.tap("#fold");
  }
}

// Touch, a small screen with three times the pixels, a light scheme.
export async function try_phone(browser, url, id, picture) {
  const phone = { ...kTerrainAlone, viewport: { width: 240, height: 427 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true, colorScheme: "light" };
  const { page, complaints } = await open_dataset(browser, url, id, phone);
  const { scrolls, pixels, paper } = await page.evaluate(() => ({
    scrolls: document.documentElement.scrollWidth > window.innerWidth,
    pixels: window.cordillera.scene.canvas.width / window.innerWidth,
    paper: getComputedStyle(document.getElementById("panel")).backgroundColor,
  }));
  assert.equal(scrolls, false, "the page is wider than the screen");
  assert.ok(pixels <= 2.01, `${pixels} pixels a point are drawn`);
  assert.match(paper, /25\d, 25\d, 25\d/, `the light scheme is dark: ${paper}`);
  await page.touchscreen.tap(70, 215);  // the terrain is beside the tools
  await page.waitForFunction(() => / m above the ellipsoid$/.test(document.getElementById("ellipsoid-height").textContent));
  const small = await page.$$eval("button, summary, select, #documents a", (all) => all.map((one) => [one.id || one.textContent, one.getBoundingClientRect()])
    .filter(([, { width, height }]) => width > 0 && Math.min(width, height) < 44).map(([name]) => name));
  assert.deepEqual(small, [], "smaller than a finger");
  await try_profile_by_touch(page);
  await page.tap("#fold");
  await page.waitForFunction(() => !document.getElementById("panel").classList.contains("folded"));
  await page.screenshot({ path: picture });
  await try_reach(page);
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}
