// The camera: turns about a point, which may ride with the tractor. Mouse, touch and keys.

import { add, lookAt, multiply, perspective, sub } from "./matrix.js";

// From ahead and beside, so that the beams are seen between the tractor and its row.
const START = { azimuth: 2.28, height: 0.34, distance: 8.2 };

export class Camera {
  constructor(canvas, changed) {
    this.changed = changed;
    this.follows = true;
    this.target = [-0.6, 0, 1.25];
    this.reset();
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.min(Math.max(event.deltaY, -200), 200) * 0.0015));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  reset() {
    Object.assign(this, START);
    this.changed();
  }

  setFollow(follows) {
    this.follows = follows;
    this.changed();
  }

  /** The tractor has come to here. */
  ride(at) {
    if (this.follows && at) this.target = [at.x + 1.25, at.y - 0.3, 1.2];
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const spread = () => {
      const [a, b] = [...this.pointers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
    };
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    if (this.pointers.size === 2) {
      const wide = spread();
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
      this.zoom(wide / spread());
      this.pan(dx / 2, dy / 2);
      return;
    }
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (event.shiftKey || event.buttons & 6) this.pan(dx, dy);
    else this.turn(-dx * 0.006, dy * 0.006);
  }

  turn(azimuth, height) {
    this.azimuth += azimuth;
    this.height = Math.min(Math.max(this.height + height, 0.02), 1.5);
    this.changed();
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.8), 220);
    this.changed();
  }

  pan(dx, dy) {
    const step = this.distance * 0.0013, c = Math.cos(this.azimuth), s = Math.sin(this.azimuth);
    // To the camera's right, and away from it over ground.
    this.setFollow(false);
    this.target = add(this.target, [(-dx * -s + -dy * c) * step, (-dx * c + -dy * s) * step, 0]);
    this.changed();
  }

  key(event) {
    const acts = {
      ArrowLeft: () => this.turn(-0.08, 0), ArrowRight: () => this.turn(0.08, 0), ArrowUp: () => this.turn(0, 0.06), ArrowDown: () => this.turn(0, -0.06),
      "+": () => this.zoom(0.88), "=": () => this.zoom(0.88), "-": () => this.zoom(1.14),
      a: () => this.pan(40, 0), d: () => this.pan(-40, 0), w: () => this.pan(0, 40), s: () => this.pan(0, -40),
      f: () => this.setFollow(!this.follows), r: () => this.reset(),
    };
    const act = event.ctrlKey || event.metaKey || event.altKey ? undefined : acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  eye() {
    const flat = Math.cos(this.height) * this.distance;
    const eye = add(this.target, [flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.height) * this.distance]);
    return [eye[0], eye[1], Math.max(eye[2], 0.15)];
  }

  /** What the shaders need, for a picture of this shape. */
  view(aspect) {
    const eye = this.eye(), far = Math.max(120, this.distance * 4);
    // A tall picture sees as wide as a wide one.
    const angle = aspect < 1 ? 2 * Math.atan(Math.tan(0.42) / aspect) : 0.84;
    const matrix = multiply(perspective(Math.min(angle, 1.7), aspect, 0.1, far), lookAt(eye, this.target, [0, 0, 1]));
    return { eye, matrix, far, ahead: sub(this.target, eye) };
  }
}
