// How terrain looks: one light from the north-west, as on a relief map, and a colour that follows the height.
const { Cartesian3, CustomShader, DirectionalLight, ImageBasedLighting, LightingModel, Math: CesiumMath, Matrix4, Transforms, UniformType } =
  window.Cesium;

const kLightAzimuth_deg = 315;
const kLightElevation_deg = 38;

// A sun that stands still over the dataset: the real one would leave half the world's datasets in the night.
export function relief_light(center) {
  const azimuth = CesiumMath.toRadians(kLightAzimuth_deg);
  const elevation = CesiumMath.toRadians(kLightElevation_deg);
  const towards_light = new Cartesian3(
    Math.sin(azimuth) * Math.cos(elevation), Math.cos(azimuth) * Math.cos(elevation), Math.sin(elevation));
  const frame = Transforms.eastNorthUpToFixedFrame(center);
  const direction = Cartesian3.negate(Matrix4.multiplyByPointAsVector(frame, towards_light, new Cartesian3()), new Cartesian3());
  return new DirectionalLight({ direction, intensity: 3.0 });
}

// Plain ambient light: the sky reflections that Cesium would otherwise compute cost more than the terrain and wash it out.
export function plain_ambient() {
  const grey = new Cartesian3(0.20, 0.22, 0.26);
  const none = Cartesian3.ZERO;
  return new ImageBasedLighting({ sphericalHarmonicCoefficients: [grey, none, none, none, none, none, none, none, none] });
}

// Pictures that have their shades already: no light of ours on top.
export const as_drawn = () => new CustomShader({ lightingModel: LightingModel.UNLIT });

// From the lowest to the highest, as the shader below mixes them: share of the range, colour, the share where the mixing begins.
const kTints = [[0, [0.22, 0.36, 0.20]], [0.40, [0.60, 0.53, 0.33], 0], [0.75, [0.43, 0.34, 0.28], 0.40], [1, [0.95, 0.95, 0.96], 0.80]];
const vec3 = ([red, green, blue]) => `vec3(${red.toFixed(2)}, ${green.toFixed(2)}, ${blue.toFixed(2)})`;
const kTintOfShare = kTints.map(([end, colour, begin]) => (begin === undefined ? `vec3 colour = ${vec3(colour)};` :
  `colour = mix(colour, ${vec3(colour)}, smoothstep(${begin.toFixed(2)}, ${end.toFixed(2)}, share));`)).join("\n        ");

// The same for a legend, as stops of heights: what the screen shows of these numbers, without light.
const on_screen = (colour) => `#${colour.map((channel) => Math.round(255 * channel ** (1 / 2.2)).toString(16).padStart(2, "0")).join("")}`;
export const tint_stops = (low_m, high_m) => [...kTints.map(([share, colour]) => [share, colour]), [0.80, kTints[2][1]]].sort(([a], [b]) => a - b)
  .map(([share, colour]) => [low_m + share * Math.max(high_m - low_m, 1), on_screen(colour)]);

// The height is computed from the position relative to the camera: 32-bit world coordinates only know half metres, which shows as
// bands on low terrain. A sphere through the camera's own height is right within metres as far as a camera sees detail.
export function height_tint(min_height_m, max_height_m) {
  return new CustomShader({
    uniforms: {
      u_camera_up: { type: UniformType.VEC3, value: new Cartesian3(0, 0, 1) },
      u_camera_height: { type: UniformType.FLOAT, value: 0 },
      u_low: { type: UniformType.FLOAT, value: min_height_m },
      u_through: { type: UniformType.FLOAT, value: 0 },  // how much of a picture on the terrain is seen
      u_range: { type: UniformType.FLOAT, value: Math.max(max_height_m - min_height_m, 1) },
    },
    fragmentShaderText: `
      float height_above_ellipsoid(vec3 position) {
        vec3 up = normalize(czm_viewRotation3D * u_camera_up);
        float rise = dot(position, up);
        float across = dot(position, position) - rise * rise;
        float radius = 6371000.0 + u_camera_height + rise;
        return u_camera_height + rise + across / (sqrt(radius * radius + across) + radius);
      }
      vec3 tint(float share) {
        ${kTintOfShare}
        return colour;
      }
      void fragmentMain(FragmentInput fsInput, inout czm_modelMaterial material) {
        float share = (height_above_ellipsoid(fsInput.attributes.positionEC) - u_low) / u_range;
        material.diffuse = mix(tint(clamp(share, 0.0, 1.0)), material.diffuse, u_through);
      }`,
  });
}

// To be called before each frame: the shader cannot know where the camera is on the globe.
export function follow_camera(shader, camera, ellipsoid) {
  shader.setUniform("u_camera_up", ellipsoid.geodeticSurfaceNormal(camera.positionWC, new Cartesian3()));
  shader.setUniform("u_camera_height", camera.positionCartographic.height);
}
