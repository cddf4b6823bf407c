// Heights around a place, on a grid of the map's own pixels: from Terrarium tiles, since every dataset with a geoid has them.
const kTilePixels = 256, kAround_m = 2 * Math.PI * 6378137;
const kMostCells = 512;  // from the middle to a side: rays through more take seconds
const kRadian = Math.PI / 180;

export const pixels_around = (zoom) => kTilePixels * 2 ** zoom;
export const column_at = (zoom, longitude) => ((longitude + 180) / 360) * pixels_around(zoom);
export const row_at = (zoom, latitude) => (0.5 - Math.asinh(Math.tan(latitude * kRadian)) / (2 * Math.PI)) * pixels_around(zoom);
export const latitude_of = (zoom, row) => Math.atan(Math.sinh(Math.PI * (1 - (2 * row) / pixels_around(zoom)))) / kRadian;
// Of the map's own metres: eastward for columns, southward for rows.
export const metres_at = (zoom, pixel) => (pixel / pixels_around(zoom) - 0.5) * kAround_m;
// A pixel's side on the ground: the map's scale is that of the latitude.
export const cell_at = (zoom, latitude) => (kAround_m * Math.cos(latitude * kRadian)) / pixels_around(zoom);

// The pixels around a place, in the middle of which it is: at the finest zoom that has a radius within kMostCells. minzoom, maxzoom:
// those that tiles have. west, north: the first pixel, counted from the map's corner; side: pixels across, an odd number.
export function window_around({ minzoom, maxzoom }, { longitude, latitude }, radius_m) {
  let zoom = maxzoom;
  while (zoom > minzoom && radius_m / cell_at(zoom, latitude) > kMostCells) --zoom;
  const cell_m = cell_at(zoom, latitude), reach = Math.min(Math.ceil(radius_m / cell_m), kMostCells);
  const [column, row] = [Math.floor(column_at(zoom, longitude)), Math.floor(row_at(zoom, latitude))];
  return { zoom, cell_m, west: column - reach, north: row - reach, side: 2 * reach + 1 };
}

// The tiles that a window and the data have in common: column and row as the window counts them, x as addresses do.
export function tiles_of_window({ zoom, west, north, side }, [data_west, south, east, data_north]) {
  const across = 2 ** zoom, tile = (pixel) => Math.floor(pixel / kTilePixels);
  const whole = data_east_of(data_west, east);
  const rows = [Math.max(tile(north), tile(row_at(zoom, data_north))), Math.min(tile(north + side - 1), tile(row_at(zoom, south)), across - 1)];
  const tiles = [];
  for (let row = Math.max(rows[0], 0); row <= rows[1]; ++row) {
    for (let column = tile(west); column <= tile(west + side - 1); ++column) {
      const x = ((column % across) + across) % across;
      // Data may go over the antimeridian: then their columns go on beyond the last.
      const inside = (at) => at >= tile(column_at(zoom, data_west)) && at <= tile(column_at(zoom, whole));
      if (inside(x) || inside(x + across)) tiles.push({ z: zoom, x, y: row, column, row });
    }
  }
  return tiles;
}
const data_east_of = (west, east) => (east < west ? east + 360 : east);

// What Terrarium says; the last of a pixel's four bytes is not read.
export const height_of = (pixels, k) => pixels[4 * k] * 256 + pixels[4 * k + 1] + pixels[4 * k + 2] / 256 - 32768;

// Puts a tile's heights into the window's. pixels, mask: four bytes a pixel; where the last of the mask's is 0 there is no data. Without
// a mask everything is.
export function put_tile(heights, { west, north, side }, { column, row }, pixels, mask) {
  const [left, top] = [column * kTilePixels - west, row * kTilePixels - north];
  for (let y = Math.max(0, -top); y < kTilePixels && y + top < side; ++y) {
    for (let x = Math.max(0, -left); x < kTilePixels && x + left < side; ++x) {
      const k = y * kTilePixels + x;
      heights[(y + top) * side + x + left] = mask && mask[4 * k + 3] === 0 ? NaN : height_of(pixels, k);
    }
  }
}

// Square metres of the cells that have a value, each as large as its row's latitude makes it.
export function area_of(cells, wanted, { zoom, north, side }) {
  let area = 0;
  for (let row = 0; row < side; ++row) {
    const cell_m = cell_at(zoom, latitude_of(zoom, north + row + 0.5));
    for (let k = row * side; k < (row + 1) * side; ++k) if (cells[k] === wanted) area += cell_m * cell_m;
  }
  return area;
}
