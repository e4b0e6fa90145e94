// The fan of one scanner: where its beams end, seen along the row. Row to the right and up is up where a scene or a rig says so; else as the device counts.

import { css } from "./colour.js";

const NEVER = 3000;

export class Fan {
  constructor(about, number, host) {
    this.number = number;
    this.line = null;
    this.lines = -1;
    this.changed = 0;
    const card = document.createElement("section");
    card.className = "card fan";
    card.setAttribute("aria-label", `Scan line of ${about.name}`);
    const title = document.createElement("h2"), model = document.createElement("small");
    this.state = document.createElement("span");
    this.state.className = "state";
    this.state.textContent = "no scan yet";
    this.state.dataset.status = "stale";
    model.textContent = about.model;
    title.append(about.name, model, this.state);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Ranges of ${about.name} by angle`);
    card.append(title, this.canvas);
    host.append(card);
  }

  take(line) {
    if (this.line && this.line.counter === line.counter && this.line.at === line.at) return false;
    this.line = line;
    return true;
  }

  /** What the scanner says of itself, or that it says nothing. */
  tell({ status, lines, ended }, isPaused, now) {
    if (ended) {
      this.state.dataset.status = "stale";
      this.state.textContent = "ended";
      return;
    }
    if (lines !== this.lines || isPaused) [this.lines, this.changed] = [lines, now];
    const stale = now - this.changed > NEVER;
    const words = { ok: "ok", contamination_warning: "window dirty", contamination_error: "window too dirty", error: "device error" };
    this.state.dataset.status = stale ? "stale" : (status ?? "stale");
    this.state.textContent = stale ? "no scans" : (words[status] ?? "no scan yet");
  }

  draw(colouring, ink) {
    const { canvas, line } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    if (!line) return;
    const view = this.frame(line, colouring, width, height);
    this.rings(context, view, ink, ratio);
    this.beams(context, view, line, colouring, ratio);
  }

  /** Where the scanner stands on the canvas, and how many pixels a metre is: so that all that beams can reach within the scale fits. */
  frame(line, colouring, width, height) {
    const angle = (i) => (line.sight ? line.sight.first + i * line.sight.step : ((line.start + i * line.step) * Math.PI) / 180);
    let [left, right, low, high] = [-0.04, 0.04, -0.04, 0.04];
    for (let i = 0; i < line.range.length; i += 4) {
      const r = Number.isFinite(line.range[i]) ? Math.min(line.range[i] / colouring.far, 1.15) : 0.25;
      left = Math.min(left, r * Math.cos(angle(i)));
      right = Math.max(right, r * Math.cos(angle(i)));
      low = Math.min(low, r * Math.sin(angle(i)));
      high = Math.max(high, r * Math.sin(angle(i)));
    }
    // Slowly, so that the picture does not jump with every leaf.
    const wanted = [left, right, low, high];
    this.box = this.box?.map((old, k) => old + 0.08 * (wanted[k] - old)) ?? wanted;
    [left, right, low, high] = this.box;
    const pad = 0.07 * Math.min(width, height);
    const pixels = Math.min((width - 2 * pad) / (right - left), (height - 2 * pad) / (high - low));
    return {
      angle, width, height,
      pixels: pixels / colouring.far,
      x: width / 2 - ((left + right) / 2) * pixels,
      y: height / 2 + ((low + high) / 2) * pixels,
    };
  }

  rings(context, view, ink, ratio) {
    const reach = Math.hypot(view.width, view.height) / view.pixels;
    const step = [0.5, 1, 2, 5, 10, 20, 50].find((metres) => metres * view.pixels > 42 * ratio) ?? 100;
    context.strokeStyle = ink.line;
    context.fillStyle = ink.soft;
    context.lineWidth = ratio;
    context.font = `${10 * ratio}px system-ui, sans-serif`;
    for (let r = step; r < reach; r += step) {
      context.beginPath();
      context.arc(view.x, view.y, r * view.pixels, 0, 2 * Math.PI);
      context.stroke();
      const x = view.x + r * view.pixels;
      if (x < view.width - 24 * ratio) context.fillText(`${r} m`, x + 3 * ratio, view.y - 3 * ratio);
      else if (view.y - r * view.pixels > 12 * ratio) context.fillText(`${r} m`, view.x + 3 * ratio, view.y - r * view.pixels - 3 * ratio);
    }
  }

  beams(context, view, line, colouring, ratio) {
    const { range } = line;
    context.beginPath();
    context.moveTo(view.x, view.y);
    for (let i = 0; i < range.length; i++) {
      const r = (Number.isFinite(range[i]) ? range[i] : 0) * view.pixels;
      context.lineTo(view.x + r * Math.cos(view.angle(i)), view.y - r * Math.sin(view.angle(i)));
    }
    context.closePath();
    context.fillStyle = css([57, 197, 147], 0.1);
    context.fill();
    const dot = 2.1 * ratio;
    for (let i = 0; i < range.length; i++) {
      if (!Number.isFinite(range[i])) continue;
      const r = range[i] * view.pixels;
      context.fillStyle = css(colouring.of(line, i));
      context.fillRect(view.x + r * Math.cos(view.angle(i)) - dot / 2, view.y - r * Math.sin(view.angle(i)) - dot / 2, dot, dot);
    }
    context.beginPath();
    context.arc(view.x, view.y, 3.4 * ratio, 0, 2 * Math.PI);
    context.fillStyle = css([57, 197, 147]);
    context.fill();
  }
}
