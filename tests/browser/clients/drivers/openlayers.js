import { fromLonLat } from "ol/proj.js";

const kWorld_m = 2 * 20037508.342789244, kSide = 256;

// The height between the centres of the four nearest pixels of the finest tiles, as a picture of heights is meant.
function height_near(map, source, height_at, { lon, lat }) {
  const pixel_m = kWorld_m / kSide / 2 ** source.getTileGrid().getMaxZoom();
  const [x, y] = fromLonLat([lon, lat]).map((metres) => metres / pixel_m - 0.5), [column, row] = [Math.floor(x), Math.floor(y)];
  const at = (i, j) => height_at(map.getPixelFromCoordinate([(column + i + 0.5) * pixel_m, (row + j + 0.5) * pixel_m]));
  const mix = (from, to, share) => from + (to - from) * share;
  return mix(mix(at(0, 0), at(1, 0), x - column), mix(at(0, 1), at(1, 1), x - column), y - row);
}

export function drive({ map, heights, height_at }) {
  const source = heights.getSource(), zoom = source.getTileGrid().getMaxZoom();
  let drawn = false, loaded = 0;
  map.on("rendercomplete", () => { drawn = true; });
  source.on("tileloadend", () => { ++loaded; });
  const go_to = async ({ lon, lat }) => {
    const done = new Promise((complete) => map.once("rendercomplete", complete));
    map.getView().setZoom(zoom);
    map.getView().setCenter(fromLonLat([lon, lat]));
    map.render();
    await done;
  };
  return {
    settled: () => drawn && loaded > 0,
    tiles: () => loaded,
    look_down() {},
    async heights(places) {
      const found = [];
      for (const place of places) {
        await go_to(place);
        found.push(height_near(map, source, height_at, place));
      }
      return found;
    },
  };
}
