// Heights between two places, as the service reads them from the tiles that clients get: two clicks, a line on the terrain, a picture of it.
import { ask } from "./token.js";
import { show, tell } from "./unseen.js";

const Cesium = window.Cesium;
const { ArcType, Cartesian3, Color, GeometryInstance, Material, PolylineGeometry, PolylineMaterialAppearance, Primitive } = Cesium;
const element = (id) => document.getElementById(id);

const kSamples = 256;
const kWidth = 320, kHeight = 96;  // of the picture, in its own units
const kSteps = { ArrowLeft: -0.01, ArrowDown: -0.01, ArrowRight: 0.01, ArrowUp: 0.01, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 };  // shares of it
const kLift_m = 3;  // above the terrain, beside the line's own error

// Where coarser tiles than the service's lie above the line it is seen through them, paler.
const line_look = (alpha) => new PolylineMaterialAppearance({ material: Material.fromType("Color", { color: Color.fromCssColorString("#ff5a3c").withAlpha(alpha) }) });
const line_of = (positions) => new GeometryInstance({
  geometry: new PolylineGeometry({ positions, width: 4, arcType: ArcType.NONE, vertexFormat: PolylineMaterialAppearance.VERTEX_FORMAT }) });

const kilometres = (metres) => (metres >= 10000 ? `${(metres / 1000).toFixed(0)} km` : metres >= 1000 ? `${(metres / 1000).toFixed(1)} km` : `${metres.toFixed(0)} m`);
const height_of = (point) => point.orthometric_height ?? point.ellipsoidal_height;

// Metres up and down along points that have heights.
export function climbs(heights) {
  let up = 0, down = 0;
  for (let k = 1; k < heights.length; ++k) {
    const step = heights[k] - heights[k - 1];
    if (step > 0) up += step;
    else down -= step;
  }
  return { up, down };
}

export class Profile {
  // scene; base() and factor() give the address of the dataset that is shown and how heights are exaggerated.
  constructor(scene, { base, factor, on_change, on_error }) {
    Object.assign(this, { scene, base, factor, on_change, on_error, on: false, ends: [], turn: 0 });
    this.line = null;
    element("profile-close").onclick = () => this.stop();
    element("profile-chart").onkeydown = (event) => this.step(event);
    element("profile-chart").onpointermove = ({ offsetX, currentTarget }) => this.point(offsetX / currentTarget.clientWidth);
  }

  start() {
    this.stop();
    this.on = true;
    this.on_change("Profile: choose the first place.");
  }

  stop() {
    ++this.turn;
    Object.assign(this, { on: false, ends: [], points: null });
    this.show_line([]);
    show("profile", false, "measure");
    this.on_change("");
  }

  // A place that was clicked on; null beside the terrain.
  take(place) {
    if (!place) return;
    if (this.ends.length === 2) this.start();
    this.ends.push([place.longitude, place.latitude]);
    if (this.ends.length === 1) return this.on_change("Profile: choose the second place.");
    this.on_change("");
    this.fetch().catch((error) => { this.stop(); this.on_error(error); });
  }

  async fetch() {
    const turn = ++this.turn, line = this.ends.map((place) => place.map((degrees) => degrees.toFixed(7)).join(",")).join(";");
    const response = await ask(`${this.base()}/elevation?line=${line}&samples=${kSamples}`);
    const answer = await response.json().catch(() => ({}));
    if (!response.ok) throw new Error(answer.detail || `no profile: HTTP ${response.status}`);
    if (turn !== this.turn) return;
    this.points = answer.points;
    this.draw_line();
    this.draw_chart(answer);
  }

  // In pieces, between places without data.
  draw_line() {
    const pieces = [];
    let piece = [];
    for (const point of [...this.points, null]) {
      if (point && point.ellipsoidal_height !== null) {
        piece.push(Cartesian3.fromDegrees(point.lon, point.lat, (point.ellipsoidal_height + kLift_m) * this.factor()));
        continue;
      }
      if (piece.length > 1) pieces.push(piece);
      piece = [];
    }
    this.show_line(pieces);
  }

  show_line(pieces) {
    const { primitives } = this.scene;
    if (this.line) primitives.remove(this.line);
    this.line = pieces.length === 0 ? null : primitives.add(new Primitive({
      geometryInstances: pieces.map(line_of), appearance: line_look(1), depthFailAppearance: line_look(0.5), asynchronous: false }));
    this.scene.requestRender();
  }

  draw_chart({ length, level, stated_max_error: error, geoid }) {
    const heights = this.points.map(height_of), known = heights.filter((height) => height !== null);
    if (known.length === 0) throw new Error("There is no data between these places.");
    const low = Math.min(...known), high = Math.max(...known), range = Math.max(high - low, 1);
    const x = (k) => (kWidth * k) / (heights.length - 1), y = (height) => kHeight - 4 - ((kHeight - 8) * (height - low)) / range;
    let path = "", area = "", start = 0;
    heights.forEach((height, k) => {
      if (height === null) return;
      const begins = k === 0 || heights[k - 1] === null, ends = k === heights.length - 1 || heights[k + 1] === null;
      if (begins) start = k;
      path += `${begins ? "M" : "L"}${x(k).toFixed(1)} ${y(height).toFixed(1)}`;
      area += `${begins ? `M${x(k).toFixed(1)} ${kHeight}L` : "L"}${x(k).toFixed(1)} ${y(height).toFixed(1)}${ends ? `L${x(k).toFixed(1)} ${kHeight}L${x(start).toFixed(1)} ${kHeight}Z` : ""}`;
    });
    element("profile-line").setAttribute("d", path);
    element("profile-area").setAttribute("d", area);
    const { up, down } = climbs(known);
    element("profile-words").textContent = `${kilometres(length)} · ${low.toFixed(0)} to ${high.toFixed(0)} m ${geoid ? `above sea level (${geoid})` : "above the ellipsoid"} · ` +
      `up ${up.toFixed(0)} m, down ${down.toFixed(0)} m`;
    element("profile-error").textContent = error === null ? "error not known yet" : `± ${error.toFixed(error < 10 ? 2 : 1)} m (level ${level})`;
    this.point(0);
    element("profile").hidden = false;
    tell(`${element("profile-words").textContent}, ${element("profile-error").textContent}`);
  }

  // What the chart shows at a share of its width.
  point(share) {
    this.share = Math.min(1, Math.max(0, share));
    const point = this.points?.[Math.round(this.share * (this.points.length - 1))];
    if (!point) return;
    const height = height_of(point), words = `${kilometres(point.distance)}: ${height === null ? "no data" : `${height.toFixed(1)} m`}`;
    element("profile-mark").setAttribute("x", String(kWidth * this.share));
    element("profile-place").textContent = words;
    element("profile-chart").ariaValueNow = String(Math.round(100 * this.share));
    element("profile-chart").ariaValueText = words;
  }

  // The same by keys, as a slider has them.
  step(event) {
    const { key } = event;
    if (!(key in kSteps) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.point(this.share + kSteps[key]);
  }
}
