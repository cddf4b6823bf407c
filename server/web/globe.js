// The globe and its camera: where the data is, how to get there, what is under a pixel.
const Cesium = window.Cesium;
const { BoundingSphere, Cartesian3, Cartographic, Color, HeadingPitchRange, Math: CesiumMath, Rectangle } = Cesium;

// A phone has three pixels where a desk has one; nobody sees more than two, and each costs as much as the first.
const kMostPixelsAPoint = 2;

const kEarth = "Natural Earth II";

// on_error(error): nothing is drawn any more. Gives null where the browser cannot draw at all.
export function make_globe(on_error) {
  // The default credit is the logo of a hosted service that this page does not use.
  Cesium.CreditDisplay.cesiumCredit = new Cesium.Credit('<a href="https://cesium.com/cesiumjs/" rel="noreferrer">CesiumJS</a>', true);
  const widget = widget_or_null();
  if (!widget) return null;
  widget.resolutionScale = Math.min(window.devicePixelRatio, kMostPixelsAPoint) / window.devicePixelRatio;
  const scene = widget.scene;
  scene.renderError.addEventListener((_, { message }) => on_error(new Error(`The terrain cannot be drawn any more: ${message}. Load the page again.`)));
  leave_out_copyrights_of_tiles(widget);
  scene.globe.baseColor = Color.fromCssColorString("#24384c");
  scene.globe.enableLighting = false;
  scene.globe.showGroundAtmosphere = true;
  scene.skyAtmosphere.show = true;
  Object.assign(scene.fog, { enabled: true, visualDensityScalar: 0.4 });
  scene.screenSpaceCameraController.enableCollisionDetection = false;
  return widget;
}

// CesiumJS's own words of errors would cover the page.
function widget_or_null() {
  try {
    return new Cesium.CesiumWidget("globe", {
      baseLayer: natural_earth(), scene3DOnly: true, msaaSamples: 4, useBrowserRecommendedResolution: false, showRenderLoopErrors: false,
      requestRenderMode: true, maximumRenderTimeChange: Infinity,  // nothing moves by itself: a page that lies open costs nothing
    });
  } catch (error) {
    console.warn(error);
    return null;
  }
}

// A tile's own copyright is text, and CesiumJS takes it for HTML: pictures in it would be fetched from anywhere. The tileset says the same as HTML.
function leave_out_copyrights_of_tiles({ creditDisplay, scene: { primitives } }) {
  const add = creditDisplay.addCreditToNextFrame.bind(creditDisplay);
  const names = (tileset, html) => tileset.asset?.extras?.cesium?.credits?.some((credit) => credit.html === html);
  creditDisplay.addCreditToNextFrame = (credit) => {
    let named = credit.html === kEarth;
    for (let k = 0; !named && k < primitives.length; ++k) named = names(primitives.get(k), credit.html);
    if (named) add(credit);
  };
}

// The whole Earth in three levels, as CesiumJS ships it: a backdrop, so a little darker and paler than the data.
function natural_earth() {
  const layer = Cesium.ImageryLayer.fromProviderAsync(Cesium.TileMapServiceImageryProvider.fromUrl(Cesium.buildModuleUrl("Assets/Textures/NaturalEarthII"),
    { credit: kEarth }), {});
  Object.assign(layer, { brightness: 0.95, saturation: 0.6 });
  return layer;
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

// The box of the data, until there is something in it to be seen. Gives what is to be removed from the scene's primitives.
export function outline([west, south, east, north, , max_height]) {
  const kSteps = 16, wide = (east - west + 360) % 360 || 360, corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], positions = [];
  for (let side = 0; side < 4; ++side) {
    for (let k = 0; k <= kSteps; ++k) {
      const [u, v] = [0, 1].map((axis) => corners[side][axis] + ((corners[side + 1][axis] - corners[side][axis]) * k) / kSteps);
      positions.push(Cartesian3.fromDegrees(west + u * wide, south + v * (north - south), max_height));
    }
  }
  const lines = new Cesium.PolylineCollection();
  lines.add({ positions, width: 2, material: Cesium.Material.fromType("Color", { color: Color.fromCssColorString("#f0a94c").withAlpha(0.8) }) });
  return lines;
}

// From the south-east, the horizon in sight. A tall window looks down more steeply: there is little beside the data. So does one of data that go
// around much of the Earth, which would hide them behind itself.
const kHomeHeading_deg = -24, kHomePitch_deg = -21, kTallPitch_deg = -38, kWidePitch_deg = -85;
const kWide_rad = 0.5;
const kFilled = 0.95;  // of the window
const kNearly_rad = 0.01;  // as good as straight down, or as north up

// Shares of the window: panel has some of its width, at the left, tools { width, height } of it, in the corner at the right and above. Data that would
// reach this corner is beside it, or below it where it is wider than high.
export function fly_home(scene, bounds, { panel, tools }) {
  const { camera } = scene, sphere = data_sphere(bounds), { aspectRatio, fovy } = camera.frustum;
  const wide = Math.min(1, sphere.radius / Cesium.Ellipsoid.WGS84.maximumRadius / kWide_rad);
  const pitch = CesiumMath.lerp(aspectRatio < 1 ? kTallPitch_deg : kHomePitch_deg, kWidePitch_deg, wide);
  const points = points_of(bounds, scene.verticalExaggeration), middle = points[0];
  camera.lookAt(middle, new HeadingPitchRange(CesiumMath.toRadians(kHomeHeading_deg * (1 - wide)), CesiumMath.toRadians(pitch), sphere.radius));
  camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
  const up = Math.tan(fovy / 2), side = up * aspectRatio, left = panel * (1 - wide);
  const free = (half, before, behind) => ({ middle: half * (before - behind), half: kFilled * half * (1 - before - behind) });
  const place = (right, top) => place_that_sees(points, camera, free(side, left, right), free(up, 0, top));
  camera.position = place(0, 0);
  const in_corner = ([right, above]) => right > side * (1 - 2 * tools.width) && above > up * (1 - 2 * tools.height);
  if (wide === 1 || !points.some((point) => in_corner(seen_at(camera, point)))) return;
  camera.position = tools.width * aspectRatio > tools.height ? place(0, tools.height) : place(tools.width, 0);
}

// How far to the right and up a camera sees a point, as metres per metre ahead.
function seen_at({ positionWC, directionWC, rightWC, upWC }, point) {
  const to = Cartesian3.subtract(point, positionWC, new Cartesian3());
  return [rightWC, upWC].map((axis) => Cartesian3.dot(to, axis) / Cartesian3.dot(to, directionWC));
}

// The middle first, then all around, low and high.
function points_of([west, south, east, north, low, high], factor) {
  const kSteps = 8, wide = (east - west + 360) % 360 || 360, points = [];
  const add = (u, v, height) => points.push(Cartesian3.fromDegrees(west + u * wide, south + v * (north - south), height * factor));
  add(0.5, 0.5, (low + high) / 2);
  for (let k = 0; k <= kSteps; ++k) for (const height of [low, high]) for (const at of [0, 1]) { add(k / kSteps, at, height); add(at, k / kSteps, height); }
  return points;
}

// Where a camera that looks as this one does has all points in its window, in the middle of it, and no farther. across, upright: what of the window
// there is to be filled, { middle, half } as metres to the right or up per metre ahead.
function place_that_sees(points, { positionWC, rightWC, upWC, directionWC }, across, upright) {
  const along = (axis) => points.map((point) => Cartesian3.dot(Cartesian3.subtract(point, positionWC, new Cartesian3()), axis));
  const ahead = along(directionWC), axes = [[along(rightWC), across], [along(upWC), upright]];
  // Within a share of the window the camera may be from least + plus * z to -most - minus * z, z metres ahead.
  const limits = ([places, { middle, half }], share) => {
    const plus = middle + share * half, minus = share * half - middle;
    return { plus, minus, least: Math.max(...places.map((x, k) => x - plus * ahead[k])), most: Math.max(...places.map((x, k) => -x - minus * ahead[k])) };
  };
  const nearest = ({ plus, minus, least, most }) => -(least + most) / (plus + minus);
  const z = Math.min(...axes.map((axis) => nearest(limits(axis, 1))));
  const [x, y] = axes.map((axis) => {
    let [low, high] = [0, 1];  // the least share that is enough has as much room on one side as on the other
    for (let k = 0; k < 30; ++k) {
      const share = (low + high) / 2;
      if (nearest(limits(axis, share)) >= z) high = share;
      else low = share;
    }
    const { plus, minus, least, most } = limits(axis, high);
    return (least + plus * z - most - minus * z) / 2;
  });
  const place = Cartesian3.clone(positionWC);
  for (const [axis, length] of [[rightWC, x], [upWC, y], [directionWC, z]]) Cartesian3.add(place, Cartesian3.multiplyByScalar(axis, length, new Cartesian3()), place);
  return place;
}

// Without data: the Earth, with sun on it.
export function show_earth(camera) {
  camera.setView({ destination: Cartesian3.fromDegrees(-40, 28, 1.5e7 / Math.min(1, camera.frustum.aspectRatio)) });
}

// What the middle of the window shows; null beside the Earth.
const middle = (widget, tileset) => place_at(widget, tileset, new Cesium.Cartesian2(widget.canvas.clientWidth / 2, widget.canvas.clientHeight / 2));
function place_at(widget, tileset, position) {
  return terrain_at(widget, tileset, position) || widget.camera.pickEllipsoid(position) || null;
}
function terrain_at(widget, tileset, position) {
  const ray = widget.camera.getPickRay(position);
  return (ray && tileset?.pick(ray, widget.scene.frameState, new Cartesian3())) || null;
}

export const kCloser = 0.6;
// Nearer by a factor below 1, farther by one above, towards what the middle of the window shows.
export function zoom(widget, tileset, factor) {
  const { camera } = widget;
  const target = middle(widget, tileset);
  const distance = target ? Cartesian3.distance(camera.positionWC, target) : camera.positionCartographic.height;
  camera.move(camera.direction, distance * (1 - factor));
}

// Turns about what the middle of the window shows. The pitch that stays is that at this place, from which the camera's own differs as the Earth is round.
function turn(widget, tileset, { heading, pitch }) {
  const { camera } = widget, target = middle(widget, tileset);
  if (!target) return camera.setView({ orientation: { heading, pitch: pitch ?? camera.pitch, roll: 0 } });
  return look_at(camera, target, heading, pitch ?? pitch_at(target, camera.positionWC), Cartesian3.distance(camera.positionWC, target));
}
function look_at(camera, target, heading, pitch, distance) {
  camera.lookAt(target, new HeadingPitchRange(heading, pitch, distance));
  camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
}
function pitch_at(target, from) {
  const up = Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(target, new Cartesian3()), away = Cartesian3.subtract(from, target, new Cartesian3());
  return -Math.asin(CesiumMath.clamp(Cartesian3.dot(up, away) / Cartesian3.magnitude(away), -1, 1));
}

// With north up already, a quarter on: all sides are seen without dragging.
export function face_north(widget, tileset) {
  const is_north = Math.abs(CesiumMath.negativePiToPi(widget.camera.heading)) < kNearly_rad;
  turn(widget, tileset, { heading: is_north ? CesiumMath.PI_OVER_TWO : 0 });
}

// Straight down, or from the side where it does so already.
export function tilt(widget, tileset) {
  const { heading, pitch } = widget.camera, is_down = pitch + CesiumMath.PI_OVER_TWO < kNearly_rad;
  turn(widget, tileset, { heading, pitch: is_down ? CesiumMath.toRadians(kTallPitch_deg) : -CesiumMath.PI_OVER_TWO });
}

// A place of the window comes to its middle, and nearer.
export function go_to(widget, tileset, position, factor) {
  const { camera } = widget, target = place_at(widget, tileset, position), before = target && middle(widget, tileset);
  if (!target) return;
  const pitch = before ? pitch_at(before, camera.positionWC) : camera.pitch;
  look_at(camera, target, camera.heading, pitch, factor * Cartesian3.distance(camera.positionWC, target));
}

// Metres that a CSS pixel covers where the terrain is seen, as near to the middle of the window as there is some. Without terrain on the ellipsoid;
// null beside the Earth.
const kPlaces = [[0.5, 0.5], [0.5, 0.7], [0.7, 0.5], [0.3, 0.5], [0.5, 0.3]];
export function metres_a_pixel(widget, tileset) {
  const { canvas: { clientWidth, clientHeight }, camera: { positionWC, directionWC, frustum: { fovy } } } = widget;
  let place = null;
  for (const [u, v] of kPlaces) place ??= terrain_at(widget, tileset, new Cesium.Cartesian2(u * clientWidth, v * clientHeight));
  place ??= middle(widget, tileset);
  return place && (2 * Math.tan(fovy / 2) * Cartesian3.dot(Cartesian3.subtract(place, positionWC, new Cartesian3()), directionWC)) / clientHeight;
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

// Below the ground everything is black. CesiumJS's own collision detection would keep the camera above the ellipsoid, which half of all terrain lies
// below. To be called before each frame: heights change with the exaggeration and with finer tiles, too.
const kLeastAbove_m = 2;
export function stay_above(scene, tileset, [, , , , low, high]) {
  const { camera } = scene, factor = scene.verticalExaggeration, { longitude, latitude, height } = camera.positionCartographic;
  const top = Math.max(high * factor, 0) + kLeastAbove_m;
  if (height > top) return;
  const above = Cartesian3.fromRadians(longitude, latitude, top);
  const down = Cartesian3.negate(Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(above, new Cartesian3()), new Cartesian3());
  const hit = tileset.pick(new Cesium.Ray(above, down), scene.frameState, new Cartesian3());
  const ground = hit ? Cartographic.fromCartesian(hit).height : Math.min(low * factor, 0);
  if (height >= ground + kLeastAbove_m) return;
  const { heading, pitch, roll } = camera;
  camera.setView({ destination: Cartesian3.fromRadians(longitude, latitude, ground + kLeastAbove_m), orientation: { heading, pitch, roll } });
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
