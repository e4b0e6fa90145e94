// The canopy along the row: what stands there by height, and by metre beside what was measured. The tractor stays in place and the row passes.

import { css, scale } from "./colour.js";

const WINDOW = 14;
const AHEAD = 0.3;

/** The colour of a share of the fullest cell: the root, so that thin parts of the canopy can be seen. */
function shadeOf(share) {
  return scale(0.12 + 0.88 * Math.sqrt(share));
}

export class StripView {
  constructor(canvas, keys) {
    this.canvas = canvas;
    this.keys = keys;
    this.strip = null;
    this.version = -1;
  }

  take({ version, strip }) {
    this.version = version;
    this.strip = strip;
    this.most = Math.max(1e-6, ...strip.truth.flatMap((column) => column.leaf_area_m2));
    this.bands = Math.max(1, ...strip.truth.map((column) => column.leaf_area_m2.length));
    const text = [];
    if (strip.truth.length) text.push(["leaf area that stands there, by metre", css([138, 134, 120])]);
    if (strip.measured.some((metres) => metres.length)) text.push(["leaf area measured", css([0, 158, 115])], ["impacted area", css([230, 159, 0])]);
    this.keys.replaceChildren(...text.map(([words, colour]) => {
      const chip = document.createElement("span"), dot = document.createElement("span");
      chip.className = "chip";
      dot.className = "dot";
      dot.style.background = colour;
      chip.append(dot, words);
      return chip;
    }), ...(strip.truth.length ? [this.scaleOf()] : []));
  }

  /** What the colours of the upper half mean: leaf area a cell. */
  scaleOf() {
    const chip = document.createElement("span"), bar = document.createElement("canvas");
    chip.className = "chip scale";
    bar.width = 90;
    bar.height = 8;
    const context = bar.getContext("2d");
    for (let x = 0; x < 90; x++) {
      context.fillStyle = css(shadeOf(x / 89));
      context.fillRect(x, 0, 1, 8);
    }
    const { y_from_m: from, y_to_m: to } = this.strip.truth[0];
    chip.append("by height: 0", bar, `${this.most.toFixed(2)} m² in ${(to - from).toFixed(2)} × ${this.strip.band_m} m`);
    return chip;
  }

  get isEmpty() {
    return !this.strip || (!this.strip.truth.length && !this.strip.measured.some((metres) => metres.length));
  }

  draw(y, ink) {
    const { canvas, strip } = this;
    if (this.isEmpty) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d"), last = strip.measured.flat().at(-1);
    const here = y ?? last?.y_to_m ?? 0, from = here - WINDOW * (1 - AHEAD), metre = width / WINDOW;
    const view = { context, width, height, ratio, from, metre, x: (at) => (at - from) * metre, split: strip.truth.length ? height * 0.52 : 0, ink };
    context.clearRect(0, 0, width, height);
    if (strip.truth.length) this.heights(view);
    this.metres(view);
    this.axis(view, here);
    if (strip.truth.length) this.upAxis(view);
  }

  /** Calls `each` with every truth column that is in sight, where it is. */
  columns({ from }, each) {
    const { truth, period_m: period } = this.strip;
    const first = period ? Math.floor(from / period) : 0, last = period ? Math.floor((from + WINDOW) / period) : 0;
    for (let round = first; round <= last; round++) for (const column of truth) {
      const shift = round * (period ?? 0);
      if (column.y_to_m + shift > from && column.y_from_m + shift < from + WINDOW) each(column, shift);
    }
  }

  heights(view) {
    const { context, split } = view, tall = split / this.bands;
    this.columns(view, (column, shift) => {
      const x = view.x(column.y_from_m + shift), wide = view.x(column.y_to_m + shift) - x;
      column.leaf_area_m2.forEach((area, band) => {
        if (area <= 0) return;
        context.fillStyle = css(shadeOf(area / this.most));
        context.fillRect(x, split - (band + 1) * tall, wide + 0.6, tall + 0.6);
      });
    });
  }

  /** Heights above the ground, every metre, beside the upper half. */
  upAxis({ context, split, ratio, ink }) {
    const { z_from_m: lowest, band_m: tall } = this.strip, metre = split / (this.bands * tall);
    context.fillStyle = ink.soft;
    context.strokeStyle = ink.line;
    context.lineWidth = ratio;
    context.font = `${10 * ratio}px system-ui, sans-serif`;
    for (let z = Math.ceil(lowest); (z - lowest) * metre <= split; z++) {
      const y = split - (z - lowest) * metre;
      context.beginPath();
      context.moveTo(0, y + 0.5);
      context.lineTo(6 * ratio, y + 0.5);
      context.stroke();
      if (y <= 9 * ratio) continue;
      // Over the colours a label needs paper of its own.
      const words = z === 0 ? "ground" : `${z} m high`, wide = context.measureText(words).width;
      context.fillStyle = ink.paper;
      context.fillRect(6 * ratio, y - 11 * ratio, wide + 4 * ratio, 12 * ratio);
      context.fillStyle = ink.soft;
      context.fillText(words, 8 * ratio, y - 2 * ratio);
    }
  }

  metres(view) {
    const { context, split, height, ratio, ink } = view, floor = height - 16 * ratio, room = floor - split - 8 * ratio;
    const truth = new Map();
    this.columns(view, (column, shift) => {
      const metre = Math.floor((column.y_from_m + column.y_to_m) / 2 + shift);
      truth.set(metre, (truth.get(metre) ?? 0) + column.leaf_area_m2.reduce((sum, area) => sum + area, 0));
    });
    const measured = this.strip.measured.flat();
    const areas = [...truth.values(), ...measured.flatMap((of) => [of.leaf_area_m2 ?? 0, of.impacted_m2 ?? 0])];
    const most = Math.max(...areas, 1e-6);
    const bar = (y0, y1, area, colour, inset) => {
      const x = view.x(y0) + inset * ratio, tall = (area / most) * room;
      context.fillStyle = colour;
      context.fillRect(x, floor - tall, Math.max(1, view.x(y1) - view.x(y0) - 2 * inset * ratio), tall);
    };
    for (const [metre, area] of truth) bar(metre, metre + 1, area, css([138, 134, 120], 0.45), 1);
    for (const of of measured) {
      const middle = (of.y_from_m + of.y_to_m) / 2;
      if (of.leaf_area_m2 !== null) bar(of.y_from_m, middle, of.leaf_area_m2, css([0, 158, 115]), 3);
      if (of.impacted_m2 !== null) bar(middle, of.y_to_m, of.impacted_m2, css([230, 159, 0]), 3);
    }
    context.fillStyle = ink.soft;
    context.font = `${10 * ratio}px system-ui, sans-serif`;
    context.fillText(`${most.toFixed(1)} m² a metre`, 4 * ratio, split + 11 * ratio);
  }

  axis(view, here) {
    const { context, height, ratio, from, ink } = view, floor = height - 16 * ratio;
    context.fillStyle = ink.soft;
    context.strokeStyle = ink.line;
    context.lineWidth = ratio;
    context.beginPath();
    context.moveTo(0, floor + 0.5);
    context.lineTo(view.width, floor + 0.5);
    context.stroke();
    context.font = `${10 * ratio}px system-ui, sans-serif`;
    context.textAlign = "center";
    for (let y = Math.ceil(from / 2) * 2; y < from + WINDOW; y += 2) context.fillText(`${y} m`, view.x(y), height - 3 * ratio);
    context.textAlign = "start";
    context.strokeStyle = ink.accent;
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    context.moveTo(view.x(here), 0);
    context.lineTo(view.x(here), floor);
    context.stroke();
  }
}
