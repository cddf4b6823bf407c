// Which cells of a height grid can be seen from one of them: a ray to each cell of the rim, as R2 of Franklin and Ray (1994). No page is
// needed for it: the test runs it beside GDAL's.
const kEarth_m = 6378137;
// Light bends after the Earth: of a drop by its curvature, 13 % are taken back.
const kRefraction = 0.13;

// How far the surface lies below the observer's horizon, at a distance.
export const drop_m = (distance_m) => ((1 - kRefraction) * distance_m * distance_m) / (2 * kEarth_m);

export const kHidden = 0, kSeen = 1, kNoData = 2;

// heights: rows of side cells from the north, NaN without data, the observer's cell in the middle; cell_m: a cell's side on the ground;
// eye_m: the observer above it. Gives a byte for each cell: kSeen, kHidden, or kNoData where it has no height. Cells farther than
// half a side are hidden. Null where the observer's own cell has no height.
export function visible_cells({ heights, side, cell_m, eye_m }) {
  const middle = (side - 1) / 2, eye = heights[middle * side + middle] + eye_m;
  if (Number.isNaN(eye)) return null;
  const seen = Uint8Array.from(heights, (height) => (Number.isNaN(height) ? kNoData : kHidden));
  seen[middle * side + middle] = kSeen;
  // drops[k]: by which what is k steps of a straight ray away is lowered, by the square of the cells' distance.
  const drop_a_square = drop_m(cell_m);

  // across: how far the ray moves sideways with each step along, -1 to 1. along, aside: steps between cells of the array.
  const cast = (along, aside, across) => {
    const stretch = Math.sqrt(1 + across * across);  // of a step, in cells
    let steepest = -Infinity;
    for (let step = 1; step <= middle && step * stretch <= middle; ++step) {
      const beside = step * across, near = Math.floor(beside), share = beside - near;
      const at = middle * side + middle + step * along + near * aside;
      const height = share === 0 ? heights[at] : heights[at] + share * (heights[at + aside] - heights[at]);
      const cells = step * stretch, nearest = share < 0.5 ? at : at + aside;
      if (Number.isNaN(height)) continue;  // nothing is there to hide what is behind
      const slope = (height - drop_a_square * cells * cells - eye) / cells;
      if (slope < steepest) continue;
      steepest = slope;
      if (seen[nearest] === kHidden) seen[nearest] = kSeen;
    }
  };
  for (let k = -middle; k <= middle; ++k) {
    const across = k / middle;
    cast(side, 1, across);
    cast(-side, 1, across);
    cast(1, side, across);
    cast(-1, side, across);
  }
  return seen;
}
