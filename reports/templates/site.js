// The table of runs: sort by a heading, filter by words, choose columns, turn pages.
(function () {
  "use strict";
  var table = window.gyrobenchRuns, PAGE = 50;
  var box = document.getElementById("runs-table");
  if (!table || !box) { return; }
  var head = box.querySelector("thead"), body = box.querySelector("tbody"), status = document.getElementById("runs-status");
  var input = document.getElementById("runs-filter"), choice = document.getElementById("runs-columns");
  var pager = box.querySelector(".pager");
  var words = new Map(Object.entries(table.words || {}));  // English -> the language of the page

  function say(text, values) {
    var said = words.get(text) || text;
    return values ? said.replace(/\{(\w+)\}/g, function (_, name) { return values[name]; }) : said;
  }
  var by = new Map();
  table.columns.forEach(function (c) { by.set(c.key.toLowerCase(), c); });
  var all = Array.from({ length: table.rows }, function (_, k) { return k; });
  var shown = all, first = 0, sorted = null, down = false, shownColumns = [], lower = new Map();

  // ------------------------------------------------------------------------------------------------- numbers
  function minus(text) { return text.replace("-", "−"); }

  function fixed(value, digits) {
    var text = digits >= 0 ? value.toFixed(Math.min(digits, 100)) : String(Math.round(value * Math.pow(10, digits)) / Math.pow(10, digits));
    return minus(/^-0\.?0*$/.test(text) ? text.slice(1) : text);
  }

  function power(value, significant) {
    var parts = value.toExponential(Math.max(significant - 1, 0)).split("e");
    return minus(parts[0]) + "·10" + String(+parts[1]).replace(/[-0-9]/g, function (d) {
      return "⁻⁰¹²³⁴⁵⁶⁷⁸⁹".charAt("-0123456789".indexOf(d));
    });
  }

  // to the second significant digit of u; without u to five digits
  function rounded(value, u) {
    if (value === null) { return "–"; }
    var size = Math.max(Math.abs(value), Math.abs(u || 0));
    if (u && isFinite(u)) {
      var digits = 1 - +u.toExponential(1).split("e")[1];
      if ((digits <= 6 || (digits <= 9 && size >= 0.1)) && size < 1e7) { return fixed(value, digits); }
      return power(value, Math.max(1, digits + Math.floor(Math.log10(size)) + 1));
    }
    if (value === 0) { return "0"; }
    if (size >= 1e-4 && size < 1e6) { return minus(String(+value.toPrecision(5))); }
    return power(value, 5);
  }

  function text(column, row) {
    var value = column.values[row];
    if (column.kind === "text") { return value; }
    if (value === null) { return "–"; }
    if (column.kind === "count") { return String(value); }
    var u = column.kind === "number" ? null : by.get(("u(" + column.measure + ")").toLowerCase());
    return rounded(value, u ? u.values[row] : null);
  }

  // -------------------------------------------------------------------------------------------------- filter
  var TERM = /(?:"([^"]+)"|([^\s"<>=!]+))\s*(<=|>=|!=|=|<|>)\s*(?:"([^"]*)"|([^\s"]+))|"([^"]*)"|(\S+)/g;

  function lowered(column) {
    if (!lower.has(column.key)) {
      lower.set(column.key, column.values.map(function (v) {
        return v === null ? "" : (words.has(v) ? v + "\n" + words.get(v) : String(v)).toLowerCase();
      }));
    }
    return lower.get(column.key);
  }

  function compare(values, sign, wanted) {
    return function (row) {
      var v = values[row];
      if (v === null) { return false; }
      return sign === "<" ? v < wanted : sign === ">" ? v > wanted : sign === "<=" ? v <= wanted :
        sign === ">=" ? v >= wanted : sign === "=" ? v === wanted : v !== wanted;
    };
  }

  function condition(match) {
    var name = match[1] || match[2], sign = match[3], wanted = match[4] !== undefined ? match[4] : match[5];
    if (!sign) {
      var word = (match[6] !== undefined ? match[6] : match[7]).toLowerCase();
      var texts = table.columns.filter(function (c) { return c.kind === "text"; }).map(lowered);
      return function (row) { return texts.some(function (t) { return t[row].indexOf(word) >= 0; }); };
    }
    var column = by.get(name.toLowerCase());
    if (!column) { throw new Error(say("no column {v}", { v: name })); }
    if (column.kind === "text") {
      if (sign !== "=" && sign !== "!=") { throw new Error(say("{v} holds texts: name=text", { v: name })); }
      var low = lowered(column), part = wanted.toLowerCase();
      return function (row) { return (low[row].indexOf(part) >= 0) === (sign === "="); };
    }
    var number = +wanted.replace("−", "-");
    if (wanted === "" || isNaN(number)) { throw new Error(say("{v}: {v2} is not a number", { v: name, v2: wanted })); }
    return compare(column.values, sign, number);
  }

  function filter() {
    var conditions = [], problem = "", match;
    TERM.lastIndex = 0;
    while ((match = TERM.exec(input.value)) !== null) {
      try { conditions.push(condition(match)); } catch (e) { problem = e.message; }
    }
    shown = all.filter(function (row) { return conditions.every(function (c) { return c(row); }); });
    input.setAttribute("aria-invalid", problem ? "true" : "false");
    status.dataset.problem = problem;
    first = 0;
    sort();
  }

  // ---------------------------------------------------------------------------------------------------- sort
  function sort() {
    if (sorted) {
      var v = sorted.values, sign = down ? -1 : 1, texts = sorted.kind === "text";
      shown = shown.slice().sort(function (a, b) {
        var x = v[a], y = v[b];
        if (x === y) { return a - b; }
        if (x === null || x === "") { return 1; }  // what is not there comes last in either order
        if (y === null || y === "") { return -1; }
        return sign * (texts ? x.localeCompare(y, "en", { numeric: true }) : x - y) || a - b;
      });
    }
    draw();
  }

  // ---------------------------------------------------------------------------------------------------- draw
  function columns() {
    var of = choice.value;
    shownColumns = table.columns.filter(function (c) {
      if (!c.measure) { return true; }
      return of === "" ? c.kind === "value" && c.key === c.measure || c.kind === "u" : c.measure === of;
    });
    var row = document.createElement("tr");
    shownColumns.forEach(function (c) {
      var th = document.createElement("th"), button = document.createElement("button");
      th.scope = "col";
      if (c.kind !== "text") { th.className = "n"; }
      button.type = "button";
      button.textContent = c.head;
      if (c.unit && c.unit !== "1") { button.append(" / " + (/[\/ ]/.test(c.unit) ? "(" + c.unit + ")" : c.unit)); }
      button.addEventListener("click", function () {
        if (sorted === c && down) { sorted = null; down = false; filter(); } else {
          down = sorted === c;
          sorted = c;
          first = 0;
          sort();
        }
      });
      th.append(button);
      row.append(th);
    });
    head.replaceChildren(row);
    draw();
  }

  function cell(column, row) {
    var td = document.createElement("td"), value = text(column, row), mark = null;
    if (column.kind !== "text") { td.className = "n"; }
    if (value.length > 40) { td.title = say(value); }
    if (column.key === "verdict" && /^(pass|fail|inconclusive|void)$/.test(value)) {
      td.className = value;
      mark = document.createElement("span");
      mark.className = "verdict";
    }
    if (column.key === "state" && value !== "done") { td.className = "failed"; }
    var link = table.links[row];
    if (link && (column.key === "index" || column.key === "instrument" || column.key === "verdict")) {
      var a = document.createElement("a");
      a.href = link;
      a.textContent = say(value);
      if (column.key === "index") { a.setAttribute("aria-label", say("Report of run {n}", { n: value })); }
      (mark ? td.appendChild(mark) : td).append(a);
    } else { (mark ? td.appendChild(mark) : td).textContent = say(value); }
    return td;
  }

  function draw() {
    Array.from(head.querySelectorAll("th")).forEach(function (th, k) {
      if (shownColumns[k] === sorted) { th.setAttribute("aria-sort", down ? "descending" : "ascending"); }
      else { th.removeAttribute("aria-sort"); }
    });
    var last = Math.min(first + PAGE, shown.length), part = document.createDocumentFragment();
    for (var k = first; k < last; k++) {
      var tr = document.createElement("tr");
      for (var j = 0; j < shownColumns.length; j++) { tr.append(cell(shownColumns[j], shown[k])); }
      part.append(tr);
    }
    body.replaceChildren(part);
    var count = shown.length ? say("{n} to {n2} of {n3} runs", { n: first + 1, n2: last, n3: shown.length }) :
      say("No runs");
    var of = shown.length < table.rows ? say(", filtered from {n}", { n: table.rows }) : "";
    status.textContent = (status.dataset.problem ? status.dataset.problem + say(". ") : "") + count + of + say(".");
    buttons[0].disabled = buttons[1].disabled = first === 0;
    buttons[2].disabled = buttons[3].disabled = last >= shown.length;
    pager.hidden = shown.length <= PAGE;
  }

  function end() { return Math.max(0, Math.floor((shown.length - 1) / PAGE) * PAGE); }
  var buttons = [["⇤", "First page", function () { first = 0; }],
    ["←", "Previous page", function () { first = Math.max(0, first - PAGE); }],
    ["→", "Next page", function () { first = Math.min(end(), first + PAGE); }],
    ["⇥", "Last page", function () { first = end(); }]].map(function (b) {
    var button = document.createElement("button");
    button.type = "button";
    button.textContent = b[0];
    button.setAttribute("aria-label", say(b[1]));
    button.addEventListener("click", function () { b[2](); draw(); });
    pager.append(button);
    return button;
  });

  [["", say(table.measures.length > 1 ? "all estimates" : "estimate")]].concat(table.measures.map(function (m) { return [m, m]; }))
    .forEach(function (m) { choice.append(new Option(m[1], m[0])); });
  choice.addEventListener("change", columns);
  var timer = 0;
  input.addEventListener("input", function () { clearTimeout(timer); timer = setTimeout(filter, 120); });
  function fromAddress() {
    if (location.hash.indexOf("#filter=") !== 0) { return; }
    input.value = decodeURIComponent(location.hash.slice(8));
    filter();
    document.getElementById("runs").scrollIntoView();
  }
  window.addEventListener("hashchange", fromAddress);
  box.hidden = false;
  columns();
  fromAddress();
})();
