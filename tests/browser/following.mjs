// Which dataset the page shows, and which build it listens to: the one that somebody chose, and nothing else.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { made, new_page, open_dataset, open_page, some_frames, tiles_loaded, was_said } from "./browser.mjs";
import { kTiny } from "./controls.mjs";

const shows = (page, id) => page.waitForFunction((wanted) => window.cordillera?.id === wanted, id);
const named = (page) => page.evaluate(() => new URL(window.location.href).searchParams.get("dataset"));
const choose = (page, id) => page.selectOption("#datasets", id, { force: true });  // the panel is folded

// One that is ready is shown while another is being built, by link and by the list. Gives what is to be called when that build is over.
export async function try_choice(browser, url, { held, terrain }) {
  const { page, complaints, asked } = await open_page(browser, `${url}/?dataset=${terrain}`, kTiny);
  const listens = () => asked.some((one) => one.endsWith(`/${held}/events`));
  await shows(page, terrain);
  assert.equal(listens(), false, "the page listens to a build that it does not show");
  await choose(page, held);
  await shows(page, held);
  await page.waitForSelector("#going:not([hidden])");
  assert.equal(listens(), true, "the page does not listen to the build that it shows");
  assert.equal(await page.isVisible("#cancel"), false, "a build of somebody else can be cancelled");
  await choose(page, terrain);
  await shows(page, terrain);
  await page.waitForSelector("#going", { state: "hidden" });
  return async () => {
    assert.deepEqual([await named(page), await page.evaluate(() => window.cordillera.id)], [terrain, terrain], "another dataset took its place");
    assert.deepEqual(complaints, [], "the browser complained");
    await page.close();
  };
}

// Somebody chooses a dataset, and looks while it is on its way: the last of each is what is seen, however late the service answers.
export async function try_last_choice(browser, url, { terrain, other }) {
  const { page, complaints } = await open_dataset(browser, url, terrain, kTiny), look = (name) => page.selectOption("#look", name, { force: true });
  const hold = async (address) => {
    let answer;
    const answered = new Promise((then) => { answer = then; }), asked = page.waitForRequest(address);
    await page.route(address, (route) => answered.then(() => route.fallback()), { times: 1 });
    return { asked, answer };
  };
  const tileset = await hold(`${url}/v1/datasets/${other}/tileset.json`);
  await choose(page, other);
  await tileset.asked;
  await look("slope");
  await look("levels");
  tileset.answer();
  await shows(page, other);
  await tiles_loaded(page);
  assert.deepEqual([await page.evaluate(() => window.cordillera.looks.look), await named(page)], ["levels", other]);

  const picture = await hold(`${url}/v1/datasets/${other}/slope.json`);
  await page.evaluate(() => { window.before = window.cordillera.tileset; });
  await look("slope");
  await picture.asked;
  for (let k = 0; k < 10; ++k) await some_frames(page);
  assert.equal(await page.evaluate(() => window.cordillera.tileset === window.before), true, "tiles without their picture take the place of others");
  await look("plain");
  picture.answer();
  await tiles_loaded(page);
  assert.equal(await page.evaluate(() => window.cordillera.looks.look), "plain", "a look of before has come late");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// It says how much is made, without a bar that never ends, and sharpens where the camera goes; a link that differs in the camera moves it.
export async function try_lazy(browser, url, id) {
  const { page, complaints } = await open_page(browser, `${url}/?dataset=${id}`, kTiny);
  await was_said(page, "made where you look. 0 %");
  assert.equal(await page.isVisible("#going"), false, "a bar waits for an end that nobody knows");
  const tiles = await page.evaluate(() => window.cordillera.manifest.tiles);
  await page.evaluate(() => { window.location.hash = "-71.3,44.27,4000,0,-89"; });
  await page.waitForFunction(() => Math.abs(window.cordillera.scene.camera.positionCartographic.height - 4000) < 1);
  await page.waitForFunction((before) => window.cordillera.manifest.tiles > before, tiles);
  await was_said(page, "made where you look. [1-9]\\d* %");
  assert.equal(await named(page), id);
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// A proxy answers for the service while it starts anew: the page listens again, and sharpens where others look.
export async function try_interrupted(browser, url, id) {
  const { page } = await open_page(browser, "about:blank", kTiny), at = `${url}/v1/datasets/${id}`;
  let refused = 0;
  await page.route(`${at}/events`, (route) => {
    ++refused;
    return route.fulfill({ status: 502, body: "Bad Gateway" });
  }, { times: 1 });
  await page.goto(`${url}/?dataset=${id}`);
  await shows(page, id);
  const tiles = await page.evaluate(() => window.cordillera.manifest.tiles);
  const { bounds: [west, south], done_blocks: { level } } = await (await fetch(`${at}/manifest.json`)).json(), side = 180 / 2 ** level;
  const corner = `${Math.floor((west + 180) / side)}/${Math.floor((south + 90) / side)}`;  // where nobody has looked
  assert.equal(await made(`${at}/tiles/${level}/${corner}.drc`), 200);
  await page.waitForFunction((before) => window.cordillera.manifest.tiles > before, tiles);
  assert.equal(refused, 1, "no proxy has answered (control)");
  await page.close();
}

// One that is asleep is read, which wakes it, and waited for. The service's answers for that are put in the place of those of one that is ready.
export async function try_asleep(browser, url, id) {
  const page = await new_page(browser, kTiny), at = `${url}/v1/datasets/${id}`, once = { times: 1 };
  let refused = 0;
  await page.route(at, async (route) => {
    const json = await (await route.fetch()).json();
    return route.fulfill({ json: { ...json, state: "queued", asleep: true, provisional: false } });
  }, once);
  await page.route(`${at}/events`, (route) => route.fulfill({ contentType: "text/event-stream", body: "retry: 600000\n\n" }));
  await page.route(`${at}/manifest.json`, (route) => {
    ++refused;
    return route.fulfill({ status: 503, headers: { "Retry-After": "1" }, json: { detail: "it has to be waited for" } });
  }, once);
  await page.goto(`${url}/?dataset=${id}`);
  await shows(page, id);
  assert.equal(refused, 1, "its manifest was not asked for while it was asleep");
  assert.equal(await page.evaluate(() => window.cordillera.error), null);
  await page.close();
}

// Somebody gives the dataset that is shown another title: a new version, which the page notices when it is looked at again.
export async function try_new_version(page, url, id, title) {
  assert.equal((await fetch(`${url}/v1/datasets/${id}?title=${encodeURIComponent(title)}`, { method: "PATCH" })).status, 200);
  await page.evaluate(() => document.dispatchEvent(new Event("visibilitychange")));
  await page.waitForFunction((wanted) => document.getElementById("title").textContent === wanted, title);
  await page.waitForFunction(() => /new version/.test(document.getElementById("message").textContent));
}

// Nobody answers for a while, and tiles fail. All of them are asked for again when somebody answers, and the page says nothing more of it.
async function try_silence(page) {
  const words = () => page.textContent("#message"), all = "**/v1/**";
  await page.route(all, (route) => route.abort());
  await page.evaluate(() => {
    window.failed = window.cordillera.tileset;
    window.failed.tileFailed.raiseEvent({ url: "a/tile", message: "nobody" });
  });
  await page.waitForFunction(() => document.getElementById("message").className === "problem");
  assert.match(await words(), /^The service does not answer\. /);
  await page.unroute(all);
  await page.waitForFunction(() => window.cordillera.tileset !== window.failed && window.failed.isDestroyed());
  await page.waitForFunction(() => document.getElementById("message").className === "");
  assert.equal(await page.evaluate(() => window.cordillera.error), null);
}

// Nobody answers a page that lies open and lacks nothing: it says so, and that it is over, and goes on with the tiles that it has.
async function try_idle_silence(page) {
  const all = "**/v1/**", before = await page.evaluateHandle(() => window.cordillera.tileset);
  await page.route(all, (route) => route.fulfill({ status: 502, body: "Bad Gateway" }));
  await page.evaluate(() => document.dispatchEvent(new Event("visibilitychange")));
  await was_said(page, "^The service does not answer\\. ");
  await page.unroute(all);
  await was_said(page, "^The service answers again");
  assert.ok(await page.evaluate((tileset) => window.cordillera.tileset === tileset, before), "what the page has is asked for anew");
}

// Somebody deletes the dataset while another version of it is on its way: that it is gone is what stays.
export async function try_deleted_version(browser, url, raster) {
  const { id } = await (await fetch(`${url}/v1/datasets?name=short-lived.tif`, { method: "POST", body: readFileSync(raster), headers: { Prefer: "wait" } })).json();
  const { page } = await open_dataset(browser, url, id, kTiny), look = () => page.evaluate(() => document.dispatchEvent(new Event("visibilitychange")));
  let release;
  const released = new Promise((then) => { release = then; }), asked = page.waitForRequest(/\/tiles\//);
  await page.route(/\/tiles\//, (route) => released.then(() => route.fallback()));
  assert.equal((await fetch(`${url}/v1/datasets/${id}?title=another`, { method: "PATCH" })).status, 200);
  await look();
  await asked;
  assert.equal((await fetch(`${url}/v1/datasets/${id}`, { method: "DELETE" })).status, 204);
  await look();
  await was_said(page, "not there any more");
  release();
  await page.waitForFunction(() => {
    const { primitives } = window.cordillera.scene, all = Array.from({ length: primitives.length }, (_, k) => primitives.get(k));
    return all.filter((one) => one instanceof window.Cesium.Cesium3DTileset).length === 1;
  });
  await some_frames(page);
  assert.match(await page.textContent("#message"), /not there any more/, "its new version is said in its place");
  await page.close();
}

// Somebody deletes the dataset that is shown. The page says so, also where a tile is the first that tells, and does not offer it any more.
export async function try_deleted(browser, url, raster) {
  const delete_it = async (id) => assert.equal((await fetch(`${url}/v1/datasets/${id}`, { method: "DELETE" })).status, 204);
  for (const told_by of ["look", "tile"]) {
    const body = readFileSync(raster), headers = { Prefer: "wait" };
    const { id } = await (await fetch(`${url}/v1/datasets?name=short-lived.tif`, { method: "POST", body, headers })).json();
    const { page } = await open_dataset(browser, url, id, kTiny);
    if (told_by === "look") await try_idle_silence(page);
    else await try_silence(page);
    await delete_it(id);
    if (told_by === "look") await page.evaluate(() => document.dispatchEvent(new Event("visibilitychange")));
    else await page.evaluate(() => { window.cordillera.tileset.tileFailed.raiseEvent({ url: "a/tile", message: "404" }); });
    await page.waitForFunction(() => /not there any more/.test(document.getElementById("message").textContent));
    await page.waitForFunction((gone) => ![...document.querySelectorAll("#datasets option")].some(({ value }) => value === gone), id);
    await page.evaluate(() => { window.cordillera.tileset.tileFailed.raiseEvent({ url: "another/tile", message: "404" }); });
    assert.match(await page.textContent("#message"), /not there any more/, "a tile's address is said in its place");
    await page.close();
  }
}
