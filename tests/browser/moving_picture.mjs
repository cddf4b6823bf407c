// Still pictures one after the other, as an animated WebP that goes round for ever. The layout is that of WebP's container specification (RIFF, VP8X,
// ANIM, ANMF): a browser encodes the stills, and here is only what stands around them.
const bytes_of = (text) => Buffer.from(text, "latin1");
const whole = (value, size) => { const out = Buffer.alloc(size); out.writeUIntLE(value, 0, size); return out; };

function chunk(name, ...parts) {
  const body = Buffer.concat(parts);
  return Buffer.concat([bytes_of(name), whole(body.length, 4), body, Buffer.alloc(body.length % 2)]);
}

// The chunks of a still that hold its pixels: what stands behind RIFF's twelve bytes, less a header of its own.
function pixels_of(still) {
  const kept = [];
  for (let at = 12; at < still.length;) {
    const name = still.toString("latin1", at, at + 4), end = at + 8 + still.readUInt32LE(at + 4);
    if (["VP8 ", "VP8L", "ALPH"].includes(name)) kept.push(still.subarray(at, end + (end % 2)));
    at = end + (end % 2);
  }
  return Buffer.concat(kept);
}

export function moving_picture(stills, { width, height, frame_ms }) {
  const size = [whole(width - 1, 3), whole(height - 1, 3)], kMoves = 0x02, kBlack = 0xff000000, kForEver = 0;
  const frames = stills.map((still) => chunk("ANMF", whole(0, 6), ...size, whole(frame_ms, 3), whole(0, 1), pixels_of(still)));
  const body = Buffer.concat([bytes_of("WEBP"), chunk("VP8X", whole(kMoves, 4), ...size), chunk("ANIM", whole(kBlack, 4), whole(kForEver, 2)), ...frames]);
  return Buffer.concat([bytes_of("RIFF"), whole(body.length, 4), body]);
}
