// A recording's time line: where it is, and the way to another place.

const byId = (id) => document.getElementById(id);

/** Seconds as minutes and seconds. */
function told(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}

export class Timeline {
  /** `order` sends what the clock is to do. */
  constructor(order) {
    this.order = order;
    this.slider = byId("tape");
    this.span = [0, 0];
    // While somebody drags it, it stays where the hand is.
    this.slider.oninput = () => { this.held = true; this.tell(Number(this.slider.value)); };
    this.slider.onchange = () => { this.held = false; this.go(Number(this.slider.value)); };
  }

  /** Places are seconds from the beginning. */
  go(seconds) {
    this.order({ seek: `${seconds.toFixed(3)}s` });
  }

  show({ recorded_s: at, recorded_span_s: span, paused }) {
    byId("timeline").hidden = !span;
    if (!span) return;
    this.span = span;
    const length = span[1] - span[0], place = Math.min(Math.max(at - span[0], 0), length);
    this.slider.max = String(length);
    this.slider.step = String(Math.max(length / 2000, 0.001));
    if (!this.held) {
      this.slider.value = String(place);
      this.tell(place);
    }
    const isOver = place >= length - 0.001;
    if (isOver && !this.wasOver && !paused && byId("again").checked) this.go(0);
    this.wasOver = isOver;
  }

  tell(seconds) {
    byId("tape-told").textContent = `${told(seconds)} of ${told(this.span[1] - this.span[0])}`;
  }
}
