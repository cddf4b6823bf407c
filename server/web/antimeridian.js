// Pictures on tiles that reach longitude -180. Their vertices there are at +180 for CesiumJS, so that a tile seems to go around the Earth, and has no
// picture (CesiumJS issue 12769). A tile of ours is never on both sides, so the side of its middle is that of all its vertices.
const { ModelImageryMapping } = window.Cesium;

// positions: cartographic ones, each the same object with other numbers. They may be gone through again and again.
export function on_one_side(positions) {
  let eastward = 0, beyond_a_quarter = false;
  for (const { longitude } of positions) {
    eastward += Math.sin(longitude);
    beyond_a_quarter ||= Math.abs(longitude) > Math.PI / 2;
  }
  const side = Math.sign(eastward);
  if (!beyond_a_quarter || side === 0) return positions;
  return { *[Symbol.iterator]() {
    for (const position of positions) {
      if (Math.abs(position.longitude) > Math.PI / 2 && Math.sign(position.longitude) !== side) position.longitude = side * Math.PI;
      yield position;
    }
  } };
}

// The class is one that CesiumJS does not document. Without it there is nothing to be put right here.
export function mend_antimeridian() {
  if (!ModelImageryMapping?.createCartographicPositions) return;
  const made = ModelImageryMapping.createCartographicPositions;
  ModelImageryMapping.createCartographicPositions = (...given) => on_one_side(made(...given));
}
