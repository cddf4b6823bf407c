import { layer_of, look_down } from "./deck_camera.js";
import { highest_in } from "./lonlat_mesh.js";

const kFinestOffset = 4;  // zooms beyond what pixels ask for: the finest tiles, from above all of the data
const kTilePixels = 256;
const kWorld = 512;  // deck.gl's common units around the earth

// Mercator's rows are not linear in latitude, and triangles are straight on the map: both sides are compared there.
const row_of = (lat) => kWorld * (0.5 + Math.log(Math.tan(Math.PI / 4 + (lat * Math.PI) / 360)) / (2 * Math.PI));
const column_of = (lon) => kWorld * (lon / 360 + 0.5);

// deck.gl moves what a picture shows: a pixel's height goes to its north-western corner, and every tile is stretched by a
// pixel to each side, so that tiles overlap. Where a place came to lie by both; nothing if the tile does not hold it.
function stretched({ index: { x, y, z }, content: [mesh] }, [column, row]) {
  const size = kWorld / 2 ** z, west = x * size, south = kWorld - (y + 1) * size;
  const [u, v] = [(column - west) / size, (row - south) / size];
  if (u < 0 || u > 1 || v < 0 || v > 1) return null;
  const [[left, bottom], [right, top]] = mesh.header.boundingBox;
  const half = 0.5 / kTilePixels;
  return { lon: left + Math.max(u - half, 0) * (right - left), lat: bottom + Math.min(v + half, 1) * (top - bottom) };
}

function height_in_tile(tile, place) {
  const at = stretched(tile, place), [mesh] = tile.content;
  return at && highest_in([{ vertices: mesh.attributes.POSITION.value, triangles: mesh.indices.value }], at);
}

export function drive({ deck }) {
  const tileset = () => layer_of(deck, "terrain-tiles")?.state.tileset;
  const loaded = () => tileset()?.selectedTiles?.filter(({ content }) => content?.[0]) ?? [];
  return {
    settled: () => Boolean(tileset()?.isLoaded) && loaded().length > 0,
    tiles: () => loaded().length,
    look_down(view) {
      document.body.style.background = "#ff00ff";
      deck.setProps({ layers: [deck.props.layers[0].clone({ zoomOffset: view.finest ? kFinestOffset : 0 })] });
      look_down(deck, view);
    },
    hide: () => { deck.setProps({ layers: [] }); },
    heights: (places) => places.map(({ lon, lat }) => {
      const at = [column_of(lon), row_of(lat)];
      const found = loaded().map((tile) => height_in_tile(tile, at)).filter((height) => height !== null);
      return found.length > 0 ? Math.max(...found) : null;
    }),
  };
}
