// What the tests do with the scene, and what they measure in its picture.
import { tiles_loaded } from "./browser.mjs";

// Nothing but the tileset in front of one colour; the tiles' own material instead of the tint.
export function set_background(page, colour) {
  return page.evaluate((css) => {
    const { scene, tileset } = window.cordillera;
    tileset.customShader = undefined;
    tileset.imageryLayers.removeAll();
    scene.globe.show = false;
    scene.skyAtmosphere.show = false;
    for (const part of ["skyBox", "sun", "moon"]) if (scene[part]) scene[part].show = false;
    scene.backgroundColor = window.Cesium.Color.fromCssColorString(css);
    document.getElementById("panel").hidden = true;
  }, colour);
}

// The camera over the data's centre, looking down, so that the picture's height covers a share of the data's extent.
export async function look_straight_down(page, { share, error_px, heading = 0 }) {
  await page.evaluate(({ share, error_px, heading }) => {
    const { scene, tileset, manifest } = window.cordillera;
    const { Cartesian3, Math: CesiumMath } = window.Cesium;
    const [west, south, to, north, , max_height] = manifest.bounds, east = to < west ? to + 360 : to;
    const longitude = (west + east) / 2;
    const latitude = (south + north) / 2;
    const metres_a_degree = 111000;
    const across_m = Math.min((north - south) * metres_a_degree, (east - west) * metres_a_degree * Math.cos(CesiumMath.toRadians(latitude)));
    const { fovy, aspectRatio } = scene.camera.frustum;
    // The wider side of the picture must stay on the data as well.
    const range_m = (share * across_m) / aspectRatio / 2 / Math.tan(fovy / 2);
    tileset.maximumScreenSpaceError = error_px;
    tileset.cullRequestsWhileMoving = false;
    scene.camera.setView({
      destination: Cartesian3.fromDegrees(longitude, latitude, max_height + range_m),
      orientation: { heading, pitch: -CesiumMath.PI_OVER_TWO, roll: 0 },
    });
  }, { share, error_px, heading });
  await tiles_loaded(page);
}

// Every tile of the finest level under the whole data: the screen-space error asked for cannot be met by any other.
export async function load_everything(page) {
  await look_straight_down(page, { share: 2.2, error_px: 0.001 });
  await page.waitForFunction(() => {
    const { tileset, manifest } = window.cordillera;
    return tileset.statistics.selected === manifest.levels[0].tiles;
  });
}

// The picture of this very frame: the drawing buffer is gone once the frame is shown.
function measure(page, kind) {
  return page.evaluate((wanted) => {
    const { scene } = window.cordillera;
    scene.requestRender();
    scene.render();
    const flat = document.createElement("canvas");
    flat.width = scene.canvas.width;
    flat.height = scene.canvas.height;
    const context = flat.getContext("2d");
    context.drawImage(scene.canvas, 0, 0);
    const { data } = context.getImageData(0, 0, flat.width, flat.height);
    let magenta = 0, sum = 0, squares = 0, darkest = 255, lightest = 0;
    const pixels = data.length / 4;
    for (let i = 0; i < data.length; i += 4) {
      const [red, green, blue] = [data[i], data[i + 1], data[i + 2]];
      if (red - green > 60 && blue - green > 60) ++magenta;
      const light = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
      sum += light;
      squares += light * light;
      darkest = Math.min(darkest, light);
      lightest = Math.max(lightest, light);
    }
    const mean = sum / pixels;
    if (wanted === "colour") return [0, 1, 2].map((k) => data.reduce((total, value, i) => (i % 4 === k ? total + value : total), 0) / pixels);
    if (wanted === "darkest") return mean - darkest;
    if (wanted === "lightest") return lightest - mean;
    return wanted === "cracks" ? magenta / pixels : Math.sqrt(Math.max(squares / pixels - mean * mean, 0));
  }, kind);
}
export const mean_colour = (page) => measure(page, "colour");
export const crack_share = (page) => measure(page, "cracks");
export const darkest_below_mean = (page) => measure(page, "darkest");
export const lightest_above_mean = (page) => measure(page, "lightest");
export const luminance_deviation = (page) => measure(page, "luminance");

// Ellipsoidal heights of the loaded surface, by intersecting its triangles with the ellipsoid's normal; null where there is none.
// The tileset's own getHeight looks towards the Earth's centre, which is metres to the side on a mountain.
export function heights_at(page, places) {
  return page.evaluate((all) => {
    const { scene, tileset } = window.cordillera;
    const { Cartesian3, Cartographic, Ellipsoid, Ray } = window.Cesium;
    return all.map(({ lon, lat }) => {
      const above = Cartesian3.fromDegrees(lon, lat, 20000);
      const down = Cartesian3.negate(Ellipsoid.WGS84.geodeticSurfaceNormal(above, new Cartesian3()), new Cartesian3());
      const hit = tileset.pick(new Ray(above, down), scene.frameState, new Cartesian3());
      return hit ? Cartographic.fromCartesian(hit).height : null;
    });
  }, places);
}
