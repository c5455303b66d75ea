"use strict";
// The page of `trestle generate --ui`. The program reads, checks and writes; this page holds the files and the edits, and
// asks again after each change.

const $ = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

const page = {
  files: [],       // {name, text}
  edits: {},       // by the full name of a service: {id, instance, members: {name: {id, getter, setter, notifier}}}
  model: null,
  targets: [],
  chosen: null,    // {service, kind, name}: kind "service", "methods", "events", "fields"
  part: "",        // which payload of a method
  target: "routes",
  output: [],      // files of the target
  asked: 0,        // the number of the last question; older answers are dropped
};

async function ask(path, more = {}) {
  const answer = await fetch(path, {
    method: "POST",
    headers: {"Content-Type": "application/json"},
    body: JSON.stringify({files: page.files, edits: page.edits, ...more}),
  });
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
}
const askJson = async (path, more) => (await ask(path, more)).json();

// ---- reading ----

async function refresh() {
  const number = ++page.asked;
  showFiles();
  if (page.files.length === 0) {
    page.model = null;
    page.chosen = null;
    show({problems: []});
    state("Drop FIDL, FDEPL, ARXML, vsomeip JSON, .msg or .srv files anywhere.");
    return;
  }
  try {
    const system = await askJson("/api/system");
    if (number !== page.asked) return;
    page.model = system.model;
    page.targets = system.targets;
    show(system);
    const errors = system.problems.filter((one) => one.severity === "error").length;
    const warnings = system.problems.length - errors;
    const services = page.model ? page.model.services.length : 0;
    state(`${count(services, "service")}, ${count(errors, "error")}, ${count(warnings, "warning")}`, errors > 0);
    await Promise.all([showOutput(number), showLayout(number)]);
  } catch (error) {
    state(String(error.message || error), true);
  }
}

const count = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;
function state(text, bad = false) {
  $("state").textContent = text;
  $("state").className = bad ? "bad" : "faint";
}

async function take(list) {
  for (const file of list) {
    const text = await file.text();
    page.files = page.files.filter((one) => one.name !== file.name);
    page.files.push({name: file.name, text});
  }
  await refresh();
}

function showFiles() {
  $("files").replaceChildren(...page.files.map((file) => {
    const remove = make("button", {type: "button", title: `Remove ${file.name}`, textContent: "✕"});
    remove.setAttribute("aria-label", `Remove ${file.name}`);
    remove.onclick = () => {
      page.files = page.files.filter((one) => one !== file);
      refresh();
    };
    return make("li", {}, make("span", {textContent: file.name}), remove);
  }));
}

// ---- the tree ----

const fullName = (service) => !service.scope ? service.name
  : service.scope + (service.scope.startsWith("/") ? "/" : ".") + service.name;
const KINDS = [["methods", "method"], ["events", "event"], ["fields", "field"]];

function items() {
  const all = [];
  for (const service of page.model ? page.model.services : []) {
    all.push({service: fullName(service), kind: "service", name: service.name, id: service.id, level: 1});
    for (const [kind] of KINDS) {
      for (const member of service[kind]) {
        all.push({service: fullName(service), kind, name: member.name, id: member.id || idsOfField(member), level: 2});
      }
    }
  }
  return all;
}
const idOf = (part) => part && typeof part === "object" ? part.id : part;
const idsOfField = (field) => ["getter", "setter", "notifier"].map((part) => idOf(field[part])).filter(Boolean).join(" ");
const same = (a, b) => a && b && a.service === b.service && a.kind === b.kind && a.name === b.name;

function show(system) {
  if (page.chosen && !items().some((item) => same(item, page.chosen))) page.chosen = null;
  if (!page.chosen) page.chosen = items()[0] || null;
  $("tree").replaceChildren(...items().map((item, index) => {
    const row = make("div", {className: "row"},
      make("span", {textContent: (item.level === 2 ? "  " : "") + item.name}), make("span", {className: "id", textContent: item.id || "no id"}));
    const element = make("li", {id: `item-${index}`}, row);
    element.setAttribute("role", "treeitem");
    element.setAttribute("aria-level", item.level);
    element.setAttribute("aria-selected", String(Boolean(same(item, page.chosen))));
    element.setAttribute("aria-label", `${item.kind === "service" ? "service" : item.kind.slice(0, -1)} ${item.name} ${item.id || ""}`);
    element.onclick = () => choose(item);
    if (same(item, page.chosen)) $("tree").setAttribute("aria-activedescendant", element.id);
    return element;
  }));
  $("problems").replaceChildren(...system.problems.map((one) => make("li", {className: one.severity === "error" ? "bad" : "warn"},
    make("span", {className: "place", textContent: `${one.file}:${one.line}:${one.column} `}), one.text)));
  if (system.problems.length === 0) $("problems").replaceChildren(make("li", {className: "faint", textContent: "none"}));
  showEdit();
}

function choose(item) {
  page.chosen = item;
  page.part = "";
  for (const element of $("tree").children) element.setAttribute("aria-selected", "false");
  const index = items().findIndex((one) => same(one, item));
  const element = $("tree").children[index];
  if (element) {
    element.setAttribute("aria-selected", "true");
    element.scrollIntoView({block: "nearest"});
    $("tree").setAttribute("aria-activedescendant", element.id);
  }
  showEdit();
  showLayout(page.asked);
}

$("tree").addEventListener("keydown", (event) => {
  const all = items();
  const at = all.findIndex((item) => same(item, page.chosen));
  const next = {ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: all.length - 1}[event.key];
  if (next !== undefined) {
    event.preventDefault();
    if (all[next]) choose(all[next]);
  } else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
    // To the service that a member belongs to, and to the first member.
    const step = event.key === "ArrowLeft" ? all.findIndex((item) => item.kind === "service" && item.service === page.chosen.service) : at + 1;
    if (all[step] && all[step].service === page.chosen.service) choose(all[step]);
    event.preventDefault();
  } else if (event.key === "Enter") {
    event.preventDefault();
    const first = $("edit").querySelector("input");
    if (first) first.focus();
  }
});

// ---- editing ids ----

const serviceOf = (name) => page.model ? page.model.services.find((one) => fullName(one) === name) : null;
function chosenElement() {
  const service = page.chosen && serviceOf(page.chosen.service);
  if (!service) return null;
  return page.chosen.kind === "service" ? service : service[page.chosen.kind].find((one) => one.name === page.chosen.name);
}

/// What may be edited of the chosen element: [key, label, present value].
function editable() {
  const element = chosenElement();
  if (!element) return [];
  if (page.chosen.kind === "service") {
    const instance = (element.instances || [])[0];
    return [["id", "Service id", element.id], ["instance", "Instance id", instance ? instance.id : ""]];
  }
  if (page.chosen.kind === "fields") {
    return ["getter", "setter", "notifier"].filter((part) => element[part])
      .map((part) => [part, `${part[0].toUpperCase()}${part.slice(1)} id`, idOf(element[part])]);
  }
  return [["id", page.chosen.kind === "methods" ? "Method id" : "Event id", element.id]];
}

function showEdit() {
  $("title").textContent = page.chosen ? `${page.chosen.service}${page.chosen.kind === "service" ? "" : "." + page.chosen.name}` : "Nothing is chosen";
  const rows = [];
  for (const [key, label, value] of editable()) {
    const input = make("input", {id: `edit-${key}`, value: value || "", spellcheck: false, placeholder: "0x0001"});
    const fault = make("span", {className: "fault", id: `fault-${key}`});
    input.setAttribute("aria-describedby", fault.id);
    input.oninput = () => edit(key, input, fault);
    rows.push(make("label", {htmlFor: input.id, textContent: label}), input, fault);
  }
  $("edit").replaceChildren(...rows);
}

let waiting = 0;
function edit(key, input, fault) {
  const text = input.value.trim();
  const number = /^0x[0-9a-f]{1,4}$/i.test(text) ? parseInt(text, 16) : /^[1-9][0-9]*$/.test(text) ? Number(text) : NaN;
  const good = number >= 1 && number <= 0xfffe;
  input.classList.toggle("bad", !good);
  input.setAttribute("aria-invalid", String(!good));
  fault.textContent = good ? "" : "a number from 0x0001 to 0xfffe";
  if (!good) return;
  const service = (page.edits[page.chosen.service] ||= {});
  const target = page.chosen.kind === "service" ? service : ((service.members ||= {})[page.chosen.name] ||= {});
  target[key] = "0x" + number.toString(16).padStart(4, "0");
  clearTimeout(waiting);
  const focused = input.id;
  const caret = input.selectionStart;
  waiting = setTimeout(async () => {
    await refresh();
    const again = $(focused);
    if (again) {
      again.value = text;
      again.focus();
      again.setSelectionRange(caret, caret);
    }
  }, 250);
}
$("edit").addEventListener("submit", (event) => event.preventDefault());

// ---- the bytes ----

function partsOf(element) {
  if (!element || page.chosen.kind === "service") return [];
  if (page.chosen.kind !== "methods") return ["payload"];
  return element.fire_and_forget ? ["request"] : ["request", "response"];
}

async function showLayout(number) {
  const element = chosenElement();
  const parts = partsOf(element);
  if (!parts.includes(page.part)) page.part = parts[0] || "";
  $("parts").replaceChildren(...(parts.length > 1 ? parts : []).map((part) => {
    const button = make("button", {type: "button", textContent: part});
    button.setAttribute("aria-pressed", String(part === page.part));
    button.onclick = () => {
      page.part = part;
      showLayout(page.asked);
    };
    return button;
  }));
  showTry(element);
  if (!page.part) {
    $("layout").replaceChildren();
    return;
  }
  const asked = page.chosen;
  const layout = await askJson("/api/layout", {service: asked.service, member: asked.name, part: page.part, values: valuesOf(element)});
  if (number !== page.asked || !same(asked, page.chosen)) return;
  const roots = [];
  const boxes = (layout.ranges || []).map((range) => {
    const root = range.path.split(/[.[]/)[0];
    if (!roots.includes(root)) roots.push(root);
    const box = make("div", {className: `byte c${roots.indexOf(root) % 6}`, title: range.rule || ""},
      make("span", {className: "range", textContent: `${range.offset}${range.size ? ` (${range.size})` : ""}`}),
      make("span", {className: "name", textContent: range.path || "payload"}),
      make("span", {className: "what", textContent: [range.type, range.rule].filter(Boolean).join(", ")}));
    if (range.value !== undefined) box.append(make("span", {className: "value", textContent: range.value}));
    return box;
  });
  const text = layout.error ? layout.error : layout.hex;
  $("layout").replaceChildren(make("div", {className: "bytes"}, ...boxes),
    make("pre", {textContent: text || "", className: layout.error ? "bad" : ""}));
}

// ---- trying it ----

function valuesOf(element) {
  const box = $("arguments").querySelector("textarea");
  return element && box && $("try").dataset.of === tryKey() ? box.value : "";
}
const tryKey = () => page.chosen ? `${page.chosen.service}.${page.chosen.name}` : "";

function showTry(element) {
  const callable = element && page.chosen.kind !== "service" && page.chosen.kind !== "events";
  $("try").hidden = !callable;
  if (!callable || $("try").dataset.of === tryKey()) return;
  $("try").dataset.of = tryKey();
  $("result").textContent = "";
  const values = page.chosen.kind === "methods" ? element.request.values : element.payload.values;
  const box = make("textarea", {id: "values", rows: Math.min(8, 2 + values.length), spellcheck: false});
  box.value = values.map((value) => `${value.name || "value"}: ${zero(value)}`).join("\n");
  box.oninput = () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => showLayout(page.asked), 250);
  };
  const rows = [make("label", {htmlFor: "values", textContent: "Values (YAML)"}), box];
  if (page.chosen.kind === "fields") {
    const choice = make("select", {id: "access"}, ...["getter", "setter"].filter((part) => element[part]).map((part) => make("option", {textContent: part})));
    rows.unshift(make("label", {htmlFor: "access", textContent: "Access"}), choice);
  }
  $("arguments").replaceChildren(...rows);
}

/// A value to begin with, from the type that the model names.
function zero(value) {
  const name = typeof value.type === "string" ? value.type : value.type.kind || "";
  const type = (page.model.types || []).find((one) => one.label === name) || (typeof value.type === "object" ? value.type : {kind: name});
  const kind = type.kind || name;
  if (kind === "string") return '""';
  if (kind === "array" || kind === "map" || kind === "bytes" || /\[\]$/.test(name)) return "[]";
  if (kind === "structure" || kind === "choice") return "{}";
  if (kind === "enumeration") return type.enumerators && type.enumerators[0] ? type.enumerators[0].name : "0";
  if (kind === "alias" && type.element) return zero(type.element);
  return (type.primitive || name) === "bool" ? "false" : "0";
}

$("try").addEventListener("submit", async (event) => {
  event.preventDefault();
  $("result").textContent = "calling …";
  try {
    const access = $("access");
    const answer = await askJson("/api/call", {
      service: page.chosen.service, member: page.chosen.name, access: access ? access.value : "", values: $("values").value,
    });
    $("result").className = answer.ok ? "good" : "bad";
    $("result").textContent = answer.text;
  } catch (error) {
    $("result").className = "bad";
    $("result").textContent = String(error.message || error);
  }
});

// ---- what is generated ----

const COMMENT = /^(\s*)(#|\/\/|<!--).*/;
function highlighted(text) {
  const parts = [];
  for (const line of text.split("\n")) {
    if (COMMENT.test(line)) {
      parts.push(make("span", {className: "c", textContent: line}), "\n");
      continue;
    }
    let last = 0;
    for (const match of line.matchAll(/("(?:[^"\\]|\\.)*")|(\b0x[0-9a-fA-F]+\b|\b\d+(?:\.\d+)?\b)|(<\/?[A-Z0-9-]+>?|^[\s-]*[A-Za-z_]+:|\b(?:package|import|interface|typeCollection|version|major|minor|attribute|method|broadcast|in|out|error|struct|union|enumeration|array|of|map|to|typedef|is|define|for|provider|instance|as)\b)/g)) {
      parts.push(line.slice(last, match.index), make("span", {className: match[1] ? "s" : match[2] ? "n" : "k", textContent: match[0]}));
      last = match.index + match[0].length;
    }
    parts.push(line.slice(last), "\n");
  }
  return parts;
}

async function showOutput(number) {
  $("targets").replaceChildren(...page.targets.map((target) => {
    const tab = make("button", {type: "button", textContent: target.name, title: target.title || ""});
    tab.setAttribute("role", "tab");
    tab.setAttribute("aria-selected", String(target.name === page.target));
    tab.tabIndex = target.name === page.target ? 0 : -1;
    tab.onclick = () => openTarget(target.name);
    return tab;
  }));
  if (!page.model) {
    page.output = [];
  } else {
    const preview = await askJson("/api/preview", {target: page.target});
    if (number !== page.asked) return;
    page.output = preview.files;
    $("not-carried").replaceChildren(...preview.not_carried.map((one) => make("li", {textContent: `not carried: ${one.element}: ${one.what}`})));
  }
  const before = $("output-file").value;
  $("output-file").replaceChildren(...page.output.map((file) => make("option", {textContent: file.name, value: file.name})));
  if (page.output.some((file) => file.name === before)) $("output-file").value = before;
  showText();
}
function openTarget(name) {
  page.target = name;
  showOutput(page.asked).catch((error) => state(error.message, true));
}
$("targets").addEventListener("keydown", (event) => {
  const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
  if (!step) return;
  const at = page.targets.findIndex((target) => target.name === page.target);
  const next = page.targets[(at + step + page.targets.length) % page.targets.length];
  if (next) {
    openTarget(next.name);
    setTimeout(() => $("targets").querySelector("[aria-selected=true]").focus());
  }
});

const shown = () => page.output.find((file) => file.name === $("output-file").value) || page.output[0];
function showText() {
  const file = shown();
  $("text").replaceChildren(...(file ? highlighted(file.text) : []));
}
$("output-file").onchange = showText;

function save(name, blob) {
  const link = make("a", {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
$("save").onclick = () => {
  const file = shown();
  if (file) save(file.name.split("/").pop(), new Blob([file.text]));
};
$("zip").onclick = async () => {
  try {
    const all = [];
    for (const target of page.targets) {
      const preview = await askJson("/api/preview", {target: target.name});
      all.push(...preview.files.map((file) => ({name: `${target.name}/${file.name}`, text: file.text})));
    }
    save("interfaces.zip", zip(all));
  } catch (error) {
    state(error.message, true);
  }
};

/// A zip file that stores: PKWARE's APPNOTE, 4.3.
function zip(files) {
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

// ---- files come in ----

$("pick").onchange = async () => {
  await take($("pick").files);
  $("pick").value = "";
};
$("clear").onclick = () => {
  page.files = [];
  page.edits = {};
  refresh();
};
for (const name of ["dragover", "dragenter"]) {
  document.addEventListener(name, (event) => {
    event.preventDefault();
    document.body.classList.add("drop");
  });
}
document.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) document.body.classList.remove("drop");
});
document.addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("drop");
  take(event.dataTransfer.files);
});

// What the program was started with.
fetch("/api/start").then((answer) => answer.json()).then((start) => {
  page.files = start.files;
  page.edits = start.edits || {};
  return refresh();
}).catch((error) => state(error.message, true));
