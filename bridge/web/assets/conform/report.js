// The page of `trestle conform run`: everything it shows is in the element #data.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

const VERDICTS = ["fail", "error", "inconclusive", "pass-nonstrict", "pass", "unsupported"];
/// Beside the colour of a square.
const MARKS = {fail: "✕", error: "!", inconclusive: "?", "pass-nonstrict": "~"};
const LEGEND = {
  pass: "all its cases pass", "pass-nonstrict": "pass, but not strictly", fail: "a case fails", inconclusive: "could not be judged",
  error: "the runner could not go on", unsupported: "the device does not support it", none: "no case in this run",
  rule: "a rule for designs, not for devices",
};

const cases = data.cases.map((one, index) => ({
  ...one, index, words: [one.id, one.title, one.reason, ...one.requirements, ...one.tc8].join("\n").toLowerCase(),
}));
const hidden = new Set();
let requirement = null;   // the chosen one

// ---- the head ----

const plural = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;
document.title = `${data.device.name}: trestle conform`;
$("device").textContent = [data.device.name, data.device.version].filter(Boolean).join(" ");
$("run").textContent = [
  plural(cases.length, "case"), `${(data.milliseconds / 1000).toFixed(1)} s`, data.started, `profile ${data.profile}`, `level ${data.level}`,
  `seed ${data.seed}`, ...(data.cancelled ? ["ended before all cases were run"] : []),
].join(" · ");

// ---- the map of requirements ----

const casesOf = new Map();
for (const one of cases) {
  for (const id of one.requirements) casesOf.set(id, [...(casesOf.get(id) || []), one]);
}

function stateOf(row) {
  const found = casesOf.get(row.id);
  if (found) return VERDICTS.find((verdict) => found.some((one) => one.verdict === verdict));
  return row.testable === "no" ? "rule" : "none";
}

/// What a requirement says, and why no case is about it where that is so.
function summaryOf(row) {
  return row.summary + (row.why_no_case && !casesOf.has(row.id) ? ` There is no case: ${row.why_no_case}.` : "");
}

const squares = [];
function buildMap() {
  const areas = new Map();
  for (const row of data.requirements) areas.set(row.area, [...(areas.get(row.area) || []), row]);
  const counts = {};
  for (const [area, rows] of areas) {
    const line = make("div", {className: "squares"});
    for (const row of rows) {
      const state = stateOf(row);
      counts[state] = (counts[state] || 0) + 1;
      const label = `${row.id}: ${LEGEND[state]}. ${summaryOf(row)}`;
      const square = make("button", {
        type: "button", className: `square ${state}`, title: label, "aria-label": label, "aria-pressed": "false", tabIndex: squares.length ? -1 : 0,
        textContent: MARKS[state] || "",
      });
      square.dataset.id = row.id;
      square.onclick = () => chooseRequirement(requirement === row.id ? null : row.id);
      squares.push(square);
      line.append(square);
    }
    $("map").append(make("span", {textContent: area}), line);
  }
  $("map").addEventListener("keydown", (event) => {
    const at = squares.indexOf(document.activeElement);
    const steps = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1};
    const next = event.key === "Home" ? squares[0] : event.key === "End" ? squares[squares.length - 1] : squares[at + (steps[event.key] || 0)];
    if (at < 0 || !next || next === squares[at]) return;
    event.preventDefault();
    squares[at].tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  });
  const testable = data.requirements.filter((row) => row.testable !== "no");
  $("map-sum").textContent = `${testable.filter((row) => casesOf.has(row.id)).length} of ${testable.length} requirements that can be tested have a case in this run. `
    + "A square is a requirement of the Open SOME/IP Specification, in our words; choose one to see its cases.";
  $("legend").append(...Object.keys(LEGEND).filter((state) => counts[state]).map((state) => make("li", {},
    make("span", {className: `square ${state}`, textContent: MARKS[state] || "", "aria-hidden": "true"}), `${counts[state]} ${LEGEND[state]}`)));
}

function chooseRequirement(id) {
  requirement = id;
  for (const square of squares) square.setAttribute("aria-pressed", String(square.dataset.id === id));
  const row = data.requirements.find((one) => one.id === id);
  $("requirement").replaceChildren(...(row ? [make("code", {textContent: row.id}), ` ${summaryOf(row)} `, make("button", {
    type: "button", textContent: "all requirements", onclick: () => chooseRequirement(null),
  })] : []));
  showCases();
}

// ---- the table of cases ----

function buildFilters() {
  for (const verdict of VERDICTS) {
    const number = cases.filter((one) => one.verdict === verdict).length;
    if (!number) continue;
    const button = make("button", {type: "button", className: verdict, textContent: `${number} ${verdict}`, "aria-pressed": "true"});
    button.onclick = () => {
      if (hidden.has(verdict)) hidden.delete(verdict);
      else hidden.add(verdict);
      button.setAttribute("aria-pressed", String(!hidden.has(verdict)));
      showCases();
    };
    $("verdicts").append(button);
  }
  $("filter").oninput = showCases;
}

const rows = [];
function buildCases() {
  for (const one of cases) {
    const opener = make("button", {type: "button", className: "opener", textContent: one.id, "aria-expanded": "false"});
    const row = make("tr", {id: one.id}, make("td", {className: `verdict ${one.verdict}`, textContent: one.verdict}), make("td", {}, opener),
      make("td", {}, one.title, ...(one.reason ? [make("div", {className: "reason", textContent: one.reason})] : [])),
      make("td", {className: "number", textContent: one.milliseconds}));
    rows.push({one, row, opener, details: null});
    const entry = rows[rows.length - 1];
    opener.onclick = () => toggle(entry);
    opener.onkeydown = (event) => {
      const shown = rows.filter((other) => !other.row.hidden);
      const at = shown.indexOf(entry);
      const next = {ArrowDown: shown[at + 1], ArrowUp: shown[at - 1], Home: shown[0], End: shown[shown.length - 1]}[event.key];
      if (!next) return;
      event.preventDefault();
      next.opener.focus();
    };
    document.querySelector("#cases > tbody").append(row);
  }
}

function showCases() {
  const words = $("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  let number = 0;
  for (const {one, row, details} of rows) {
    const shown = !hidden.has(one.verdict) && (!requirement || one.requirements.includes(requirement)) && words.every((word) => one.words.includes(word));
    row.hidden = !shown;
    if (details) details.hidden = !shown;
    number += shown ? 1 : 0;
  }
  $("shown").textContent = number === cases.length ? "" : `${number} of ${plural(cases.length, "case")}`;
}

function toggle(entry) {
  const open = !entry.row.classList.contains("open");
  entry.row.classList.toggle("open", open);
  entry.opener.setAttribute("aria-expanded", String(open));
  if (!open) {
    entry.details.remove();
    entry.details = null;
    return;
  }
  entry.details = make("tr", {className: "details"}, make("td", {colSpan: 4}, make("div", {className: "panel"}, ...detailsOf(entry.one))));
  entry.row.after(entry.details);
}

const part = (title, ...children) => make("div", {}, make("h3", {textContent: title}), ...children);

function detailsOf(one) {
  const parts = [];
  if (one.differences.length) {
    parts.push(part("What is different", make("table", {className: "differences"},
      make("thead", {}, make("tr", {}, ...["field", "expected", "actual", "packet"].map((name) => make("th", {textContent: name})))),
      make("tbody", {}, ...one.differences.map((row) => make("tr", {}, make("td", {textContent: row.field}), make("td", {textContent: row.expected}),
        make("td", {textContent: row.actual}), make("td", {}, row.packet ? make("a", {href: `#${one.id}/${row.packet}`, textContent: row.packet}) : "")))))));
  }
  const known = new Map(data.requirements.map((row) => [row.id, row.summary]));
  parts.push(part("What it is about", make("ul", {}, ...one.requirements.map((id) => make("li", {}, make("code", {textContent: id}), ` ${known.get(id) || ""}`)),
    ...one.tc8.map((id) => make("li", {}, make("code", {textContent: id}), ` ${data.tc8[id] || ""}`)))));
  if (one.retries) parts.push(make("p", {textContent: `The device ${one.retried}; ${plural(one.retries, "message")} sent again.`}));
  if (one.attempts > 1) parts.push(make("p", {textContent: `Tried ${one.attempts} times; this is the last one.`}));
  if (one.packets.length) {
    parts.push(part(`Packets (${one.evidence})`, make("table", {className: "packets"},
      make("thead", {}, make("tr", {}, ...["", "ms", "tester – device", "what"].map((name) => make("th", {textContent: name})))),
      make("tbody", {}, ...one.packets.map((packet) => packetRow(one, packet))))));
    if (one.packets_left_out) parts.push(make("p", {className: "faint", textContent: `${plural(one.packets_left_out, "more packet")} in the capture.`}));
  }
  parts.push(part("Run it again", make("pre", {textContent: one.again})));
  return parts;
}

function packetRow(one, packet) {
  const offending = packet.comment.includes("OFFENDING");
  return make("tr", {id: `${one.id}/${packet.number}`, className: offending ? "offending" : packet.comment ? "marked" : ""},
    make("td", {className: "number", textContent: packet.number}),
    make("td", {className: "number", textContent: (packet.microseconds / 1000).toFixed(1)}),
    make("td", {className: `way ${packet.sent ? "sent" : ""}`, textContent: packet.sent ? "───▶" : "◀───", title: packet.sent ? "the tester sent it" : "the device sent it"}),
    make("td", {}, ...(packet.comment ? [make("div", {className: "comment", textContent: packet.comment})] : []),
      make("details", {}, make("summary", {textContent: packet.text}),
        make("div", {className: "ends", textContent: `${packet.transport} ${packet.from} → ${packet.to}`}), make("pre", {textContent: packet.hex}))));
}

// ---- links: #sd.offer.ttl opens that case ----

function follow() {
  const id = decodeURIComponent(location.hash.slice(1));
  const entry = rows.find(({one}) => one.id === id);
  if (!entry) return;
  if (!entry.details) toggle(entry);
  entry.row.hidden = false;
  entry.opener.focus();
  entry.row.scrollIntoView();
}

buildMap();
buildFilters();
buildCases();
showCases();
addEventListener("hashchange", follow);
follow();
