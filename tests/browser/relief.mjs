// The relief that is shaded here, where tiles have normal maps, as the service's own picture has it; that picture itself where they have none.
import assert from "node:assert/strict";

import { open_dataset, tiles_loaded } from "./browser.mjs";
import { kTiny } from "./controls.mjs";
import { look_straight_down } from "./views.mjs";

// Few triangles: what is seen of the relief is from the normal maps.
const kCoarse_px = 8;
// The picture has a step of contrast and of detail for each zoom, so shades are never the same.
const kLeastCorrelation = 0.5;

// The terrain alone, from above, in the middle of the data: light of every pixel, 0 to 255.
const lights = (page) => page.evaluate(() => {
  const { scene } = window.cordillera;
  scene.requestRender();
  scene.render();
  const flat = document.createElement("canvas");
  [flat.width, flat.height] = [scene.canvas.width, scene.canvas.height];
  const context = flat.getContext("2d");
  context.drawImage(scene.canvas, 0, 0);
  const { data } = context.getImageData(0, 0, flat.width, flat.height);
  return Array.from({ length: data.length / 4 }, (_, k) => 0.2126 * data[4 * k] + 0.7152 * data[4 * k + 1] + 0.0722 * data[4 * k + 2]);
});

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
const without_mean = (values) => { const middle = mean(values); return values.map((value) => value - middle); };
const spread = (values) => Math.sqrt(mean(without_mean(values).map((value) => value * value)));
function correlation(a, b) {
  const [x, y] = [without_mean(a), without_mean(b)];
  return mean(x.map((value, k) => value * y[k])) / (spread(a) * spread(b));
}

// Which normals were asked for with tiles, null for those that they have, and which pictures.
function kinds(asked) {
  const picture = (url) => /\/v1\/datasets\/[^/]+\/([a-z-]+)\/\d+\/\d+\/\d+\.png/.exec(url)?.[1];
  return {
    tiles: [...new Set(asked.filter((url) => url.includes(".glb")).map((url) => new URL(url).searchParams.get("normals")))],
    pictures: [...new Set(asked.map(picture).filter(Boolean))],
  };
}

const kShaded = "shaded-relief";

// Other tiles, or other pictures, of another look; they take the place of those that are seen when they are there.
async function choose(page, look, error) {
  await page.selectOption("#look", look, { force: true });
  await page.waitForFunction(([wanted, text]) => window.cordillera.looks.look === wanted && document.querySelector("#detail-value").textContent === text, [look, error]);
  await tiles_loaded(page);
}

export async function try_relief(browser, url, id) {
  const { page, complaints, asked } = await open_dataset(browser, url, id, kTiny);
  assert.deepEqual(kinds(asked), { tiles: [null], pictures: ["relief"] }, "the first look");
  asked.length = 0;
  await choose(page, kShaded, "1 px");
  assert.deepEqual(kinds(asked), { tiles: ["texture"], pictures: ["color-relief"] });
  await choose(page, "slope", "0.5 px");  // a picture on tiles is as fine as they are
  await choose(page, kShaded, "1 px");
  assert.equal(await page.getAttribute("#legend", "hidden"), null, "nothing says what the colours mean");
  await look_straight_down(page, { share: 0.5, error_px: kCoarse_px });

  const show = async (what) => {
    await page.evaluate(what);
    await tiles_loaded(page);
    return lights(page);
  };
  const shaded = await lights(page);
  const steeper = await show(() => window.cordillera.looks.shaded.setUniform("u_exaggeration", 2));
  const level = await show(() => window.cordillera.looks.shaded.setUniform("u_exaggeration", 0));
  const turned = await show(() => window.cordillera.looks.shaded.setUniform("u_exaggeration", -1));
  const pictured = await show(() => {
    const { looks } = window.cordillera;
    looks.normal_maps = false;
    return looks.show("shaded-relief");
  });
  const shades = ([...seen]) => seen.map((light, k) => light / Math.max(level[k], 1));
  const [alike, opposite] = [shaded, turned].map((seen) => correlation(shades(seen), shades(pictured)));
  const [once, twice, wanted] = [shaded, steeper, pictured].map((seen) => spread(shades(seen)));
  console.log(`    shades correlate by ${alike.toFixed(2)} with the service's picture, by ${opposite.toFixed(2)} with the lights on the other side; ` +
    `they spread by ${once.toFixed(3)}, by ${twice.toFixed(3)} where heights are doubled, the picture's by ${wanted.toFixed(3)}`);
  assert.ok(alike >= kLeastCorrelation, `shades correlate by ${alike.toFixed(2)} with those of the service's picture`);
  assert.ok(opposite < 0, `with the lights on the other side they correlate by ${opposite.toFixed(2)} (control)`);
  assert.ok(twice > 1.2 * once, "doubled heights have no stronger shades");
  assert.ok(once > 0.5 * wanted && once < 2 * wanted, "shades are much stronger or weaker than the picture's");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// A folder of finished tiles answers ?normals=texture with what it has: its relief is the picture.
export async function try_relief_of_folder(browser, url, id) {
  const { page, complaints, asked } = await open_dataset(browser, url, `${id}&look=${kShaded}`, kTiny);
  assert.deepEqual(kinds(asked), { tiles: [null], pictures: ["relief"] });
  assert.equal(await page.textContent("#detail-value"), "0.5 px");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}
