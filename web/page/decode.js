// Bytes of the server as things to draw. docs/watch.md and the crate's files picture.rs and orchard.rs say what stands where.

const LETTERS = new TextDecoder();

function magic(view) {
  return LETTERS.decode(new Uint8Array(view.buffer, view.byteOffset, 4));
}

/** A picture: {number, at, tractor, lines}; none of bytes that are none. */
export function readPicture(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 44 || magic(view) !== "RWP1") return null;
  const pose = Array.from({ length: 6 }, (_, i) => view.getFloat32(20 + 4 * i, true));
  const [x, y, up, heading, roll, pitch] = pose;
  const picture = {
    number: view.getUint32(4, true),
    at: view.getFloat64(12, true),
    tractor: Number.isNaN(x) ? null : { x, y, up, heading, roll, pitch },
    lines: [],
  };
  let at = 44;
  for (let left = view.getUint32(8, true); left > 0; left--) {
    const [line, end] = readLine(buffer, view, at);
    picture.lines.push(line);
    at = end;
  }
  return picture;
}

function readLine(buffer, view, at) {
  const beams = view.getUint32(at + 4, true);
  const flags = view.getUint32(at + 12, true);
  const sight = Array.from({ length: 12 }, (_, i) => view.getFloat32(at + 32 + 4 * i, true));
  const line = {
    scanner: view.getUint32(at, true),
    counter: view.getUint32(at + 8, true),
    at: view.getFloat64(at + 16, true),
    start: view.getFloat32(at + 24, true),
    step: view.getFloat32(at + 28, true),
    sight: null,
    range: new Float32Array(buffer, at + 80, beams),
    remission: null,
    classes: null,
  };
  let end = at + 80 + 4 * beams;
  if (flags & 1) {
    line.remission = new Uint16Array(buffer, end, beams);
    end += 2 * beams;
  }
  if (flags & 2) {
    line.classes = new Uint8Array(buffer, end, beams);
    end += beams;
  }
  if (flags & 4) {
    line.sight = { origin: sight.slice(0, 3), first: sight[3], step: sight[4], advance: sight[5], row: sight.slice(6, 9), up: sight.slice(9, 12) };
  }
  return [line, Math.ceil(end / 4) * 4];
}

/** Where beam `i` of a line met something, in the scene's frame, into `out` at `at`; false if it met nothing or nobody knows. */
export function returnOf(line, i, out, at) {
  const { sight, range } = line;
  const r = range[i];
  if (!sight || !Number.isFinite(r)) return false;
  const theta = sight.first + i * sight.step;
  const c = r * Math.cos(theta), s = r * Math.sin(theta);
  for (let k = 0; k < 3; k++) out[at + k] = sight.origin[k] + c * sight.row[k] + s * sight.up[k];
  out[at + 1] += i * sight.advance;
  return true;
}

/** An orchard: its head, and the two buffers as they go to the graphics card. */
export function readOrchard(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 8 || magic(view) !== "RWO1") return null;
  const length = view.getUint32(4, true);
  const head = JSON.parse(LETTERS.decode(new Uint8Array(buffer, 8, length)));
  const blades = 28 * (head.leaves + head.facets + head.grass);
  const sticks = 32 * (head.wood + head.supports);
  return {
    head,
    blades: new Uint8Array(buffer, 8 + length, blades),
    sticks: new Uint8Array(buffer, 8 + length + blades, sticks),
    bytes: buffer.byteLength,
  };
}
