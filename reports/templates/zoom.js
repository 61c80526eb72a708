// Zoom along the time axis of figures marked data-zoom, and the current section in the contents.
// Without scripting the figures and the contents stand as they are.
(function () {
  "use strict";
  var NS = "http://www.w3.org/2000/svg";

  function nice(span) {
    var power = Math.pow(10, Math.floor(Math.log10(span / 6))), rest = span / 6 / power;
    return (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10) * power;
  }

  function zoomable(figure) {
    var svg = figure.querySelector("svg[data-x0]");
    if (!svg) { return; }
    var boxes = Array.from(svg.querySelectorAll("clipPath rect"), function (r) {
      return { x: +r.getAttribute("x"), y: +r.getAttribute("y"), w: +r.getAttribute("width"), h: +r.getAttribute("height") };
    });
    if (!boxes.length) { return; }
    boxes.sort(function (a, b) { return a.y - b.y; });
    var box = boxes[boxes.length - 1];  // all panels share the time axis; the lowest carries its numbers
    var whole = [+svg.dataset.x0, +svg.dataset.x1], view = whole.slice();
    var lines = [], marks = [], labels = [];
    svg.querySelectorAll("[clip-path]").forEach(function (node) {
      if (node.closest('[id*="-xtick_"], [id*="-ytick_"]')) { return; }
      if (node.tagName === "g") {
        node.querySelectorAll("use").forEach(function (use) { marks.push([use, +use.getAttribute("x")]); });
      } else {
        var outer = document.createElementNS(NS, "g");
        node.parentNode.insertBefore(outer, node);
        outer.setAttribute("clip-path", node.getAttribute("clip-path"));
        node.removeAttribute("clip-path");
        node.setAttribute("vector-effect", "non-scaling-stroke");
        outer.appendChild(node);
        lines.push(node);
      }
    });
    svg.querySelectorAll('[id*="spanlabel"]').forEach(function (node) {
      var b = node.getBBox();
      labels.push([node, b.x + b.width / 2]);
    });
    var ticks = svg.querySelectorAll('[id*="-xtick_"]');
    var drawn = document.createElementNS(NS, "g");
    var first = svg.querySelector('[id*="-axes_"]');
    first.insertBefore(drawn, first.firstChild);

    function draw() {
      var zoomed = view[0] > whole[0] || view[1] < whole[1];
      var scale = (whole[1] - whole[0]) / (view[1] - view[0]);
      var left = box.x + (view[0] - whole[0]) / (whole[1] - whole[0]) * box.w;
      function to(x) { return box.x + (x - left) * scale; }
      lines.forEach(function (n) { n.setAttribute("transform", "matrix(" + scale + " 0 0 1 " + (box.x - left * scale) + " 0)"); });
      marks.forEach(function (m) {
        var x = to(m[1]);
        m[0].setAttribute("x", x);
        m[0].style.display = x < box.x - 2 || x > box.x + box.w + 2 ? "none" : "";
      });
      labels.forEach(function (l) {
        var x = to(l[1]);
        l[0].setAttribute("transform", zoomed ? "translate(" + (x - l[1]) + " 0)" : "");
        l[0].style.display = x < box.x || x > box.x + box.w ? "none" : "";
      });
      ticks.forEach(function (t) { t.style.display = zoomed ? "none" : ""; });
      drawn.replaceChildren();
      if (!zoomed) { return; }
      var step = nice(view[1] - view[0]), digits = Math.max(0, -Math.floor(Math.log10(step)));
      for (var k = Math.ceil(view[0] / step); k * step <= view[1]; k++) {
        var x = box.x + (k * step - view[0]) / (view[1] - view[0]) * box.w;
        var line = document.createElementNS(NS, "path"), text = document.createElementNS(NS, "text");
        line.setAttribute("d", boxes.map(function (b) { return "M" + x + " " + b.y + "V" + (b.y + b.h); }).join(""));
        line.setAttribute("style", "stroke: var(--grid); stroke-width: 0.5");
        text.setAttribute("x", x);
        text.setAttribute("y", box.y + box.h + 10);
        text.setAttribute("style", "font: 8px sans-serif; text-anchor: middle; fill: var(--ink)");
        text.textContent = (k * step).toFixed(digits);
        drawn.append(line, text);
      }
    }

    function set(a, b) {
      var span = Math.max(Math.min(b - a, whole[1] - whole[0]), (whole[1] - whole[0]) / 1e4);
      a = Math.min(Math.max(a, whole[0]), whole[1] - span);
      view = [a, a + span];
      draw();
    }

    function by(centre, factor) {
      var half = (view[1] - view[0]) * factor / 2;
      set(centre - half, centre + half);
    }

    function middle() { return (view[0] + view[1]) / 2; }
    var words = document.body.dataset.zoom.split("|");
    var bar = document.createElement("div");
    bar.className = "zoombar";
    if (window.matchMedia("(pointer: fine)").matches) { bar.append(words[0]); }
    [["+", words[1], function () { by(middle(), 0.5); }], ["−", words[2], function () { by(middle(), 2); }],
      ["◀", words[3], function () { var s = (view[1] - view[0]) / 2; set(view[0] - s, view[1] - s); }],
      ["▶", words[4], function () { var s = (view[1] - view[0]) / 2; set(view[0] + s, view[1] + s); }],
      [words[5], words[6], function () { set(whole[0], whole[1]); }]].forEach(function (b) {
      var button = document.createElement("button");
      button.type = "button";
      button.textContent = b[0];
      button.setAttribute("aria-label", b[1]);
      button.addEventListener("click", b[2]);
      bar.append(button);
    });
    figure.insertBefore(bar, figure.firstChild);

    function at(event) {
      var p = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return view[0] + Math.min(Math.max((p.x - box.x) / box.w, 0), 1) * (view[1] - view[0]);
    }
    var start = null;
    svg.addEventListener("pointerdown", function (e) { if (e.pointerType === "mouse") { start = at(e); e.preventDefault(); } });
    window.addEventListener("pointerup", function (e) {
      if (start === null) { return; }
      var end = at(e), a = Math.min(start, end), b = Math.max(start, end);
      start = null;
      if (b - a > 0.01 * (view[1] - view[0])) { set(a, b); }
    });
    svg.addEventListener("dblclick", function () { set(whole[0], whole[1]); });
  }

  document.querySelectorAll("figure[data-zoom]").forEach(zoomable);
  window.addEventListener("beforeprint", function () {
    document.querySelectorAll("details").forEach(function (d) { d.open = true; });
  });
  var links = new Map();
  document.querySelectorAll("nav a").forEach(function (a) { links.set(a.hash.slice(1), a); });
  var heads = Array.from(document.querySelectorAll("h2[id], h3[id]"));
  function mark() {
    var here = heads.filter(function (h) { return h.getBoundingClientRect().top < 120; }).pop();
    links.forEach(function (a, id) { a.classList.toggle("here", !!here && id === here.id); });
  }
  window.addEventListener("scroll", mark, { passive: true });
  mark();
})();
