// The way to the server: plain HTTP first, then a socket; where that breaks, HTTP again once a second until it is back.

const FIRST = 400;
const LONGEST = 4000;

/** The token that the address holds behind `#token=`, or was given before. */
export function token() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) sessionStorage.setItem("token", given);
  return sessionStorage.getItem("token");
}

export class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

/** Asks the server. What it refuses is told in its own words. */
export async function ask(path, { method = "GET", body, as = "json" } = {}) {
  const headers = token() ? { Authorization: `Bearer ${token()}` } : {};
  const answer = await fetch(path, { method, headers, body: body === undefined ? undefined : JSON.stringify(body), cache: "no-store" });
  if (!answer.ok) {
    const told = await answer.json().catch(() => ({}));
    throw new Refused(answer.status, told.error ?? `${answer.status} ${answer.statusText}`);
  }
  if (answer.status === 204) return null;
  return as === "bytes" ? answer.arrayBuffer() : as === "text" ? answer.text() : answer.json();
}

export class Link {
  /** `on` hears of picture(buffer), state(json), status(word) and begun(), which comes anew after every break. */
  constructor(on) {
    this.on = on;
    this.wait = FIRST;
    this.received = 0;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const protocols = token() ? ["rowscan", `bearer.${token()}`] : ["rowscan"];
    const socket = new WebSocket(`${scheme}//${location.host}/watch/live`, protocols);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => {
      this.wait = FIRST;
      this.on.status("live");
      this.on.begun();
    };
    socket.onmessage = ({ data }) => {
      this.received += data.byteLength ?? data.length;
      if (typeof data !== "string") {
        this.on.picture(data);
        return;
      }
      this.say("taken");
      this.on.state(JSON.parse(data));
    };
    socket.onclose = () => this.broken();
  }

  /** A picture is drawn: the next may come. */
  drawn() {
    this.say("drawn");
  }

  say(word) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(word);
  }

  async broken() {
    this.on.status("lost");
    setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(this.wait * 1.6, LONGEST);
    // Meanwhile what plain HTTP gives, if anything.
    try {
      this.on.state(await ask("/watch/state"));
      this.on.picture(await ask("/watch/scan", { as: "bytes" }));
      this.on.status("polling");
    } catch (error) {
      if (error instanceof Refused && error.status === 401) this.on.status("token");
    }
  }
}
