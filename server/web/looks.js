// How the terrain is shown: its colours, its triangles, how high, how fine.
import { height_tint, plain_ambient } from "./terrain_style.js";
import { ask, asked_by_cesium } from "./token.js";

const Cesium = window.Cesium;
const { Color, ImageryLayer, Rectangle, UrlTemplateImageryProvider } = Cesium;

// Of neighbouring levels, clearly different.
const kLevelColours = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#edc948", "#b07aa1", "#9c755f"].map((css) => Color.fromCssColorString(css));

export class Looks {
  constructor(scene, tileset, manifest, base) {
    Object.assign(this, { scene, tileset, manifest, base, look: "height", imagery_url: "" });
    this.tint = height_tint(manifest.bounds[4], manifest.bounds[5]);
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

  // look: height, hillshade, levels, plain or imagery. Fails with a reason where an image layer cannot be had.
  async show(look, imagery_url = "") {
    this.look = look;
    this.tileset.customShader = look === "height" ? this.tint : undefined;
    // White would replace the imagery, not light it.
    this.tileset.colorBlendMode = look === "levels" ? Cesium.Cesium3DTileColorBlendMode.REPLACE : Cesium.Cesium3DTileColorBlendMode.HIGHLIGHT;
    this.tileset.imageryLayers.removeAll();
    if (look === "hillshade") this.tileset.imageryLayers.add(await this.hillshade());
    if (look === "imagery" && imagery_url) this.tileset.imageryLayers.add(new ImageryLayer(new UrlTemplateImageryProvider({ url: imagery_url })));
  }

  async hillshade() {
    const response = await ask(`${this.base}/hillshade.json`);
    if (!response.ok) throw new Error(`hillshade: HTTP ${response.status}`);
    const { bounds, maxzoom, minzoom } = await response.json();
    return new ImageryLayer(new UrlTemplateImageryProvider({
      url: asked_by_cesium(`${this.base}/hillshade/{z}/{x}/{y}.png`), rectangle: Rectangle.fromDegrees(...bounds), minimumLevel: minzoom, maximumLevel: maxzoom,
    }));
  }

  exaggerate(factor) {
    this.scene.verticalExaggeration = factor;
    this.tint.setUniform("u_low", this.manifest.bounds[4] * factor);
    this.tint.setUniform("u_range", Math.max(this.manifest.bounds[5] - this.manifest.bounds[4], 1) * factor);
  }
}
