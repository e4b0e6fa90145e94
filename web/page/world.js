// The orchard, the tractor, the beams and what they met, drawn by WebGL 2. A tree's leaves are one call. The nearest trees are drawn leaf by leaf, the next ones by a
// sample of their leaves, the others as crowns, so that all together stay within a budget. Leaves and wood lie in textures that the shaders read by the number of the corner: instances of so few
// corners would take a renderer without a graphics card several times as long.

import { crown } from "./crowns.js";
import { returnOf } from "./decode.js";
import { dot, pose, sub, unit } from "./matrix.js";
import { BLADE_CORNERS, programs, STICK_CORNERS } from "./shaders.js";
import { mast, scanner, tractor } from "./solids.js";

// The part of a tree's leaves that a sample has, and the part of the budget that is for trees that are drawn whole.
const SAMPLE = 0.18;
const WHOLE_PART = 0.6;
// A scanner that has told nothing for so many seconds has no beams to show.
const OLD = 0.6;
// Returns that are kept, and how many of them where every one costs.
const CLOUD = 90000;
const SMALL_CLOUD = 30000;
const FEWEST = 18000;
const MOST = 160000;
// A picture that takes longer, ms, has fewer leaves the next time; one that takes less, more.
const SLOW = 55;
const FAST = 25;
// Words of a leaf or a piece of wood in a texture, and how many of them a line of it holds.
const WORDS = 8;
const LINE = 256;
const SUN = unit([-0.5, -0.35, 0.85]);
const SKIES = {
  light: { haze: [0.87, 0.91, 0.92], top: [0.60, 0.75, 0.87], dim: 1.06 },
  dark: { haze: [0.10, 0.13, 0.135], top: [0.03, 0.045, 0.06], dim: 0.62 },
};

export class World {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    this.isSoftware = drawsBySoftware();
    // Without a graphics card every pixel costs: smooth edges would take several times as long.
    this.gl = canvas.getContext("webgl2", { antialias: !this.isSoftware, alpha: false, powerPreference: "high-performance" });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    const gl = this.gl;
    this.programs = programs(gl);
    this.budget = 40000;
    this.orchard = null;
    this.lines = new Map();
    /** Where each scanner was seen from its tractor. */
    this.asides = new Map();
    this.stats = { draws: 0, leaves: 0, sticks: 0, points: 0, bytes: 0, orchardBytes: 0 };
    this.solids = { tractor: this.solid(tractor()), scanner: this.solid(scanner()), mast: this.solid(mast()) };
    this.ground = this.mesh([[0, 2, gl.FLOAT, false, 8, 0]], new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    this.noCorners = gl.createVertexArray();
    this.makeCloud();
    this.sheetBuffer = gl.createBuffer();
    this.sheet = this.vertexArray(this.sheetBuffer, [[0, 3, gl.FLOAT, false, 12, 0]]);
    gl.enable(gl.DEPTH_TEST);
  }

  buffer(data) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return buffer;
  }

  vertexArray(buffer, attributes, array = this.gl.createVertexArray(), each = 0) {
    const gl = this.gl;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const [at, size, type, normalised, stride, offset] of attributes) {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, type, normalised, stride, offset);
      gl.vertexAttribDivisor(at, each);
    }
    gl.bindVertexArray(null);
    return array;
  }

  mesh(attributes, data) {
    return this.vertexArray(this.buffer(data), attributes);
  }

  solid(data) {
    const f = this.gl.FLOAT;
    return { count: data.length / 9, array: this.mesh([[0, 3, f, false, 36, 0], [1, 3, f, false, 36, 12], [2, 3, f, false, 36, 24]], data) };
  }

  makeCloud() {
    const gl = this.gl;
    this.cloudBuffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.cloudBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, CLOUD * 16, gl.DYNAMIC_DRAW);
    this.cloud = this.vertexArray(this.cloudBuffer, [[0, 3, gl.FLOAT, false, 16, 0], [1, 3, gl.UNSIGNED_BYTE, true, 16, 12]]);
    this.clearCloud();
  }

  clearCloud() {
    this.forgetReturns();
    this.lines.clear();
  }

  /** Those to come may have other colours. */
  forgetReturns() {
    this.cloudAt = 0;
    this.cloudCount = 0;
  }

  /** Takes an orchard as decode.js reads it. */
  setOrchard(orchard) {
    const { head } = orchard, span = ([first, count], before = 0) => ({ first: before + first, count });
    const trees = head.trees.map((of) => ({ leaves: span(of.leaves), facets: span(of.facets, head.leaves), wood: span(of.wood) }));
    trees.forEach((tree, number) => this.makeCrown(tree, orchard.blades, head.trees[number].leaves));
    const supports = { first: head.wood, count: head.supports }, grass = { first: head.leaves + head.facets, count: head.grass };
    this.orchard = { head, trees, supports, grass, blades: this.table(bladeWords(orchard.blades)), sticks: this.table(stickWords(orchard.sticks)) };
    this.stats.orchardBytes = orchard.bytes;
    this.gl.bindVertexArray(null);
  }

  /** A texture of eight words a thing, 256 things a line: what the shaders call `things`. */
  table(words) {
    const gl = this.gl, lines = Math.max(1, Math.ceil(words.length / WORDS / LINE));
    const padded = new Uint32Array(lines * LINE * WORDS);
    padded.set(words);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, LINE * 2, lines, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, padded);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    return texture;
  }

  /** What a tree is from afar, and room for the places of those that are. */
  makeCrown(tree, blades, [first, count]) {
    const gl = this.gl, corners = crown(blades, first, count), places = gl.createBuffer();
    const array = this.mesh([[0, 3, gl.FLOAT, false, 24, 0], [1, 3, gl.FLOAT, false, 24, 12]], corners);
    this.vertexArray(places, [[2, 3, gl.FLOAT, false, 20, 0], [3, 2, gl.FLOAT, false, 20, 12]], array, 1);
    tree.crown = { array, places, corners: corners.length / 6, leaves: corners.length / 36, at: [] };
  }

  /** A new line: its returns join those before it. */
  take(line, colouring) {
    const before = this.lines.get(line.scanner);
    if (before && before.counter === line.counter && before.at === line.at) return;
    this.lines.set(line.scanner, line);
    if (!line.sight) return;
    const data = new ArrayBuffer(line.range.length * 16), places = new Float32Array(data), paints = new Uint8Array(data);
    let count = 0;
    for (let i = 0; i < line.range.length; i++) {
      if (!returnOf(line, i, places, count * 4)) continue;
      paints.set(colouring.of(line, i), count * 16 + 12);
      count++;
    }
    this.append(new Uint8Array(data, 0, count * 16), count);
  }

  append(bytes, count) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.cloudBuffer);
    if (this.cloudAt + count > (this.isSoftware ? SMALL_CLOUD : CLOUD)) this.cloudAt = 0;
    gl.bufferSubData(gl.ARRAY_BUFFER, this.cloudAt * 16, bytes);
    this.cloudAt += count;
    this.cloudCount = Math.max(this.cloudCount, this.cloudAt);
    this.stats.bytes += bytes.length;
  }

  /** Fewer leaves where a picture takes long, more where it does not. */
  adapt(frameMs) {
    if (frameMs > SLOW) this.budget = Math.max(FEWEST, this.budget * Math.max(0.6, (SLOW - 5) / frameMs));
    else if (frameMs < FAST) this.budget = Math.min(MOST, this.budget * 1.05);
  }

  /** `at`: the picture's seconds, by which a line is old. */
  draw(tractorAt, theme, at) {
    const { gl, canvas, stats } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    Object.assign(stats, { draws: 0, leaves: 0, sticks: 0, points: this.cloudCount });
    const sky = SKIES[theme];
    this.sky = sky;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...sky.haze, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.camera.ride(tractorAt);
    this.view = this.camera.view(width / height);
    for (const line of this.lines.values()) this.mount(line, tractorAt, at);
    this.drawSky();
    this.drawGround();
    if (this.orchard) this.drawOrchard();
    if (tractorAt) this.drawTractor(tractorAt);
    this.drawCloud(height);
    this.drawSheets();
    gl.bindVertexArray(null);
  }

  /** A scanner that tells no more rides on with its tractor. */
  mount(line, tractorAt, at) {
    if (!line.sight) return;
    line.isOld = at - line.at > OLD;
    const { origin } = line.sight;
    if (!line.isOld || !tractorAt) line.stand = origin;
    else {
      const aside = this.asides.get(line.scanner) ?? [0, 0];
      line.stand = [tractorAt.x + aside[0], tractorAt.y + aside[1], origin[2]];
    }
    if (tractorAt && !line.isOld) this.asides.set(line.scanner, [origin[0] - tractorAt.x, origin[1] - tractorAt.y]);
  }

  use(name) {
    const { gl, view, sky } = this, { program, at } = this.programs[name];
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.view, false, view.matrix);
    if (at.eye) gl.uniform3fv(at.eye, view.eye);
    if (at.sun) gl.uniform3fv(at.sun, SUN);
    if (at.haze) gl.uniform3fv(at.haze, sky.haze);
    if (at.far) gl.uniform1f(at.far, view.far);
    return at;
  }

  drawSky() {
    const { gl } = this, at = this.use("sky");
    gl.uniform3fv(at.top, this.sky.top);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.ground);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.DEPTH_TEST);
    this.stats.draws++;
  }

  drawGround() {
    const { gl } = this, at = this.use("ground"), head = this.orchard?.head;
    gl.uniform3fv(at.middle, this.camera.target);
    gl.uniform1f(at.spacing, head?.row_spacing_m ?? 0);
    gl.uniform1f(at.rows, head?.rows ?? 1);
    gl.uniform1f(at.dim, this.sky.dim);
    gl.bindVertexArray(this.ground);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    this.stats.draws++;
  }

  /** What of the orchard may be seen, and how much of each tree is drawn. */
  standing() {
    const { head, trees } = this.orchard, { eye, ahead, far } = this.view, forward = unit(ahead);
    const period = head.period_m, { target } = this.camera, middle = target[1], seen = [];
    for (const [tree, x, y, z, cos, sin] of head.places) {
      const here = period ? Math.round((middle - y) / period) : 0;
      for (const copy of period ? [here - 1, here, here + 1] : [0]) {
        const foot = [x, y + copy * (period ?? 0), z];
        const away = sub([foot[0], foot[1], foot[2] + 1.5], eye), distance = Math.hypot(...away);
        if (distance > far * 0.9 || (dot(away, forward) < 0.35 * distance && distance > 5)) continue;
        if (trees[tree]) seen.push({ tree: trees[tree], foot, cos, sin, distance, aside: Math.hypot(x - target[0], foot[1] - target[1]) });
      }
    }
    return seen;
  }

  drawOrchard() {
    const { gl, stats } = this, standing = this.standing();
    shareOut(standing, this.budget);
    const seen = standing.filter(({ part }) => part > 0);
    this.drawCrowns(standing.filter(({ part }) => part === 0));
    let at = this.useTable("leaf", this.orchard.blades);
    gl.uniform1f(at.grow, 1);
    for (const { tree, foot, cos, sin, distance, part } of seen) {
      const count = Math.ceil(tree.leaves.count * part);
      this.place(at, foot, cos, sin);
      this.things(at, tree.leaves.first, count, BLADE_CORNERS);
      stats.leaves += count;
      if (tree.facets.count && distance < 25) {
        this.things(at, tree.facets.first, tree.facets.count, BLADE_CORNERS);
        stats.leaves += tree.facets.count;
      }
    }
    this.drawGrass(at);
    at = this.useTable("stick", this.orchard.sticks);
    for (const { tree, foot, cos, sin, part } of seen) {
      // Twigs come last: from afar a tree is its older wood.
      const count = Math.ceil(tree.wood.count * part);
      this.place(at, foot, cos, sin);
      this.things(at, tree.wood.first, count, STICK_CORNERS);
      stats.sticks += count;
    }
    this.drawSupports(at);
  }

  drawGrass(at) {
    const { grass, head } = this.orchard, period = head.period_m ?? 0;
    if (!grass.count) return;
    const here = period ? Math.floor(this.camera.target[1] / period) : 0, count = Math.ceil(grass.count * Math.min(1, this.budget / 60000));
    this.gl.uniform1f(at.grow, Math.sqrt(grass.count / count));
    for (const copy of period ? [here - 1, here, here + 1] : [0]) {
      this.place(at, [0, copy * period, 0], 1, 0);
      this.things(at, grass.first, count, BLADE_CORNERS);
      this.stats.leaves += count;
    }
  }

  /** Far trees: one call for all that are alike. */
  drawCrowns(far) {
    const { gl, stats } = this;
    if (!far.length) return;
    for (const { tree, foot, cos, sin } of far) tree.crown.at.push(...foot, cos, sin);
    this.use("far");
    for (const { crown } of this.orchard.trees) {
      if (!crown.at.length) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, crown.places);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(crown.at), gl.STREAM_DRAW);
      this.instances(crown.array, gl.TRIANGLES, crown.corners, crown.at.length / 5);
      stats.leaves += crown.leaves * (crown.at.length / 5);
      crown.at = [];
    }
  }

  drawSupports(at) {
    const { supports, head } = this.orchard, period = head.period_m ?? 0;
    if (!supports.count) return;
    const here = period ? Math.floor(this.camera.target[1] / period) : 0;
    for (const copy of period ? [here - 1, here, here + 1] : [0]) {
      this.place(at, [0, copy * period, 0], 1, 0);
      this.things(at, supports.first, supports.count, STICK_CORNERS);
      this.stats.sticks += supports.count;
    }
  }

  place(at, foot, cos, sin) {
    this.gl.uniform3fv(at.foot, foot);
    this.gl.uniform2f(at.turn, cos, sin);
  }

  /** A program that reads a table. */
  useTable(name, table) {
    const { gl } = this, at = this.use(name);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, table);
    gl.uniform1i(at.things, 0);
    gl.bindVertexArray(this.noCorners);
    return at;
  }

  /** So many things of the table in use. */
  things(at, first, count, corners) {
    if (!count) return;
    this.gl.uniform1i(at.first, first);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, corners * count);
    this.stats.draws++;
  }

  instances(array, mode, corners, count) {
    if (!count) return;
    this.gl.bindVertexArray(array);
    this.gl.drawArraysInstanced(mode, 0, corners, count);
    this.stats.draws++;
  }

  drawTractor({ x, y, up, heading, roll, pitch }) {
    const at = this.use("solid");
    this.drawSolid(at, this.solids.tractor, pose([x, y, up], heading, roll, pitch));
    for (const { sight, stand: foremost } of this.lines.values()) {
      if (!sight) continue;
      const model = pose(foremost, heading, roll, pitch);
      this.drawSolid(at, this.solids.scanner, model);
      // From the bonnet out to the scanner.
      const [dx, dy] = [foremost[0] - x, foremost[1] - y];
      const foot = Math.max(0.4, Math.min(1.1, foremost[2] - 0.2));
      const stand = pose([x + Math.max(-0.3, Math.min(0.3, dx)), y + dy, foot], heading, 0, 0);
      for (let k = 8; k < 11; k++) stand[k] *= foremost[2] - 0.1 - foot;
      this.drawSolid(at, this.solids.mast, stand);
    }
  }

  drawSolid(at, { array, count }, model) {
    const { gl } = this;
    gl.uniformMatrix4fv(at.model, false, model);
    gl.bindVertexArray(array);
    gl.drawArrays(gl.TRIANGLES, 0, count);
    this.stats.draws++;
  }

  drawCloud(height) {
    if (!this.cloudCount) return;
    const { gl } = this, at = this.use("point");
    gl.uniform1f(at.dot_size, height * 0.014);
    gl.bindVertexArray(this.cloud);
    gl.drawArrays(gl.POINTS, 0, this.cloudCount);
    this.stats.draws++;
  }

  /** The beams of the newest lines, as a thin sheet, and its rim. */
  drawSheets() {
    const { gl } = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const line of this.lines.values()) {
      if (!line.sight || line.isOld) continue;
      const corners = sheetOf(line), at = this.use("sheet");
      gl.bindBuffer(gl.ARRAY_BUFFER, this.sheetBuffer);
      gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STREAM_DRAW);
      gl.bindVertexArray(this.sheet);
      gl.uniform4f(at.paint, 0.2, 0.85, 0.6, 0.13);
      gl.drawArrays(gl.TRIANGLES, 0, corners.length / 3);
      gl.uniform4f(at.paint, 0.25, 0.95, 0.68, 0.3);
      gl.drawArrays(gl.LINES, 0, corners.length / 3);
      this.stats.draws += 2;
      this.stats.bytes += corners.byteLength;
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** How many colours a picture has: one that is empty has few. For tests. */
  colours() {
    const { gl, canvas } = this, pixels = new Uint8Array(canvas.width * canvas.height * 4), seen = new Set();
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (let i = 0; i < pixels.length; i += 4 * 97) seen.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
    return seen.size;
  }
}

/** Whether there is no graphics card: a browser that says nothing has one. */
function drawsBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2"), told = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = told ? String(gl.getParameter(told.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Leaves have seven words on the way here. */
function bladeWords(bytes) {
  const from = new Uint32Array(bytes.slice().buffer), words = new Uint32Array((from.length / 7) * WORDS);
  for (let i = 0, at = 0; i < from.length; i += 7, at += WORDS) for (let k = 0; k < 7; k++) words[at + k] = from[i + k];
  return words;
}

function stickWords(bytes) {
  return new Uint32Array(bytes.slice().buffer);
}

/** Gives each tree the part of its leaves that is drawn, from where the camera looks outwards: all, a sample, then none while the budget lasts. */
function shareOut(standing, budget) {
  standing.sort((a, b) => a.aside - b.aside);
  let left = budget;
  const fits = (leaves, kept) => leaves <= left - kept;
  for (const of of standing) {
    const { count } = of.tree.leaves, kept = budget * (1 - WHOLE_PART);
    of.part = fits(count, kept) ? 1 : fits(SAMPLE * count, 0) ? SAMPLE : 0;
    // No crown stands before a sample.
    left = of.part ? left - of.part * count : 0;
  }
}

/** Triangles from the scanner to neighbouring returns; beams that met nothing leave a gap. */
function sheetOf(line) {
  const out = [], a = [0, 0, 0], b = [0, 0, 0], { origin } = line.sight, stride = Math.max(1, Math.round(line.range.length / 540));
  for (let i = 0; i + stride < line.range.length; i += stride) {
    if (!returnOf(line, i, a, 0) || !returnOf(line, i + stride, b, 0)) continue;
    out.push(...origin, ...a, ...b);
  }
  return new Float32Array(out);
}
