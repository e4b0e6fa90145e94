// The page: what comes from the server goes to the views, and what people press goes to the server.

import { Camera } from "./camera.js";
import { Colouring, legend } from "./colour.js";
import { readOrchard, readPicture } from "./decode.js";
import { Fan } from "./fan.js";
import { Faults } from "./faults.js";
import { ask, Link, Refused, token } from "./link.js";
import { Numbers, TelegramList } from "./numbers.js";
import { StripView } from "./strip.js";
import { Timeline } from "./timeline.js";
import { World } from "./world.js";

const byId = (id) => document.getElementById(id);
const MAP_EVERY_MS = 3000;
const dark = matchMedia("(prefers-color-scheme: dark)");

class Page {
  constructor() {
    this.colouring = new Colouring();
    this.state = null;
    this.picture = null;
    this.undrawn = 0;
    this.wanted = true;
    this.fans = [];
    this.times = [];
    this.pictures = 0;
    this.firstMs = null;
    this.log = new TelegramList(byId("log"));
    this.strip = new StripView(byId("strip"), byId("strip-keys"));
    this.redraw = () => { this.wanted = true; };
  }

  async begin() {
    await this.load();
    this.makeWorld();
    this.buttons();
    this.take(await ask("/watch/scan", { as: "bytes" }));
    this.show(await ask("/watch/state"));
    requestAnimationFrame((now) => this.frame(now));
    this.link = new Link({
      picture: (buffer) => { this.undrawn++; this.take(buffer); },
      state: (state) => this.show(state),
      status: (word) => this.tellLink(word),
      begun: () => this.rejoin(),
    });
    await this.loadOrchard();
  }

  /** What does not change while one program runs. */
  async load() {
    this.about = await ask("/watch/about");
    byId("title").textContent = this.about.title.replace(/^rowscan /, "");
    document.title = `${this.about.title}`;
    byId("fans").replaceChildren();
    this.fans = this.about.scanners.map((scanner, number) => new Fan(scanner, number, byId("fans")));
    this.numbers = new Numbers(this.about, byId("speeds"), byId("counts"));
    byId("transport").hidden = !this.about.has_control;
    byId("world-card").hidden = !this.about.has_orchard;
    document.body.classList.toggle("flat", !this.about.has_orchard);
    if (this.about.has_control) this.faults = Faults.of(await ask("/fault-table"));
    this.log.clear();
    this.strip.version = -1;
    byId("map-card").hidden = true;
  }

  makeWorld() {
    if (!this.about.has_orchard) return;
    const canvas = byId("world");
    try {
      this.camera = new Camera(canvas, () => { this.redraw(); byId("follow").setAttribute("aria-pressed", String(this.camera?.follows ?? true)); });
      this.world = new World(canvas, this.camera);
    } catch (error) {
      this.world = null;
      byId("world-card").classList.add("plain");
      byId("world-card").textContent = `The orchard cannot be drawn: ${error.message}. Everything else works without it.`;
    }
  }

  async loadOrchard() {
    if (!this.world || !this.about.has_orchard) return;
    const orchard = readOrchard(await ask("/watch/orchard", { as: "bytes" }));
    if (orchard) this.world.setOrchard(orchard);
    this.redraw();
  }

  /** The server is there again: perhaps another program with another orchard. */
  async rejoin() {
    if (!this.wasLost) return;
    this.wasLost = false;
    await this.load();
    this.world?.clearCloud();
    await this.loadOrchard();
  }

  tellLink(word) {
    const words = { live: "live", ended: "ended", lost: "no connection", polling: "no socket, polling", token: "token needed" };
    this.wasLost ||= word !== "live" && word !== "ended";
    byId("link").dataset.state = { polling: "connecting", ended: "connecting" }[word] ?? word;
    byId("link").textContent = words[word];
    if (word === "token") askToken();
  }

  take(buffer) {
    const picture = readPicture(buffer);
    if (!picture) return;
    this.picture = picture;
    this.colouring.learn(picture.lines);
    for (const line of picture.lines) {
      if (this.fans[line.scanner]?.take(line)) this.world?.take(line, this.colouring);
    }
    byId("by-class").hidden = picture.lines.length > 0 && !picture.lines.some((line) => line.classes);
    // Telegrams have them only where a client asks for them.
    byId("by-remission").hidden = !this.colouring.hasRemission;
    this.redraw();
  }

  show(state) {
    this.state = state;
    this.numbers.show(state);
    const { clock } = state, isPaused = stands(clock);
    if (clock) {
      byId("time").textContent = `${clock.now_s.toFixed(2)} s`;
      byId("pause").textContent = isPaused ? "Run" : "Pause";
      byId("pause").setAttribute("aria-pressed", String(isPaused));
      byId("speed-label").hidden = clock.scale === undefined;
      byId("seek").hidden = clock.recorded_s === undefined;
      byId("step").hidden = clock.steps === undefined;
      this.timeline?.show(clock);
      if (clock.scale !== undefined && document.activeElement !== byId("speed")) byId("speed").value = String(clock.scale);
    }
    const now = performance.now();
    state.scanners.forEach((of, number) => this.fans[number]?.tell(of, isPaused, now));
    if (state.scanners.length && state.scanners.every(({ ended }) => ended)) this.tellLink("ended");
    if (state.faults) this.faults?.show(state.faults);
    byId("place-told").textContent = placeOf(state.tractor);
    byId("slow").textContent = slowness(state.scanners, state.clock);
    byId("slow").hidden = !byId("slow").textContent;
    if (state.log_last > this.log.last || state.log_last < this.log.last) this.readLog(state.log_last < this.log.last);
    if (state.strip_version !== this.strip.version) this.readStrip();
    if (this.about.has_map && now - (this.mapMs ?? -Infinity) > MAP_EVERY_MS) this.readMap(now);
  }

  /** What the sprayer has done so far; it is drawn where it runs, as an image without a script. */
  async readMap(now) {
    this.mapMs = now;
    await ask("/watch/map", { as: "text" }).then((svg) => {
      byId("map").src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
      byId("map-card").hidden = false;
    }, () => {});
  }

  async readLog(isNew) {
    if (this.reading) return;
    this.reading = true;
    if (isNew) this.log.clear();
    await ask(`/watch/log?since=${this.log.last}`).then((told) => this.log.add(told), () => {});
    this.reading = false;
  }

  async readStrip() {
    if (this.readingStrip) return;
    this.readingStrip = true;
    await ask("/watch/strip").then((told) => this.strip.take(told), () => {});
    byId("strip-card").hidden = this.strip.isEmpty;
    this.readingStrip = false;
    this.redraw();
  }

  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    // How long the picture before kept the graphics busy.
    if (this.drew) this.world?.adapt(now - this.drew);
    this.drew = 0;
    if (!this.wanted) return;
    this.wanted = false;
    this.drew = now;
    const style = getComputedStyle(document.documentElement);
    const ink = { line: style.getPropertyValue("--line"), soft: style.getPropertyValue("--soft"), accent: style.getPropertyValue("--accent"), paper: style.getPropertyValue("--card") };
    const begun = performance.now();
    this.colouring.scheme = dark.matches ? "dark" : "light";
    this.world?.draw(this.picture?.tractor, this.colouring.scheme, this.picture?.at);
    for (const fan of this.fans) fan.draw(this.colouring, ink);
    this.strip.draw(this.picture?.tractor?.y, ink);
    this.drawMs = performance.now() - begun;
    this.count(now);
    for (; this.undrawn > 0; this.undrawn--) this.link?.drawn();
    const host = byId("legend"), ends = `${this.colouring.by} ${this.colouring.ends()} ${this.colouring.scheme}`;
    if (host.dataset.ends !== ends) {
      host.dataset.ends = ends;
      host.replaceChildren(legend(this.colouring, document));
    }
  }

  /** How many pictures a second there are, and what they cost. */
  count(now) {
    if (this.firstMs === null && this.picture?.lines.length) this.firstMs = performance.now();
    this.pictures++;
    this.times.push(now);
    while (this.times.length > 2 && this.times[0] < now - 2000) this.times.shift();
    const spans = this.times.length - 1;
    this.fps = spans > 0 ? (1000 * spans) / (now - this.times[0]) : 0;
    if (!this.world || now < (this.told ?? 0) + 400) return;
    this.told = now;
    const { draws, leaves, sticks, points, bytes, orchardBytes } = this.world.stats;
    const rate = (this.link?.received ?? 0) - (this.lastReceived ?? 0), passed = (now - (this.lastTold ?? now)) / 1000;
    if (passed > 1.5 || !this.lastTold) {
      this.kilobytes = passed > 0 ? rate / passed / 1000 : 0;
      [this.lastReceived, this.lastTold] = [this.link?.received ?? 0, now];
    }
    byId("stats").textContent =
      `${this.fps.toFixed(0)} pictures/s  ${(this.kilobytes ?? 0).toFixed(0)} kB/s\n${draws} draw calls\n${leaves} leaves  ${sticks} sticks  ${points} returns\n${(orchardBytes / 1e6).toFixed(1)} MB orchard`;
    this.world.stats.bytes = bytes;
  }

  buttons() {
    const tell = (asked) => asked.then((told) => told && this.state && this.show({ ...this.state, clock: told.clock ?? told }), (error) => notice(error.message));
    const clock = (body) => tell(ask("/clock", { method: "POST", body }));
    byId("pause").onclick = () => clock({ paused: !stands(this.state?.clock) });
    this.timeline = new Timeline((body) => clock(body));
    byId("step").onclick = () => tell(ask("/step", { method: "POST", body: { n: 1 } }));
    byId("speed").onchange = ({ target }) => clock({ scale: Number(target.value) });
    byId("seek").onsubmit = (event) => {
      event.preventDefault();
      clock({ seek: byId("place").value });
    };
    byId("follow").onclick = () => this.camera?.setFollow(!this.camera.follows);
    byId("reset").onclick = () => this.camera?.reset();
    byId("legend").onclick = () => {
      this.colouring.fit();
      this.world?.forgetReturns();
      this.redraw();
    };
    byId("legend").title = "New limits from what comes next";
    byId("colours").onchange = ({ target }) => {
      this.colouring.by = target.value;
      this.world?.forgetReturns();
      this.redraw();
    };
    addEventListener("resize", this.redraw);
    dark.addEventListener("change", this.redraw);
    document.addEventListener("keydown", (event) => {
      if (/INPUT|SELECT|BUTTON|TEXTAREA/.test(document.activeElement?.tagName ?? "") || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "i" || event.key === "I") byId("stats").hidden = !byId("stats").hidden;
      const button = { " ": "pause", ".": "step" }[event.key];
      if (!button || !this.about.has_control) return;
      event.preventDefault();
      byId(button).click();
    });
  }
}

/** Time is paused, or has taken all the steps that it was granted. */
function stands(clock) {
  return Boolean(clock && (clock.paused || (clock.granted !== undefined && clock.steps >= clock.granted)));
}

/** What to do where scans were missed: areas by metre stay away with too many of them. */
function slowness(scanners, clock) {
  const sum = (key) => scanners.reduce((all, of) => all + (of[key] ?? 0), 0), missed = sum("missed"), all = sum("scans") + missed;
  if (missed <= 0.01 * all) return "";
  return `The emulator's machine is too slow for this pace: ${missed} of ${all} scans missed. Areas are withheld where more is missed than the rig allows. Run it slower (--time-scale ${(clock?.scale ?? 1) / 2}), or as fast as it can (--time-scale max).`;
}

function placeOf(tractor) {
  if (!tractor) return "";
  if (!tractor.has_begun) return "The tractor waits for the first client that takes scans.";
  return `Row ${tractor.y_m.toFixed(2)} m`;
}

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
  clearTimeout(notice.timer);
  notice.timer = setTimeout(() => { byId("notice").hidden = true; }, 6000);
}

function askToken() {
  byId("token").hidden = false;
  byId("token").onsubmit = (event) => {
    event.preventDefault();
    sessionStorage.setItem("token", byId("token-value").value.trim());
    location.reload();
  };
}

const page = new Page();
// For whoever looks into the page from outside: tests, and people with a console.
globalThis.rowscan = page;
page.begin().catch((error) => {
  if (error instanceof Refused && error.status === 401) {
    byId("link").dataset.state = "lost";
    byId("link").textContent = token() ? "wrong token" : "token needed";
    askToken();
  } else {
    byId("link").dataset.state = "lost";
    byId("link").textContent = "no connection";
    notice(`${error.message}; trying again`);
    setTimeout(() => location.reload(), 3000);
  }
});
