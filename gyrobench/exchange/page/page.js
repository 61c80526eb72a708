"use strict";
const content = JSON.parse(document.getElementById("content").textContent);
const at = (id) => document.getElementById(id);
const dark = matchMedia("(prefers-color-scheme: dark)");
const PALETTES = [
  ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"],
  ["#56b4e9", "#f28e54", "#3fc79a", "#e4a3c8", "#f0c04a", "#a7d8f5"],
];
const colour = (i) => PALETTES[Number(dark.matches)][i % 6];
const PREFIXES = { "-9": "n", "-6": "µ", "-3": "m", 3: "k", 6: "M" };
const SLICE = 30; // ms of steps between two looks at the buttons
const width = content.outputs.length + 1; // of a row: the time and the outputs
const lesson = content.lesson; // its texts, formulas and exercise; undefined: the system alone
let engine, instance, rows, count = 0, before = null, token = 0;

/** A text of the page in its language; {n}, {n2} and {v} take what follows. */
function say(text, n, n2) {
  return (lesson?.words[text] ?? text).replace(/\{n2\}/, n2).replace(/\{[nv]\}/, n);
}

// ---------------------------------------------------------------------------------------- the system
function text(pointer) {
  const bytes = new Uint8Array(engine.memory.buffer, pointer);
  return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
}

async function load() {
  const bytes = Uint8Array.from(atob(content.wasm), (c) => c.charCodeAt(0));
  engine = (await WebAssembly.instantiate(bytes, {})).instance.exports;
  engine._initialize?.();
  instance = engine.create();
  rows = engine.rows(content.rows + 1);
  document.body.dataset.ready = "yes";
}

const table = () => new Float64Array(engine.memory.buffer, rows, (content.rows + 1) * width);

/** Run from the beginning in slices of a frame; a second call ends the first. */
async function run() {
  const mine = ++token;
  if (count > 1) before = { data: table().slice(0, count * width), count, letters: lesson && lesson.letters };
  if (lesson) lesson.letters = letters();
  engine.renew(instance);
  const changed = content.parameters.filter((p) => p.value !== p.start); // there and back a unit may cost a last digit
  changed.forEach((p) => engine.set(instance, p.reference, p.value * p.factor));
  count = 0;
  document.body.dataset.run = "on";
  if (engine.start(instance, rows)) return finish(text(engine.reason(instance)), true);
  count = 1;
  let slice = 1, failed = false, ended = false, spent = 0, next = 0;
  while (count <= content.rows && !failed && !ended) {
    await new Promise((go) => (document.hidden ? setTimeout(go, 0) : requestAnimationFrame(go)));
    if (mine !== token) return;
    const began = performance.now();
    const n = Math.min(slice, content.rows + 1 - count);
    const made = engine.advance(instance, n, content.every, rows + count * width * 8);
    failed = made < n;
    if (content.done >= 0) {
      const data = table();
      for (let i = count; i < count + made && !ended; i++) {
        ended = data[i * width + 1 + content.done] > 0.5;
        if (ended) count = i + 1;
      }
    }
    if (!ended) count += made;
    const took = performance.now() - began;
    spent += took;
    slice = Math.max(1, Math.round(took > 0 ? Math.min(4 * slice, (slice * SLICE) / took) : 4 * slice));
    if (performance.now() < next) continue;
    const planned = Math.max(content.planned ?? content.rows * content.every * content.step, time());
    at("progress").value = time() / planned;
    at("state").textContent = say("{n} of {n2}", quantity(time()), quantity(planned));
    const drawn = performance.now();
    draw();
    next = performance.now() + Math.max(4 * SLICE, 5 * (performance.now() - drawn)); // the run has most of the time
  }
  at("progress").value = 1;
  document.body.dataset.milliseconds = spent;
  finish(failed ? text(engine.reason(instance)) : say("End at {n}.", quantity(time())), failed);
}

const time = () => table()[(count - 1) * width];

function finish(message, failed) {
  at("state").textContent = message;
  at("state").className = failed ? "failed" : "";
  document.body.dataset.run = failed ? "failed" : "ended";
  draw();
}

// --------------------------------------------------------------------------------------- parameters
function quantity(seconds) {
  return seconds >= 7200 ? say("{n} h", (seconds / 3600).toPrecision(3)) : seconds >= 120 ? say("{n} min", (seconds / 60).toPrecision(3)) : say("{n} s", Number(seconds.toPrecision(4)));
}

function allowed(p, x) {
  const [min, max, above, below] = p.bounds;
  return Number.isFinite(x) && (min === null || x >= min) && (max === null || x <= max)
    && (above === null || x > above) && (below === null || x < below) && (p.kind === "float" || Number.isInteger(x));
}

function control(p, i) {
  const box = document.createElement("div");
  box.className = "parameter";
  box.innerHTML = `<label for="p${i}"></label><small></small><div><input type="range" tabindex="-1" aria-hidden="true"><input type="number" id="p${i}" step="any"></div>`;
  const [slider, field] = box.querySelectorAll("input");
  box.querySelector("label").textContent = p.shown === "1" ? p.label ?? p.name : `${p.label ?? p.name} / ${p.shown}`;
  box.querySelector("small").textContent = p.label ? p.name : p.doc;
  Object.assign(slider, { min: p.low, max: p.high, step: p.kind === "float" ? (p.high - p.low) / 200 : 1 });
  p.show = (x) => {
    p.value = x;
    field.value = Number(x.toPrecision(7));
    slider.value = x;
    field.classList.toggle("changed", x !== p.start);
  };
  const take = (x) => {
    if (!allowed(p, x)) {
      at("state").textContent = say("{v} is not allowed", `${p.label ?? p.name}: ${x}`);
      at("state").className = "failed";
      return p.show(p.value);
    }
    p.show(x);
    run();
  };
  slider.addEventListener("change", () => take(Number(slider.value)));
  slider.addEventListener("input", () => (field.value = Number(Number(slider.value).toPrecision(7))));
  field.addEventListener("change", () => take(Number(field.value)));
  p.show(p.start);
  return box;
}

// ------------------------------------------------------------------------------------------- curves
const raised = (power) => [...`${power}`].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("");

function scale(unit, shown, largest) {
  if (unit === "rad") [shown, unit] = ["°", 180 / Math.PI];
  else if (unit === "rad/s") [shown, unit] = largest > content.fast ? ["°/s", 180 / Math.PI] : ["°/h", 648000 / Math.PI];
  else unit = 1;
  const size = largest * unit;
  if (size === 0 || (size >= 1e-2 && size < 1e5)) return [unit, shown];
  const power = 3 * Math.floor(Math.log10(size) / 3);
  return [unit / 10 ** power, "VANmsW".includes(shown) && PREFIXES[power] ? PREFIXES[power] + shown : `10${raised(power)} ${shown}`];
}

function ticks(low, high, most) {
  const raw = (high - low) / most, unit = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((k) => k * unit >= raw) * unit, found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

/** A mark as text, to the digits that tell it from the next one. */
const plain = (x, step) => (x === 0 ? "0" : String(Number(x.toFixed(Math.min(100, Math.max(0, 1 - Math.floor(Math.log10(step))))))).replaceAll("-", "−"));

/** A band from the smallest to the largest value of each pixel, and a line through their means. */
function line(pen, { data, count: rowCount, width }, column, x, y) {
  const columns = [];
  for (let i = 0; i < rowCount; i++) {
    const px = Math.round(x(data[i * width])), v = data[i * width + column], last = columns.at(-1);
    if (last?.px === px) Object.assign(last, { low: Math.min(last.low, v), high: Math.max(last.high, v), sum: last.sum + v, n: last.n + 1 });
    else columns.push({ px, low: v, high: v, sum: v, n: 1 });
  }
  const shade = pen.globalAlpha;
  pen.globalAlpha = 0.3 * shade;
  pen.beginPath();
  for (const c of columns) { pen.moveTo(c.px, y(c.low)); pen.lineTo(c.px, y(c.high)); }
  pen.stroke();
  pen.globalAlpha = shade;
  pen.beginPath();
  for (const c of columns) pen.lineTo(c.px, y(c.sum / c.n));
  pen.stroke();
}

/** Draw columns of sets of rows ({data, count, width, alpha}, the time first); return the unit at the axis.  least: margin. */
function plot(canvas, sets, indices, scaled, least = 0) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (!w) return undefined; // folded away
  canvas.width = w * ratio;
  canvas.height = h * ratio;
  const pen = canvas.getContext("2d"), style = getComputedStyle(document.body);
  pen.scale(ratio, ratio);
  let low = Infinity, high = -Infinity, last = 0;
  for (const { data, count: n, width } of sets) {
    if (n) last = Math.max(last, data[(n - 1) * width]);
    for (let i = 0; i < n; i++) for (const k of indices) {
      const v = data[i * width + 1 + k];
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  if (!(high >= low)) return undefined;
  const [factor, unit] = scaled(Math.max(Math.abs(low), Math.abs(high)));
  const margin = Math.max(least, 0.06 * (high - low)) || Math.abs(high) || 1;
  [low, high] = [factor * (low - margin), factor * (high + margin)];
  const hours = last > 7200, per = hours ? 3600 : 1, left = 74, bottom = h - 34, top = 8, right = w - 10;
  const x = (t) => left + ((right - left) * t) / (last || 1), y = (v) => bottom - ((bottom - top) * (factor * v - low)) / (high - low);
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = style.getPropertyValue("--soft");
  pen.strokeStyle = style.getPropertyValue("--line");
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  const levels = ticks(low, high, 5);
  for (const v of levels) {
    const py = bottom - ((bottom - top) * (v - low)) / (high - low);
    pen.beginPath(); pen.moveTo(left, py); pen.lineTo(right, py); pen.stroke();
    pen.fillText(plain(v, levels[1] - levels[0] || 1), left - 6, py);
  }
  pen.textAlign = "center";
  pen.textBaseline = "top";
  const marks = last ? ticks(0, last / per, Math.max(2, w / 110)) : [0];
  for (const t of marks) pen.fillText(plain(t, marks[1] - marks[0] || 1), x(t * per), bottom + 5);
  pen.fillText(`${say("time")} / ${hours ? "h" : "s"}`, (left + right) / 2, bottom + 19);
  pen.lineWidth = 1.3;
  pen.lineJoin = "round";
  for (const set of sets.toReversed()) {
    pen.globalAlpha = set.alpha;
    indices.forEach((k, i) => {
      pen.strokeStyle = set.alpha < 1 ? style.getPropertyValue("--soft") : colour(i);
      pen.setLineDash(set.dashed && k > 0 ? [7, 4] : []);
      line(pen, set, k + 1, x, y);
    });
  }
  return unit;
}

function chart(canvas, indices) {
  const first = content.outputs[indices[0]], now = { data: count ? table() : new Float64Array(0), count, width, alpha: 1 };
  const sets = [now, ...(before ? [{ ...before, width, alpha: 0.35 }] : [])];
  return plot(canvas, sets, indices, (largest) => scale(first.unit, first.shown, largest));
}

const charts = lesson ? [null, ...content.charts] : content.charts; // of a lesson its own curve comes first

function draw() {
  document.querySelectorAll("[data-colour]").forEach((key) => (key.style.color = colour(Number(key.dataset.colour))));
  document.querySelectorAll("figure").forEach((figure, k) => {
    const canvas = figure.querySelector("canvas"), unit = lesson && k === 0 ? lessonChart(canvas) : chart(canvas, charts[k]);
    if (unit !== undefined) figure.querySelector(".unit").textContent = unit === "1" ? "" : ` / ${unit}`;
  });
}

function figureOf(indices) {
  const figure = document.createElement("figure");
  figure.innerHTML = '<h2><span class="name"></span><span class="unit"></span></h2><canvas role="img"></canvas><figcaption></figcaption>';
  const named = indices.map((k) => content.outputs[k]);
  const common = named.length > 1 ? named[0].name.replace(/\[[\d,]+\]$/, "") : named[0].name;
  figure.querySelector(".name").textContent = common;
  figure.querySelector("canvas").setAttribute("aria-label", `${common} against time`);
  const caption = figure.querySelector("figcaption");
  if (named.length > 1) named.forEach((o, i) => {
    const key = document.createElement("b");
    key.dataset.colour = i;
    key.textContent = `― ${o.name}  `;
    caption.append(key);
  });
  if (!lesson || lesson.language === "en") caption.append(named[0].doc);
  return figure;
}

// -------------------------------------------------------------------------------------------- begin
function save() {
  const data = table(), lines = [["time [s]", ...content.outputs.map((o) => `${o.name} [${o.unit}]`)].map((n) => (n.includes(",") ? `"${n}"` : n)).join(",")];
  for (let i = 0; i < count; i++) lines.push(Array.from(data.subarray(i * width, (i + 1) * width)).join(","));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
  link.download = `${content.name}.csv`;
  link.click();
}

if (!lesson) at("about").textContent = `gyrobench ${content.version}, system ${content.name}, step ${content.step} s, seed ${content.seed}; a row every ${quantity(content.every * content.step)}. Band: smallest to largest of a pixel's rows; line: their mean; grey: the run before.`;
at("parts").textContent = `${lesson ? `gyrobench ${content.version}, ${content.name}. ` : ""}${say("Parts: {v}.", content.parts.map(([slot, part]) => (slot === part ? slot : `${slot}: ${part}`)).join(", "))}`;
if (lesson) teach();
const shownParameters = lesson ? Object.keys(lesson.sliders).map((n) => content.parameters.find((p) => p.name === n)) : content.parameters;
shownParameters.forEach((p, i) => at("parameters").append(control(p, i)));
content.charts.forEach((c) => at(lesson ? "signals" : "curves").append(figureOf(c)));
at("run").addEventListener("click", run);
at("save").addEventListener("click", save);
at("defaults").addEventListener("click", () => { shownParameters.forEach((p) => p.show(p.start)); run(); });
addEventListener("resize", draw);
dark.addEventListener("change", draw);
load().then(run, (error) => finish(String(error), true));
