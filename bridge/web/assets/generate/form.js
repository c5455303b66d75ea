// A form for the values of a payload, made of its types, and the JSON that its inputs mean.
import {make} from "/parts.js";

/// More inputs than these nobody fills in; and a type of 32 levels could have more than memory.
const MOST_INPUTS = 1000;

let ids = 0;

export class Form {
  /// @param form     the answer to /api/form
  /// @param changed  is called after each change
  constructor(form, changed) {
    this.types = form.types;
    this.changed = changed;
    this.inputs = 0;
    this.root = this.message(form.type, "");
  }

  get element() { return this.root.element; }
  get empty() { return this.types.length === 0 || this.root.parts.length === 0; }
  /// JSON as text: numbers of 64 bits would lose digits otherwise.
  get text() { return this.root.text(); }
  get faults() { return this.element.querySelectorAll("[aria-invalid=true]").length; }

  message(index, path) {
    const type = this.types[index];
    const parts = type.choice ? this.choice(type, path) : type.fields.map((field) => this.field(field, path));
    const element = make("div", {className: "message"}, ...(type.choice ? [parts.select, parts.place] : parts.map((part) => part.element)));
    if (type.choice) return {element, parts: [parts], text: () => `{${parts.text()}}`};
    return {element, parts, text: () => `{${parts.map((part) => part.text()).filter(Boolean).join(", ")}}`};
  }

  /// One of its members is there.
  choice(type, path) {
    const place = make("div");
    const select = make("select", {"aria-label": `${path || "value"}: which member`},
      make("option", {value: "", textContent: "(none)"}), ...type.fields.map((field, i) => make("option", {value: i, textContent: field.label})));
    let member = null;
    const show = () => {
      member = select.value === "" ? null : this.field({...type.fields[select.value], optional: false, one: true}, path);
      place.replaceChildren(...(member ? [member.element] : []));
    };
    select.value = type.fields.length > 0 ? 0 : "";
    show();
    select.onchange = () => {
      show();
      this.changed();
    };
    return {select, place, text: () => member ? member.text() : ""};
  }

  field(field, path) {
    const where = path ? `${path}.${field.name}` : field.name;
    const key = JSON.stringify(field.name);
    if (field.optional) return this.optional(field, where, key);
    const value = field.array && field.kind !== "bytes" ? this.list(field, where) : this.single(field, where);
    const element = value.block
      ? make("fieldset", {}, make("legend", {}, ...this.label(field)), value.element)
      : make("div", {className: "field"}, make("label", {for: value.id}, ...this.label(field)), value.element);
    return {element, text: () => `${key}: ${field.one ? `[${value.text()}]` : value.text()}`};
  }

  label(field) {
    const what = [field.what, field.unit].filter(Boolean).join(", ");
    return [make("span", {className: "label", textContent: field.label, title: field.description || ""}), make("span", {className: "faint", textContent: what ? ` ${what}` : ""})];
  }

  optional(field, where, key) {
    const box = make("input", {type: "checkbox", id: `value-${++ids}`});
    const place = make("div", {className: "message"});
    let value = null;
    box.onchange = () => {
      value = box.checked ? this.field({...field, optional: false, one: true}, where) : null;
      place.replaceChildren(...(value ? [value.element] : []));
      this.changed();
    };
    const element = make("div", {}, make("div", {className: "field"}, make("label", {for: box.id}, ...this.label(field), make("span", {className: "faint", textContent: " is there"})), box), place);
    return {element, text: () => value ? value.text() : `${key}: []`};
  }

  list(field, where) {
    const items = [];
    const place = make("ol", {className: "items"});
    const add = make("button", {type: "button", textContent: `Add to ${field.label}`});
    const fixed = field.array === "fixed";
    const put = () => {
      const value = this.single(field, `${where}[${items.length}]`);
      const remove = make("button", {type: "button", textContent: "✕", "aria-label": `Remove from ${field.label}`});
      const item = {value, element: make("li", {}, value.element)};
      if (!fixed) item.element.append(remove);
      remove.onclick = () => {
        items.splice(items.indexOf(item), 1);
        item.element.remove();
        add.disabled = false;
        add.focus();
        this.changed();
      };
      items.push(item);
      place.append(item.element);
      if (!fixed && field.size && items.length >= field.size) add.disabled = true;
      return item;
    };
    if (fixed && this.inputs + field.size > MOST_INPUTS) return this.json(field, where, "[]");
    for (let i = 0; fixed && i < field.size; ++i) put();
    add.onclick = () => {
      const input = put().element.querySelector("input, select, textarea");
      if (input) input.focus();
      this.changed();
    };
    return {block: true, element: make("div", {}, place, ...(fixed ? [] : [add])), text: () => `[${items.map((item) => item.value.text()).join(", ")}]`};
  }

  /// Where there would be too many inputs: the JSON itself.
  json(field, where, text) {
    const box = make("textarea", {id: `value-${++ids}`, value: text, rows: 2, spellcheck: false});
    box.oninput = () => {
      let good = true;
      try { JSON.parse(box.value); } catch { good = false; }
      box.setAttribute("aria-invalid", String(!good));
      this.changed();
    };
    return {id: box.id, element: box, text: () => box.value};
  }

  single(field, where) {
    if (++this.inputs > MOST_INPUTS) return this.json(field, where, field.kind === "message" ? "{}" : "0");
    if (field.kind === "message") {
      const message = this.message(field.type, where);
      return {block: true, element: message.element, text: message.text};
    }
    const id = `value-${++ids}`;
    if (field.kind === "bool") {
      const box = make("input", {type: "checkbox", id, checked: field.default === "true"});
      box.onchange = this.changed;
      return {id, element: box, text: () => String(box.checked)};
    }
    if (field.enumerators && field.enumerators.length > 0) {
      const select = make("select", {id}, ...field.enumerators.map(([name, number]) => make("option", {value: number, textContent: `${name} (${number})`})));
      select.onchange = this.changed;
      return {id, element: select, text: () => select.value};
    }
    const input = make("input", {id, spellcheck: false, autocomplete: "off"});
    const fault = make("span", {className: "fault", id: `${id}-fault`});
    input.setAttribute("aria-describedby", fault.id);
    const plain = field.default && !/^["[]/.test(field.default) ? field.default : "";
    input.value = plain || (field.kind === "integer" || field.kind === "float" ? "0" : "");
    const check = () => {
      const wrong = this.fault(field, input.value.trim());
      input.setAttribute("aria-invalid", String(Boolean(wrong)));
      input.classList.toggle("bad", Boolean(wrong));
      fault.textContent = wrong;
    };
    input.oninput = () => {
      check();
      this.changed();
    };
    const texts = {
      string: () => JSON.stringify(input.value),
      bytes: () => JSON.stringify(`hex:${input.value.replace(/[^0-9a-fA-F]/g, "")}`),
      float: () => this.number(input.value.trim()),
      integer: () => this.whole(input.value.trim()),
    };
    if (field.kind === "bytes") {
      input.placeholder = "00 ff";
      if (field.array === "fixed") input.value = "00 ".repeat(Math.min(field.size, 64)).trim();
    }
    return {id, element: make("span", {className: "input"}, input, fault), text: texts[field.kind]};
  }

  fault(field, text) {
    if (field.kind === "integer") {
      let number;
      try { number = BigInt(text); } catch { number = null; }
      const good = text !== "" && number !== null && number >= BigInt(field.low) && number <= BigInt(field.high);
      return good ? "" : `a whole number from ${field.low} to ${field.high}`;
    }
    if (field.kind === "float") return text !== "" && (!Number.isNaN(Number(text)) || text === "NaN") ? "" : "a number";
    if (field.kind === "bytes") return /^(?:\s*[0-9a-fA-F]{2})*$/.test(text) ? "" : "two hexadecimal digits for each byte";
    if (field.kind === "string" && field.bound && text.length > field.bound) return `at most ${field.bound} characters`;
    return "";
  }

  number(text) {
    const number = Number(text || "x");
    if (Number.isFinite(number)) return JSON.stringify(number);
    return JSON.stringify(text);  // "Infinity", "NaN"
  }
  whole(text) {
    try { return BigInt(text || "x").toString(); } catch { return JSON.stringify(text); }
  }
}
