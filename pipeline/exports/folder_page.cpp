#include "pipeline/exports/folder_page.h"

#include <string_view>

#include "pipeline/tileset/html_text.h"

namespace cordillera::pipeline {
namespace {

// @TITLE@ and @ATTRIBUTION@ stand for the dataset's own. Heights are coloured on the GPU, from the position relative to the
// camera: 32-bit world coordinates know half metres only.
constexpr std::string_view kPage = R"html(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<title>@TITLE@</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" crossorigin="anonymous"
      href="https://cdn.jsdelivr.net/npm/cesium@1.145.0/Build/Cesium/Widgets/CesiumWidget/CesiumWidget.css"
      integrity="sha384-8Ks1t6G4x11950+T9lShhZ+d7qPxFg7sKXBwCy2LkRyHdWx4yD09qB3IiwGexpvZ">
<script>window.CESIUM_BASE_URL = "https://cdn.jsdelivr.net/npm/cesium@1.145.0/Build/Cesium/";</script>
<script src="https://cdn.jsdelivr.net/npm/cesium@1.145.0/Build/Cesium/Cesium.js" crossorigin="anonymous"
        integrity="sha384-D1oR8FyBDsJWkPeydGJTh8nJg5/++9sqchzJuu+oGQPmgbwu3aJmoVj3BTowr6t6"></script>
<style>
html, body, #map, #map .cesium-widget, #map canvas { margin: 0; width: 100%; height: 100%; display: block; overflow: hidden; }
#words { position: absolute; top: 12px; left: 12px; max-width: calc(100vw - 56px); padding: 8px 16px; border-radius: 12px; }
#words { color: #eaf0f5; background: rgb(15 22 31 / 85%); font: 14px/1.4 system-ui, sans-serif; }
#words p { margin: 0; opacity: .8; }
#words p:empty { position: absolute; }
#map:focus-visible::after { content: ""; position: fixed; inset: 0; border: 3px solid #5aa9ff; pointer-events: none; }
</style>
</head>
<body>
<div id="map" role="application" tabindex="0" aria-label="The terrain on the globe. Arrow keys move, + and - zoom,
Page Up and Page Down tilt, [ and ] turn, Home goes back to the data."></div>
<div id="words"><strong>@TITLE@</strong><p id="message" role="status"></p><p>@ATTRIBUTION@</p></div>
<script type="module">
const say = (text) => { document.getElementById("message").textContent = text; };
try {
  if (!window.Cesium) throw new Error("This page takes CesiumJS from cdn.jsdelivr.net, which cannot be reached. "
      + "cordillera view FOLDER needs no internet.");
  const { Cartesian3, Cesium3DTileset, CesiumWidget, CustomShader, DirectionalLight, HeadingPitchRange, ImageryLayer, Matrix4,
          Rectangle, TileMapServiceImageryProvider, Transforms, UniformType } = Cesium;
  const manifest = await (await fetch("manifest.json")).json(), [west, south, east, north, low, high] = manifest.bounds;
  const pictures = Cesium.buildModuleUrl("Assets/Textures/NaturalEarthII");
  const earth = ImageryLayer.fromProviderAsync(TileMapServiceImageryProvider.fromUrl(pictures), {});
  const cesium = '<a href="https://cesium.com/cesiumjs/" rel="noreferrer">CesiumJS</a>';
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit(cesium, true);
  const { scene, camera } = new CesiumWidget("map", { baseLayer: earth, scene3DOnly: true });
  scene.screenSpaceCameraController.enableCollisionDetection = false;
  scene.globe.depthTestAgainstTerrain = false;

  // One light from the north-west, as on a relief map.
  const outline = Rectangle.fromDegrees(west, south, east, north);
  const sphere = Cesium.BoundingSphere.fromRectangle3D(outline, Cesium.Ellipsoid.WGS84, (low + high) / 2);
  const frame = Transforms.eastNorthUpToFixedFrame(sphere.center);
  const north_west = Matrix4.multiplyByPointAsVector(frame, new Cartesian3(0.56, -0.56, -0.62), new Cartesian3());
  scene.light = new DirectionalLight({ direction: north_west, intensity: 3 });

  const tint = new CustomShader({
    uniforms: {
      u_up: { type: UniformType.VEC3, value: new Cartesian3(0, 0, 1) }, u_height: { type: UniformType.FLOAT, value: 0 },
      u_low: { type: UniformType.FLOAT, value: low }, u_range: { type: UniformType.FLOAT, value: Math.max(high - low, 1) },
    },
    fragmentShaderText: `
      void fragmentMain(FragmentInput fsInput, inout czm_modelMaterial material) {
        vec3 place = fsInput.attributes.positionEC;
        float rise = dot(place, normalize(czm_viewRotation3D * u_up)), across = dot(place, place) - rise * rise;
        float radius = 6371000.0 + u_height + rise;
        float share = clamp((u_height + rise + across / (sqrt(radius * radius + across) + radius) - u_low) / u_range, 0.0, 1.0);
        vec3 colour = mix(vec3(0.22, 0.36, 0.20), vec3(0.60, 0.53, 0.33), smoothstep(0.0, 0.4, share));
        colour = mix(colour, vec3(0.43, 0.34, 0.28), smoothstep(0.4, 0.75, share));
        material.diffuse = mix(colour, vec3(0.95, 0.95, 0.96), smoothstep(0.8, 1.0, share));
      }` });
  const imagery = manifest.options?.imagery;  // pictures that lie on the terrain in place of colours
  const photo = @PHOTO@;  // the tiles have colours of their own
  const look = { maximumScreenSpaceError: 2, customShader: imagery || photo ? undefined : tint };
  const tileset = await Cesium3DTileset.fromUrl("tileset.json", look);
  if (imagery) {
    // They reach the rims of tiles, as in the viewer (tile_rims.js), through a class that CesiumJS does not document.
    const stage = Cesium.ImageryPipelineStage, made = stage?._createImageryUniforms;
    const beyond = ({ x, y, z, w }) =>
        new Cesium.Cartesian4(x > 1e-4 ? x : -1, y > 1e-4 ? y : -1, z < 1 - 1e-4 ? z : 2, w < 1 - 1e-4 ? w : 2);
    if (made) stage._createImageryUniforms = (inputs) => {
      const uniforms = made.call(stage, inputs);
      uniforms.imageryTextureCoordinateRectangle = uniforms.imageryTextureCoordinateRectangle.map(beyond);
      return uniforms;
    };
    const tiles = new Cesium.UrlTemplateImageryProvider({ url: imagery, rectangle: outline });
    tileset.imageryLayers.add(new ImageryLayer(tiles));
  }
  scene.primitives.add(tileset);
  scene.preRender.addEventListener(() => {
    tint.setUniform("u_up", Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(camera.positionWC, new Cartesian3()));
    tint.setUniform("u_height", camera.positionCartographic.height);
  });
  const look_at_data = () => {
    camera.viewBoundingSphere(sphere, new HeadingPitchRange(-0.4, -0.45, 1.7 * sphere.radius));
    camera.lookAtTransform(Matrix4.IDENTITY);
  };
  look_at_data();

  // As in the viewer: steps grow with the height.
  const step = (share) => share * Math.max(Math.abs(camera.positionCartographic.height), 20);
  const closer = () => camera.moveForward(step(0.2));
  const keys = {
    ArrowUp: () => camera.moveUp(step(0.06)), ArrowDown: () => camera.moveDown(step(0.06)), "+": closer, "=": closer,
    ArrowLeft: () => camera.moveLeft(step(0.06)), ArrowRight: () => camera.moveRight(step(0.06)),
    "-": () => camera.moveBackward(step(0.2)), PageUp: () => camera.lookUp(0.05), PageDown: () => camera.lookDown(0.05),
    "[": () => camera.lookLeft(0.05), "]": () => camera.lookRight(0.05), Home: look_at_data,
  };
  document.getElementById("map").addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  const stop = scene.postRender.addEventListener(() => {
    if (!tileset.tilesLoaded || tileset.statistics.numberOfTilesWithContentReady === 0) return;
    document.body.dataset.tiles = "final";
    stop();
  });
} catch (error) {
  const from_file = "A browser shows this folder only through a web server: cordillera view FOLDER, or any other.";
  say(location.protocol === "file:" ? from_file : String(error.message || error));
}
</script>
</body>
</html>
)html";

void put(std::string& page, std::string_view word, const std::string& value) {
  for (std::size_t at = page.find(word); at != page.npos; at = page.find(word, at + value.size()))
    page.replace(at, word.size(), value);
}

}  // namespace

std::string folder_page(const faces::Terrain& terrain) {
  const proto::Manifest& manifest = terrain.manifest();
  std::string page(kPage);
  put(page, "@PHOTO@", terrain.look().photo ? "true" : "false");
  put(page, "@ATTRIBUTION@", html_text(manifest.attribution()));
  put(page, "@TITLE@", html_text(manifest.title().empty() ? manifest.name() : manifest.title()));
  return page;
}

}  // namespace cordillera::pipeline
