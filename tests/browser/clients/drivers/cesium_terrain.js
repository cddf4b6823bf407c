import { Cartographic, sampleTerrainMostDetailed } from "cesium";
import { look_down, set_background, draw_little } from "./cesium_camera.js";

// A globe cuts tiles into smaller ones where the data ends, as long as it is asked for less error: what is enough for a picture.
const kLeastError_px = 1;

// Of both terrain providers. heights() asks the provider, as a program would that clamps things to the ground.
export function drive({ widget, terrainProvider }) {
  const { globe } = widget.scene;
  draw_little(widget.scene);
  const drawn = () => globe._surface.tileProvider._tilesToRenderByTextureCount.flat().filter(Boolean).length;
  return {
    settled() {
      widget.scene.requestRender();
      return globe.tilesLoaded && drawn() > 0;
    },
    tiles: drawn,
    look_down(view) {
      set_background(widget.scene, "#ff00ff");
      globe.maximumScreenSpaceError = Math.max(view.error_px, kLeastError_px);
      look_down(widget.camera, view);
    },
    hide() {
      globe.show = false;
      widget.scene.requestRender();
    },
    async heights(places) {
      const positions = places.map(({ lon, lat }) => Cartographic.fromDegrees(lon, lat));
      await sampleTerrainMostDetailed(terrainProvider, positions);
      return positions.map(({ height }) => height ?? null);
    },
  };
}
