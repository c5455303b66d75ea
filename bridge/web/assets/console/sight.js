// What there is to see of the newest message of a route: a cloud in space, a picture, a track, frames.
import {make} from "/parts.js";
import {Asker} from "/console/message.js";
import {Scene, axes} from "/console/scene.js";
import {counted, put, size, svg, whole} from "/console/text.js";

export const SIGHTS = new Set(["sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage",
  "sensor_msgs/msg/NavSatFix", "tf2_msgs/msg/TFMessage"]);
const EVERY = 80;  // ms, after each answer
const MOST_FIXES = 5000;

class Cloud {
  constructor() {
    this.scene = new Scene();
    this.by = make("select", {}, make("option", {value: "height", textContent: "height"}), make("option", {value: "value", textContent: "intensity"}));
    this.by.onchange = () => this.draw();
    this.element = make("div", {}, this.scene.canvas, make("p", {className: "tools"}, make("label", {}, "Colour by ", this.by),
      make("span", {className: "faint", textContent: "Drag or arrow keys turn, wheel or + and − come closer, Home shows all."})));
  }
  show(about, bytes) {
    if (!this.scene.gl) return "this browser has no WebGL";
    this.points = new Float32Array(bytes);
    this.by.options[1].textContent = about.value || "value";
    this.by.disabled = about.value === "";
    this.draw();
    const few = about.every > 1 ? ` of ${whole(about.points)}: one of ${about.every}` : "";
    const nowhere = about.not_finite ? `, ${whole(about.not_finite)} nowhere` : "";
    const words = `${counted(about.sent, "point")}${few}${nowhere}, in ${about.frame || "no frame"}`;
    this.scene.canvas.setAttribute("aria-label", words);
    return words;
  }
  draw() {
    if (!this.points) return;
    this.scene.points = this.points;
    if (this.by.value === "height") {
      this.scene.points = this.points.slice();
      for (let i = 3; i < this.points.length; i += 4) this.scene.points[i] = this.points[i - 1];
    }
    this.scene.lines = new Float32Array(axes([0, 0, 0], (one) => one, 2));
    this.scene.draw();
  }
}

class Picture {
  constructor() {
    this.canvas = make("canvas", {className: "picture", role: "img"});
    this.element = make("div", {}, this.canvas);
  }
  async show(about, bytes) {
    const draw = this.canvas.getContext("2d");
    let words;
    if (about.kind === "compressed") {
      const picture = await createImageBitmap(new Blob([bytes], {type: about.mime}));
      this.room(picture.width, picture.height);
      draw.drawImage(picture, 0, 0);
      picture.close();
      words = `${this.canvas.width} × ${this.canvas.height}, ${about.format}`;
    } else {
      this.room(about.sent_width, about.sent_height);
      draw.putImageData(new ImageData(new Uint8ClampedArray(bytes), about.sent_width, about.sent_height), 0, 0);
      const smaller = about.sent_width < about.width ? `, shown as ${about.sent_width} × ${about.sent_height}` : "";
      words = `${about.width} × ${about.height}, ${about.encoding}${smaller}`;
    }
    this.canvas.setAttribute("aria-label", `Picture of ${words}`);
    return `${words}, ${size(about.size)}`;
  }
  room(width, height) {
    if (this.canvas.width !== width || this.canvas.height !== height) [this.canvas.width, this.canvas.height] = [width, height];
  }
}

/// Where it was, as seen from above, in metres from the first place.
class Track {
  constructor() {
    this.line = svg("polyline", {class: "rate"});
    this.here = svg("circle", {r: 4, class: "here"});
    this.scale = svg("text", {x: 4, y: 14, class: "small"});
    this.element = svg("svg", {viewBox: "0 0 480 320", class: "chart track", role: "img", "aria-label": "Track"}, this.line, this.here, this.scale);
    this.fixes = [];
  }
  show(about) {
    if (about.status < 0) return "no fix";
    this.fixes.push([about.latitude, about.longitude]);
    if (this.fixes.length > MOST_FIXES) this.fixes.shift();
    const [latitude, longitude] = this.fixes[0];
    const metres = this.fixes.map(([one, other]) => [(other - longitude) * 111320 * Math.cos(latitude * Math.PI / 180), (one - latitude) * 110574]);
    const [xs, ys] = [0, 1].map((axis) => metres.map((one) => one[axis]));
    const middle = [xs, ys].map((all) => (Math.min(...all) + Math.max(...all)) / 2);
    const wide = Math.max(10, Math.max(...xs) - Math.min(...xs), 1.5 * (Math.max(...ys) - Math.min(...ys)));
    const place = ([x, y]) => [240 + (x - middle[0]) * 440 / wide, 160 - (y - middle[1]) * 440 / wide].map((one) => one.toFixed(1));
    this.line.setAttribute("points", metres.map((one) => place(one).join(",")).join(" "));
    const [x, y] = place(metres[metres.length - 1]);
    this.here.setAttribute("cx", x);
    this.here.setAttribute("cy", y);
    put(this.scale, `${wide.toFixed(0)} m wide, north is up`);
    return `${about.latitude.toFixed(7)}°, ${about.longitude.toFixed(7)}°, ${about.altitude === null ? "?" : about.altitude.toFixed(1)} m`;
  }
}

/// Frames, each where its parent has it; known from the messages since this page was opened.
class Frames {
  static most = 500;
  static deepest = 32;
  constructor() {
    this.scene = new Scene();
    this.list = make("p", {className: "faint"});
    this.element = make("div", {}, this.scene.canvas, this.list);
    this.frames = new Map();
  }
  show(about) {
    if (!this.scene.gl) return "this browser has no WebGL";
    for (const one of about.transforms) if (this.frames.has(one.child) || this.frames.size < Frames.most) this.frames.set(one.child, one);
    const turn = ([x, y, z, w], v) => {
      const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
      return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
    };
    const up = (name, v) => {  // a vector in this frame, as its root has it
      for (let deep = 0, one = this.frames.get(name); one && deep < Frames.deepest; ++deep, one = this.frames.get(one.parent)) {
        v = turn(one.rotation, v).map((part, i) => part + one.translation[i]);
      }
      return v;
    };
    const roots = new Set([...this.frames.values()].map((one) => one.parent).filter((one) => !this.frames.has(one)));
    const places = [...roots, ...this.frames.keys()].map((name) => [name, up(name, [0, 0, 0])]);
    const length = Math.max(0.3, ...places.flatMap(([, at]) => at.map(Math.abs))) / 8;
    this.scene.lines = new Float32Array(places.flatMap(([name, at]) => {
      const parent = this.frames.has(name) ? up(this.frames.get(name).parent, [0, 0, 0]) : at;
      return [...axes(at, (v) => up(name, v).map((one, i) => one - at[i]), length), ...at, 0.6, 0.6, 0.6, ...parent, 0.6, 0.6, 0.6];
    }));
    this.scene.draw();
    put(this.list, [...this.frames.values()].map((one) => `${one.parent} → ${one.child}`).join(", "));
    const words = `${counted(this.frames.size, "frame")} below ${[...roots].join(", ")}`;
    this.scene.canvas.setAttribute("aria-label", words);
    return words;
  }
}

const MAKERS = {cloud: Cloud, image: Picture, compressed: Picture, fix: Track, frames: Frames};

export class SightPanel {
  constructor(get) {
    this.words = make("p", {className: "faint", id: "sight-words", textContent: "None has come since this page was opened."});
    this.place = make("div");
    this.element = make("div", {className: "panel wide-panel", id: "sight"}, make("h2", {textContent: "Live"}), this.words, this.place);
    this.asker = new Asker(EVERY, async (wanted) => {
      try {
        const answer = await get(`/sight?route=${this.index}`);
        if (answer.status === 204) return;
        const bytes = await answer.arrayBuffer();
        const length = new DataView(bytes).getUint32(0, true);
        const about = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
        if (wanted() && about.route === this.name && about.at_ns !== this.at) await this.put(about, bytes.slice(4 + length));
      } catch (error) {
        if (wanted()) put(this.words, error.message);
      }
    });
  }

  show(route, index) {
    [this.name, this.index] = [route.name, index];
    this.asker.start();
  }
  stop() {
    this.asker.stop();
  }

  async put(about, bytes) {
    this.at = about.at_ns;
    if (about.kind === "none") {
      put(this.words, about.why);
      return;
    }
    if (!(this.sight instanceof MAKERS[about.kind])) {
      this.sight = new MAKERS[about.kind]();
      this.place.replaceChildren(this.sight.element);
    }
    put(this.words, await this.sight.show(about, bytes));
  }
}
