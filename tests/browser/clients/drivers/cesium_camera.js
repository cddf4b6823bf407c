// What both CesiumJS drivers do with a scene.
import { Cartesian3, Color, Math as CesiumMath } from "cesium";

// What software draws for long and no test looks at: the scattered light of the sky, three quarters of a frame, the sun's glow, several
// samples a pixel, and frames that nobody asked for: they take the processor from the workers that decode tiles.
export function draw_little(scene) {
  scene.msaaSamples = 1;
  scene.requestRenderMode = true;
  scene.maximumRenderTimeChange = Infinity;
  for (const part of ["skyBox", "skyAtmosphere", "sun", "moon"]) if (scene[part]) scene[part].show = false;
  if (scene.globe) scene.globe.showGroundAtmosphere = false;
}

// Nothing but terrain in front of one colour.
export function set_background(scene, css) {
  scene.backgroundColor = Color.fromCssColorString(css);
  for (const part of ["skyBox", "skyAtmosphere", "sun", "moon"]) if (scene[part]) scene[part].show = false;
}

// From above the middle of the bounds, so that the picture's height covers a share of their north-south extent.
export function look_down(camera, { bounds: [west, south, east, north, , top], share }) {
  const across_m = share * (north - south) * 111000;
  const range_m = across_m / 2 / Math.tan(camera.frustum.fovy / 2);
  camera.setView({
    destination: Cartesian3.fromDegrees((west + east) / 2, (south + north) / 2, top + range_m),
    orientation: { heading: 0, pitch: -CesiumMath.PI_OVER_TWO, roll: 0 },
  });
}
