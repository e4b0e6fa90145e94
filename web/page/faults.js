// Faults: a form made of the server's own table, and the list of those there are.

import { ask } from "./link.js";

const byId = (id) => document.getElementById(id);

function option(value, text = value) {
  return Object.assign(document.createElement("option"), { value, textContent: text });
}

export class Faults {
  /** The form, where there is a stream on which something can go wrong. */
  static of(table) {
    byId("faults-card").hidden = table.streams.length === 0;
    return table.streams.length ? new Faults(table) : undefined;
  }

  constructor({ faults, streams }) {
    this.table = new Map(faults.map((fault) => [fault.name, fault]));
    const groups = new Map();
    for (const fault of faults) {
      if (!groups.has(fault.acts_on)) groups.set(fault.acts_on, Object.assign(document.createElement("optgroup"), { label: fault.acts_on }));
      groups.get(fault.acts_on).append(option(fault.name, fault.name.replaceAll("_", " ")));
    }
    byId("fault-name").replaceChildren(...groups.values());
    byId("fault-on").replaceChildren(option("", "all"), ...streams.map((stream) => option(stream)));
    byId("fault-name").onchange = () => this.choose();
    byId("fault-form").onsubmit = (event) => this.start(event);
    byId("fault-reset").onclick = () => this.told(ask("/faults", { method: "DELETE" }));
    this.choose();
  }

  /** Shows the chosen fault's parameters. */
  choose() {
    const fault = this.table.get(byId("fault-name").value);
    byId("fault-does").textContent = fault.does;
    byId("fault-keys").replaceChildren(...fault.parameters.map((parameter) => {
      const label = document.createElement("label");
      label.append(parameter.key.replaceAll("_", " "), this.input(parameter));
      label.title = `${parameter.about} (${parameter.takes})`;
      return label;
    }));
    this.fail("");
  }

  input({ key, input, low, high, words, default: absent }) {
    const choice = input === "choice" || input === "flag";
    const field = document.createElement(choice ? "select" : "input");
    if (choice) field.append(option("", absent), ...(words ?? ["true", "false"]).map((word) => option(word)));
    else {
      field.placeholder = absent;
      if (input === "number" || input === "integer") Object.assign(field, { type: "number", min: low, max: high, step: input === "integer" ? 1 : "any" });
    }
    field.dataset.key = key;
    field.dataset.input = input;
    return field;
  }

  /** The fault that the form asks for, as files have it. */
  order() {
    const order = { name: byId("fault-name").value };
    const [on, lasts] = [byId("fault-on").value, byId("fault-for").value];
    if (on) order.on = on;
    if (lasts) order.for = { s: Number(lasts) };
    for (const { dataset, value } of byId("fault-keys").querySelectorAll("[data-key]")) {
      if (value === "") continue;
      if (dataset.input === "number" || dataset.input === "integer") order[dataset.key] = Number(value);
      else if (dataset.input === "flag") order[dataset.key] = value === "true";
      else if (dataset.input === "json") order[dataset.key] = JSON.parse(value);
      else order[dataset.key] = value;
    }
    return order;
  }

  start(event) {
    event.preventDefault();
    let body;
    try {
      body = this.order();
    } catch {
      this.fail("a list is written as JSON has it, such as [1, 2]");
      return;
    }
    this.told(ask("/faults", { method: "POST", body }));
  }

  async told(asked) {
    try {
      await asked;
      this.fail("");
    } catch (error) {
      this.fail(error.message);
    }
  }

  fail(why) {
    byId("fault-error").textContent = why;
    byId("fault-error").hidden = !why;
  }

  /** The faults there are, the newest first. */
  show(faults) {
    const text = JSON.stringify(faults);
    if (text === this.shown) return;
    this.shown = text;
    byId("fault-list").replaceChildren(...faults.slice(-30).reverse().map((fault) => {
      const row = document.createElement("li"), name = document.createElement("b"), told = document.createElement("span"), end = document.createElement("button");
      row.dataset.state = fault.state;
      row.dataset.name = fault.name;
      name.textContent = fault.name.replaceAll("_", " ");
      told.textContent = `${fault.on} · ${fault.state}${fault.acts ? ` · acted ${fault.acts}×` : ""}`;
      end.type = "button";
      end.textContent = "End";
      end.setAttribute("aria-label", `End ${fault.name} on ${fault.on}`);
      end.onclick = () => this.told(ask(`/faults/${encodeURIComponent(fault.id)}`, { method: "DELETE" }));
      row.append(name, told, end);
      return row;
    }));
  }
}
