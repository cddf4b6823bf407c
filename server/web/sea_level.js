// The geoid's height above the ellipsoid, as the service knows it: asked once for a place of some two kilometres, since it changes slowly.
import { ask } from "./token.js";

const kCells_a_degree = 50;

export class SeaLevel {
  // base: the dataset's address. on_answer() is called when a height that was asked for is there.
  constructor(base, on_answer) {
    Object.assign(this, { base, on_answer, known: new Map(), asking: false, name: "" });
  }

  // Metres, or undefined while nobody knows.
  undulation_at(longitude, latitude) {
    const cell = `${Math.round(longitude * kCells_a_degree)},${Math.round(latitude * kCells_a_degree)}`;
    if (!this.known.has(cell) && !this.asking) this.fetch(cell, longitude, latitude);
    return this.known.get(cell);
  }

  async fetch(cell, longitude, latitude) {
    this.asking = true;
    const found = await undulation(this.base, longitude, latitude);
    this.known.set(cell, found?.metres);  // nobody will know later either
    this.name = found?.geoid ?? "";
    this.asking = false;
    this.on_answer();
  }
}

// { metres, geoid }, or null without a geoid and beside the data.
async function undulation(base, longitude, latitude) {
  try {
    const response = await ask(`${base}/elevation?points=${longitude.toFixed(6)},${latitude.toFixed(6)}`);
    const { points: [{ ellipsoidal_height: above_ellipsoid, orthometric_height: above_sea }], geoid } = await response.json();
    return above_sea === null || above_ellipsoid === null ? null : { metres: above_ellipsoid - above_sea, geoid };
  } catch {
    return null;
  }
}
