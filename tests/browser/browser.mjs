// A headless Chromium that draws WebGL in software and talks to nobody but the server under test.
import { chromium } from "playwright-core";

const kArguments = [
  "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
  "--disable-gpu-rasterization"];
export const kPatience_ms = 240000;
const kQuietFrames = 5;

// The browser for as long as the body runs: it ends with it, and with this process however that ends (its pipe to the browser closes).
export async function with_browser(executablePath, body) {
  const browser = await chromium.launch({ executablePath, args: kArguments, timeout: kPatience_ms });
  try {
    await body(browser);
  } finally {
    await browser.close();
  }
}

// A page, waited for as long as a slow machine takes.
export async function new_page(browser, { terrain_alone = false, ...how } = {}) {
  const page = await browser.newPage({ viewport: { width: 320, height: 240 }, ...how });
  page.setDefaultTimeout(kPatience_ms);
  await page.addInitScript(remember_words);
  if (terrain_alone) await page.addInitScript(hide_what_is_around);
  return page;
}

// All that its line of words has said, however short a time: a slow page draws no frame meanwhile, and nobody who looks now and then sees it.
function remember_words() {
  window.said = [];
  new MutationObserver((changes) => {
    for (const { target, addedNodes } of changes) if (target.id === "message") window.said.push([...addedNodes].map(({ textContent }) => textContent).join(""));
  }).observe(document, { childList: true, subtree: true });
}
export const was_said = (page, words) => page.waitForFunction((wanted) => window.said.some((one) => new RegExp(wanted).test(one)), words);

// What the service makes when it is asked for, waited for beyond its own limit.
export async function made(address) {
  for (;;) {
    const response = await fetch(address, { headers: { Prefer: "wait" } });
    await response.arrayBuffer();
    if (response.status !== 503) return response.status;
  }
}

// Pictures of one colour, in the place of those at an address: what they do not cover is seen.
const kBlack = Buffer.from("iVBORw0KGgoAAAANSUhEUgAAAAgAAAAICAIAAABLbSncAAAADElEQVR42mNgGB4AAADIAAGTvaWOAAAAAElFTkSuQmCC", "base64");
export const make_black = (page, address) => page.route(address, (route) => route.fulfill({ contentType: "image/png", body: kBlack }));

// Whatever a developer would see in red in the browser's tools, and every request that leaves the server.
function collect_complaints(page, url) {
  const complaints = [];
  // The page stops listening when a build is over, and gives up tiles and pictures that others have taken the place of.
  const given_up = /\/events$|\/tiles\/|\/subtrees\/|\.png(\?|$)/;
  page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("requestfailed", (request) => {
    const why = request.failure()?.errorText;
    if (why !== "net::ERR_ABORTED" || !given_up.test(request.url())) complaints.push(`${request.url()}: ${why}`);
  });
  page.on("response", (response) => { if (response.status() >= 400) complaints.push(`${response.url()}: ${response.status()}`); });
  page.on("request", (request) => {
    if (!["data:", "blob:"].includes(new URL(request.url()).protocol) && !request.url().startsWith(url)) {
      complaints.push(`a request to somewhere else: ${request.url()}`);
    }
  });
  return complaints;
}

// Only the terrain, from the first frame on: what no test looks at takes most of the time in software. Globe and sky are two thirds
// of a frame. The table of what rough ground reflects takes seconds of a page's first one; one value in its place changes no colour by
// more than 1 of 255. And bars that move are drawn all the time. The page of cracks and places stays as people have it.
export const kTerrainAlone = { terrain_alone: true, reducedMotion: "reduce" };

function hide_what_is_around() {
  let viewer, scene = null;
  const seen_as_set = (of, name, get, set) => Object.defineProperty(of, name, { get, set, enumerable: true });
  seen_as_set(window, "cordillera", () => viewer, (made) => {
    viewer = made;
    window.Cesium.BrdfLutGenerator.prototype.update = function ({ context }) {
      const source = { width: 1, height: 1, arrayBufferView: new Uint8Array([255, 0, 0, 255]) };
      this._colorTexture ??= new window.Cesium.Texture({ context, source });
    };
    seen_as_set(viewer, "scene", () => scene, (shown) => {
      scene = shown;
      scene.msaaSamples = 1;
      for (const part of ["globe", "skyAtmosphere", "skyBox", "sun", "moon"]) if (scene[part]) scene[part].show = false;
    });
  });
}

// A page of the server, as soon as it stands. asked: the addresses of its requests, as they come.
export async function open_page(browser, url, how = {}) {
  const page = await new_page(browser, { viewport: { width: 450, height: 300 }, ...how });
  const complaints = collect_complaints(page, new URL(url).origin), asked = [];
  page.on("request", (request) => asked.push(request.url()));
  await page.goto(url);
  return { page, complaints, asked };
}

export async function open_dataset(browser, url, id, how = {}) {
  const opened = await open_page(browser, `${url}/?dataset=${id}`, how);
  await tiles_loaded(opened.page);
  return opened;
}

// Nothing of what a tileset puts off while a camera moves. Nor what software draws for long and no test looks at: more samples than one a
// pixel, and the scattered light of the sky, which takes three quarters of a frame.
function no_deferring() {
  const { scene, tileset } = window.cordillera;
  scene.msaaSamples = 1;
  scene.skyAtmosphere.show = false;
  scene.globe.showGroundAtmosphere = false;
  if (tileset) Object.assign(tileset, { cullRequestsWhileMoving: false, foveatedScreenSpaceError: false });
}

// What a frame asked for is taken up as the browser's own frames go by.
const kFramesBetween = 3;
export const some_frames = (page) => page.evaluate(async (count) => {
  for (let frame = 0; frame < count; ++frame) await new Promise((drawn) => requestAnimationFrame(drawn));
}, kFramesBetween);

// Which tiles are wanted does not depend on how many pixels a point has, but what a frame costs does.
const kCheap = 0.25;
const draw_at = (page, scale) => page.evaluate((wanted) => {
  const { widget } = window.cordillera;
  widget.resolutionScale = wanted;
  widget.resize();
}, scale);

// A picture that is laid on tiles which are loaded already takes frames, and CesiumJS draws nothing of such a tile meanwhile.
const pictures_are_laid = (page) => page.evaluate(() => window.cordillera.tileset._selectedTiles.every(({ content }) => content?._model?._modelImagery.ready ?? true));

// Loaded, and still so some frames later, the last of them with all pixels: a tileset learns what it lacks, and shows what it got, only as
// frames and moments go by. Fails with the page's own words.
export async function tiles_loaded(page) {
  await page.waitForFunction(() => window.cordillera?.scene);
  await page.evaluate(no_deferring);
  await page.waitForFunction(() => window.cordillera?.tileset || window.cordillera?.error);
  await page.evaluate(no_deferring);
  const whole = await page.evaluate(() => window.cordillera.widget.resolutionScale);
  await draw_at(page, kCheap * whole);
  const end = Date.now() + kPatience_ms;
  for (let quiet = 0; quiet < kQuietFrames;) {
    if (Date.now() > end) throw new Error("the viewer never has all of its tiles");
    if (quiet === kQuietFrames - 1) await draw_at(page, whole);
    const { error, loaded } = await page.evaluate(() => {
      window.cordillera.scene.requestRender();
      window.cordillera.scene.render();
      return { error: window.cordillera.error, loaded: window.cordillera.tilesLoaded };
    });
    if (error) throw new Error(`the viewer says: ${error}`);
    await some_frames(page);
    quiet = loaded && (await pictures_are_laid(page)) ? quiet + 1 : 0;
  }
}
