// What is seen, without shortcuts: a straight line from the eye to each cell, against the ground at every line of the grid that it crosses.
const kEarth_m = 6378137, kRefraction = 0.13;

// 1 where a cell is seen, for cells within half a side of the middle.
export function lines_of_sight({ heights, side, cell_m }, eye_m) {
  const middle = (side - 1) / 2, eye = heights[middle * side + middle] + eye_m, seen = new Uint8Array(side * side);
  const drop_a_square = ((1 - kRefraction) * cell_m * cell_m) / (2 * kEarth_m);
  const slope_to = (height, cells) => (height - drop_a_square * cells * cells - eye) / cells;

  // Between two cells of a line of the grid. x, y: from the middle, one of them whole.
  const ground_at = (x, y) => {
    const [left, top] = [Math.floor(x), Math.floor(y)], share = x - left + (y - top);
    const at = (top + middle) * side + left + middle;
    return share === 0 ? heights[at] : heights[at] + share * (heights[at + (x > left ? 1 : side)] - heights[at]);
  };
  const is_seen = (x, y) => {
    const far = Math.hypot(x, y), slope = slope_to(heights[(y + middle) * side + x + middle], far);
    const hides = (across, along, k) => {
      const share = k / Math.abs(across), [a, b] = [Math.sign(across) * k, along * share];
      return slope_to(across === x ? ground_at(a, b) : ground_at(b, a), far * share) > slope;
    };
    for (let k = 1; k < Math.abs(x); ++k) if (hides(x, y, k)) return false;
    if (Math.abs(y) === Math.abs(x)) return true;  // the same crossings
    for (let k = 1; k < Math.abs(y); ++k) if (hides(y, x, k)) return false;
    return true;
  };
  for (let y = -middle; y <= middle; ++y) {
    for (let x = -middle; x <= middle; ++x) {
      if (Math.hypot(x, y) <= middle) seen[(y + middle) * side + x + middle] = (x === 0 && y === 0) || is_seen(x, y) ? 1 : 0;
    }
  }
  return seen;
}
