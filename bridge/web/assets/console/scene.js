// Points and lines in space, by WebGL: drag or arrow keys turn, wheel or + and - come closer, Home looks at all of it again.
import {make} from "/parts.js";

const VERTEX = `
  attribute vec4 place;
  attribute vec3 tint;
  uniform mat4 camera;
  uniform vec3 scale;  // least value, 1 / range, size of a point; a range of 0: tints
  varying vec3 colour;
  vec3 ramp(float t) {
    return clamp(vec3(1.5) - abs(4.0 * vec3(t) - vec3(3.0, 2.0, 1.0)), 0.0, 1.0);
  }
  void main() {
    gl_Position = camera * vec4(place.xyz, 1.0);
    gl_PointSize = scale.z;
    colour = scale.y == 0.0 ? tint : ramp(0.05 + 0.9 * clamp((place.w - scale.x) * scale.y, 0.0, 1.0));
  }`;
const FRAGMENT = "precision mediump float; varying vec3 colour; void main() { gl_FragColor = vec4(colour, 1.0); }";

export class Scene {
  constructor() {
    this.canvas = make("canvas", {className: "scene", tabIndex: 0, role: "img"});
    this.points = new Float32Array(0);  // x, y, z, value
    this.lines = new Float32Array(0);   // x, y, z, red, green, blue
    this.height = true;                 // coloured by it, not by the value
    Object.assign(this, {yaw: -2.2, pitch: 0.6, far: 0, middle: [0, 0, 0]});
    this.gl = this.canvas.getContext("webgl", {antialias: false, preserveDrawingBuffer: true});
    if (!this.gl) return;
    this.prepare();
    this.listen();
  }

  prepare() {
    const {gl} = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "WebGL does not work here");
    gl.useProgram(program);
    this.place = gl.getAttribLocation(program, "place");
    this.tint = gl.getAttribLocation(program, "tint");
    this.camera = gl.getUniformLocation(program, "camera");
    this.scale = gl.getUniformLocation(program, "scale");
    this.pointBuffer = gl.createBuffer();
    this.lineBuffer = gl.createBuffer();
    gl.enable(gl.DEPTH_TEST);
  }

  listen() {
    const {canvas} = this;
    canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
    canvas.onpointermove = (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) this.turn(event.movementX * -0.008, event.movementY * 0.008);
    };
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.near(Math.exp(event.deltaY * 0.001));
    }, {passive: false});
    canvas.onkeydown = (event) => {
      const act = {ArrowLeft: () => this.turn(0.1, 0), ArrowRight: () => this.turn(-0.1, 0), ArrowUp: () => this.turn(0, 0.1),
        ArrowDown: () => this.turn(0, -0.1), "+": () => this.near(0.8), "-": () => this.near(1.25), Home: () => {
          this.far = 0;
          this.draw();
        }}[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    };
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.draw();
  }
  near(factor) {
    this.far = Math.max(0.01, Math.min(1e5, this.far * factor));
    this.draw();
  }

  /// Looks at all of it: where nearly all points are, as a few may be far away.
  lookAtAll() {
    const corners = [0, 1, 2].map((axis) => {
      const all = [];
      const step = Math.max(1, Math.floor(this.points.length / 4 / 2000));
      for (let i = axis; i < this.points.length; i += 4 * step) all.push(this.points[i]);
      for (let i = axis; i < this.lines.length; i += 6) all.push(this.lines[i]);
      all.sort((a, b) => a - b);
      return [all[Math.floor(0.02 * all.length)] || 0, all[Math.floor(0.98 * (all.length - 1))] || 0];
    });
    this.middle = corners.map(([low, high]) => (low + high) / 2);
    this.far = Math.max(0.5, 0.9 * Math.hypot(...corners.map(([low, high]) => high - low)));
  }

  matrix(width, height) {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const right = [-sy, cy, 0];
    const back = [cp * cy, cp * sy, sp];  // from the middle to the eye
    const up = [-sp * cy, -sp * sy, cp];
    const eye = this.middle.map((one, i) => one + this.far * back[i]);
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const [near, end] = [this.far / 100, this.far * 20];
    const f = 1.6;
    const fx = f * height / width;
    const depth = -(end + near) / (end - near);
    const shift = -2 * end * near / (end - near);
    // Columns: projection times view.
    const column = (i) => [fx * right[i], f * up[i], depth * back[i], -back[i]];
    return new Float32Array([...column(0), ...column(1), ...column(2), fx * dot(right), f * dot(up), depth * dot(back) + shift, -dot(back)]);
  }

  /// How many points and ends of lines were drawn.
  draw() {
    const {gl, canvas} = this;
    if (!gl) return;
    const [width, height] = [canvas.clientWidth || 600, canvas.clientHeight || 400];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    if (this.far === 0 && this.points.length + this.lines.length > 0) this.lookAtAll();
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.05, 0.06, 0.08, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.camera, false, this.matrix(width, height));
    gl.enableVertexAttribArray(this.place);

    gl.bindBuffer(gl.ARRAY_BUFFER, this.pointBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.points, gl.STREAM_DRAW);
    gl.disableVertexAttribArray(this.tint);
    gl.vertexAttribPointer(this.place, 4, gl.FLOAT, false, 16, 0);
    const [low, high] = this.range();
    gl.uniform3f(this.scale, low, 1 / Math.max(1e-6, high - low), this.points.length > 4 * 50000 ? 1.5 : 2);
    gl.drawArrays(gl.POINTS, 0, this.points.length / 4);

    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.lines, gl.STREAM_DRAW);
    gl.enableVertexAttribArray(this.tint);
    gl.vertexAttribPointer(this.place, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(this.tint, 3, gl.FLOAT, false, 24, 12);
    gl.uniform3f(this.scale, 0, 0, 1);
    gl.drawArrays(gl.LINES, 0, this.lines.length / 6);
    canvas.dataset.points = this.points.length / 4;
  }

  /// Of nearly all values.
  range() {
    const step = 4 * Math.max(1, Math.floor(this.points.length / 4 / 2000));
    const all = [];
    for (let i = 3; i < this.points.length; i += step) all.push(this.points[i]);
    all.sort((a, b) => a - b);
    return all.length === 0 ? [0, 1] : [all[Math.floor(0.02 * all.length)], all[Math.floor(0.98 * (all.length - 1))]];
  }
}

/// The axes of a frame: red, green and blue for x, y and z.
export function axes(at, turned, length) {
  return [0, 1, 2].flatMap((axis) => {
    const colour = [0, 1, 2].map((one) => one === axis ? 1 : 0.25);
    const end = turned([axis === 0 ? length : 0, axis === 1 ? length : 0, axis === 2 ? length : 0]).map((one, i) => one + at[i]);
    return [...at, ...colour, ...end, ...colour];
  });
}
