// The pages that the service has for each client: /v1/datasets/ID/demo/CLIENT.html. Their libraries are asked for at another host; here
// they come from npm, and the browser itself holds them against the hashes that the pages name.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { extname, join } from "node:path";

import { made, make_black, new_page, tiles_loaded } from "../browser.mjs";
import { come_to, open_client, picture_of, settle } from "./browser_page.mjs";

export const kDemoPages = ["leaflet", "openlayers", "maplibre", "threejs", "deckgl", "cesium"];
export const kLibraryHost = "https://cdn.jsdelivr.net";
const kTypes = { ".css": "text/css", ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm" };
const kLeastSpread = 12;  // of shades, of 255; a page without terrain has less than 4

// NAME@VERSION/PATH of a package, from npm's folder: the page and the tests must mean the same version.
export async function serve_libraries(page, modules) {
  await page.route(`${kLibraryHost}/**`, (route) => {
    const [, name, version, path] = new URL(route.request().url()).pathname.match(/^\/npm\/((?:@[^/]+\/)?[^@/]+)@([^/]+)\/(.+)$/);
    const here = JSON.parse(readFileSync(join(modules, name, "package.json"), "utf8")).version;
    if (version !== here) throw new Error(`the page takes ${name} ${version}, the tests have ${here}`);
    return route.fulfill({
      body: readFileSync(join(modules, name, path)), contentType: kTypes[extname(path)] ?? "application/octet-stream",
      headers: { "Access-Control-Allow-Origin": "*" } });
  });
}

const shown = ({ page }) => page.waitForFunction(() => document.body?.dataset.tiles === "final");  // a page that is loaded anew has no body for a moment

// Terrain is seen, nothing is asked for elsewhere or refused, and a drag moves the picture where the page has a camera of its own.
// least: how far shades must deviate, of 255.
export async function try_demo_page(name, { browser, url, id, modules, pictures, picture = name, least = kLeastSpread }) {
  const opened = await open_client(browser, `${url}/v1/datasets/${id}/demo/${name}.html`, [url, kLibraryHost],
    { started: () => document.body.dataset.tiles, prepare: (page) => serve_libraries(page, modules) });
  await shown(opened);
  const { deviation } = await picture_of(opened, `${pictures}/demo-${picture}.png`);
  assert.ok(deviation > least, `there is no terrain: shades deviate by ${deviation.toFixed(1)} of 255`);
  if (name === "threejs") await try_drag(opened);
  if (name in kPlaces) await try_keys(opened, kPlaces[name]);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();
  return `shades deviate by ${deviation.toFixed(1)} of 255`;
}

// Keys move the map and its height, where the page itself sees to that.
const of_camera = () => { const { x, y, z } = globalThis.demo.camera.position; return [x, y, z]; };
const kPlaces = {
  cesium: of_camera, threejs: of_camera, openlayers: () => globalThis.demo.map.getView().getCenter(),
  leaflet: () => { const { lng, lat } = globalThis.demo.map.getCenter(); return [lng, lat]; },
};
async function try_keys({ page }, place) {
  assert.equal(await page.getByRole("application").count(), 1, "the map is none for screen readers");
  await page.focus("#map");
  for (const key of ["ArrowRight", "ArrowUp"]) {
    const before = await page.evaluate(place);
    await page.keyboard.press(key);
    await page.waitForFunction(`JSON.stringify((${place})()) !== ${JSON.stringify(JSON.stringify(before))}`);
  }
  if (!(await page.$("#height, .leaflet-container"))) return;
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => ["message", "height"].some((id) => /m above sea level|no data/.test(document.getElementById(id)?.textContent)));
}

async function try_drag({ page }) {
  const place = () => page.evaluate(() => globalThis.demo.camera.position.toArray());
  const before = await place(), { width, height } = page.viewportSize();
  await page.mouse.move(width / 2, 0.7 * height);
  await page.mouse.down();
  await page.mouse.move(width / 2 + 40, 0.7 * height - 20, { steps: 4 });
  await page.waitForFunction((from) => Math.hypot(...globalThis.demo.camera.position.toArray().map((value, k) => value - from[k])) > 10, before);
  await page.mouse.up();
}

// No terrain of its own, but addresses to enter: they answer.
export async function try_qgis_page({ browser, url, id, modules }) {
  const opened = await open_client(browser, `${url}/v1/datasets/${id}/demo/qgis.html`, [url],
    { started: () => document.body.dataset.tiles, prepare: (page) => serve_libraries(page, modules) });
  const addresses = await opened.page.$$eval("code", (all) => all.map((one) => one.textContent));
  assert.equal(addresses.length, 3);
  for (const address of addresses.filter((one) => !one.includes("{"))) assert.equal((await opened.page.request.get(address)).status(), 200, address);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();
  return `${addresses.length} addresses`;
}

// A private dataset: the page asks for the token, keeps it for the tab, and shows the terrain.
export async function try_private_page({ browser, url, id, token, modules }) {
  const page = await new_page(browser);
  await serve_libraries(page, modules);
  await page.goto(`${url}/v1/datasets/${id}/demo/leaflet.html`);
  await page.waitForFunction(() => !document.getElementById("token").hidden);
  assert.match(await page.textContent("#message"), /there is no dataset/, "it says more than that there is none");
  await page.fill("#token input", token);
  await page.click("#token button");
  await shown({ page });
  await page.close();
  return "shown with the token, unknown without";
}

// A private dataset that names pictures: in the viewer those of its own are asked for with the token, and those of another without.
export async function try_private_imagery({ browser, url, id, other, token }) {
  const headers = { Authorization: `Bearer ${token}` }, of = (dataset) => `${url}/v1/datasets/${dataset}/slope/{z}/{x}/{y}.png`;
  for (const [imagery, shown_token] of [[of(id), headers.Authorization], [of(other), undefined]]) {
    assert.equal((await fetch(`${url}/v1/datasets/${id}?imagery=${encodeURIComponent(imagery)}`, { method: "PATCH", headers })).status, 200);
    const page = await new_page(browser);
    await page.addInitScript((mine) => sessionStorage.setItem("cordillera-token", mine), token);
    const picture = page.waitForResponse((response) => response.url().startsWith(imagery.split("{")[0]));
    await page.goto(`${url}/?dataset=${id}`);
    const response = await picture;
    assert.ok(response.status() < 300, `${response.url()}: ${response.status()}`);
    assert.equal(response.request().headers().authorization, shown_token);
    await page.close();
  }
  return "its own pictures are shown the token, others' are not";
}

// A document that names another host: nobody there is shown the token.
const kElsewhere = "http://elsewhere.test/";
export async function try_foreign_tiles({ browser, url, id, token, modules }) {
  for (const address of [`${url}/?dataset=${id}`, `${url}/v1/datasets/${id}/demo/cesium.html`, `${url}/v1/datasets/${id}/demo/threejs.html`]) {
    const page = await new_page(browser);
    await serve_libraries(page, modules);
    await page.addInitScript((mine) => sessionStorage.setItem("cordillera-token", mine), token);
    await page.route(/\/tileset(-explicit)?\.json/, async (route) => {
      const text = await (await route.fetch()).text();
      await route.fulfill({ contentType: "application/json", body: text.replaceAll(/"uri":\s*"/g, `$&${kElsewhere}`) });
    });
    await page.route(`${kElsewhere}**`, (route) => route.fulfill({ status: 404 }));
    const asked = page.waitForRequest((request) => request.url().startsWith(kElsewhere));
    await page.goto(address);
    assert.ok(!("authorization" in (await asked).headers()), `${address} shows the token elsewhere`);
    await page.close();
  }
  return "the token stays here";
}

// A private dataset that names pictures: they lie on it in place of its relief, and whoever has them is shown no token.
const kWithImagery = ["leaflet", "openlayers", "maplibre", "threejs", "deckgl", "cesium"];
export async function try_imagery_pages({ browser, url, id, other, token, modules }) {
  const imagery = `${url}/v1/datasets/${other}/slope/{z}/{x}/{y}.png`, headers = { Authorization: `Bearer ${token}` };
  assert.equal((await fetch(`${url}/v1/datasets/${id}?imagery=${encodeURIComponent(imagery)}`, { method: "PATCH", headers })).status, 200);
  for (const name of kWithImagery) {
    const pictures = [], relief = [];
    const opened = await open_client(browser, `${url}/v1/datasets/${id}/demo/${name}.html`, [url, kLibraryHost], {
      started: () => document.body.dataset.tiles,
      prepare: async (page) => {
        await serve_libraries(page, modules);
        await page.addInitScript((mine) => sessionStorage.setItem("cordillera-token", mine), token);
        page.on("request", (request) => {
          if (request.url().includes(`/${other}/slope/`)) pictures.push(request.headers().authorization);
          if (request.url().includes(`/${id}/relief/`)) relief.push(request.url());
        });
      } });
    await shown(opened);
    assert.ok(pictures.length > 0 && relief.length === 0, `${name}: ${pictures.length} pictures that it names, ${relief.length} of its relief`);
    assert.ok(pictures.every((shown_token) => shown_token === undefined), `${name} shows the token to whoever has the pictures`);
    assert.deepEqual(opened.complaints, [], "the browser complained");
    await opened.page.close();
  }
  return `${kWithImagery.join(", ")} lay them on`;
}

// Goes so near that finer tiles are wanted, and looks at every frame as the map draws it: is there nothing but its ground in the middle? The
// finest zoom that there is so far.
const watch_map = async (opened) => {
  const coarse = await opened.page.evaluate(() => {
    const { map } = globalThis.demo, gl = map.getCanvas().getContext("webgl2"), seen = (globalThis.seen = { frames: 0, bare: 0 });
    const zoom = map.getSource("relief").maxzoom, ground = map.getPaintProperty("ground", "background-color").match(/[0-9a-f]{2}/g).map((part) => parseInt(part, 16));
    map.jumpTo({ zoom });
    map.on("render", () => {
      const pixel = new Uint8Array(4);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      ++seen.frames;
      if (ground.every((part, k) => Math.abs(part - pixel[k]) < 4)) ++seen.bare;
    });
    return zoom;
  });
  await come_to(opened, () => opened.page.evaluate(() => globalThis.demo.map.loaded() && globalThis.seen.frames > 0), "the map is not drawn");
  assert.equal((await opened.page.evaluate(() => globalThis.seen)).bare, 0, "the map is bare before other tiles come");
  return coarse;
};

async function was_never_bare(opened, coarse) {
  const { frames, bare } = await opened.page.evaluate(() => globalThis.seen);
  assert.equal(bare, 0, `the map was bare in ${bare} of ${frames} frames`);
  const finest = Math.max(...opened.answered.map((one) => Number(/\/relief\/(\d+)\//.exec(one)?.[1] ?? 0)));
  assert.ok(finest > coarse, `finer tiles were not asked for: zoom ${finest}, and ${coarse} before`);
  await opened.page.evaluate(() => globalThis.demo.map.setLayoutProperty("relief", "visibility", "none"));
  await come_to(opened, () => opened.page.evaluate(() => globalThis.seen.bare > 0), "a bare map is not noticed (control)");
}

// Pages of a dataset that is being built by the process job, which was stopped when its first tiles stood: final tiles take their place.
const kFollowing = ["leaflet", "threejs", "maplibre"];
export async function try_following_pages({ browser, url, id, job, modules }) {
  const open = (name) => open_client(browser, `${url}/v1/datasets/${id}/demo/${name}.html`, [url, kLibraryHost],
    { started: () => document.body.dataset.tiles, prepare: (page) => serve_libraries(page, modules) });
  const opened = [];
  for (const name of kFollowing) opened.push(await open(name));
  for (const { page } of opened) {
    assert.equal(await page.evaluate(() => document.body.dataset.tiles), "provisional", "the build is over already");
    assert.match(await page.textContent("#message"), /first look/);
  }
  const map = opened[kFollowing.indexOf("maplibre")], coarse = await watch_map(map);
  process.kill(job, "SIGCONT");
  for (const one of opened) {
    await shown(one);
    if (one === map) await was_never_bare(map, coarse);
    assert.equal(await one.page.textContent("#message"), "");
    assert.deepEqual(one.complaints, [], "the browser complained");
    await one.page.close();
  }
  return `${kFollowing.join(", ")} show the final tiles`;
}

// A lazy dataset: each block that somebody looks at is on the page, and how much is made is said. Here others look, one after the other, at
// the places that lie at these shares of its width.
const kLooks = [0.2, 0.8];
export async function try_lazy_page({ browser, url, id, modules }) {
  const at = `${url}/v1/datasets/${id}`;
  let hear, asked = 0, read = {};  // the manifest that the page has read last
  const heard = new Promise((then) => { hear = then; });
  const answer = (route) => (asked++ === 0 ? route.fulfill({ contentType: "text/event-stream", body: "" }) : route.continue());  // the first breaks off
  const opened = await open_client(browser, `${url}/v1/datasets/${id}/demo/leaflet.html`, [url, kLibraryHost], {
    started: () => document.body.dataset.tiles,
    prepare: async (page) => {
      await serve_libraries(page, modules);
      await page.route("**/events", (route) => heard.then(() => answer(route)));
      page.on("response", async (response) => { if (response.url() === `${at}/manifest.json`) read = await response.json().catch(() => read); });
    } });
  assert.match(await opened.page.textContent("#message"), /made where you look/, "before the first event, too");
  hear();
  const { page } = opened, has_read = (column, row) => read.done_blocks?.x?.some((x, k) => x === column && read.done_blocks.y[k] === row);
  const { bounds: [west, south, east, north], done_blocks: { level } } = await (await fetch(`${at}/manifest.json`)).json(), side = 180 / 2 ** level;
  for (const across of kLooks) {
    const x = Math.floor((west + across * (east - west) + 180) / side), y = Math.floor(((south + north) / 2 + 90) / side);
    assert.equal(await made(`${at}/tiles/${level}/${x}/${y}.drc`), 200);
    await come_to(opened, () => has_read(x, y), "the page does not show the block");
  }
  await page.waitForFunction(() => / made where you look\. [1-9]\d* % /.test(document.getElementById("message").textContent));
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await page.close();
  return `${kLooks.length} blocks are shown as they are made`;
}

// A folder that `cordillera build` wrote. Its index.html, from a plain web server, shows the terrain; and so does the viewer of
// `cordillera view`, without a word about pictures that the folder does not hold.
export async function try_folder_page({ browser, plain, modules, pictures }) {
  const opened = await open_client(browser, `${plain}/`, [plain, kLibraryHost], { started: () => document.body.dataset.tiles === "final", prepare: (page) => serve_libraries(page, modules) });
  const { deviation } = await picture_of(opened, `${pictures}/folder.png`);
  assert.ok(deviation > kLeastSpread, `there is no terrain: shades deviate by ${deviation.toFixed(1)} of 255`);
  assert.match(await opened.page.textContent("#words"), /white_mountains/);
  await opened.page.focus("#map");
  const before = await opened.page.screenshot();
  await opened.page.keyboard.press("-");
  let moved = false;
  for (let tries = 0; tries < 50 && !moved; ++tries) moved = !before.equals(await opened.page.screenshot());
  assert.ok(moved, "keys do not move it");
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();
  return `shades deviate by ${deviation.toFixed(1)} of 255`;
}

// Where the folder was built with pictures they reach the rims of tiles: from above, and without light, there is nothing but black.
export async function try_folder_pictures({ browser, plain, modules, pictures }) {
  const opened = await open_client(browser, `${plain}/`, [plain, kLibraryHost], {
    started: () => document.body.dataset.tiles === "final",
    prepare: async (page) => {
      await serve_libraries(page, modules);
      await make_black(page, `${plain}/pictures/**`);
      await page.route("**/manifest.json", async (route) => {
        const json = await (await route.fetch()).json();
        await route.fulfill({ json: { ...json, options: { ...json.options, imagery: `${plain}/pictures/{z}/{x}/{y}.png` } } });
      });
      await page.addInitScript(() => document.addEventListener("load", ({ target }) => {
        if (!target.src?.endsWith("/Cesium.js")) return;
        const { Cesium3DTileset, CustomShader, LightingModel } = window.Cesium, { fromUrl } = Cesium3DTileset;
        Cesium3DTileset.fromUrl = async (url, how) => {
          const tileset = await fromUrl.call(Cesium3DTileset, url, { ...how, customShader: new CustomShader({ lightingModel: LightingModel.UNLIT }) });
          window.client = { settled: () => tileset.tilesLoaded, tiles: () => tileset.statistics.selected };
          return tileset;
        };
      }, true));
    } });
  const { page } = opened;
  await page.addStyleTag({ content: "#words, .cesium-widget-credits, #map::after { display: none; }" });
  await page.focus("#map");
  for (const [key, times] of [["+", 10], ["PageDown", 7]]) for (let k = 0; k < times; ++k) await page.keyboard.press(key);
  const tiles = await settle(opened), { greenest } = await picture_of(opened, `${pictures}/folder-pictures.png`);
  assert.ok(tiles > 1 && greenest < kLeastSpread, `of ${tiles} tiles, some rim has no picture: ${greenest} of 255`);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await page.close();
  return `pictures on ${tiles} tiles leave ${greenest} of 255`;
}

// Where the library's host cannot be reached, pages say so.
export async function try_without_libraries({ browser, url, id, plain }) {
  for (const address of [`${plain}/`, `${url}/v1/datasets/${id}/demo/maplibre.html`, `${url}/v1/datasets/${id}/demo/leaflet.html`]) {
    const page = await new_page(browser);
    await page.route(`${kLibraryHost}/**`, (route) => route.abort());
    await page.goto(address);
    await page.waitForFunction(() => document.getElementById("message").textContent.includes("cdn.jsdelivr.net"));
    await page.close();
  }
  return "they say what they need";
}

export async function try_folder_view({ browser, viewer }) {
  const page = await new_page(browser);
  await page.goto(viewer);
  await tiles_loaded(page);
  const { error, look } = await page.evaluate(() => ({ error: window.cordillera.error, look: window.cordillera.looks.look }));
  assert.equal(error, null);
  assert.equal(look, "height");
  assert.equal(await page.textContent("#message"), "");
  await page.close();
  return "the viewer shows it, coloured by height";
}

// The same of an archive of heights alone: the map's page colours and shades them itself, and the viewer says which page shows it.
export async function try_archive_view({ browser, viewer, modules, pictures }) {
  const origin = new URL(viewer).origin;
  const opened = await open_client(browser, `${origin}/v1/datasets/dem/demo/maplibre.html`, [origin, kLibraryHost],
    { started: () => document.body.dataset.tiles, prepare: (page) => serve_libraries(page, modules) });
  await shown(opened);
  const { deviation } = await picture_of(opened, `${pictures}/archive.png`);
  assert.ok(deviation > kLeastSpread, `there is no terrain: shades deviate by ${deviation.toFixed(1)} of 255`);
  assert.deepEqual(opened.complaints, [], "the browser complained");
  await opened.page.close();
  const page = await new_page(browser);
  await page.goto(`${origin}/?dataset=dem`);
  await page.waitForFunction(() => window.cordillera?.error);
  assert.match(await page.textContent("#message"), /no 3D Tiles/);
  await page.close();
  return `shades deviate by ${deviation.toFixed(1)} of 255`;
}
