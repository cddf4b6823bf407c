// Where the camera is put, and what is seen when one picture takes the place of another.
import assert from "node:assert/strict";

import { make_black, new_page, some_frames, tiles_loaded } from "./browser.mjs";
import { draw, seen, watch_frames } from "./live.mjs";
import { crack_share, darkest_below_mean, lightest_above_mean, look_straight_down, luminance_deviation, mean_colour } from "./views.mjs";

const shown = (page, id) => page.waitForFunction((wanted) => window.cordillera.id === wanted && document.getElementById("datasets").value === wanted, id);

// A flat raster across the antimeridian has one colour on both sides. The page shows another one before.
export async function try_antimeridian(page, before, across) {
  await page.evaluate(() => {
    document.getElementById("panel").hidden = false;
    window.cordillera.scene.backgroundColor = window.Cesium.Color.MAGENTA;
  });
  const choose = (list, value) => page.selectOption(list, value, { force: true });  // the panel is folded
  await choose("#look", "slope");  // and before its pictures are there
  await choose("#datasets", across);
  await shown(page, across);
  await look_straight_down(page, { share: 0.7, error_px: 0.5 });
  assert.equal(await crack_share(page), 0);
  assert.ok((await luminance_deviation(page)) < 1, "the two sides of the antimeridian differ");
  // With several samples a pixel, as people have it, and rims of tiles askew to pixels.
  const samples = (count) => page.evaluate((wanted) => { window.cordillera.scene.msaaSamples = wanted; }, count);
  await samples(4);
  await look_straight_down(page, { share: 0.4, error_px: 0.5, heading: 0.3 });
  assert.ok((await darkest_below_mean(page)) < 4, "the rims of tiles have no picture");
  await samples(1);

  await watch_frames(page);
  await choose("#look", "hillshade");
  await tiles_loaded(page);
  const { frames, bare } = await seen(page);
  assert.ok(frames > 0 && bare === 0, `without terrain: ${bare} of ${frames} frames`);
  await page.evaluate(() => { window.cordillera.tileset.show = false; });
  await draw(page);
  assert.ok((await seen(page)).bare > 0, "a frame without terrain is not noticed (control)");
  await page.goBack();
  await shown(page, before);
}

// Pictures reach the rims of tiles on the page for CesiumJS, too, which is looked at as the viewer is. Rims lie askew to pixels.
export async function try_rims_of_demo(browser, url, id) {
  const page = await new_page(browser, { viewport: { width: 160, height: 120 } });  // sky and globe are drawn all the time
  await make_black(page, "**/relief/**");
  await page.goto(`${url}/v1/datasets/${id}/demo/cesium.html`);
  await page.waitForFunction(() => globalThis.demo);
  await page.evaluate(async (manifest) => {
    const { widget } = globalThis.demo, { scene } = widget;
    scene.globe.show = false;  // it takes most of the time
    const all = Array.from({ length: scene.primitives.length }, (_, k) => scene.primitives.get(k));
    const tileset = all.find((one) => one instanceof window.Cesium.Cesium3DTileset);
    window.cordillera = { widget, scene, tileset, manifest: await (await fetch(manifest)).json(), error: null, get tilesLoaded() { return tileset.tilesLoaded; } };
  }, `${url}/v1/datasets/${id}/manifest.json`);
  const samples = await page.evaluate(() => window.cordillera.scene.msaaSamples);
  assert.ok(samples > 1, "it has one sample a pixel");
  await look_straight_down(page, { share: 0.7, error_px: 0.5, heading: 0.3 });
  await page.evaluate((count) => { window.cordillera.scene.msaaSamples = count; }, samples);
  assert.ok((await mean_colour(page)).every((channel) => channel < 4), "there are no pictures");
  assert.ok((await lightest_above_mean(page)) < 4, "the rims of tiles have no picture");
  await page.close();
}

// Where in the window the corners of the data's box are, -1 to 1.
const corners_of = (page) => page.evaluate(() => {
  const { scene, manifest: { bounds: [west, south, east, north, low, high] } } = window.cordillera, { Cartesian3, Matrix4 } = window.Cesium;
  const { viewMatrix, frustum: { projectionMatrix } } = scene.camera, view = Matrix4.multiply(projectionMatrix, viewMatrix, new Matrix4());
  return [west, east].flatMap((lon) => [south, north].flatMap((lat) => [low, high].map((height) => {
    const { x, y, z } = Cartesian3.fromDegrees(lon, lat, height * scene.verticalExaggeration);
    const [a, b, , w] = [0, 1, 2, 3].map((row) => view[row] * x + view[row + 4] * y + view[row + 8] * z + view[row + 12]);
    return [a / w, b / w];
  })));
});

// The tools stand in the window's corner: where it begins, in the same measure.
const corner_of = (page) => page.evaluate(() => {
  const { left, bottom } = document.getElementById("tools").getBoundingClientRect();
  return [(2 * left) / window.innerWidth - 1, 1 - (2 * bottom) / window.innerHeight];
});

// All of it is in the window, and none of it under the tools.
async function assert_framed(page, what) {
  const [end, ceiling] = await corner_of(page), corners = await corners_of(page);
  const [[left, right], [bottom, top]] = [0, 1].map((axis) => [Math.min, Math.max].map((of) => of(...corners.map((corner) => corner[axis]))));
  const box = `${what}: ${[left, right, bottom, top]}`;
  assert.ok(left >= -1 && right <= 1 && bottom >= -1 && top <= 1, `the data is cut off: ${box}`);
  assert.ok(corners.every(([x, y]) => x <= end || y <= ceiling), `the data lies under the tools: ${box}`);
  const beside = right <= end && Math.abs(left + right) > 0.1, below = top <= ceiling && Math.abs(top + bottom) > 0.1;
  const [east, north] = [beside ? end : 1, below ? ceiling : 1];
  assert.ok(right - left > 0.9 * (east + 1) || top - bottom > 0.9 * (north + 1), `the window is not filled: ${box}`);
  assert.ok(Math.abs(left + right - (east - 1)) < 0.1 && Math.abs(top + bottom - (north - 1)) < 0.1, `the data is not in the middle: ${box}`);
}

export async function try_frame(page) {
  const before = page.viewportSize();
  for (const [width, height] of [[900, 450], [360, 640], [before.width, before.height]]) {  // tools in a row, two columns
    await page.setViewportSize({ width, height });
    await some_frames(page);
    for (const factor of ["5", "1"]) {
      await page.evaluate((value) => {
        const slider = document.getElementById("exaggeration");
        slider.value = value;
        slider.dispatchEvent(new Event("input"));
        document.getElementById("home").click();
      }, factor);
      await assert_framed(page, `${width} x ${height}, heights x ${factor}`);
    }
  }
  await tiles_loaded(page);
  const above = await page.evaluate(() => {
    const { scene, tileset, manifest: { bounds: [west, south, east, north] } } = window.cordillera, { Cartesian3, Cartographic, Math: CesiumMath, Ray } = window.Cesium;
    const place = [(west + east) / 2, (south + north) / 2];
    scene.camera.setView({ destination: Cartesian3.fromDegrees(...place, 5), orientation: { heading: 0, pitch: 0, roll: 0 } });
    scene.requestRender();
    scene.render();
    const origin = Cartesian3.fromDegrees(...place, 20000), direction = Cartesian3.normalize(Cartesian3.negate(origin, new Cartesian3()), new Cartesian3());
    const ground = Cartographic.fromCartesian(tileset.pick(new Ray(origin, direction), scene.frameState, new Cartesian3())).height;
    return scene.camera.positionCartographic.height - ground;
  });
  assert.ok(above > 0 && above < 60, `the camera is ${above} m above the ground`);  // the ray is not upright
  await page.click("#home");
}

// Sixty metres above ground that lies at 500 m: a distance on this ground, and not on the ellipsoid far below it, is what the bar says.
export async function try_scale(page) {
  const metres_a_pixel = await page.evaluate(() => {
    const { scene, tileset, manifest: { bounds: [west, south, east, north, , high] } } = window.cordillera, { Cartesian2, Cartesian3 } = window.Cesium;
    scene.camera.setView({ destination: Cartesian3.fromDegrees((west + east) / 2, (south + north) / 2, high + 60), orientation: { heading: 0, pitch: -Math.PI / 2, roll: 0 } });
    scene.requestRender();
    scene.render();
    const { clientWidth, clientHeight } = scene.canvas, kAcross_px = 40;
    const at = (dx) => tileset.pick(scene.camera.getPickRay(new Cartesian2(clientWidth / 2 + dx, clientHeight / 2)), scene.frameState, new Cartesian3());
    return Cartesian3.distance(at(-kAcross_px / 2), at(kAcross_px / 2)) / kAcross_px;
  });
  await page.waitForFunction((wanted) => {
    const [length, unit] = document.getElementById("scale-words").textContent.split(" "), pixels = parseFloat(document.getElementById("scale-bar").style.width);
    return unit === "m" && Math.abs(parseFloat(length) / pixels / wanted - 1) < 0.05;
  }, metres_a_pixel);
}

// All that dragging does is done by single clicks, too: turns and tilts by buttons, and a place comes to the middle by a double click.
export async function try_turns(page) {
  // The Earth is round: between the camera and what it looks at, up differs by a degree.
  const assert_looks = async (heading, pitch, within = 0.1) => {
    const found = await page.evaluate(() => {
      const { camera } = window.cordillera.scene, { Math: CesiumMath } = window.Cesium;
      return [CesiumMath.negativePiToPi(camera.heading), camera.pitch].map(CesiumMath.toDegrees);
    });
    assert.ok(Math.abs(found[0] - heading) < 1.5 && Math.abs(found[1] - pitch) < within, `heading ${found[0]}, pitch ${found[1]} in place of ${heading} and ${pitch}`);
    return found[1];
  };
  await page.click("#home");
  await page.click("#north");
  const from_side = await assert_looks(0, -20, 10);
  await page.click("#north");
  await assert_looks(90, from_side);
  await page.click("#north");
  await assert_looks(0, from_side);
  await page.click("#tilt");
  await assert_looks(0, -90);
  await page.click("#tilt");
  await assert_looks(0, -38, 1.5);

  await look_straight_down(page, { share: 0.7, error_px: 2 });
  const place_at = (across, down) => page.evaluate(([u, v]) => {
    const { scene: { camera, canvas, frameState }, tileset } = window.cordillera, { Cartesian2, Cartographic, Cartesian3 } = window.Cesium;
    const hit = tileset.pick(camera.getPickRay(new Cartesian2(u * canvas.clientWidth, v * canvas.clientHeight)), frameState, new Cartesian3());
    const { longitude, latitude } = Cartographic.fromCartesian(hit);
    return { longitude, latitude, distance: Cartesian3.distance(camera.positionWC, hit) };
  }, [across, down]);
  const aside = await place_at(0.6, 0.4), { width, height } = page.viewportSize();
  await page.mouse.dblclick(0.6 * width, 0.4 * height);
  const now = await place_at(0.5, 0.5);
  for (const axis of ["longitude", "latitude"]) assert.ok(Math.abs(now[axis] - aside[axis]) < 1e-5, `${axis}: another place is in the middle`);
  assert.ok(now.distance < 0.7 * aside.distance, "the camera is no nearer");
  await page.click("#home");
}
