// Service discovery while the page was open, as a timeline: who was heard, offered what and subscribed to ours, from when until
// when. It is made of the pictures, so what comes and goes again between two of them is not seen.
import {make} from "/parts.js";
import {ago, counted, cut, fill, mono, put, serviceOf, svg, table} from "/console/text.js";

const [LEFT, RIGHT, TALL] = [330, 950, 18];
const DRAWN = 30;  // rows

/// All that there is in a picture, by keys that stay: of which host, what it is, and how it is told.
function thereIn({someip}) {
  const there = new Map();
  const note = (host, what, came, went) => there.set(`${host} ${what}`, {host, what, came, went});
  for (const one of someip.hosts) {
    note(one.address, "", "is heard", "is heard no longer");
    if (one.subscribed > 0) note(one.address, "subscribed to ours", "subscribes to ours", "subscribes to ours no longer");
  }
  const offer = (host, one) => {
    const what = `${serviceOf(one)} ${one.major}.${one.minor}`;
    note(host, what, `offers ${what}`, `offers ${what} no longer`);
  };
  for (const one of someip.offers) offer(one.host, one);
  for (const one of someip.own_offers) if (one.offered) offer(`${someip.address} (here)`, one);
  return there;
}

export class Timeline {
  static seconds = 600;  // that are kept
  static changes = 50;   // that are told
  static rows = 2000;    // that are kept
  static spans = 100;    // of a row

  constructor() {
    this.drawing = svg("svg", {class: "chart timeline", role: "img"});
    this.more = make("p", {className: "faint"});
    this.told = table(["At", "Host", ""], "Changes, the newest first");
    this.element = make("div", {className: "panel wide-panel", id: "timeline"}, make("h2", {textContent: "Service discovery while this page is open"}),
      this.drawing, this.more, this.told.element);
  }

  /// Another process, or the same that has read its configuration again: its peers did not come just now.
  begin(picture) {
    this.from = picture.at_ns / 1e9;
    this.rows = new Map();     // by key: what thereIn() has, and spans of {from, to}, to: null while it is there
    this.restarts = [];        // of others: times
    this.changes = [];         // {at, host, words}, the newest first
    [this.pid, this.ran, this.reboots] = [picture.pid, 0, picture.someip.reboots];
  }

  note(picture) {
    const begins = picture.pid !== this.pid || picture.running_s < this.ran;
    if (begins) this.begin(picture);
    const now = this.now = picture.at_ns / 1e9;
    this.ran = picture.running_s;
    const tell = (host, words) => {
      if (!begins) this.changes.unshift({at: now, host, words});
    };
    const there = thereIn(picture);
    for (const [key, one] of there) {
      const row = this.rows.get(key) || {...one, spans: []};
      if (row.spans.length > 0 && row.spans[row.spans.length - 1].to === null) continue;
      row.spans.push({from: now, to: null});
      if (row.spans.length > Timeline.spans) row.spans.shift();
      this.rows.set(key, row);
      tell(row.host, row.came);
    }
    for (const [key, row] of this.rows) {
      const last = row.spans[row.spans.length - 1];
      if (last.to === null && !there.has(key)) {
        last.to = now;
        tell(row.host, row.went);
      }
      const isOver = last.to !== null && (now - last.to > Timeline.seconds || this.rows.size > Timeline.rows);
      if (isOver) this.rows.delete(key);
    }
    if (picture.someip.reboots > this.reboots) {
      this.restarts = [...this.restarts.filter((one) => now - one < Timeline.seconds), now];
      tell("", `${counted(picture.someip.reboots - this.reboots, "restart")} of others`);
    }
    this.reboots = picture.someip.reboots;
    this.changes.length = Math.min(this.changes.length, Timeline.changes);
  }

  show() {
    const seconds = Math.min(Timeline.seconds, Math.max(60, this.now - this.from));
    const x = (at) => Math.max(LEFT, RIGHT - (RIGHT - LEFT) * (this.now - at) / seconds);
    const rows = [...this.rows.values()].sort((a, b) => a.host.localeCompare(b.host) || a.what.localeCompare(b.what));
    const drawn = rows.slice(0, DRAWN);
    const bottom = TALL * (drawn.length + 1);
    const name = (row) => row.what === "" ? svg("text", {x: 4}, cut(row.host, 40)) : svg("text", {x: 16, class: "small"}, cut(row.what, 44));
    this.drawing.replaceChildren(
      ...drawn.flatMap((row, i) => {
        const label = name(row);
        label.setAttribute("y", TALL * (i + 1) - 4);
        const first = row.what !== "" && (i === 0 || drawn[i - 1].host !== row.host);  // of a host that is not heard itself
        if (first) label.textContent = cut(`${row.host}: ${row.what}`, 48);
        return [label, ...row.spans.map(({from, to}) => svg("rect", {x: x(from).toFixed(1), y: TALL * i + 4, height: TALL - 6,
          width: Math.max(2, x(to === null ? this.now : to) - x(from)).toFixed(1), class: to === null ? "there" : "gone"},
          svg("title", {}, `${row.host} ${row.came}, ${to === null ? "still" : `for ${ago(to - from)}`}`)))];
      }),
      ...this.restarts.filter((at) => this.now - at < seconds).map((at) => svg("line", {x1: x(at).toFixed(1), x2: x(at).toFixed(1), y1: 0, y2: bottom - TALL, class: "restart"},
        svg("title", {}, "a host has restarted"))),
      svg("text", {x: LEFT, y: bottom - 2, class: "small"}, `${ago(seconds)} ago`),
      svg("text", {x: RIGHT, y: bottom - 2, class: "small", "text-anchor": "end"}, "now"));
    this.drawing.setAttribute("viewBox", `0 0 ${RIGHT + 5} ${bottom + 4}`);
    this.drawing.setAttribute("aria-label", `${counted(rows.length, "row")} of hosts and services; the changes stand below`);
    put(this.more, rows.length > DRAWN ? `${counted(rows.length - DRAWN, "more row")} not drawn.` : "");
    fill(this.told.body, this.changes.length === 0 ? [["", "", "Nothing has changed."]]
      : this.changes.map((one) => [new Date(one.at * 1e3).toLocaleTimeString(), mono(one.host), one.words]));
  }
}
