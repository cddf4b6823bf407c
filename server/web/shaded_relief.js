// The service's relief, shaded here: colours of a picture under shades of four lights, from the normal maps of tiles. A map has
// a normal for every cell of its tile, of heights two levels finer, so coarse tiles show relief that their triangles do not have.
// Lights, weights and shadows are those of the service's own picture (pipeline/faces/pictures/styles.cpp): both look alike.
const { CustomShader, LightingModel, UniformType } = window.Cesium;

export const shaded_relief = () => new CustomShader({
  lightingModel: LightingModel.UNLIT,
  uniforms: {
    u_exaggeration: { type: UniformType.FLOAT, value: 1 },
    u_finest_m: { type: UniformType.FLOAT, value: 0 },  // a cell of the finest level
    u_cells: { type: UniformType.FLOAT, value: 1 },  // a cell of what is drawn, in pixels of the screen
  },
  fragmentShaderText: `
    // A byte cannot say zero: level ground leans by half a step of the map.
    const float kLean = 1.0 / 255.0;
    // Next to a cliff's own normal every other is nothing.
    const float kLeastUp = 0.02;

    // Metres up a metre eastward and northward. Vertices have the ellipsoid's normal, and east as their tangent.
    vec2 rise_of(vec3 normal, vec3 up, vec3 tangent) {
      vec3 north = normalize(cross(up, tangent));
      vec2 rise = -vec2(dot(normal, cross(north, up)), dot(normal, north)) / max(dot(normal, up), kLeastUp);
      return rise - clamp(rise, -kLean, kLean);
    }

    // From the south-west, west, north-west and north, each as strong as the slope faces it or away from it. 1 on level ground.
    float shade_of(vec2 rise) {
      const float kHalf = 0.70710678;
      vec4 along = vec4(dot(rise, vec2(-kHalf)), -rise.x, dot(rise, vec2(-kHalf, kHalf)), rise.y);
      float square = dot(rise, rise);
      vec4 weight = square > 0.0 ? along * along / square : vec4(0.5);
      return dot(weight, max(1.0 - along, 0.0)) / (2.0 * sqrt(1.0 + square));
    }

    // Coarse heights are smooth and would look flat. The picture has a step for each zoom. Here it follows the distance: with a step
    // for each tile, tiles of two levels would differ where they meet.
    float steepening(vec3 position) {
      float cell_m = max(u_cells * czm_metersPerPixel(vec4(position, 1.0)), u_finest_m);
      return clamp(sqrt(cell_m / 25.0), 1.2, 8.0);
    }

    // Shadows take light away, blue last; what faces the light goes towards white.
    vec3 lit(vec3 colour, float shade) {
      vec3 dark = 1.0 - 0.62 * vec3(1.0, 0.96, 0.86) * (1.0 - min(shade, 1.0));
      return colour * dark + (1.0 - colour) * 0.55 * clamp(shade - 1.0, 0.0, 1.0);
    }

    void fragmentMain(FragmentInput fsInput, inout czm_modelMaterial material) {
      vec3 position = fsInput.attributes.positionEC;
      vec2 rise = rise_of(material.normalEC, fsInput.attributes.normalEC, fsInput.attributes.tangentEC);
      float shade = shade_of(rise * u_exaggeration * steepening(position));
      material.diffuse = czm_srgbToLinear(lit(czm_linearToSrgb(material.diffuse), shade));  // the picture's numbers are of sRGB
    }`,
});

const kCellsAcross = 256, kHalfAround_m = Math.PI * 6378137;
const kLeastError_m = 1e-3;  // of level ground
const kShare = 0.5;  // of the coarsest cell that the error allows: tiles are often finer

// To be called before each frame. Cells and stated errors grow alike from level to level, so the error that is asked for tells how
// large the cells are that are drawn.
export function follow_detail(shader, { level, stated_max_error: error_m }, error_px) {
  const finest_m = kHalfAround_m / kCellsAcross / 2 ** level;
  shader.setUniform("u_finest_m", finest_m);
  shader.setUniform("u_cells", (kShare * error_px * finest_m) / Math.max(error_m, kLeastError_m));
}
