import { Cartesian3, Cartographic, Ellipsoid, Ray } from "cesium";
import { look_down, set_background, draw_little } from "./cesium_camera.js";

// The tileset's own getHeight looks towards the earth's centre, metres to the side on a mountain: this is the ellipsoid's normal.
function height_at({ scene }, tileset, { lon, lat }) {
  const above = Cartesian3.fromDegrees(lon, lat, 20000);
  const down = Cartesian3.negate(Ellipsoid.WGS84.geodeticSurfaceNormal(above, new Cartesian3()), new Cartesian3());
  const hit = tileset.pick(new Ray(above, down), scene.frameState, new Cartesian3());
  return hit ? Cartographic.fromCartesian(hit).height : null;
}

export function drive({ widget, tileset }) {
  draw_little(widget.scene);
  return {
    settled() {
      widget.scene.requestRender();
      return tileset.tilesLoaded && tileset.statistics.selected > 0;
    },
    tiles: () => tileset.statistics.selected,
    look_down(view) {
      set_background(widget.scene, "#ff00ff");
      tileset.maximumScreenSpaceError = view.error_px;
      tileset.cullRequestsWhileMoving = false;
      look_down(widget.camera, view);
    },
    hide() {
      tileset.show = false;
      widget.scene.requestRender();
    },
    heights: (places) => places.map((place) => height_at(widget, tileset, place)),
  };
}
