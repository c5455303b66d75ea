// The newest message of a route: its values, and what each of its bytes is. The bridge keeps it only while this asks.
import {make} from "/parts.js";
import {fill, mono, put, size, table, whole} from "/console/text.js";

export const KINDS = new Set(["topic_to_event", "event_to_topic"]);
const EVERY = 1000;  // ms

/// Asks again and again, one question at a time, until it is stopped or looks away.
export class Asker {
  /// @param every  ms between an answer and the next question
  constructor(every, ask) {
    this.every = every;
    this.ask = ask;
    this.number = 0;
    this.running = false;
  }
  start() {
    if (this.running) return;
    this.running = true;
    this.run(++this.number);
  }
  stop() {
    this.running = false;
    ++this.number;
  }
  async run(number) {
    while (number === this.number) {
      if (!document.hidden) await this.ask(() => number === this.number);
      await new Promise((done) => setTimeout(done, document.hidden ? EVERY : this.every));
    }
  }
}

export class MessagePanel {
  constructor(get) {
    this.about = make("p", {className: "faint"});
    this.fault = make("p", {className: "bad"});
    this.values = make("pre", {className: "values", tabIndex: 0, "aria-label": "Values"});
    this.layout = table(["Offset", "Bytes", "Name", "Type", "Value"], "Bytes in SOME/IP");
    this.more = make("p", {className: "faint"});
    this.element = make("div", {className: "panel wide-panel", id: "message"}, make("h2", {textContent: "Newest message"}), this.about, this.fault,
      make("div", {className: "halves"}, this.values, make("div", {}, this.layout.element, this.more)));
    this.asker = new Asker(EVERY, async (wanted) => {
      try {
        const message = await (await get(`/message?route=${this.index}`)).json();
        if (wanted() && message.route === this.name) this.put(message);
      } catch (error) {
        if (wanted()) put(this.about, error.message);
      }
    });
  }

  /// @param index  of the route, in the picture
  show(route, index) {
    [this.name, this.index] = [route.name, index];
    this.asker.start();
  }
  stop() {
    this.asker.stop();
  }

  put(message) {
    const there = message.at_ns !== undefined;
    if (this.at === message.at_ns && this.shown) return;
    [this.at, this.shown] = [message.at_ns, true];
    put(this.about, there ? `${new Date(message.at_ns / 1e6).toLocaleTimeString()}, ${size(message.size)}${message.payload_type ? ` of ${message.payload_type} in SOME/IP` : ""}` : "None has come since this page was opened.");
    put(this.fault, message.fault ? `It cannot be carried: ${message.fault}` : "");
    put(this.values, message.values || "");
    this.values.hidden = !message.values;
    this.layout.element.hidden = !message.layout;
    fill(this.layout.body, (message.layout || []).map((one) => [mono(one.offset), {text: one.hex, className: "mono hex"}, " ".repeat(2 * one.depth) + one.path,
      {text: [one.type, one.rule].filter(Boolean).join(", "), className: "faint"}, {text: one.value, className: "mono hex"}]));
    put(this.more, message.more_ranges ? `… and ${whole(message.more_ranges)} more` : "");
  }
}
