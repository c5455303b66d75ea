// Who else is there in both networks, how full the limits of the bridge are, and what was counted for all routes.
import {make} from "/parts.js";
import {ago, fill, mono, numeric, serviceOf, table, whole} from "/console/text.js";
import {Timeline} from "/console/timeline.js";

const panel = (title, ...children) => make("div", {className: "panel"}, make("h2", {textContent: title}), ...children);

export class Limits {
  constructor(place) {
    this.hosts = table(["Host", "Port", "Heard", "Offers", "Subscribed to ours"], "SOME/IP hosts");
    this.offers = table(["Service", "Version", "By"], "Services of others");
    this.own = table(["Service", "Version", "Ports", ""], "Services of ours");
    this.participants = table(["Name", "GUID", "Addresses"], "DDS participants");
    this.limits = table(["Limit", "", "Used", "Of"], "Limits");
    this.counters = table(["Group", "Counter", "Count"], "Counters");
    this.facts = make("p", {className: "faint"});
    this.timeline = new Timeline();
    place.append(this.timeline.element, panel("SOME/IP", this.facts, this.hosts.element, this.offers.element, this.own.element), panel("DDS", this.participants.element),
      panel("This bridge", this.limits.element, this.counters.element));
  }

  /// Of each picture, also while this is not shown.
  note(picture) {
    this.timeline.note(picture);
  }

  show(picture) {
    this.timeline.show();
    const {someip, dds} = picture;
    this.facts.textContent = `${someip.address}${someip.interface ? ` (${someip.interface})` : ""}, service discovery at port ${someip.port}; ` +
      `${whole(someip.discovery_received)} messages of it heard, ${whole(someip.reboots)} restarts of others. ` +
      `DDS domain ${dds.domain}, ${whole(dds.writers)} writers of others. Process ${picture.pid}, trestle ${picture.program}.`;
    fill(this.hosts.body, someip.hosts.map((one) => [one.address, String(one.port), `${ago(one.seen_s)} ago`, String(one.offers), String(one.subscribed)]));
    fill(this.offers.body, someip.offers.map((one) => [mono(serviceOf(one)), `${one.major}.${one.minor}`, one.host]));
    fill(this.own.body, someip.own_offers.map((one) => [mono(serviceOf(one)), `${one.major}.${one.minor}`,
      [one.udp_port && `UDP ${one.udp_port}`, one.tcp_port && `TCP ${one.tcp_port}`].filter(Boolean).join(", "),
      one.offered ? {text: "offered", className: "good"} : {text: "not offered", className: "faint"}]));
    fill(this.participants.body, dds.participants.map((one) => [one.name, mono(one.guid), one.addresses.join(", ")]));
    fill(this.limits.body, picture.limits.map((one, i) => {
      const row = this.limits.body.rows[i];
      const meter = row && row.querySelector("meter") || make("meter", {"aria-label": one.name});
      Object.assign(meter, {max: Math.max(1, one.limit), high: 0.8 * one.limit, value: one.used});
      return [mono(one.name), meter, numeric(whole(one.used)), numeric(whole(one.limit))];
    }));
    fill(this.counters.body, picture.counters.flatMap((group) => group.counters.filter((one) => one.count > 0).map((one) =>
      [group.name, {text: one.name, className: one.kind === "loss" ? "mono warn" : "mono"}, numeric(whole(one.count))])));
  }
}
