// Numbers: speeds side by side, and what each scanner has done. What nobody knows is a dash.

const ROWS = [
  ["rate_hz", "Scans a second", (v) => v.toFixed(2)],
  ["scans", "Scans", whole],
  ["lost", "Lost", whole],
  ["repeated", "Repeated", whole],
  ["bad", "Bad telegrams", whole],
  ["missed", "Missed by a slow host", whole],
  ["refused", "Refused", whole],
  ["clients", "Clients", whole],
  ["counter", "Telegram counter", whole],
  ["returns", "Beams with a return", (v, of) => `${v} of ${of.beams}`],
  ["nearest_m", "Nearest, m", (v) => v.toFixed(2)],
];
const ALARMS = new Set(["lost", "bad", "missed"]);
const SPEEDS = [["wheel_m_s", "Wheel"], ["ground_m_s", "Ground"], ["gnss_m_s", "GNSS"]];

function whole(value) {
  return String(value);
}

function element(name, text = "", parts = {}) {
  return Object.assign(document.createElement(name), { textContent: text, ...parts });
}

export class Numbers {
  constructor(about, speeds, table) {
    this.cells = new Map();
    const names = element("tr");
    names.append(element("th"), ...about.scanners.map(({ name }) => element("th", name, { scope: "col" })));
    const rows = ROWS.map(([key, title]) => {
      const row = element("tr");
      row.append(element("th", title, { scope: "row" }));
      about.scanners.forEach((_, scanner) => {
        const cell = element("td", "–");
        cell.dataset.number = `${scanner}.${key}`;
        this.cells.set(`${scanner}.${key}`, cell);
        row.append(cell);
      });
      return row;
    });
    table.replaceChildren(table.caption ?? "", names, ...rows);
    this.speeds = SPEEDS.map(([key, title]) => {
      const box = element("div", "", { className: "speed" }), value = element("b", "–"), bar = element("i");
      value.dataset.number = key;
      box.append(element("span", title), value, bar);
      return { key, box, value, bar };
    });
    speeds.replaceChildren(...this.speeds.map(({ box }) => box));
  }

  show(state) {
    state.scanners.forEach((of, scanner) => {
      for (const [key, , words] of ROWS) {
        const cell = this.cells.get(`${scanner}.${key}`);
        if (!cell) continue;
        const known = of[key] !== null && of[key] !== undefined;
        cell.textContent = known ? words(of[key], of) : "–";
        cell.className = known ? (ALARMS.has(key) && of[key] > 0 ? "alarm" : "") : "unknown";
      }
    });
    const speeds = state.tractor?.speeds ?? {};
    const most = Math.max(...SPEEDS.map(([key]) => Math.abs(speeds[key] ?? 0)), 0.5);
    for (const { key, value, bar } of this.speeds) {
      const known = speeds[key] !== null && speeds[key] !== undefined;
      value.textContent = known ? `${speeds[key].toFixed(2)} m/s` : "–";
      bar.style.setProperty("--part", known ? Math.abs(speeds[key]) / most : 0);
    }
  }
}

/** What was said, line by line, the last below. */
export class TelegramList {
  constructor(list) {
    this.list = list;
    this.last = 0;
  }

  add({ last, telegrams }) {
    const stays = this.list.scrollTop + this.list.clientHeight < this.list.scrollHeight - 30;
    for (const spoken of telegrams) {
      const row = element("li"), said = element("span");
      const who = element("span", spoken.by_device ? "←" : "→", { title: spoken.by_device ? "the scanner says" : "a client says" });
      const name = element("b", spoken.telegram, { className: spoken.is_bad ? "bad" : spoken.by_device ? "" : "host" });
      said.append(name, " ", element("q", spoken.words));
      row.append(element("time", spoken.at_s.toFixed(2)), who, said);
      row.title = spoken.scanner;
      this.list.append(row);
    }
    while (this.list.childElementCount > 200) this.list.firstElementChild.remove();
    this.last = last;
    if (!stays) this.list.scrollTop = this.list.scrollHeight;
  }

  clear() {
    this.list.replaceChildren();
    this.last = 0;
  }
}
