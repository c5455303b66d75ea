// The page of `trestle generate --ui`. The program reads, checks and writes; this page holds the files and the edits, and
// asks again after each change.
import {$, Tree, ask, coloured, count, make, save, showTabs, zip} from "/parts.js";
import {Form} from "/generate/form.js";

const HINT = "Drop FIDL, FDEPL, ARXML, vsomeip JSON, .msg or .srv files anywhere, or press Add files.";
const KINDS = ["methods", "events", "fields"];

const page = {
  files: [],         // {name, text}
  edits: {},         // by the full name of a service in the files: {name, id, major, minor, instance, udp_port, tcp_port,
                     // methods, events, fields}, the latter by names: {name, id, transport, eventgroups, getter, …}
  renamed: {},       // names of now, and what they are in the files: "car.Gate", "car.Gate methods turn"
  captures: [],      // that the program was started with: it has them, not the page
  started: "",
  model: null,
  good: false,
  lock: "",          // ids.lock
  targets: [],
  part: "",          // which payload of a method
  form: null,        // of the part
  formOf: "",
  responses: new Map(),  // of calls, by key of the item: what /api/call said
  target: "routes",
  output: [],        // files of the target
  asked: 0,          // the number of the last question; older answers are dropped
};

const question = (more = {}) => ({files: page.files, edits: page.edits, ...more});
/// Later, once, when nothing more changes for a moment.
function calm(action) {
  let timer = 0;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(() => action().catch(complain), 200);
  };
}
function state(text, bad = false) {
  $("state").textContent = text;
  $("state").className = bad ? "bad" : "faint";
}
const complain = (error) => state(String(error.message || error), true);

// ---- what survives a reload ----

function remember() {
  try {
    sessionStorage.setItem("generate", JSON.stringify({started: page.started, files: page.files, edits: page.edits}));
  } catch {
    sessionStorage.removeItem("generate");  // too much for the browser; a reload begins again
  }
}
function remembered(started) {
  try {
    const before = JSON.parse(sessionStorage.getItem("generate") || "null");
    return before && before.started === started ? before : null;
  } catch {
    return null;
  }
}

// ---- reading ----

let formFiles = null;  // that the form was made of
async function refresh() {
  const number = ++page.asked;
  remember();
  showFiles();
  if (page.files.length === 0 && page.captures.length === 0) {
    page.model = null;
    page.good = false;
    showSystem({problems: []});
    state(HINT);
    await Promise.all([showPart(), showOutput()]);
    return;
  }
  const system = await ask("/api/system", question());
  if (number !== page.asked) return;
  page.model = system.model;
  page.good = system.good;
  page.lock = system.lock;
  page.renamed = system.renamed;
  page.targets = system.targets;
  if (formFiles !== page.files) page.formOf = "";  // else what was typed there stays
  formFiles = page.files;
  showSystem(system);
  const errors = system.problems.filter((one) => one.severity === "error").length;
  const services = page.model ? page.model.services.length : 0;
  state(`${count(services, "service")}, ${count(errors, "error")}, ${count(system.problems.length - errors, "warning")}`, errors > 0);
  await Promise.all([showPart(), showOutput()]);
}

async function take(list) {
  for (const file of list) {
    const name = file.webkitRelativePath || file.name;
    const text = await file.text();
    page.files = page.files.filter((one) => one.name !== name);
    page.files.push({name, text});
  }
  await refresh();
}

function showFiles() {
  $("files").replaceChildren(...page.captures.map((name) => make("li", {textContent: name})), ...page.files.map((file) => {
    const remove = make("button", {type: "button", textContent: "✕", "aria-label": `Remove ${file.name}`});
    remove.onclick = () => {
      page.files = page.files.filter((one) => one !== file);
      refresh().catch(complain);
      $("pick").focus();
    };
    return make("li", {}, make("span", {textContent: file.name}), remove);
  }));
}

// ---- the tree ----

const fullName = (service) => !service.scope ? service.name
  : service.scope + (service.scope.startsWith("/") ? "/" : ".") + service.name;
const memberKey = (member) => member.selector ? `${member.name}:${member.selector}` : member.name;
const idsOf = (member) => member.id !== undefined ? member.id || ""
  : ["getter", "setter", "notifier"].map((part) => member[part]).filter(Boolean).join(" ");

/// By key: {service, kind, element, of, member}; kind "service", "methods", "events", "fields"; `of` and `member` are the
/// names in the files. So is the key: it stays when something is renamed.
let elements = new Map();
const tree = new Tree($("tree"), () => {
  page.part = "";
  showChosen();
}, () => {
  const first = $("edit").querySelector("input");
  if (first) first.focus();
});
const chosen = () => elements.get(tree.chosen) || null;

function showSystem(system) {
  elements = new Map();
  const items = [];
  const add = (key, service, kind, element, level, what, of, member) => {
    elements.set(key, {key, service, kind, element, of, member});
    const ids = idsOf(element);
    items.push({key, level, text: element.name, detail: ids || "no id", label: `${what} ${element.name} ${ids || "without an id"}`});
  };
  for (const service of page.model ? page.model.services : []) {
    const name = fullName(service);
    const of = page.renamed[name] || name;
    add(of, service, "service", service, 1, "service", of, "");
    for (const kind of KINDS) {
      for (const member of service[kind]) {
        const key = page.renamed[`${name} ${kind} ${memberKey(member)}`] || memberKey(member);
        add(`${of} ${kind} ${key}`, service, kind, member, 2, kind.slice(0, -1), of, key);
      }
    }
  }
  if (tree.items.length === 0 && items.length > 300) {
    for (const item of items) if (item.level === 1) tree.closed.add(item.key);
  }
  tree.show(items);
  $("problems").replaceChildren(...system.problems.map((one) => make("li", {className: one.severity === "error" ? "bad" : "warn"},
    make("span", {className: "place", textContent: `${one.file}${one.line ? `:${one.line}:${one.column}` : ""} `}), one.text)));
  if (system.problems.length === 0) $("problems").replaceChildren(make("li", {className: "faint", textContent: "none"}));
  showEdit();
}

function showChosen() {
  showEdit();
  showPart().catch(complain);
}

// ---- editing ----

const ID = {
  read: (text) => {
    const number = /^0x[0-9a-f]{1,4}$/i.test(text) ? parseInt(text, 16) : /^[1-9][0-9]{0,4}$/.test(text) ? Number(text) : NaN;
    return number >= 1 && number <= 0xfffe ? "0x" + number.toString(16).padStart(4, "0") : null;
  },
  expected: "a number from 0x0001 to 0xfffe",
  empty: "chosen by trestle",
};
const NAME = {
  read: (text) => /^[A-Za-z][A-Za-z0-9_]{0,127}$/.test(text) ? text : null,
  expected: "a letter, and letters, digits and underscores behind it",
};
const number = (low, high) => ({
  read: (text) => /^[0-9]{1,10}$/.test(text) && Number(text) >= low && Number(text) <= high ? String(Number(text)) : null,
  expected: `a number from ${low} to ${high}`,
});
const GROUPS = {
  read: (text) => {
    const ids = text.split(/[\s,]+/).filter(Boolean).map(ID.read);
    return ids.length > 0 && ids.length <= 64 && !ids.includes(null) ? ids : null;
  },
  expected: "ids with commas between them, such as 0x0001, 0x0002",
};
/// A choice; the last one takes an edit back.
const TRANSPORT = {options: [["udp", "UDP"], ["tcp", "TCP"], ["", "as in the files"]]};

/// Of all parts of a field, if they have one.
function transportOf(field) {
  const all = ["getter", "setter", "notifier"].filter((part) => field[part] !== undefined).map((part) => field[`${part}_transport`]);
  return all.every((one) => one === all[0]) ? all[0] : "";
}

/// What may be edited of the chosen element: {key, label, value, format}.
function editable() {
  const item = chosen();
  if (!item) return [];
  const element = item.element;
  const name = {key: "name", label: "Name", value: element.name, format: NAME};
  const transport = (value) => ({key: "transport", label: "Transport", value, format: TRANSPORT});
  const groups = {key: "eventgroups", label: "Eventgroups", value: (element.eventgroups || []).join(", "), format: GROUPS};
  if (item.kind === "service") {
    const instance = (element.instances || [])[0] || {};
    return [{key: "id", label: "Service id", value: element.id, format: ID},
      {key: "instance", label: "Instance id", value: instance.id, format: ID}, name,
      {key: "major", label: "Major version", value: String(element.major), format: number(0, 254)},
      {key: "minor", label: "Minor version", value: String(element.minor), format: number(0, 4294967294)},
      {key: "udp_port", label: "UDP port", value: String(instance.udp_port || ""), format: {...number(1, 65535), empty: "none"}},
      {key: "tcp_port", label: "TCP port", value: String(instance.tcp_port || ""), format: {...number(1, 65535), empty: "none"}}];
  }
  if (item.kind === "fields") {
    const ids = ["getter", "setter", "notifier"].filter((part) => element[part] !== undefined)
      .map((part) => ({key: part, label: `${part[0].toUpperCase()}${part.slice(1)} id`, value: element[part], format: ID}));
    return [...ids, name, transport(transportOf(element)), ...(element.notifier !== undefined ? [groups] : [])];
  }
  const method = item.kind === "methods";
  return [{key: "id", label: method ? "Method id" : "Event id", value: element.id, format: ID}, name,
    transport(method ? element.request_transport : element.transport), ...(method ? [] : [groups])];
}

/// The edit of the chosen element.
function editPlace() {
  const item = chosen();
  const service = (page.edits[item.of] ||= {});
  return item.kind === "service" ? service : ((service[item.kind] ||= {})[item.member] ||= {});
}

let edited = "";  // the element that the inputs are of
function showEdit() {
  const item = chosen();
  $("title").textContent = item ? `${fullName(item.service)}${item.kind === "service" ? "" : "." + item.element.name}` : "Nothing is chosen";
  $("about").textContent = item ? [item.element.description, item.element.place].filter(Boolean).join(" · ") : "";
  const rows = editable();
  if (item && edited === item.key && rows.every((row) => $(`edit-${row.key}`))) {
    for (const row of rows) {
      const input = $(`edit-${row.key}`);
      if (input !== document.activeElement) input.value = row.value || "";
    }
    return;  // somebody types there
  }
  edited = item ? item.key : "";
  $("edit").replaceChildren(...rows.flatMap((row) => {
    const id = `edit-${row.key}`;
    const input = row.format.options
      ? make("select", {id}, ...row.format.options.map(([value, textContent]) => make("option", {value, textContent})))
      : make("input", {id, spellcheck: false, placeholder: row.format.empty || "as in the files"});
    input.value = row.value || "";
    const fault = make("span", {className: "fault", id: `fault-${row.key}`});
    input.setAttribute("aria-describedby", fault.id);
    input[row.format.options ? "onchange" : "oninput"] = () => edit(row, input, fault);
    return [make("label", {for: id, textContent: row.label}), input, fault];
  }));
}

const refreshSoon = calm(refresh);
function edit(row, input, fault) {
  const text = input.value.trim();
  const value = text === "" || row.format.options ? text : row.format.read(text);
  input.classList.toggle("bad", value === null);
  input.setAttribute("aria-invalid", String(value === null));
  fault.textContent = value === null ? row.format.expected : "";
  if (value === null) return;
  const place = editPlace();
  if (value === "") delete place[row.key];  // as in the files
  else place[row.key] = value;
  refreshSoon();
}
$("edit").addEventListener("submit", (event) => event.preventDefault());

// ---- one payload: its values, its bytes, and a call ----

function partsOf(item) {
  if (!item || item.kind === "service") return [];
  if (item.kind !== "methods") return ["payload"];
  return item.element.fire_and_forget ? ["request"] : ["request", "response"];
}
const about = (item, more) => question({service: fullName(item.service), kind: item.kind, member: memberKey(item.element), part: page.part, ...more});

async function showPart() {
  const item = chosen();
  const parts = partsOf(item);
  if (!parts.includes(page.part)) page.part = parts[0] || "";
  showTabs($("parts"), parts.length > 1 ? parts.map((name) => ({name})) : [], page.part, (name) => {
    page.part = name;
    showPart().catch(complain);
  });
  $("bytes-title").hidden = !page.part;
  if (!page.part) {
    page.form = null;
    page.formOf = "";
    $("try").hidden = true;
    $("layout").replaceChildren();
    return;
  }
  const key = `${item.key} ${page.part}`;
  if (page.formOf !== key) {
    page.formOf = key;
    const form = await ask("/api/form", about(item));
    if (page.formOf !== key) return;
    showForm(item, form);
  }
  await showLayout();
}

function showForm(item, form) {
  const response = page.part === "response";
  page.form = form.error ? null : new Form(form, calm(showLayout));
  const none = make("p", {className: "faint", textContent: form.error || "There are none."});
  $("values").replaceChildren(page.form && !page.form.empty ? page.form.element : none);
  $("values-title").textContent = response ? "Values to try the layout with" : "Values";
  const calls = item.kind === "methods" ? [["", "Call"]]
    : item.kind === "fields" ? [["getter", "Get"], ["setter", "Set"]].filter(([part]) => item.element[part]) : [];
  $("calls").replaceChildren(...(response ? [] : calls).map(([access, text], index) => {
    const button = make("button", {type: "button", className: index === 0 ? "main" : "", textContent: text, id: `call-${access || "method"}`});
    button.onclick = () => call(access).catch((error) => showResult({error: error.message}));
    return button;
  }));
  $("result").textContent = "";
  $("try").hidden = false;
}

$("try").addEventListener("submit", (event) => {
  event.preventDefault();  // Enter in an input
  const button = $("calls").querySelector("button");
  if (button) button.click();
});

function showResult(answer) {
  $("result").className = answer.ok ? "good" : "bad";
  $("result").textContent = answer.error || answer.text;
}

async function call(access) {
  const item = chosen();
  if (access !== "getter" && page.form && page.form.faults > 0) {
    showResult({error: "a value is not right yet"});
    return;
  }
  $("result").className = "faint";
  $("result").textContent = "calling …";
  const answer = await ask("/api/call", about(item, {access, part: "request", values: page.form ? page.form.text : ""}));
  if (chosen() !== item) return;
  showResult(answer);
  if (answer.ranges) {
    page.responses.set(item.key, answer);
    showBoxes(answer, "What the answer was:");
  }
}

async function showLayout() {
  const item = chosen();
  const key = page.formOf;
  if (!item || !page.part) return;
  const layout = await ask("/api/layout", about(item, {values: page.form ? page.form.text : ""}));
  if (key !== page.formOf) return;
  if (!layout.ranges) {
    // Values that are not right yet: the bytes without them.
    const bare = await ask("/api/layout", about(item));
    if (key === page.formOf) showBoxes({...bare, error: layout.error}, "");
    return;
  }
  showBoxes(layout, "");
}

/// Boxes that are shown; payloads of more are shown to here.
const MOST_BOXES = 400;

function showBoxes(layout, title) {
  const roots = [];
  const ranges = layout.ranges || [];
  const boxes = ranges.slice(0, MOST_BOXES).map((range) => {
    const root = (range.path || "").split(/[.[]/)[0];
    if (!roots.includes(root)) roots.push(root);
    const size = /^[0-9]+$/.test(range.size) ? count(Number(range.size), "byte") : range.size;
    const box = make("div", {className: `byte c${roots.indexOf(root) % 6}`, title: range.rule || ""},
      make("span", {className: "range", textContent: `${"+ ".repeat(layout.hex === undefined ? range.depth : 0)}${range.offset} · ${size}`}),
      make("span", {className: "name", textContent: range.path || "payload"}),
      make("span", {className: "what", textContent: [range.type, range.rule].filter(Boolean).join(", ")}));
    if (range.hex) box.append(make("span", {className: "hex", textContent: range.hex.replace(/(..)/g, "$1 ").trim()}));
    if (range.value) box.append(make("span", {className: "value", textContent: range.value}));
    return box;
  });
  if (ranges.length > MOST_BOXES) boxes.push(make("div", {className: "faint", textContent: `… and ${ranges.length - MOST_BOXES} more`}));
  if (ranges.length === 0) boxes.push(make("div", {className: "faint", textContent: "no bytes"}));
  const hex = layout.hex ? `${layout.hex.replace(/(..)/g, "$1 ").trim()}${layout.bytes * 2 > layout.hex.length ? " …" : ""}` : "";
  $("layout").replaceChildren(...(title ? [make("p", {className: "faint", textContent: title})] : []), make("div", {className: "bytes"}, ...boxes),
    ...(hex ? [make("pre", {className: "hex", textContent: hex, "aria-label": "All bytes"})] : []),
    ...(layout.error ? [make("pre", {className: "bad", textContent: layout.error})] : []));
}

// ---- what is generated ----

async function showOutput() {
  const number = page.asked;
  const wanted = page.target;
  showTabs($("targets"), page.targets, wanted, (name) => {
    page.target = name;
    showOutput().catch(complain);
  });
  const about = page.targets.find((target) => target.name === wanted);
  $("target-title").textContent = about ? about.title : "";
  let lost = [];
  page.output = [];
  if (page.model) {
    const preview = await ask("/api/preview", question({target: wanted}));
    if (number !== page.asked || wanted !== page.target) return;
    page.output = preview.files;
    lost = preview.not_carried;
  }
  $("not-carried").replaceChildren(...lost.map((one) => make("li", {textContent: `not carried: ${one.element}: ${one.what}`, title: one.place})));
  const before = $("output-file").value;
  $("output-file").replaceChildren(...page.output.map((file) => make("option", {textContent: file.name, value: file.name})));
  if (page.output.some((file) => file.name === before)) $("output-file").value = before;
  $("save").disabled = $("zip").disabled = page.output.length === 0;
  showText();
}

const shown = () => page.output.find((file) => file.name === $("output-file").value) || page.output[0];
function showText() {
  const file = shown();
  $("text").replaceChildren(...(file ? coloured(file.text) : page.model && !page.good ? ["The files have errors, so nothing is generated."] : []));
}
$("output-file").onchange = showText;

$("save").onclick = () => {
  const file = shown();
  if (file) save(file.name.split("/").pop(), new Blob([file.text]));
};
$("zip").onclick = async () => {
  try {
    const all = page.lock ? [{name: "ids.lock", text: page.lock}] : [];
    for (const target of page.targets) {
      const preview = await ask("/api/preview", question({target: target.name}));
      all.push(...preview.files);
    }
    save("interfaces.zip", zip(all));
  } catch (error) {
    complain(error);
  }
};

// ---- files come in ----

$("pick").onchange = async () => {
  await take([...$("pick").files]).catch(complain);
  $("pick").value = "";
};
$("clear").onclick = () => {
  page.files = [];
  page.edits = {};
  refresh().catch(complain);
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
  take([...event.dataTransfer.files]).catch(complain);
});

// What the program was started with, or what was here before a reload.
async function begin() {
  const start = await ask("/api/start");
  const before = remembered(start.started);
  page.started = start.started;
  page.captures = start.captures;
  page.files = before ? before.files : start.files;
  page.edits = before ? before.edits : start.edits;
  await refresh();
}
begin().catch(complain);
