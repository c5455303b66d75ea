// What pages of trestle share: elements, questions to the program, saved files, a tree and tabs for the keyboard, colours
// for text.

export const $ = (id) => document.getElementById(id);

export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role" || key === "for") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

/// Asks the program; JSON both ways.
/// @throws Error with what it says went wrong
export async function ask(path, question) {
  const answer = await fetch(path, question === undefined ? {} : {
    method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(question),
  }).catch(() => {
    throw new Error("trestle does not answer: has it ended?");
  });
  if (!answer.ok) throw new Error((await answer.text()).trim() || answer.statusText);
  return answer.json();
}

export const count = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;

export function save(name, blob) {
  const link = make("a", {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// ---- a tree of two levels ----

/// @param element  a list with role="tree" and tabindex="0"
/// @param choose   is told of the item that is chosen
/// @param enter    what Enter does
export class Tree {
  constructor(element, choose, enter) {
    this.element = element;
    this.choose = choose;
    this.items = [];   // {key, level, text, detail, label}
    this.closed = new Set();
    this.chosen = null;
    element.addEventListener("keydown", (event) => {
      const shown = this.shown();
      const at = shown.findIndex((item) => item.key === this.chosen);
      const item = shown[at];
      let next;
      switch (event.key) {
        case "ArrowDown": next = shown[at + 1]; break;
        case "ArrowUp": next = shown[at - 1]; break;
        case "Home": next = shown[0]; break;
        case "End": next = shown[shown.length - 1]; break;
        case "ArrowLeft":
          if (item && item.level === 1) this.fold(item, true);
          else next = shown.slice(0, at).reverse().find((one) => one.level === 1);
          break;
        case "ArrowRight":
          if (item && this.closed.has(item.key)) this.fold(item, false);
          else if (shown[at + 1] && shown[at + 1].level === 2) next = shown[at + 1];
          break;
        case "Enter": enter(); break;
        default: return;
      }
      event.preventDefault();
      if (next) this.select(next.key);
    });
  }

  shown() {
    let closed = false;
    return this.items.filter((item) => {
      if (item.level === 1) closed = this.closed.has(item.key);
      return item.level === 1 || !closed;
    });
  }

  fold(item, closed) {
    if (closed) this.closed.add(item.key);
    else this.closed.delete(item.key);
    this.show(this.items);
  }

  show(items) {
    this.items = items;
    if (!this.shown().some((item) => item.key === this.chosen)) {
      const parent = items.slice(0, items.findIndex((item) => item.key === this.chosen) + 1).reverse().find((item) => item.level === 1);
      this.chosen = (parent || items[0] || {key: null}).key;
    }
    this.element.replaceChildren(...this.shown().map((item, index) => {
      const mark = item.level === 2 ? "" : this.closed.has(item.key) ? "▸ " : "▾ ";
      const element = make("li", {
        id: `${this.element.id}-${index}`, role: "treeitem", className: `level${item.level}`, "aria-level": item.level,
        "aria-selected": String(item.key === this.chosen), "aria-label": item.label,
      }, make("span", {className: "row"}, make("span", {textContent: mark + item.text}), make("span", {className: "id", textContent: item.detail})));
      if (item.level === 1) element.setAttribute("aria-expanded", String(!this.closed.has(item.key)));
      element.dataset.key = item.key;
      element.onclick = () => {
        if (item.level === 1 && item.key === this.chosen) this.fold(item, !this.closed.has(item.key));
        this.select(item.key);
      };
      return element;
    }));
    this.mark();
  }

  select(key) {
    this.chosen = key;
    this.mark();
    this.choose(key);
  }

  mark() {
    for (const element of this.element.children) {
      const chosen = element.dataset.key === this.chosen;
      element.setAttribute("aria-selected", String(chosen));
      if (chosen) {
        element.scrollIntoView({block: "nearest"});
        this.element.setAttribute("aria-activedescendant", element.id);
      }
    }
  }
}

// ---- tabs ----

/// @param element  with role="tablist"
/// @param tabs     {name, title}
export function showTabs(element, tabs, chosen, choose) {
  const focused = element.contains(document.activeElement);
  element.replaceChildren(...tabs.map((tab) => {
    const selected = tab.name === chosen;
    const button = make("button", {
      type: "button", role: "tab", textContent: tab.name, title: tab.title || "", tabIndex: selected ? 0 : -1, "aria-selected": String(selected),
    });
    button.onclick = () => choose(tab.name);
    button.onkeydown = (event) => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (!step) return;
      const at = tabs.findIndex((one) => one.name === chosen);
      choose(tabs[(at + step + tabs.length) % tabs.length].name);
    };
    return button;
  }));
  if (focused) (element.querySelector("[aria-selected=true]") || element).focus();
}

// ---- text with colours ----

const COMMENT = /^\s*(#|\/\/|<!--|<\*\*)/;
const TOKENS = new RegExp([
  /("(?:[^"\\]|\\.)*")/,                                          // 1: texts
  /(\b0x[0-9a-fA-F]+\b|\b\d+(?:\.\d+)?\b)/,                       // 2: numbers
  /(<\/?[A-Za-z][A-Za-z0-9:-]*|\/?>|^[\s-]*[A-Za-z_][\w ]*:(?=\s|$))/,  // 3: tags, keys
  /\b(package|import|interface|typeCollection|version|major|minor|attribute|readonly|method|fireAndForget|broadcast|selective|in|out|error|struct|union|enumeration|array|of|map|to|typedef|is|extends|define|for|provider|instance|as|true|false|null|u?int(?:8|16|32|64)|float(?:32|64)|bool|string)\b/,
].map((one) => one.source).join("|"), "g");
/// Longer text is shown to here, and saved whole.
const MOST_LINES = 4000;

export function coloured(text) {
  const parts = [];
  const lines = text.split("\n");
  for (const line of lines.slice(0, MOST_LINES)) {
    if (COMMENT.test(line)) {
      parts.push(make("span", {className: "c", textContent: line}), "\n");
      continue;
    }
    let last = 0;
    for (const match of line.slice(0, 2000).matchAll(TOKENS)) {
      if (match.index > last) parts.push(line.slice(last, match.index));
      parts.push(make("span", {className: match[1] ? "s" : match[2] ? "n" : "k", textContent: match[0]}));
      last = match.index + match[0].length;
    }
    parts.push(line.slice(last), "\n");
  }
  if (lines.length > MOST_LINES) parts.push(make("span", {className: "c", textContent: `… ${lines.length - MOST_LINES} more lines: save the file to see them`}));
  return parts;
}

// ---- zip ----

/// A zip file that stores: PKWARE's APPNOTE, 4.3.
export function zip(files) {
  const table = Array.from({length: 256}, (_, byte) => {
    for (let bit = 0; bit < 8; ++bit) byte = byte & 1 ? 0xedb88320 ^ (byte >>> 1) : byte >>> 1;
    return byte >>> 0;
  });
  const sum = (bytes) => ~bytes.reduce((crc, byte) => table[(crc ^ byte) & 255] ^ (crc >>> 8), ~0) >>> 0;
  const numbers = (...parts) => {  // [value, bytes] ...
    const view = new DataView(new ArrayBuffer(parts.reduce((size, [, bytes]) => size + bytes, 0)));
    let at = 0;
    for (const [value, bytes] of parts) {
      if (bytes === 2) view.setUint16(at, value, true);
      else view.setUint32(at, value, true);
      at += bytes;
    }
    return new Uint8Array(view.buffer);
  };
  const body = [];
  const index = [];
  let offset = 0;
  for (const file of files) {
    const name = new TextEncoder().encode(file.name);
    const bytes = new TextEncoder().encode(file.text);
    // Version, names in UTF-8, stored, the first day there is, sum, sizes, length of the name, no more.
    const common = [[20, 2], [0x800, 2], [0, 2], [0, 2], [33, 2], [sum(bytes), 4], [bytes.length, 4], [bytes.length, 4], [name.length, 2], [0, 2]];
    const head = numbers([0x04034b50, 4], ...common);
    body.push(head, name, bytes);
    index.push(numbers([0x02014b50, 4], [20, 2], ...common, [0, 2], [0, 2], [0, 2], [0, 4], [offset, 4]), name);
    offset += head.length + name.length + bytes.length;
  }
  const size = index.reduce((all, part) => all + part.length, 0);
  const end = numbers([0x06054b50, 4], [0, 2], [0, 2], [files.length, 2], [files.length, 2], [size, 4], [offset, 4], [0, 2]);
  return new Blob([...body, ...index, end], {type: "application/zip"});
}
