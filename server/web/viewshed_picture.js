// What is seen from a place, as a picture over the terrain: colour where cells are seen, a rim at the radius, the place in the middle.
import { kSeen } from "./visible_cells.js";
import { metres_at, pixels_around } from "./viewshed_grid.js";

const kSeenColour = [190, 40, 220, 150], kRim = [255, 255, 255, 170], kPlace = [255, 255, 255, 255], kPlaceRim = [40, 10, 60, 255];
const kPlaceShare = 0.012, kLeastPlace = 2.5;  // of the window's side; cells

// Columns of a window that lie beside each other on the map, which ends at the antimeridian: first and count of the window's, column of the map.
export function parts_of({ zoom, west, side }) {
  const around = pixels_around(zoom), parts = [];
  for (let first = 0; first < side; first += parts.at(-1).count) {
    const column = (((west + first) % around) + around) % around;
    parts.push({ first, count: Math.min(side - first, around - column), column });
  }
  return parts;
}

// West, south, east and north of such a part, metres of Web Mercator.
export function rectangle_of({ zoom, north, side }, { column, count }) {
  return [metres_at(zoom, column), -metres_at(zoom, north + side), metres_at(zoom, column + count), -metres_at(zoom, north)];
}

function colour_of(cell, from_middle, middle, place) {
  if (from_middle <= place) return kPlace;
  if (from_middle <= place + 1.5) return kPlaceRim;
  if (from_middle > middle) return null;
  if (from_middle > middle - 1) return kRim;
  return cell === kSeen ? kSeenColour : null;
}

// Four bytes for each cell.
export function viewshed_picture(cells, { side }) {
  const middle = (side - 1) / 2, place = Math.max(kLeastPlace, kPlaceShare * middle);
  const pixels = new Uint8ClampedArray(4 * side * side);
  for (let k = 0; k < side * side; ++k) {
    const from_middle = Math.hypot((k % side) - middle, Math.floor(k / side) - middle);
    const colour = colour_of(cells[k], from_middle, middle, place);
    if (colour) pixels.set(colour, 4 * k);
  }
  return pixels;
}
