// How the terrain is shown: its colours, its triangles, how high, how fine.
import { mend_antimeridian } from "./antimeridian.js";
import { follow_detail, shaded_relief } from "./shaded_relief.js";
import { as_drawn, follow_camera, height_tint, plain_ambient } from "./terrain_style.js";
import { mend_rims } from "./tile_rims.js";
import { ask, asked_by_cesium } from "./token.js";

const Cesium = window.Cesium;
const { Color, ImageryLayer, Rectangle, UrlTemplateImageryProvider } = Cesium;

// Of neighbouring levels, clearly different.
const kLevelColours = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#edc948", "#b07aa1", "#9c755f"].map((css) => Color.fromCssColorString(css));

// The relief once more, shaded here from normal maps: half of the triangles, but facets where a coarse dataset's finest tiles are near.
export const kShadedRelief = "shaded-relief";

// Pictures that the service draws, and the colours that each may have; the first are its own.
export const kPictures = {
  relief: ["atlas", "land", "viridis", "grey"], [kShadedRelief]: ["atlas", "land", "viridis", "grey"], "color-relief": ["atlas", "land", "viridis", "grey"], hillshade: [],
  slope: ["steep", "grey"], aspect: ["compass", "grey"],
};
// Looks that are pictures are in Web Mercator, which ends there: a dataset that lies beyond has none of them.
const kMercatorEnd_deg = Cesium.Math.toDegrees(Cesium.WebMercatorProjection.MaximumLatitude);
const kInMercator = [...Object.keys(kPictures), "imagery"];
export const looks_without = ([, south, , north]) => (south < kMercatorEnd_deg && north > -kMercatorEnd_deg ? [] : kInMercator);
// Those with their own light; the others are lit by the scene.
const kDrawnWithLight = ["relief", kShadedRelief, "hillshade", "slope", "aspect"];

const kThrough = 0.4;

// The error that is asked for at first, as log2 of pixels. Shading shows what stated errors leave out; normal maps put it back. Pictures
// on tiles are as fine as the tiles.
const kFirstDetail = { shaded: "0", pictures: "-1" };

mend_antimeridian();
mend_rims();

export class Looks {
  // normal_maps: the tiles have them. on_failed(): a picture of the service cannot be had.
  constructor(scene, tileset, manifest, { base, normal_maps, on_failed }) {
    Object.assign(this, { scene, tileset, manifest, base, normal_maps, on_failed, look: "plain", turn: 0, overlay: [], laid: [] });
    this.tint = height_tint(manifest.bounds[4], manifest.bounds[5]);
    this.drawn = as_drawn();
    this.shaded = shaded_relief();
    tileset.environmentMapManager.enabled = false;
    tileset.imageBasedLighting = plain_ambient();
    tileset.colorBlendMode = Cesium.Cesium3DTileColorBlendMode.REPLACE;
    // Setting a colour costs a tile its draw commands, so only where it changes.
    tileset.tileVisible.addEventListener((tile) => {
      const colour = this.colour_of(tile);
      if (!Color.equals(tile.color, colour)) tile.color = colour;
    });
  }

  colour_of(tile) {
    const level = tile.implicitCoordinates?.level;
    return this.look === "levels" && level !== undefined ? kLevelColours[level % kLevelColours.length] : Color.WHITE;
  }

  // look: of kPictures, height, levels, plain or imagery. Gives the TileJSON of a picture, null for other looks. Where a picture
  // cannot be had it fails with the reason, and the terrain is coloured by height here. on_imagery(words): what is to be said of imagery that
  // cannot be had; "" when it can.
  async show(look, { imagery = "", ramp = "" } = {}, on_imagery = () => {}) {
    const turn = ++this.turn;
    const about = look in kPictures ? await this.about(this.picture_of(look), ramp).catch((error) => { if (turn === this.turn) this.paint("height"); throw error; }) : null;
    if (turn !== this.turn) return null;  // another look was chosen meanwhile
    this.paint(look);
    if (about) this.put_below(picture(about, this.on_failed));
    if (look === "imagery" && imagery) this.put_below(imagery_layer(imagery, this.is_own(imagery), on_imagery));
    return about;
  }

  // Pictures of the dataset itself, which may be private. Nobody else's are asked for with the token.
  is_own(url) {
    return new URL(url, document.baseURI).href.startsWith(new URL(`${this.base}/`, document.baseURI).href);
  }

  // With normal maps the relief is shaded here, over colours that have no light; without, it is the service's picture.
  picture_of(look) {
    if (look !== kShadedRelief) return look;
    return this.normal_maps ? "color-relief" : "relief";
  }

  shader_of(look) {
    if (look === "height") return this.tint;
    if (look === kShadedRelief && this.normal_maps) return this.shaded;
    return kDrawnWithLight.includes(look) ? this.drawn : undefined;
  }

  first_detail(look) {
    return look === kShadedRelief && this.normal_maps ? kFirstDetail.shaded : kFirstDetail.pictures;
  }

  paint(look) {
    this.look = look;
    this.tileset.customShader = this.shader_of(look);
    this.blend();
    const layers = this.tileset.imageryLayers;
    for (let k = layers.length - 1; k >= 0; --k) if (!this.overlay.includes(layers.get(k))) layers.remove(layers.get(k));
  }

  // White would replace the imagery, not light it. Colours of levels and of heights replace it, but for some of it where there is an overlay.
  blend() {
    const { REPLACE, HIGHLIGHT, MIX } = Cesium.Cesium3DTileColorBlendMode;
    this.tileset.colorBlendMode = this.look !== "levels" ? HIGHLIGHT : this.overlay.length > 0 ? MIX : REPLACE;
    this.tileset.colorBlendAmount = 1 - kThrough;
    this.tint.setUniform("u_through", this.overlay.length > 0 ? kThrough : 0);
  }

  // Under the overlay, which stays as it is when the look changes.
  put_below(layer) {
    const { imageryLayers } = this.tileset;
    imageryLayers.add(layer);
    for (const one of this.overlay) imageryLayers.raiseToTop(one);
  }

  // Pictures over whatever look there is.
  lay_over(pictures) {
    const { imageryLayers } = this.tileset;
    for (const one of this.overlay) imageryLayers.remove(one);
    this.laid = pictures;
    this.overlay = pictures.map((picture) => single_picture(picture, () => draw_frames(this.scene)));
    for (const one of this.overlay) imageryLayers.add(one);
    this.blend();
    draw_frames(this.scene);
  }

  async about(look, ramp) {
    const response = await ask(`${this.base}/${look}.json${ramp ? `?ramp=${encodeURIComponent(ramp)}` : ""}`);
    const body = await response.json().catch(() => ({}));
    if (!response.ok) throw Object.assign(new Error(body.detail || `${look}: HTTP ${response.status}`), { type: body.type });
    return { ...body, url: `${this.base}/${look}/{z}/{x}/{y}.png${ramp ? `?ramp=${encodeURIComponent(ramp)}` : ""}` };
  }

  // What shaders cannot know: to be called before each frame.
  follow(camera) {
    follow_camera(this.tint, camera, Cesium.Ellipsoid.WGS84);
    if (this.normal_maps) follow_detail(this.shaded, this.manifest.levels[0], this.tileset.maximumScreenSpaceError);
  }

  exaggerate(factor) {
    this.scene.verticalExaggeration = factor;
    this.shaded.setUniform("u_exaggeration", factor);
    this.tint.setUniform("u_low", this.manifest.bounds[4] * factor);
    this.tint.setUniform("u_range", Math.max(this.manifest.bounds[5] - this.manifest.bounds[4], 1) * factor);
  }
}

function picture({ bounds, minzoom, maxzoom, url }, on_failed) {
  const provider = new UrlTemplateImageryProvider({ url: asked_by_cesium(url), rectangle: Rectangle.fromDegrees(...bounds), minimumLevel: minzoom, maximumLevel: maxzoom });
  provider.errorEvent.addEventListener(on_failed);
  return new ImageryLayer(provider);
}

// An address of tiles names all three of these.
const is_address_of_tiles = (text) => URL.canParse(text, document.baseURI) && ["{z}", "{x}", "{y}"].every((part) => text.includes(part));

// Imagery may have a tile here and none there. It cannot be had if none at all comes.
function imagery_layer(imagery, own, on_words) {
  if (!is_address_of_tiles(imagery)) throw new Error("Imagery needs an address of tiles with {z}, {x} and {y} in it, such as https://example.org/{z}/{x}/{y}.png.");
  const provider = new UrlTemplateImageryProvider({ url: own ? asked_by_cesium(imagery) : imagery });
  let comes = false, said = false;
  provider.errorEvent.addEventListener(() => {
    if (comes || said) return;
    said = true;
    on_words(`No imagery comes from ${new URL(imagery, document.baseURI).host}: the address is wrong, nobody answers, or the host does not allow this page (CORS).`);
  });
  const request = provider.requestImage.bind(provider);
  provider.requestImage = (...tile) => request(...tile)?.then((image) => {
    if (said && !comes) on_words("");
    comes = true;
    return image;
  });
  return new ImageryLayer(provider);
}

// rectangle: west, south, east and north in metres of Web Mercator. Tilesets ask for one level less than a provider
// has, so CesiumJS's own provider of single pictures, which has one, shows nothing on them.
function single_picture({ url, rectangle: [west, south, east, north], width, height }, on_there) {
  const tilingScheme = new Cesium.WebMercatorTilingScheme({
    rectangleSouthwestInMeters: new Cesium.Cartesian2(west, south), rectangleNortheastInMeters: new Cesium.Cartesian2(east, north) });
  const provider = new UrlTemplateImageryProvider({ url, tilingScheme, rectangle: tilingScheme.rectangle, maximumLevel: 1, tileWidth: width, tileHeight: height });
  const request = provider.requestImage.bind(provider);
  provider.requestImage = (...place) => {
    const image = request(...place);
    image?.then(on_there, () => {});  // one that fails is told by the layer
    return image;
  };
  return new ImageryLayer(provider);
}

// CesiumJS takes several frames to lay a picture on tiles, and shows none of these meanwhile. Where nothing is fetched nobody else has them drawn.
const kFrames = 20;
function draw_frames(scene) {
  let left = kFrames;
  const stop = scene.postRender.addEventListener(() => (--left > 0 ? scene.requestRender() : stop()));
  scene.requestRender();
}
