// What can be seen from a place: one click, rays over the heights that the service's Terrarium tiles hold, a picture of it over the terrain.
import { ask } from "./token.js";
import { show, tell } from "./unseen.js";
import { kSeen, visible_cells } from "./visible_cells.js";
import { area_of, put_tile, tiles_of_window, window_around } from "./viewshed_grid.js";
import { parts_of, rectangle_of, viewshed_picture } from "./viewshed_picture.js";

const element = (id) => document.getElementById(id);
const square_km = (square_m) => (square_m / 1e6).toLocaleString("en", { maximumSignificantDigits: 3 });
const metres = (value) => `${value.toFixed(value < 10 ? 1 : 0)} m`;

// A picture's bytes as they are: heights are no colours to be managed. Null where there is no tile.
async function pixels_of(response) {
  if (!response.ok || response.status === 204) return null;
  const image = await createImageBitmap(await response.blob(), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  const context = new OffscreenCanvas(image.width, image.height).getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height).data;
}

export class Viewshed {
  // base(): the address of the dataset that is shown. on_picture(pictures): { url, rectangle, width, height } of each, to be shown over the
  // terrain. on_change(words): something was chosen; on_error(error).
  constructor({ base, on_picture, on_change, on_error }) {
    Object.assign(this, { base, on_picture, on_change, on_error, on: false, turn: 0, place: null, found: null });
    element("viewshed-close").onclick = () => this.stop();
    for (const id of ["viewshed-eye", "viewshed-radius"]) element(id).onchange = () => { if (this.place) this.take(this.place); };
  }

  start() {
    this.stop();
    this.on = true;
    this.on_change("Viewshed: choose a place, or press Enter on the terrain for the middle of the window.");
  }

  stop() {
    ++this.turn;
    Object.assign(this, { on: false, place: null, found: null });
    element("viewshed-place").value = "";
    show("viewshed", false, "look-around");
    this.on_picture([]);
    this.on_change("");
  }

  // A place that was clicked on, or that the address names; null beside the terrain.
  take(place) {
    if (!place) return;
    Object.assign(this, { on: true, place });
    element("viewshed-place").value = `${place.longitude.toFixed(6)},${place.latitude.toFixed(6)}`;
    this.on_change("Viewshed: looking around.");
    this.look(place).catch((error) => { this.stop(); this.on_error(error); });
  }

  async look(place) {
    const turn = ++this.turn, base = this.base(), radius_m = Number(element("viewshed-radius").value) * 1000;
    const response = await ask(`${base}/terrarium.json`), about = await response.json().catch(() => ({}));
    if (!response.ok) throw new Error(about.detail || `no heights: HTTP ${response.status}`);
    const window = window_around(about, place, radius_m), heights = await this.heights_of(base, window, about);
    if (turn !== this.turn) return;
    const eye_m = Math.max(Number(element("viewshed-eye").value), 0);
    const cells = visible_cells({ heights, side: window.side, cell_m: window.cell_m, eye_m });
    if (!cells) throw new Error("There is no data at this place.");
    this.found = { window, heights, cells, area: area_of(cells, kSeen, window) };
    this.show(cells, window);
    const error = about.zooms?.find(({ zoom }) => zoom === window.zoom)?.stated_max_error;
    const known = (error ?? null) !== null;  // not of provisional tiles
    element("viewshed-words").textContent = `${square_km(this.found.area)} km² are seen within ${radius_m / 1000} km`;
    element("viewshed-error").textContent = `· cells of ${metres(window.cell_m)}, heights ${known ? `± ${metres(error)}` : "of an error not known yet"}`;
    element("viewshed").hidden = false;
    tell(`${element("viewshed-words").textContent} ${element("viewshed-error").textContent}`);
    this.on_change("");
  }

  // NaN where there is no data: Terrarium has a height everywhere, but the coloured heights are transparent there.
  async heights_of(base, window, { bounds }) {
    const heights = new Float64Array(window.side * window.side).fill(NaN);
    await Promise.all(tiles_of_window(window, bounds).map(async (tile) => {
      const path = `${tile.z}/${tile.x}/${tile.y}.png`;
      const [pixels, mask] = await Promise.all(["terrarium", "color-relief"].map((face) => ask(`${base}/${face}/${path}`)));
      if (mask.status === 204) return;
      const coloured = await pixels_of(pixels);
      if (coloured) put_tile(heights, window, tile, coloured, await pixels_of(mask));
    }));
    return heights;
  }

  show(cells, window) {
    const pixels = new ImageData(viewshed_picture(cells, window), window.side, window.side);
    this.on_picture(parts_of(window).map((part) => {
      const canvas = Object.assign(document.createElement("canvas"), { width: part.count, height: window.side });
      canvas.getContext("2d").putImageData(pixels, -part.first, 0);
      return { url: canvas.toDataURL(), rectangle: rectangle_of(window, part), width: part.count, height: window.side };
    }));
  }
}
