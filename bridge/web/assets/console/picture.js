// What the pages make of /status.json: routes with names of their own, and where a cause sits.
import {ago, figure, hex} from "/console/text.js";

/// Of a route, as long as the configuration has it.
export const keyOf = (route) => `${route.direction} ${route.kind} ${hex(route.service)}.${hex(route.instance)}.${hex(route.member)} ${route.name}`;
export const linkOf = (route) => "#route/" + encodeURIComponent(keyOf(route));
/// "Door.0x0001" and "moved", in the names of interface descriptions; what has none there by its ids.
export const serviceOfRoute = (route) => `${route.service_name || hex(route.service)}.${hex(route.instance)}`;
export const memberOf = (route) => route.member_name || hex(route.member);
export const idsOf = (route) => route.kind === "pattern" ? "pattern" : `${serviceOfRoute(route)}.${memberOf(route)}`;
export const eventgroupOf = (route) => `eventgroup ${hex(route.eventgroup)}${route.eventgroup_name ? ` (${route.eventgroup_name})` : ""}`;
export const arrowOf = (route) => route.direction === "dds_to_someip" ? "→" : "←";
export const stateClass = {flowing: "good", idle: "faint", waiting: "warn", failing: "bad"};

export const rateText = (route) => route.kind === "pattern" ? `${route.pattern.routes} routes`
  : route.per_second > 0 ? `${figure(route.per_second)} /s, ${figure(route.bytes_per_second / 1e6)} MB/s` : "0 /s";
export const lastText = (route, picture) => route.last_ns === 0 ? "never" : ago((picture.at_ns - route.last_ns) / 1e9);

const AT_SOMEIP = new Set(["other_interface", "outside_subnet", "no_packet", "not_offered", "offered_otherwise", "refused", "over_tcp_only",
  "not_acknowledged", "other_events", "no_event", "not_callable", "not_locked", "not_published", "no_subscriber"]);
/// "someip", "dds", or "" where nothing is amiss.
export const sideOf = (route) => route.cause.words === "" ? "" : AT_SOMEIP.has(route.cause.name) ? "someip" : "dds";

/// Whether all of the words are somewhere in it.
export function matches(route, words) {
  if (words.length === 0) return true;
  const {name, type, state, cause, direction, kind} = route;
  const text = [name, type, idsOf(route), state, cause.name, cause.words, direction, kind].join(" ").toLowerCase();
  return words.every((word) => text.includes(word));
}
export const wordsOf = (text) => text.toLowerCase().split(/\s+/).filter(Boolean);

/// The last rates of each route: what the pages draw lines of.
export class History {
  static most = 120;
  constructor() {
    this.rates = new Map();
  }
  note(picture) {
    const now = new Map();
    for (const route of picture.routes) {
      const key = keyOf(route);
      const before = this.rates.get(key) || [];
      before.push({at: picture.at_ns / 1e9, rate: route.per_second, bytes: route.bytes_per_second});
      if (before.length > History.most) before.shift();
      now.set(key, before);
    }
    this.rates = now;  // what is gone is forgotten
  }
  of(key) {
    return this.rates.get(key) || [];
  }
}
