
// ------------------------------------------------------------------------------------------- lesson
const formulas = lesson && [lesson.simulated, ...lesson.theory].map((text) => new Function("v", `return ${text};`));

/** Put the texts of the lesson into the page and give its parameters their sliders. */
function teach() {
  for (const p of content.parameters) {
    const slider = lesson.sliders[p.name];
    p.value = p.start;
    if (!slider) continue;
    const si = p.start * p.factor, inUnit = (x) => Number(Number(x.match(/^[-+.\de]+/)[0]).toPrecision(12));
    Object.assign(p, { label: slider.label, shown: slider.shown, bounds: p.bounds.map((b) => (b === null ? b : (b * p.factor) / slider.factor)) });
    Object.assign(p, { factor: slider.factor, start: Number((si / slider.factor).toPrecision(12)), low: inUnit(slider.low), high: inUnit(slider.high) });
  }
  for (const id of ["run", "defaults"]) at(id).textContent = say(id === "run" ? "Run" : "Defaults");
  at("about").textContent = lesson.question;
  at("about").className = "question";
  const curve = document.createElement("figure");
  curve.className = "lesson";
  curve.innerHTML = '<h2><span class="name"></span><span class="unit"></span></h2><canvas role="img"></canvas><figcaption></figcaption><div class="equation"></div><p class="text"></p>';
  curve.querySelector(".name").textContent = lesson.curve;
  curve.querySelector("canvas").setAttribute("aria-label", `${lesson.curve}: ${say("simulation")}, ${say("theory")}`);
  [say("simulation"), say("theory")].forEach((name, i) => {
    const key = document.createElement("b");
    key.dataset.colour = i;
    key.textContent = `${i ? "┅" : "―"} ${name}  `;
    curve.querySelector("figcaption").append(key);
  });
  curve.querySelector(".equation").innerHTML = lesson.equation;
  curve.querySelector(".text").textContent = lesson.text;
  at("curves").append(curve, exercise(), signals());
}

function signals() {
  const fold = document.createElement("details");
  fold.innerHTML = '<summary></summary><div id="signals"></div>';
  fold.querySelector("summary").textContent = say("All signals");
  fold.addEventListener("toggle", draw);
  return fold;
}

/** Values by letter: parameters as they are set, or as given. */
function letters(given = {}) {
  const found = {};
  for (const [letter, name] of Object.entries(lesson.symbols)) {
    const p = content.parameters.find((q) => q.name === name);
    if (p) found[letter] = p.value * p.factor;
  }
  return { ...found, ...given };
}

function lessonRows(data, n, v, alpha) {
  const columns = Object.entries(lesson.symbols).flatMap(([letter, name]) => {
    const k = content.outputs.findIndex((o) => o.name === name);
    return k < 0 ? [] : [[letter, k + 1]];
  });
  const own = 1 + formulas.length, made = new Float64Array(n * own);
  let kept = 0;
  for (let i = 0; i < n; i++) {
    v.t = data[i * width];
    if (v.t < lesson.begin) continue;
    for (const [letter, k] of columns) v[letter] = data[i * width + k];
    made[kept * own] = v.t;
    formulas.forEach((f, k) => (made[kept * own + 1 + k] = f(v)));
    kept++;
  }
  return { data: made, count: kept, width: own, alpha, dashed: true };
}

function lessonChart(canvas) {
  const v = letters();
  lesson.shownRows = lessonRows(count ? table() : new Float64Array(0), count, v, 1);
  const sets = [lesson.shownRows, ...(before ? [lessonRows(before.data, before.count, before.letters, 0.35)] : [])];
  return plot(canvas, sets, formulas.map((_, k) => k), () => [1 / lesson.factor, lesson.shown], lesson.least);
}

function exercise() {
  const box = document.createElement("section");
  box.className = "exercise";
  box.innerHTML = '<h2></h2><p class="task"></p><form><input id="answer" autocomplete="off"><button></button></form><p id="verdict" role="status"></p>';
  box.querySelector("h2").textContent = say("Exercise");
  box.querySelector(".task").textContent = lesson.task;
  box.querySelector("input").setAttribute("aria-label", say("Your answer, with its unit"));
  box.querySelector("input").placeholder = say("Your answer, with its unit");
  box.querySelector("button").textContent = say("Check");
  box.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    const [right, words] = judge(at("answer").value);
    at("verdict").textContent = words;
    at("verdict").className = right ? "right" : "wrong";
  });
  return box;
}

const UNITS = { "°": "deg", "º": "deg", "′": "arcmin", "″": "arcsec", "'": "arcmin", '"': "arcsec", "·": ".", "²": "2", "µ": "u" };
const SPELLED = { degree: "deg", degrees: "deg", sec: "s", second: "s", seconds: "s", minute: "min", minutes: "min", hr: "h", hour: "h", hours: "h" };

/** Whether an answer as written is right, and what is said of it. */
function judge(text) {
  const { answer } = lesson, example = `12.3 ${answer.unit}`;
  const found = text.trim().replace("−", "-").replace(/^([-+]?\d+),(\d+)/, "$1.$2").match(/^([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*)$/i);
  if (!found || !found[2]) return [false, say("A number with its unit is expected, such as {v}.", example)];
  const signs = found[2].replace(/[°º′″'"·²µ]/g, (c) => UNITS[c]).replace(/\s/g, "");
  const unit = signs.replace(/[a-z]+/gi, (word) => SPELLED[word.toLowerCase()] ?? word);
  const factor = answer.units[unit] ?? answer.units[unit.replace(/^deg\/s$/, "dps")];
  if (factor === undefined) return [false, say("The answer has another unit, such as {v}.", example)];
  const right = new Function("v", `return ${answer.script};`)(letters(answer.set)), given = Number(found[1]) * factor;
  if (Math.abs(given - right) <= answer.tolerance * Math.abs(right)) return [true, `${say("Right.")} ${lesson.solution}`];
  if (Math.abs(given + right) <= answer.tolerance * Math.abs(right)) return [false, say("The size is right, the sign is not.")];
  return [false, `${say("Not yet.")} ${lesson.hint}`];
}
