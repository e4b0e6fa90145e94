// Trees from afar: a few of a tree's leaves, larger, as triangles that lie ready, so that all trees alike are one call.

const LEAVES = 100;
const BYTES = 28;

/** Corners of the first leaves of a tree, six numbers each: place and normal. `first` and `count` are its leaves among `blades`. */
export function crown(blades, first, count) {
  const view = new DataView(blades.buffer, blades.byteOffset, blades.byteLength), out = [];
  const shown = Math.min(LEAVES, count), grow = Math.sqrt(count / Math.max(shown, 1)) * 0.5;
  for (let i = 0; i < shown; i++) {
    const at = (first + i) * BYTES;
    const three = (from, read) => [0, 1, 2].map((k) => read(at + from + k));
    const centre = [0, 4, 8].map((k) => view.getFloat32(at + k, true));
    const normal = three(12, (place) => view.getInt8(place) / 127), along = three(16, (place) => view.getInt8(place) / 127);
    const across = [normal[1] * along[2] - normal[2] * along[1], normal[2] * along[0] - normal[0] * along[2], normal[0] * along[1] - normal[1] * along[0]];
    const [long, wide] = [20, 22].map((k) => view.getUint16(at + k, true) * 1e-4 * grow);
    const corner = (u, v) => centre.map((c, k) => c + u * long * along[k] + v * wide * across[k]);
    for (const [u, v] of [[-1, 0], [0, -1], [1, 0], [-1, 0], [1, 0], [0, 1]]) out.push(...corner(u, v), ...normal);
  }
  return new Float32Array(out);
}
