// The network as a graph: SOME/IP hosts, services, routes, topics. An edge on which nothing flows is red, and says why.
import {idsOf, keyOf, linkOf, memberOf, rateText, serviceOfRoute, sideOf, stateClass} from "/console/picture.js";
import {ago, cut, hex, put, svg} from "/console/text.js";

/// More nobody can look at; those with a cause come first, and the filter chooses others.
export const MOST = 40;

const COLUMNS = {host: [10, 190], service: [270, 190], route: [540, 230], topic: [850, 330]};
const WIDTH = 1190;
const ROW = 46;
const HIGH = 34;

const ARROW = {viewBox: "0 0 8 8", refX: 8, refY: 4, markerWidth: 9, markerHeight: 9, markerUnits: "userSpaceOnUse", orient: "auto"};

const serviceKey = (service, instance) => `${hex(service)}.${hex(instance)}`;

/// What to draw, without places: {hosts, services, topics, routes, edges}.
function shape(routes, picture) {
  const nodes = {host: new Map(), service: new Map(), topic: new Map()};
  const edges = [];
  const own = new Set(picture.someip.own_offers.map((one) => serviceKey(one.service, one.instance)));
  for (const route of routes) {
    const service = serviceKey(route.service, route.instance);
    if (route.kind !== "pattern") {
      if (!nodes.service.has(service)) nodes.service.set(service, {routes: [], own: own.has(service)});
      nodes.service.get(service).routes.push(route);
    }
    if (!nodes.topic.has(route.name)) nodes.topic.set(route.name, {routes: []});
    nodes.topic.get(route.name).routes.push(route);
  }
  for (const host of picture.someip.hosts) nodes.host.set(host.address, {host});
  const offers = new Set();
  for (const offer of picture.someip.offers) {
    const service = serviceKey(offer.service, offer.instance);
    const key = `${offer.host} ${service}`;
    if (offers.has(key) || !nodes.service.has(service)) continue;
    offers.add(key);
    if (!nodes.host.has(offer.host)) nodes.host.set(offer.host, {});
    edges.push({from: ["host", offer.host], to: ["service", service], about: "offers it"});
  }
  // Of the subscribers to ours only the number is known; so it is sure where a single host subscribes.
  const subscribed = picture.someip.hosts.filter((host) => host.subscribed > 0);
  for (const [service, node] of nodes.service) {
    if (!node.own || !node.routes.some((route) => route.someip.subscribers > 0)) continue;
    const maybe = subscribed.length > 1;
    for (const host of subscribed) {
      edges.push({from: ["service", service], to: ["host", host.address], about: maybe ? "may be a subscriber" : "subscribes", maybe});
    }
  }
  return {nodes, edges};
}

export class Graph {
  constructor(place) {
    this.place = place;
    this.drawn = "";
    this.updates = [];
  }

  /// @param routes  those that are to be seen
  show(routes, picture) {
    const seen = [...routes].sort((a, b) => (b.cause.words !== "") - (a.cause.words !== "")).slice(0, MOST);
    // In one order, so that lines cross seldom.
    seen.sort((a, b) => a.service - b.service || a.instance - b.instance || a.name.localeCompare(b.name) || a.member - b.member);
    const {nodes, edges} = shape(seen, picture);
    const hosts = [...nodes.host.keys()].slice(0, MOST);
    const drawn = JSON.stringify([seen.map((route) => [keyOf(route), idsOf(route), sideOf(route) !== ""]), hosts, edges]);
    if (drawn !== this.drawn) {
      this.drawn = drawn;
      this.draw(seen, nodes, edges, hosts);
    }
    const byKey = new Map(seen.map((route) => [keyOf(route), route]));
    for (const update of this.updates) update(byKey, picture);
    return seen.length;
  }

  draw(seen, nodes, edges, hosts) {
    const focus = document.activeElement && this.place.contains(document.activeElement) ? document.activeElement.dataset.key : undefined;
    this.updates = [];
    const at = {host: new Map(), service: new Map(), topic: new Map(), route: new Map()};
    let y = 34;
    for (const route of seen) {
      at.route.set(keyOf(route), y);
      y += ROW + (sideOf(route) ? 20 : 0);
    }
    const height = Math.max(y, 34 + hosts.length * ROW);
    const spread = (column, wanted) => {  // in their order, none above another
      let free = 34;
      for (const [key, middle] of [...wanted].sort((a, b) => a[1] - b[1])) {
        const place = Math.max(free, middle);
        at[column].set(key, place);
        free = place + ROW;
      }
      return free;
    };
    const middle = (node) => {
      const all = node.routes.map((route) => at.route.get(keyOf(route)));
      return all.reduce((sum, one) => sum + one, 0) / all.length;
    };
    let bottom = Math.max(height, spread("service", [...nodes.service].map(([key, node]) => [key, middle(node)])));
    bottom = Math.max(bottom, spread("topic", [...nodes.topic].map(([key, node]) => [key, middle(node)])));
    bottom = Math.max(bottom, spread("host", hosts.map((key, i) => {
      const others = edges.flatMap(({from, to}) => from[1] === key ? [to[1]] : to[1] === key ? [from[1]] : []);
      const services = others.map((service) => at.service.get(service)).filter((one) => one !== undefined);
      return [key, services.length > 0 ? services.reduce((sum, one) => sum + one, 0) / services.length : 34 + i * ROW];
    })));

    const root = svg("svg", {viewBox: `0 0 ${WIDTH} ${bottom + 10}`, width: WIDTH, role: "group", "aria-label": "Network"},
      svg("defs", {}, ...["plain", "good", "bad"].map((kind) => svg("marker", {id: `arrow-${kind}`, class: kind, ...ARROW},
        svg("path", {d: "M0 0 L8 4 L0 8 z"})))));
    for (const [column, title] of [["host", "SOME/IP hosts"], ["service", "Services"], ["route", "Routes"], ["topic", "DDS topics"]]) {
      root.append(svg("text", {x: COLUMNS[column][0], y: 18, class: "column"}, title));
    }
    const lines = svg("g");
    const boxes = svg("g");
    root.append(lines, boxes);

    for (const {from, to, about, maybe} of edges) {
      if (at[from[0]].get(from[1]) === undefined || at[to[0]].get(to[1]) === undefined) continue;
      lines.append(svg("path", {d: this.curve(at, from, to), class: `edge${maybe ? " maybe" : ""}`, "marker-end": "url(#arrow-plain)"},
        svg("title", {}, `${from[1]} – ${to[1]}: ${about}`)));
    }
    for (const host of hosts) this.host(boxes, host, at.host.get(host));
    for (const [key, node] of nodes.service) this.service(boxes, key, node, at.service.get(key));
    for (const key of nodes.topic.keys()) this.topic(boxes, key, at.topic.get(key));
    for (const route of seen) this.route(boxes, lines, route, at);
    this.place.replaceChildren(root);
    if (focus) (this.place.querySelector(`[data-key="${CSS.escape(focus)}"]`) || this.place).focus();
  }

  /// From the side of one box to the side of the other.
  curve(at, from, to) {
    const right = COLUMNS[from[0]][0] < COLUMNS[to[0]][0];
    const [x1, x2] = right ? [COLUMNS[from[0]][0] + COLUMNS[from[0]][1], COLUMNS[to[0]][0]] : [COLUMNS[from[0]][0], COLUMNS[to[0]][0] + COLUMNS[to[0]][1]];
    const [y1, y2] = [at[from[0]].get(from[1]) + HIGH / 2, at[to[0]].get(to[1]) + HIGH / 2];
    return `M${x1} ${y1} C${(x1 + x2) / 2} ${y1} ${(x1 + x2) / 2} ${y2} ${x2} ${y2}`;
  }

  box(column, y, ...children) {
    return svg("g", {transform: `translate(${COLUMNS[column][0]} ${y})`}, svg("rect", {width: COLUMNS[column][1], height: HIGH, rx: 6}), ...children);
  }

  host(boxes, address, y) {
    const about = svg("text", {x: 8, y: 28, class: "small"});
    boxes.append(this.box("host", y, svg("text", {x: 8, y: 14}, cut(address, 24)), about, svg("title", {}, address)));
    this.updates.push((_, picture) => {
      const host = picture.someip.hosts.find((one) => one.address === address);
      if (host) put(about, `heard ${ago(host.seen_s)} ago`);
    });
  }

  service(boxes, key, node, y) {
    const about = svg("text", {x: 8, y: 28, class: "small"});
    const keys = node.routes.map(keyOf);
    boxes.append(this.box("service", y, svg("text", {x: 8, y: 14, class: "id"}, cut(serviceOfRoute(node.routes[0]), 26)),
      svg("title", {}, key), about));
    this.updates.push((routes, picture) => {
      const offers = picture.someip.offers.filter((one) => `${hex(one.service)}.${hex(one.instance)}` === key);
      const subscribers = Math.max(0, ...keys.map((one) => routes.get(one)?.someip.subscribers || 0));
      put(about, node.own ? `ours, ${subscribers} subscribed` : offers.length > 0 ? `version ${offers[0].major}.${offers[0].minor}` : "offered by nobody");
    });
  }

  topic(boxes, name, y) {
    boxes.append(this.box("topic", y, svg("text", {x: 8, y: 21}, cut(name, 44)), svg("title", {}, name)));
  }

  route(boxes, lines, route, at) {
    const key = keyOf(route);
    const y = at.route.get(key);
    const state = svg("text", {x: 8, y: 14});
    const rate = svg("text", {x: 8, y: 28, class: "small"});
    const id = svg("text", {x: COLUMNS.route[1] - 8, y: 14, "text-anchor": "end", class: "id small"}, route.kind === "pattern" ? "pattern" : cut(memberOf(route), 18));
    const link = svg("a", {href: linkOf(route), "data-key": key}, this.box("route", y, state, rate, id));
    boxes.append(link);

    const toDds = route.direction !== "dds_to_someip";
    const service = ["service", `${hex(route.service)}.${hex(route.instance)}`];
    const [self, topic] = [["route", key], ["topic", route.name]];
    const ends = toDds ? {someip: [service, self], dds: [self, topic]} : {someip: [self, service], dds: [topic, self]};
    if (route.kind === "pattern") delete ends.someip;
    const paths = {};
    for (const [side, end] of Object.entries(ends)) {
      paths[side] = svg("path", {d: this.curve(at, ...end)});
      lines.append(paths[side]);
    }
    // The words of a cause stand below the edge that it is about.
    const side = sideOf(route);
    const why = svg("text", {x: side === "someip" ? COLUMNS.service[0] + COLUMNS.service[1] + 8 : COLUMNS.route[0] + 8, y: y + HIGH + 15, class: "why"});
    const whole = svg("title");
    if (side) lines.append(svg("g", {}, whole, why));

    this.updates.push((routes) => {
      const now = routes.get(key);
      put(state, now.state, stateClass[now.state]);
      put(rate, rateText(now));
      const cause = sideOf(now);
      link.setAttribute("aria-label", `${now.name} ${idsOf(now)}, ${now.state}, ${rateText(now)}${cause ? ": " + now.cause.words : ""}`);
      for (const [name, path] of Object.entries(paths)) {
        const kind = name === cause ? "bad" : now.state === "flowing" ? "good" : "plain";
        if (path.getAttribute("class") !== `edge ${kind}`) {
          path.setAttribute("class", `edge ${kind}`);
          path.setAttribute("marker-end", `url(#arrow-${kind})`);
        }
      }
      if (cause) {
        put(why, cut(now.cause.words, cause === "someip" ? 115 : 105));
        put(whole, now.cause.words);
      }
    });
  }
}
