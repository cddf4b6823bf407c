// The globe and its camera: where the data is, how to get there, what is under a pixel.
const Cesium = window.Cesium;
const { BoundingSphere, Cartesian3, Cartographic, Color, HeadingPitchRange, Math: CesiumMath, Rectangle } = Cesium;

// A phone has three pixels where a desk has one; nobody sees more than two, and each costs as much as the first.
const kMostPixelsAPoint = 2;

export function make_globe() {
  // The default credit is the logo of a hosted service that this page does not use.
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/" rel="noreferrer">CesiumJS</a>', true);
  const widget = new Cesium.CesiumWidget("globe", {
    baseLayer: false, scene3DOnly: true, msaaSamples: 4, useBrowserRecommendedResolution: false,
    requestRenderMode: true, maximumRenderTimeChange: Infinity,  // nothing moves by itself: a page that lies open costs nothing
  });
  widget.resolutionScale = Math.min(window.devicePixelRatio, kMostPixelsAPoint) / window.devicePixelRatio;
  const scene = widget.scene;
  scene.globe.baseColor = Color.fromCssColorString("#2b3d52");
  scene.globe.enableLighting = false;
  scene.globe.showGroundAtmosphere = false;
  scene.skyAtmosphere.show = true;
  scene.fog.enabled = false;
  scene.screenSpaceCameraController.enableCollisionDetection = false;
  return widget;
}

// Tiles that are no more than deferred while the camera moves are asked for by a later frame, which nobody else would draw.
const kDeferred_ms = 300;
export function draw_after_moves(scene) {
  scene.camera.moveEnd.addEventListener(() => setTimeout(() => scene.requestRender(), kDeferred_ms));
}

// The tileset's own bounding volume is half the globe (its root is a hemisphere): the manifest knows where the data is.
export function data_sphere([west, south, east, north, min_height, max_height]) {
  const sphere = BoundingSphere.fromRectangle3D(Rectangle.fromDegrees(west, south, east, north), Cesium.Ellipsoid.WGS84, (min_height + max_height) / 2);
  sphere.radius = Math.max(sphere.radius, 50);
  return sphere;
}

export function fly_home(camera, bounds) {
  const sphere = data_sphere(bounds);
  camera.viewBoundingSphere(sphere, new HeadingPitchRange(0, CesiumMath.toRadians(-38), sphere.radius * 1.9));
  camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
}

// The camera as five numbers: longitude, latitude, height, heading and pitch, in degrees and metres.
export function camera_numbers(camera) {
  const { longitude, latitude, height } = camera.positionCartographic;
  const degrees = (value, digits) => CesiumMath.toDegrees(value).toFixed(digits);
  return [degrees(longitude, 6), degrees(latitude, 6), height.toFixed(1), degrees(camera.heading, 2), degrees(camera.pitch, 2)].join(",");
}

// False where the text is no camera.
export function set_camera(camera, text) {
  const numbers = (text || "").split(",").map(Number);
  if (numbers.length !== 5 || !numbers.every(Number.isFinite)) return false;
  const [longitude, latitude, height, heading, pitch] = numbers;
  camera.setView({
    destination: Cartesian3.fromDegrees(longitude, latitude, height),
    orientation: { heading: CesiumMath.toRadians(heading), pitch: CesiumMath.toRadians(pitch), roll: 0 },
  });
  return true;
}

// Longitude, latitude (degrees) and height under a pixel, and the level of the tile that was hit. Heights are the terrain's own, however
// exaggerated they are shown.
export function place_under(widget, tileset, position) {
  const ray = widget.camera.getPickRay(position);
  const hit = ray && tileset.pick(ray, widget.scene.frameState, new Cartesian3());
  if (!hit) return null;
  const { longitude, latitude, height } = Cartographic.fromCartesian(hit);
  const level = widget.scene.pick(position)?.content?.tile?.implicitCoordinates?.level;
  return { longitude: CesiumMath.toDegrees(longitude), latitude: CesiumMath.toDegrees(latitude), height: height / widget.scene.verticalExaggeration, level };
}
