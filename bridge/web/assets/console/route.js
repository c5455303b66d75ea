// The page of one route: how fast it is, what it loses and why, and what both sides ask for.
import {make} from "/parts.js";
import {KINDS, MessagePanel} from "/console/message.js";
import {SIGHTS, SightPanel} from "/console/sight.js";
import {arrowOf, eventgroupOf, idsOf, keyOf, lastText, rateText, stateClass} from "/console/picture.js";
import {ago, counted, duration, figure, fill, hex, mono, numeric, put, serviceOf, size, svg, table, whole} from "/console/text.js";

const panel = (title, ...children) => make("div", {className: "panel"}, make("h2", {textContent: title}), ...children);

function qosText(qos) {
  return [qos.reliable ? "reliable" : "best effort", qos.transient_local ? "transient local" : "volatile",
    qos.keep_all ? "keep all" : qos.depth ? `depth ${qos.depth}` : "", qos.deadline_s ? `deadline ${qos.deadline_s} s` : "",
    qos.liveliness_s ? `liveliness ${qos.liveliness_s} s${qos.manual_liveliness ? ", manual" : ""}` : ""].filter(Boolean).join(", ");
}

const chosen = (is, what, id) => is ? `the ${what}'s id ${hex(id)} was chosen by Trestle, as no description gives it` : "";

/// A line of the rates of the last minutes.
class RateLine {
  constructor() {
    this.line = svg("polyline", {class: "rate"});
    this.most = svg("text", {x: 4, y: 12, class: "small"});
    this.element = svg("svg", {viewBox: "0 0 480 90", class: "chart", role: "img", "aria-label": "Messages a second in the last minutes"},
      this.line, this.most);
  }
  show(rates) {
    const most = Math.max(1e-9, ...rates.map((one) => one.rate));
    const end = rates.length > 0 ? rates[rates.length - 1].at : 0;
    this.line.setAttribute("points", rates.map((one) => `${(480 - 4 * (end - one.at)).toFixed(1)},${(86 - 70 * one.rate / most).toFixed(1)}`).join(" "));
    const any = rates.some((one) => one.rate > 0);
    put(this.most, any ? `at most ${figure(most)} /s in the last ${ago(end - rates[0].at)}` : "nothing was carried while this page was open");
  }
}

/// A histogram of times: columns as wide as their buckets are by their logarithm.
class LatencyChart {
  constructor(name) {
    this.columns = svg("g");
    this.ticks = svg("g");
    this.element = svg("svg", {viewBox: "0 0 480 140", class: "chart", role: "img"}, this.columns, this.ticks);
    this.words = make("p", {className: "faint"});
    this.name = name;
    this.drawn = "";
  }
  show(latency) {
    const words = latency.count === 0 ? "none yet" : `${counted(latency.count, "message")}: p50 ${duration(latency.p50_ns)}, ` +
      `p90 ${duration(latency.p90_ns)}, p99 ${duration(latency.p99_ns)}, p99.9 ${duration(latency.p999_ns)}; ${duration(latency.min_ns)} to ${duration(latency.max_ns)}`;
    if (words === this.drawn) return;
    this.drawn = words;
    put(this.words, words);
    this.element.setAttribute("aria-label", `${this.name}: ${words}`);
    this.element.toggleAttribute("hidden", latency.count === 0);
    if (latency.count === 0) return;
    const log = (ns) => Math.log10(Math.max(1, ns));
    const [low, high] = [Math.floor(log(latency.buckets[0].up_to_ns)), Math.ceil(log(latency.max_ns) + 1e-9)];
    const x = (ns) => 10 + 460 * (log(ns) - low) / Math.max(1, high - low);
    const most = Math.max(...latency.buckets.map((one) => one.count));
    this.columns.replaceChildren(...latency.buckets.map((one) => {
      const tall = Math.max(1, 108 * one.count / most);
      const [left, right] = [x(one.up_to_ns * 8 / 9), x(one.up_to_ns)];  // they are an eighth wide
      return svg("rect", {x: left.toFixed(1), y: (112 - tall).toFixed(1), width: Math.max(1.5, right - left - 0.5).toFixed(1), height: tall.toFixed(1)},
        svg("title", {}, `up to ${duration(one.up_to_ns)}: ${whole(one.count)}`));
    }));
    this.ticks.replaceChildren(svg("line", {x1: 10, x2: 470, y1: 112.5, y2: 112.5}), ...Array.from({length: high - low + 1}, (_, i) => {
      const ns = 10 ** (low + i);
      return svg("text", {x: x(ns), y: 130, "text-anchor": i === 0 ? "start" : i === high - low ? "end" : "middle", class: "small"}, duration(ns));
    }));
  }
}

export class RoutePage {
  constructor(place, get) {
    this.place = place;
    this.get = get;
    this.key = "";
    this.built = "";
    this.live = [];  // panels that ask for messages
  }

  /// @param key  of the route; empty: none
  choose(key) {
    if (key !== this.key) this.leave();
    this.key = key;
  }

  leave() {
    for (const one of this.live) one.stop();
    this.live = [];
    this.built = "";
  }

  show(picture, history) {
    const index = picture.routes.findIndex((one) => keyOf(one) === this.key);
    if (index < 0) {
      this.leave();
      this.place.replaceChildren(make("p", {className: "panel", textContent: "The bridge has no such route now."}));
      return;
    }
    const route = picture.routes[index];
    if (this.built !== this.key) this.build(route);
    for (const one of this.live) one.show(route, index);
    put(this.state, route.state, stateClass[route.state]);
    put(this.cause, route.cause.words);
    this.cause.hidden = route.cause.words === "";
    put(this.rate, rateText(route));
    put(this.last, route.last_ns === 0 ? "no message has come" : `the last one ${lastText(route, picture)} ago`);
    const wait = route.limit ? `; ${route.in_use} of ${route.limit} wait` : "";
    put(this.sums, `${whole(route.received)} came, ${whole(route.carried)} were carried (${size(route.bytes)})${wait}`);
    this.rates.show(history.of(this.key));
    this.conversion.show(route.conversion);
    this.path.show(route.path);
    const of = (kinds) => route.counters.filter((one) => one.count > 0 && kinds.includes(one.kind)).sort((a, b) => b.count - a.count);
    const drops = of(["loss", "doubt"]);
    this.noDrops.hidden = drops.length > 0;
    this.drops.element.hidden = drops.length === 0;
    fill(this.drops.body, drops.map((one) => [mono(one.name), numeric(whole(one.count), "warn"), one.kind === "doubt" ? "perhaps lost" : ""]));
    fill(this.counters.body, of(["traffic", "now"]).map((one) => [mono(one.name), numeric(whole(one.count))]));
    const dds = route.dds;
    const toSomeip = route.direction === "dds_to_someip";
    fill(this.qos.body, [[toSomeip ? "this route reads" : "this route writes", route.type, qosText(dds.qos)],
      ...dds.writers.map((one) => [(one.node || "a publisher") + (one.bridge ? " (a bridge)" : "") + (one.refused ? " (refused)" : ""), one.type, qosText(one.qos)])]);
    const refused = dds.incompatible_qos ? `; ${counted(dds.incompatible_qos, "reader")} asked for more than is offered` : "";
    put(this.matched, `${counted(dds.matched, toSomeip ? "matching publisher" : "matching reader")}${refused}.`);
    const someip = route.someip;
    fill(this.offers.body, someip.offers.map((one) => [mono(serviceOf(one)), `${one.major}.${one.minor}`, one.host]));
    this.offers.element.hidden = someip.offers.length === 0;
    const offered = someip.offered ? `offered, ${whole(someip.subscribers)} subscribed` : "not offered";
    const subscribed = someip.subscribed ? "subscribed" : someip.wanted ? "not subscribed yet" : "";
    put(this.someip, [`${idsOf(route)}, version ${route.major}.${route.minor === 0xffffffff ? "any" : route.minor}`, route.transport.toUpperCase(),
      chosen(route.service_id_is_chosen, "service", route.service), chosen(route.member_id_is_chosen, "member", route.member),
      chosen(route.eventgroup_id_is_chosen, "eventgroup", route.eventgroup), route.eventgroup ? eventgroupOf(route) : "", toSomeip ? offered : subscribed,
      someip.other_events ? `${whole(someip.other_events)} events with other ids came (${someip.other_ids.map(hex).join(", ")})` : ""].filter(Boolean).join("; "));
    fill(this.slowest.body, route.slowest.map((one) => [new Date(one.at_ns / 1e6).toLocaleTimeString(), numeric(size(one.bytes)),
      ...[one.source_ns, one.waited_ns, one.convert_ns, one.send_ns].map((ns) => numeric(ns < 0 ? "–" : duration(ns)))]));
  }

  build(route) {
    this.built = this.key;
    this.state = make("strong");
    this.cause = make("p", {className: "bad cause"});
    [this.rate, this.last, this.sums] = [make("span"), make("span"), make("p", {className: "faint"})];
    this.rates = new RateLine();
    this.conversion = new LatencyChart("Conversion");
    this.path = new LatencyChart("Path");
    this.drops = table(["Reason", "Messages", ""]);
    this.noDrops = make("p", {className: "faint", textContent: "Nothing was lost."});
    this.counters = table(["Counter", "Count"], "Other counters");
    this.qos = table(["Who", "Type", "Quality of service"], "DDS");
    this.matched = make("p", {className: "faint"});
    this.offers = table(["Offered", "Version", "By"], "Offers of the service");
    this.someip = make("p");
    this.slowest = table(["At", "Size", "Source", "Waited", "Convert", "Send"], "The slowest of the last minute");
    const what = route.line ? `, line ${route.line} of the configuration` : "";
    if (KINDS.has(route.kind)) this.live = [...(SIGHTS.has(route.type) ? [new SightPanel(this.get)] : []), new MessagePanel(this.get)];
    this.place.replaceChildren(
      make("div", {className: "panel wide-panel halves"}, make("div", {}, make("h2", {}, `${route.name} ${arrowOf(route)} ${idsOf(route)} `, this.state),
        make("p", {className: "faint", textContent: `${route.type}${what}`}), this.cause, make("p", {}, this.rate, ", ", this.last), this.sums),
      this.rates.element),
      ...this.live.map((one) => one.element),
      panel("Conversion", this.conversion.words, this.conversion.element),
      panel(route.direction === "dds_to_someip" ? "From the source to the network" : "From the network to DDS", this.path.words, this.path.element),
      panel("Drops by reason", this.noDrops, this.drops.element, this.counters.element),
      panel("Both sides", this.someip, this.offers.element, this.qos.element, this.matched),
      panel("Slowest messages", this.slowest.element));
  }
}
