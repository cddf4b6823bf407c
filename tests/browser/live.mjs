// A dataset that is being built: provisional tiles first, the final ones in their place, without a flash and without a flight.
import assert from "node:assert/strict";

import { open_dataset, tiles_loaded } from "./browser.mjs";
import { kTiny } from "./controls.mjs";
import { look_straight_down, set_background } from "./views.mjs";

// Looks at the middle of every frame as it is drawn: is it the background's magenta?
export const watch_frames = (page) => page.evaluate(() => {
  const { scene } = window.cordillera, seen = (window.seen = { frames: 0, bare: 0 }), gl = scene.canvas.getContext("webgl2");
  scene.postRender.addEventListener(() => {
    const pixel = new Uint8Array(4);
    gl.readPixels(scene.canvas.width / 2, scene.canvas.height / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    ++seen.frames;
    if (pixel[0] - pixel[1] > 60 && pixel[2] - pixel[1] > 60) ++seen.bare;
  });
});
export const seen = (page) => page.evaluate(() => window.seen);
export const draw = (page) => page.evaluate(() => { window.cordillera.scene.requestRender(); window.cordillera.scene.render(); });

const view_of = (page) => page.evaluate(() => {
  const { position, direction, up } = window.cordillera.scene.camera, { tileset, manifest, looks } = window.cordillera;
  window.tilesets = [...(window.tilesets ?? []), tileset];
  return { camera: [position, direction, up].map(({ x, y, z }) => [x, y, z]), finest: manifest.max_level, drawn: looks.look };
});

// job: the process that builds it, which was stopped when its first tiles stood.
export async function try_live(browser, url, id, job) {
  const { page, complaints } = await open_dataset(browser, url, id, kTiny);
  assert.equal(await page.evaluate(() => window.cordillera.manifest.provisional), true, "the build is over already");
  assert.match(await page.textContent("#message"), /first look/);
  const facts = await page.textContent("#facts");
  assert.match(facts, / · first look: [\d,]+ triangles in /);
  assert.doesNotMatch(facts, / off the raster’s pixels|farther from the finest level/, "an error of a first look is stated");
  const errors = await page.$$eval("#levels tr", (rows) => rows.map(({ cells }) => cells[3].textContent));
  assert.deepEqual(new Set(errors), new Set(["not known yet"]), "an error of provisional tiles is stated");
  await set_background(page, "#ff00ff");
  await look_straight_down(page, { share: 0.6, error_px: 2 });
  await watch_frames(page);
  await draw(page);
  const { width, height } = page.viewportSize();
  await page.mouse.move(width / 2, height / 2);
  await page.waitForFunction(() => /^error not known yet \(level \d+\)$/.test(document.getElementById("place-error").textContent));
  const before = await view_of(page);
  const first = await seen(page);  // the page draws frames of its own, too: at least one was looked at
  assert.ok(first.frames > 0);
  assert.equal(first.bare, 0);

  process.kill(job, "SIGCONT");
  await page.waitForFunction(() => window.cordillera.manifest.provisional === false);
  await tiles_loaded(page);
  const after = await view_of(page), { frames, bare } = await seen(page);
  assert.equal(bare, 0, `the background was seen in ${bare} of ${frames} frames`);
  assert.ok(frames > first.frames && after.finest > before.finest, "no finer tiles came");
  assert.deepEqual(after.camera, before.camera, "the camera moved");
  assert.deepEqual([before.drawn, after.drawn], ["height", "relief"], "pictures are of final tiles");
  assert.ok(await page.evaluate(() => {
    const { primitives } = window.cordillera.scene, all = Array.from({ length: primitives.length }, (_, k) => primitives.get(k));
    return window.tilesets[0].isDestroyed() && all.filter((one) => one instanceof window.Cesium.Cesium3DTileset).length === 1;
  }), "the first tiles are still there");
  assert.equal(await page.textContent("#message"), "");

  await page.evaluate(() => { window.cordillera.tileset.show = false; });
  await draw(page);
  assert.ok((await seen(page)).bare > 0, "a frame without terrain is not noticed (control)");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}
