// Pictures of the viewer for the documents: node pictures.mjs --chromium PATH --url URL --dataset ID --empty URL --pictures FOLDER [--only NAME]
import { writeFileSync } from "node:fs";
import { parseArgs } from "node:util";

import { moving_picture } from "./moving_picture.mjs";
import { open_page, some_frames, tiles_loaded, with_browser } from "./browser.mjs";

const names = ["chromium", "url", "dataset", "empty", "pictures", "only"];
const { values: given } = parseArgs({ options: Object.fromEntries(names.map((name) => [name, { type: "string" }])) });

const kQuality = 82;
const kDesk = { viewport: { width: 1440, height: 900 } };
const kPhone = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };
// The Presidential Range from the south-west.
const kRange = "#-71.52,44.06,6200,40,-17";

const kPictures = {
  "desk-dark": { how: { ...kDesk, colorScheme: "dark" }, hover: [860, 520] },
  "desk-light": { how: { ...kDesk, colorScheme: "light" }, query: "&look=slope" },
  "phone-light": { how: { ...kPhone, colorScheme: "light" }, tap: [190, 400] },
  "phone-dark": { how: { ...kPhone, colorScheme: "dark" }, query: "&detail=0", camera: kRange, unfold: true },
  welcome: { how: { ...kDesk, colorScheme: "dark" }, empty: true },
};

// Which tiles are wanted does not depend on how many pixels a point has, but what a frame costs does.
const kCheap = 0.125;
const draw_with = (page, pixels_a_point) => page.evaluate((wanted) => {
  window.cordillera.widget.resolutionScale = wanted / window.devicePixelRatio;
  window.cordillera.widget.resize();
}, pixels_a_point);

// What tests leave out, because it takes long in software.
const as_people_see_it = (page) => page.evaluate(() => {
  const { scene } = window.cordillera;
  scene.msaaSamples = 4;
  scene.skyAtmosphere.show = scene.globe.showGroundAtmosphere = true;
});

const is_wanted = (name) => !given.only || given.only.split(",").includes(name);

// The backdrop, which a tileset does not wait for.
const globe_loaded = async (page) => {
  while (!(await page.evaluate(() => {
    const { scene } = window.cordillera;
    scene.requestRender();
    scene.render();
    return scene.globe.tilesLoaded;
  }))) await some_frames(page);
};

async function take(browser, name, { how, query = "", camera = "", empty, hover, tap, unfold }) {
  const { page, complaints } = await open_page(browser, empty ? given.empty : `${given.url}/?dataset=${given.dataset}${query}${camera}`, how);
  await page.waitForFunction((none) => window.cordillera?.error || (none ? !document.getElementById("welcome").hidden : window.cordillera?.tileset), Boolean(empty));
  await draw_with(page, kCheap);
  if (!empty) await tiles_loaded(page);
  await globe_loaded(page);
  await as_people_see_it(page);
  await draw_with(page, how.deviceScaleFactor ?? 1);
  await globe_loaded(page);
  if (hover) await page.mouse.move(...hover);
  if (tap) await page.touchscreen.tap(...tap);
  if (hover || tap) await page.waitForFunction(() => document.getElementById("sea-height").textContent !== "");
  if (unfold) await page.tap("#fold");
  await page.screenshot({ path: `${given.pictures}/${name}.jpg`, type: "jpeg", quality: kQuality });
  if (complaints.length > 0) throw new Error(`${name}: ${complaints.join("; ")}`);
  await page.close();
  console.log(name);
}

// Once around the data, as a WebP.
const kAround = { width: 560, height: 315, frames: 48, frame_ms: 100, quality: 0.6 };
const still_of = (page, png, quality) => page.evaluate(async ({ base64, wanted }) => {
  const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
  const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height });
  canvas.getContext("2d").drawImage(image, 0, 0);
  return canvas.toDataURL("image/webp", wanted).split(",")[1];
}, { base64: png.toString("base64"), wanted: quality });

async function take_around(browser) {
  const { width, height, frames, quality } = kAround, stills = [];
  const { page, complaints } = await open_page(browser, `${given.url}/?dataset=${given.dataset}`, { viewport: { width, height } });
  await tiles_loaded(page);
  await page.addStyleTag({ content: "#panel, #tools, #foot, .cesium-widget-credits { display: none !important; }" });
  for (let k = 0; k < frames; ++k) {
    await page.evaluate((share) => {
      const { scene, manifest: { bounds: [west, south, east, north, low, high] } } = window.cordillera, { Cesium } = window;
      const sphere = Cesium.BoundingSphere.fromRectangle3D(Cesium.Rectangle.fromDegrees(west, south, east, north), Cesium.Ellipsoid.WGS84, (low + high) / 2);
      scene.camera.lookAt(sphere.center, new Cesium.HeadingPitchRange(2 * Math.PI * share, -0.42, 0.95 * sphere.radius));
    }, k / frames);
    await tiles_loaded(page);
    await globe_loaded(page);
    stills.push(Buffer.from(await still_of(page, await page.screenshot(), quality), "base64"));
  }
  if (complaints.length > 0) throw new Error(complaints.join("; "));
  writeFileSync(`${given.pictures}/around.webp`, moving_picture(stills, kAround));
  await page.close();
  console.log("around");
}

await with_browser(given.chromium, async (browser) => {
  for (const [name, picture] of Object.entries(kPictures)) {
    if (is_wanted(name)) await take(browser, name, picture);
  }
  if (is_wanted("around")) await take_around(browser);
});
