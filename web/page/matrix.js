// 4 × 4 matrices in columns, and three numbers as vectors.

export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const times = (a, f) => [a[0] * f, a[1] * f, a[2] * f];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => times(a, 1 / (Math.hypot(...a) || 1));

export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

export function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
}

export function lookAt(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}

/** Turned about Z by heading (clockwise from +Y), rolled right side down, pitched nose up, and moved. */
export function pose(at, heading, roll, pitch) {
  const [sh, ch, sr, cr, sp, cp] = [Math.sin(heading), Math.cos(heading), Math.sin(roll), Math.cos(roll), Math.sin(pitch), Math.cos(pitch)];
  const ahead = [sh * cp, ch * cp, sp], flat = [ch, -sh, 0], top = cross(flat, ahead);
  const right = add(times(flat, cr), times(top, -sr)), up = cross(right, ahead);
  return new Float32Array([...right, 0, ...ahead, 0, ...up, 0, ...at, 1]);
}
