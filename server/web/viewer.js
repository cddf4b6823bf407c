// The viewer: a plain globe, one dataset's tileset on it. Every address is relative, so a path prefix or a proxy changes nothing.
import { fill_dataset_list, fill_failed_list, on_controls, say, show_manifest, show_position, start_folding } from "./dataset_panel.js";
import { follow_camera, height_tint, plain_ambient, relief_light } from "./terrain_style.js";

const Cesium = window.Cesium;
const { BoundingSphere, Cartesian3, Cartographic, Color, HeadingPitchRange, Rectangle, ScreenSpaceEventType } = Cesium;

// Stated errors are maxima, seldom seen; shading shows what they leave out, so half a pixel is asked for and not Cesium's 16.
const kScreenSpaceError_px = 0.5;

// What tests and the console may look at.
const page = (window.cordillera = {
  widget: null, scene: null, tileset: null, manifest: null, datasets: [], error: null, tilesLoaded: false, tint: null });

async function fetch_json(url) {
  const response = await fetch(url);
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.detail || body.title || `${url}: HTTP ${response.status}`);
  return body;
}

function make_globe() {
  // The default credit is the logo of a hosted service that this page does not use.
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/" rel="noreferrer">CesiumJS</a>', true);
  const widget = new Cesium.CesiumWidget("globe", {
    baseLayer: false,
    scene3DOnly: true,
    msaaSamples: 4,
  });
  const scene = widget.scene;
  scene.globe.baseColor = Color.fromCssColorString("#2b3d52");
  scene.globe.enableLighting = false;
  scene.globe.showGroundAtmosphere = false;
  scene.skyAtmosphere.show = true;
  scene.fog.enabled = false;
  scene.screenSpaceCameraController.enableCollisionDetection = false;
  return widget;
}

// The tileset's own bounding volume is half the globe (its root is a hemisphere): the manifest knows where the data is.
function data_sphere(bounds) {
  const [west, south, east, north, min_height, max_height] = bounds;
  const rectangle = Rectangle.fromDegrees(west, south, east, north);
  const sphere = BoundingSphere.fromRectangle3D(rectangle, Cesium.Ellipsoid.WGS84, (min_height + max_height) / 2);
  sphere.radius = Math.max(sphere.radius, 50);
  return sphere;
}

function fly_home() {
  const sphere = data_sphere(page.manifest.bounds);
  page.scene.camera.viewBoundingSphere(sphere, new HeadingPitchRange(0, Cesium.Math.toRadians(-38), sphere.radius * 1.9));
  page.scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
}

function set_tint(on) {
  page.tileset.customShader = on ? page.tint : undefined;
}

async function show_dataset(id) {
  const base = `v1/datasets/${encodeURIComponent(id)}`;
  page.tilesLoaded = false;
  const manifest = await fetch_json(`${base}/manifest.json`);
  const tileset = await Cesium.Cesium3DTileset.fromUrl(`${base}/tileset.json`, {
    maximumScreenSpaceError: kScreenSpaceError_px, enablePick: true, enableDebugWireframe: true,
  });
  tileset.environmentMapManager.enabled = false;
  tileset.imageBasedLighting = plain_ambient();
  if (page.tileset) page.scene.primitives.remove(page.tileset);
  page.scene.primitives.add(tileset);
  Object.assign(page, { manifest, tileset, tint: height_tint(manifest.bounds[4], manifest.bounds[5]) });
  tileset.tileFailed.addEventListener(({ url, message }) => { page.error = `${url}: ${message}`; say(page.error, "problem"); });
  page.scene.light = relief_light(data_sphere(manifest.bounds).center);
  set_tint(document.getElementById("tint").checked);
  tileset.debugWireframe = document.getElementById("wireframe").checked;
  show_manifest(manifest);
  fly_home();
  say("");
}

function choose(id) {
  const url = new URL(window.location.href);
  url.searchParams.set("dataset", id);
  window.history.replaceState(null, "", url);
  return show_dataset(id).catch(report);
}

function report(error) {
  page.error = String(error.message || error);
  say(page.error, "problem");
}

function watch_frames(scene) {
  scene.preUpdate.addEventListener(() => {
    if (page.tint) follow_camera(page.tint, scene.camera, Cesium.Ellipsoid.WGS84);
  });
  scene.postRender.addEventListener(() => {
    page.tilesLoaded = Boolean(page.tileset && page.tileset.tilesLoaded && page.tileset.statistics?.numberOfTilesWithContentReady !== 0);
  });
}

// Longitude, latitude and ellipsoidal height under the pointer.
function watch_pointer(widget) {
  widget.screenSpaceEventHandler.setInputAction(({ endPosition }) => {
    const ray = widget.camera.getPickRay(endPosition);
    const hit = page.tileset && ray && page.tileset.pick(ray, widget.scene.frameState, new Cartesian3());
    if (!hit) return show_position("");
    const { longitude, latitude, height } = Cartographic.fromCartesian(hit);
    const degrees = (value) => Cesium.Math.toDegrees(value).toFixed(5);
    show_position(`${degrees(longitude)}°, ${degrees(latitude)}°, ${height.toFixed(1)} m above the ellipsoid`);
  }, ScreenSpaceEventType.MOUSE_MOVE);
}

// Removes a failed dataset from the server, then from the page.
async function delete_failed(id) {
  const response = await fetch(`v1/datasets/${encodeURIComponent(id)}`, { method: "DELETE" });
  // Somebody else may have been quicker: then it is gone as well.
  if (!response.ok && response.status !== 404) throw new Error(`${id} could not be deleted: HTTP ${response.status}`);
  page.datasets = page.datasets.filter((dataset) => dataset.id !== id);
  show_failed();
}

function show_failed() {
  fill_failed_list(page.datasets, (id) => delete_failed(id).catch(report));
}

async function start() {
  start_folding();
  page.widget = make_globe();
  page.scene = page.widget.scene;
  watch_frames(page.scene);
  watch_pointer(page.widget);
  on_controls({ tint: set_tint, wireframe: (on) => { page.tileset.debugWireframe = on; }, home: fly_home });
  const { datasets } = await fetch_json("v1/datasets");
  const wanted = new URLSearchParams(window.location.search).get("dataset");
  const first_ready = datasets.find((dataset) => dataset.state === "ready");
  const chosen = wanted || first_ready?.id;
  page.datasets = datasets;
  fill_dataset_list(datasets, chosen, choose);
  show_failed();
  if (!chosen) return say("No dataset yet. POST a GeoTIFF to v1/datasets and reload.");
  await show_dataset(chosen);
}

start().catch(report);
