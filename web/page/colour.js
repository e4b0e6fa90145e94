// Colours that colour-blind people can tell apart: cividis for what is more or less, Okabe and Ito's for what is one thing or another.

const CIVIDIS = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115], [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85], [254, 232, 56],
];

/** Names and colours of what a beam can meet, by their numbers in pictures. */
export const CLASSES = [
  { name: "nothing", rgb: [120, 130, 125] },
  { name: "leaf", rgb: [0, 158, 115] },
  { name: "wood", rgb: [213, 94, 0] },
  { name: "ground", rgb: [150, 150, 150] },
  { name: "fruit", rgb: [204, 121, 167] },
  { name: "post", rgb: [0, 114, 178] },
  { name: "wire", rgb: [86, 180, 233] },
  { name: "grass", rgb: [240, 228, 66] },
];

/** The colour of a part between 0 and 1. */
export function scale(part) {
  const at = Math.min(Math.max(part, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(at), CIVIDIS.length - 2);
  const f = at - low;
  return CIVIDIS[low].map((c, i) => Math.round(c + f * (CIVIDIS[low + 1][i] - c)));
}

// More is always brighter, in either scheme: only the darkest end, which a dark page would swallow, is left out there.
const TABLES = {
  light: Array.from({ length: 256 }, (_, i) => scale(i / 255)),
  dark: Array.from({ length: 256 }, (_, i) => scale(0.2 + (i / 255) * 0.8)),
};

export function css([r, g, b], alpha = 1) {
  return `rgb(${r} ${g} ${b} / ${alpha})`;
}

/** Lines from which the limits of the scale are taken: about a second of one scanner. */
const LEARNED = 50;

/** How returns are coloured: by "range", "remission" or "class". The limits are taken from the first lines with returns, and then stay as they are: a
    colour means one range for as long as the page is open, or until somebody asks for new limits. */
export class Colouring {
  constructor() {
    this.by = "range";
    this.far = 4;
    this.bright = 255;
    this.scheme = "light";
    this.hasRemission = false;
    this.learned = 0;
  }

  /** Takes the limits from the lines that come next. */
  fit() {
    this.learned = 0;
    [this.far, this.bright] = [0, 0];
  }

  /** Takes note of how far and how bright the first lines are. */
  learn(lines) {
    for (const line of lines) {
      this.hasRemission ||= Boolean(line.remission);
      const ranges = line.range.filter(Number.isFinite).sort();
      if (this.learned >= LEARNED || !ranges.length) continue;
      this.learned++;
      // Nine of ten: the few beams that find a gap and end far away would make all others one colour.
      this.far = Math.max(this.far, nextRound(1.1 * ranges[Math.floor(0.9 * ranges.length)]));
      if (line.remission) for (const r of line.remission) this.bright = Math.max(this.bright, r > 255 ? 65535 : 255);
    }
  }

  of(line, i) {
    if (this.by === "class" && line.classes) return CLASSES[line.classes[i]]?.rgb ?? CLASSES[0].rgb;
    if (this.by === "remission" && line.remission) return this.shade(line.remission[i] / Math.max(this.bright, 1));
    return this.shade(line.range[i] / Math.max(this.far, 0.1));
  }

  /** The colour of a part from 0 to 1. */
  shade(part) {
    return TABLES[this.scheme][Math.min(255, Math.max(0, Math.floor(part * 255)))];
  }

  /** What the scale ends at, in words. */
  ends() {
    return this.by === "remission" ? ["0", String(this.bright)] : ["0 m", `${this.far} m`];
  }
}

function nextRound(value) {
  const rounds = [1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 40, 60, 80, 100, 150, 200];
  return rounds.find((round) => round >= value * 0.999) ?? Math.ceil(value / 100) * 100;
}

/** The legend, as elements. */
export function legend(colouring, document) {
  const panel = document.createElement("div");
  panel.className = "panel";
  if (colouring.by === "class") {
    const chips = document.createElement("div");
    chips.className = "chips";
    for (const { name, rgb } of CLASSES.slice(1)) {
      const chip = document.createElement("span"), dot = document.createElement("span");
      chip.className = "chip";
      dot.className = "dot";
      dot.style.background = css(rgb);
      chip.append(dot, name);
      chips.append(chip);
    }
    panel.append(chips);
    return panel;
  }
  const row = document.createElement("div"), bar = document.createElement("canvas");
  row.className = "scale";
  bar.width = 110;
  bar.height = 1;
  const context = bar.getContext("2d");
  for (let x = 0; x < 110; x++) {
    context.fillStyle = css(colouring.shade(x / 109));
    context.fillRect(x, 0, 1, 1);
  }
  const [low, high] = colouring.ends();
  row.append(low, bar, high);
  panel.append(row);
  return panel;
}
