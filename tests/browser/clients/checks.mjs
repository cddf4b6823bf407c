import assert from "node:assert/strict";

// What every client adds to a level's stated error: geoid interpolation, float32 positions, the earth's curve under a triangle.
export const kHeightTolerance_m = 0.3;

// found[i] is the client's height at places[i], null where it has none; kind is which of a place's heights it should be.
// Returns how far the worst is off.
export function assert_heights(found, places, kind, allowed_m) {
  let worst_m = 0;
  places.forEach((place, i) => {
    assert.ok(typeof found[i] === "number", `no terrain at ${place.lon}, ${place.lat}`);
    const off_m = Math.abs(found[i] - place[kind]);
    assert.ok(off_m <= allowed_m, `${off_m.toFixed(2)} m off at ${place.lon}, ${place.lat}, more than ${allowed_m.toFixed(2)} m`);
    worst_m = Math.max(worst_m, off_m);
  });
  return worst_m;
}

// The control: the same check must not let a flat raster pass, and for no other reason than its heights.
export function assert_no_relief(found, places, kind, allowed_m) {
  assert.throws(() => assert_heights(found, places, kind, allowed_m), /m off at/, "a flat raster passes for terrain");
}
