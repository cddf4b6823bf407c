import { Color, Raycaster, Vector3 } from "three";

const kRadians = Math.PI / 180;

// From above the middle of the bounds, north up, so that the picture's height covers a share of their north-south extent.
function look_down({ ellipsoid }, camera, { bounds: [west, south, east, north, , top], share }) {
  const [lat, lon] = [(south + north) / 2, (west + east) / 2];
  const range_m = (share * (north - south) * 111000) / 2 / Math.tan((camera.fov / 2) * kRadians);
  const at = (latitude, height, target) => ellipsoid.getCartographicToPosition(latitude * kRadians, lon * kRadians, height, target);
  at(lat, top + range_m, camera.position);
  camera.up.copy(at(lat + 0.01, 0, new Vector3())).sub(at(lat, 0, new Vector3())).normalize();
  camera.lookAt(at(lat, 0, new Vector3()));
}

export function drive({ tiles, camera, scene }) {
  const height_at = ({ lon, lat }) => {
    const above = tiles.ellipsoid.getCartographicToPosition(lat * kRadians, lon * kRadians, 20000, new Vector3());
    const up = tiles.ellipsoid.getCartographicToNormal(lat * kRadians, lon * kRadians, new Vector3());
    const [hit] = new Raycaster(above, up.negate()).intersectObject(tiles.group, true);
    return hit ? tiles.ellipsoid.getPositionToCartographic(hit.point, {}).height : null;
  };
  return {
    settled: () => tiles.loadProgress === 1 && tiles.visibleTiles.size > 0 && tiles.stats.failed === 0,
    tiles: () => tiles.visibleTiles.size,
    look_down(view) {
      scene.background = new Color("#ff00ff");
      tiles.errorTarget = view.error_px;
      look_down(tiles, camera, view);
    },
    hide: () => { tiles.group.visible = false; },
    heights: (places) => places.map(height_at),
  };
}
