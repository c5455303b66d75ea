// Numbers, times and ids as people read them; elements of SVG; tables that stay while their numbers change.
import {make} from "/parts.js";

export const hex = (number) => "0x" + number.toString(16).padStart(4, "0");

/// Three digits that matter.
export function figure(number) {
  if (!number) return "–";
  return number < 10 ? number.toFixed(2) : number < 100 ? number.toFixed(1) : Math.round(number).toLocaleString("en");
}
export const whole = (number) => number.toLocaleString("en");

/// A time in nanoseconds.
export function duration(ns) {
  const [size, unit] = ns < 1e3 ? [1, "ns"] : ns < 1e6 ? [1e3, "µs"] : ns < 1e9 ? [1e6, "ms"] : [1e9, "s"];
  return `${Number((ns / size).toPrecision(3))} ${unit}`;
}
/// How long ago, in seconds.
export function ago(seconds) {
  return seconds < 10 ? `${Math.max(0, seconds).toFixed(1)} s` : seconds < 120 ? `${seconds.toFixed(0)} s`
    : seconds < 7200 ? `${(seconds / 60).toFixed(0)} min` : seconds < 172800 ? `${(seconds / 3600).toFixed(0)} h`
    : `${(seconds / 86400).toFixed(0)} d`;
}
export function size(bytes) {
  return bytes < 1e3 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
/// "0x1111.0x0001"
export const serviceOf = (one) => `${hex(one.service)}.${hex(one.instance)}`;
export const counted = (number, word) => `${whole(number)} ${word}${number === 1 ? "" : "s"}`;
// Cells of tables.
export const mono = (text) => ({text, className: "mono"});
export const numeric = (text, more = "") => ({text, className: `number ${more}`.trim()});
export const cut = (text, most) => text.length > most ? text.slice(0, most - 1) + "…" : text;

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/// Only what differs, so that what is marked stays marked.
export function put(element, text, className) {
  if (element.textContent !== text) element.textContent = text;
  if (className !== undefined && element.getAttribute("class") !== className) element.setAttribute("class", className);
}

/// Lines of a table: elements that are there stay, so that focus and selection do.
/// @param rows  of each its cells: texts, {text, className}, or elements
export function fill(body, rows) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((cells, i) => {
    const row = body.rows[i] || body.insertRow();
    cells.forEach((cell, column) => {
      const place = row.cells[column] || row.insertCell();
      if (cell instanceof Node) {
        if (place.firstChild !== cell) place.replaceChildren(cell);
      } else if (typeof cell === "object") {
        put(place, cell.text, cell.className);
      } else {
        put(place, cell, "");
      }
    });
  });
}

export function table(heads, caption) {
  const body = make("tbody");
  const element = make("table", {}, ...(caption ? [make("caption", {textContent: caption})] : []),
    make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", {scope: "col", textContent: head})))), body);
  return {element: make("div", {className: "wide", tabIndex: 0, role: "group", "aria-label": caption || heads.join(", ")}, element), body};
}
