// What is seen from a place, as a picture over the terrain: colour where cells are seen, a rim at the radius, the place itself in the middle.
import { kSeen } from "./visible_cells.js";
import { latitude_of, pixels_around, row_at } from "./viewshed_grid.js";

const kSeenColour = [190, 40, 220, 120], kRim = [255, 255, 255, 170], kPlace = [255, 255, 255, 255], kPlaceRim = [40, 10, 60, 255];
const kPlaceShare = 0.012, kLeastPlace = 2.5;  // of the window's side; cells

// West, south, east and north, degrees.
export function rectangle_of({ zoom, west, north, side }) {
  const longitude = (column) => (column / pixels_around(zoom)) * 360 - 180;
  return [longitude(west), latitude_of(zoom, north + side), longitude(west + side), latitude_of(zoom, north)];
}

function colour_of(cell, from_middle, middle, place) {
  if (from_middle <= place) return kPlace;
  if (from_middle <= place + 1.5) return kPlaceRim;
  if (from_middle > middle) return null;
  if (from_middle > middle - 1) return kRim;
  return cell === kSeen ? kSeenColour : null;
}

// Rows of the picture are equally far apart in latitude, as a client lays a single picture; those of the window in the map's projection.
export function viewshed_picture(cells, window) {
  const { zoom, north, side } = window, [, south_deg, , north_deg] = rectangle_of(window), middle = (side - 1) / 2;
  const pixels = new Uint8ClampedArray(4 * side * side), place = Math.max(kLeastPlace, kPlaceShare * middle);
  for (let y = 0; y < side; ++y) {
    const latitude = north_deg + ((y + 0.5) / side) * (south_deg - north_deg);
    const row = Math.min(side - 1, Math.max(0, Math.floor(row_at(zoom, latitude) - north)));
    for (let x = 0; x < side; ++x) {
      const colour = colour_of(cells[row * side + x], Math.hypot(x - middle, row - middle), middle, place);
      if (colour) pixels.set(colour, 4 * (y * side + x));
    }
  }
  return pixels;
}
