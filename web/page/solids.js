// The tractor, as boxes and wheels. Its origin is on the ground, abreast of the scanners: x to the right, y ahead, z up, metres.

const PAINT = { body: [0.12, 0.42, 0.30], dark: [0.14, 0.15, 0.16], glass: [0.62, 0.72, 0.76], rim: [0.88, 0.84, 0.70], metal: [0.52, 0.55, 0.57], sensor: [0.98, 0.78, 0.15] };

function box([x0, y0, z0], [x1, y1, z1], paint, out, taper = 0) {
  const [a, b] = [x0 + taper, x1 - taper];
  const corners = [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0], [a, y0 + taper, z1], [b, y0 + taper, z1], [b, y1 - taper, z1], [a, y1 - taper, z1]];
  const sides = [[4, 5, 6, 7, [0, 0, 1]], [0, 3, 2, 1, [0, 0, -1]], [0, 1, 5, 4, [0, -1, 0]], [2, 3, 7, 6, [0, 1, 0]], [1, 2, 6, 5, [1, 0, 0]], [3, 0, 4, 7, [-1, 0, 0]]];
  for (const [p, q, r, s, normal] of sides) for (const i of [p, q, r, p, r, s]) out.push(...corners[i], ...normal, ...paint);
}

function wheel([x, y, radius], width, out) {
  const count = 20;
  for (let i = 0; i < count; i++) {
    const [a, b] = [i, i + 1].map((k) => (k / count) * 2 * Math.PI);
    const rim = (angle, side, r = radius) => [x + side * width / 2, y + r * Math.cos(angle), radius + r * Math.sin(angle)];
    const normal = [0, Math.cos((a + b) / 2), Math.sin((a + b) / 2)];
    for (const [angle, side] of [[a, -1], [b, -1], [b, 1], [a, -1], [b, 1], [a, 1]]) out.push(...rim(angle, side), ...normal, ...PAINT.dark);
    for (const side of [-1, 1]) {
      for (const [r, paint, lift] of [[radius, PAINT.dark, 0], [radius * 0.58, PAINT.rim, 0.012]]) {
        const middle = [x + side * (width / 2 + lift), y, radius];
        const edge = (angle) => { const p = rim(angle, side, r); p[0] += side * lift; return p; };
        for (const p of [middle, edge(a), edge(b)]) out.push(...p, side, 0, 0, ...paint);
      }
    }
  }
}

/** Nine numbers a corner: place, normal, paint. */
export function tractor() {
  const out = [];
  // It stands behind its scanners, which are at its front.
  box([-0.32, -0.95, 0.55], [0.32, 0.28, 1.18], PAINT.body, out, 0.03);
  box([-0.28, 0.28, 0.6], [0.28, 0.33, 1.1], PAINT.dark, out);
  box([-0.30, -2.35, 0.45], [0.30, -0.9, 0.85], PAINT.dark, out);
  box([-0.52, -2.2, 0.85], [0.52, -0.95, 1.12], PAINT.body, out, 0.02);
  box([-0.48, -2.1, 1.12], [0.48, -1.0, 1.98], PAINT.glass, out, 0.05);
  box([-0.52, -2.16, 1.98], [0.52, -0.92, 2.08], PAINT.body, out, 0.03);
  for (const x of [-0.45, 0.41]) for (const y of [-2.08, -1.04]) box([x, y, 1.1], [x + 0.05, y + 0.05, 2.0], PAINT.dark, out);
  box([0.17, -0.4, 1.18], [0.23, -0.34, 1.75], PAINT.dark, out);
  for (const side of [-1, 1]) {
    wheel([side * 0.56, -1.85, 0.58], 0.3, out);
    wheel([side * 0.52, -0.15, 0.37], 0.22, out);
    box([side * 0.56 - 0.18, -2.35, 1.17], [side * 0.56 + 0.18, -1.3, 1.22], PAINT.body, out);
  }
  return new Float32Array(out);
}

/** A scanner, about its mirror. */
export function scanner() {
  const out = [];
  box([-0.055, -0.055, -0.1], [0.055, 0.055, 0.0], PAINT.sensor, out);
  box([-0.045, -0.045, 0.0], [0.045, 0.045, 0.05], PAINT.dark, out);
  return new Float32Array(out);
}

/** A mast from the ground's height to one, on which a scanner stands. */
export function mast() {
  const out = [];
  box([-0.02, -0.02, 0], [0.02, 0.02, 1], PAINT.metal, out);
  return new Float32Array(out);
}
