// Makes the figures zoomable. Without this the page shows its still pictures and loses nothing else.
(function () {
  "use strict";
  var FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
  var SUPER = "⁰¹²³⁴⁵⁶⁷⁸⁹";

  function power(e) {
    return "10" + String(e).replace(/[-0-9]/g, function (c) { return c === "-" ? "⁻" : SUPER[+c]; });
  }
  function minus(text) { return text.replace("-", "−"); }
  function fixed(v, d) {
    var text = v.toFixed(Math.min(Math.max(d, 0), 20));
    return /^-0(\.0*)?$/.test(text) ? text.slice(1) : minus(text);
  }
  // A value as the legend shows it: five digits of the range in sight.
  function reading(v, span, log) {
    if (v == null || !isFinite(v)) return "–";
    if (v === 0) return "0";
    var size = Math.floor(Math.log10(Math.abs(v)));
    if (log || size < -4 || size > 5) {
      var parts = v.toExponential(3).split("e"), e = +parts[1];
      return e > -4 && e < 5 ? fixed(v, 3 - e) : minus(parts[0]) + "·" + power(e);
    }
    return fixed(v, Math.min(3 - Math.floor(Math.log10(span)), 8));
  }

  // The same ticks as in the still pictures: three or more.
  function within(lo, hi, step) { return Math.floor(hi / step + 1e-9) - Math.ceil(lo / step - 1e-9) + 1; }
  function linearTicks(lo, hi, n) {
    var span = hi - lo;
    if (!(span > 0) || !isFinite(span)) return [];
    var raw = span / n, dec = Math.floor(Math.log10(raw)), r = raw / Math.pow(10, dec), f = 1, e = dec;
    if (r > 5.000001) e += 1; else if (r > 2.000001) f = 5; else if (r > 1.000001) f = 2;
    for (var i = 0; i < 4 && within(lo, hi, f * Math.pow(10, e)) < 3; i++) {
      if (f === 1) { f = 5; e -= 1; } else f = f === 5 ? 2 : 1;
    }
    var step = f * Math.pow(10, e), big = Math.floor(Math.log10(Math.max(Math.abs(lo), Math.abs(hi))));
    var out = [], last = Math.floor(hi / step + 1e-9);
    for (var k = Math.ceil(lo / step - 1e-9); k <= last && out.length < 4 * n + 4; k++) {
      var text = k === 0 ? "0"
        : big < -3 || big > 5 ? fixed(k * f * Math.pow(10, e - big), big - e) + "·" + power(big)
        : fixed(k * step, -e);
      out.push([e < 0 ? k * f / Math.pow(10, -e) : k * step, text]);
    }
    return out;
  }
  function logTicks(lo, hi, n) {
    var a = Math.log10(lo), b = Math.log10(hi);
    if (b - a < 1) return linearTicks(lo, hi, n);
    var stride = Math.max(1, Math.ceil((b - a) / n)), out = [];
    for (var d = Math.floor(a); d <= Math.ceil(b); d++) {
      for (var g = 1; g < (stride > 1 ? 2 : 10); g++) {
        var at = +(g + "e" + d);
        if (at < lo * (1 - 1e-9) || at > hi * (1 + 1e-9)) continue;
        var named = ((d % stride) + stride) % stride === 0 && (g === 1 || (b - a < 2.2 && (g === 2 || g === 5)));
        out.push([at, !named ? "" : d >= -3 && d <= 4 ? fixed(at, Math.max(-d, 0)) : (g === 1 ? "" : g + "·") + power(d)]);
      }
    }
    return out;
  }
  function ticks(axis, lo, hi, n) {
    if (axis.names.length) return axis.names.map(function (t, i) { return [i, t]; })
      .filter(function (t) { return t[0] >= lo && t[0] <= hi; });
    return (axis.log ? logTicks : linearTicks)(lo, hi, n);
  }

  function variable(name) { return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim(); }

  function Figure(root) {
    var data = JSON.parse(root.querySelector("script.data").textContent);
    var live = root.querySelector(".live"), box = document.createElement("div");
    var home = data.range, view = home.slice(), shown = data.series.map(function () { return true; });
    var plot = null, dots = [], values = [];

    function element(tag, cls, text, parent) {
      var e = document.createElement(tag);
      e.className = cls; e.textContent = text; parent.appendChild(e);
      return e;
    }
    // Title of the ordinate, place of the cursor and the button share a line, so that nothing moves when they appear.
    var bar = element("div", "bar", "", root);
    root.insertBefore(bar, live);
    element("span", "y-title", data.y.title, bar);
    var place = element("span", "place", "", bar);
    var reset = element("button", "reset", "Reset zoom", bar);
    reset.type = "button";
    reset.addEventListener("click", function () { show(home); });
    live.appendChild(box);
    element("p", "x-title", data.x.title, live);

    Array.prototype.forEach.call(root.querySelectorAll(".legend li"), function (li, i) {
      var button = document.createElement("button");
      button.type = "button"; button.setAttribute("aria-pressed", "true");
      while (li.firstChild) button.appendChild(li.firstChild);
      li.appendChild(button);
      values.push(button.querySelector(".v"));
      if (data.series[i].shape === "band" || data.series[i].shape === "errors") values[i].className = "v wide";
      button.addEventListener("click", function () {
        shown[i] = !shown[i];
        button.setAttribute("aria-pressed", String(shown[i]));
        if (plot) plot.redraw();
      });
    });

    // Ranges live as positions on the drawn axis (logarithms there), so that zooming is the same for both.
    function to(v, axis) { return axis.log ? Math.log10(v) : v; }
    function from(v, axis) { return axis.log ? Math.pow(10, v) : v; }
    function size() {
      var w = Math.max(live.clientWidth, 120);
      return { width: w, height: Math.round(Math.min(data.height - 30, Math.max(230, w * 0.85))) };
    }
    function settled(r) {
      var a = to(r[0], data.x), b = to(r[1], data.x), c = to(r[2], data.y), d = to(r[3], data.y);
      var ha = to(home[0], data.x), hb = to(home[1], data.x), hc = to(home[2], data.y), hd = to(home[3], data.y);
      // Data are written to a millionth of the range: nearer there is nothing to see.
      function least(lo, hi, l, h) { var w = (h - l) * 1e-5, m = (lo + hi) / 2; return hi - lo < w ? [m - w / 2, m + w / 2] : [lo, hi]; }
      var x = least(a, b, ha, hb), y = least(c, d, hc, hd);
      // Never further out than twice the whole.
      if (x[1] - x[0] > 2 * (hb - ha)) x = [ha, hb];
      if (y[1] - y[0] > 2 * (hd - hc)) y = [hc, hd];
      if (data.equal && plot && plot.over.clientWidth) {
        var W = plot.over.clientWidth, H = plot.over.clientHeight;
        var s = Math.max((x[1] - x[0]) / W, (y[1] - y[0]) / H), mx = (x[0] + x[1]) / 2, my = (y[0] + y[1]) / 2;
        x = [mx - s * W / 2, mx + s * W / 2]; y = [my - s * H / 2, my + s * H / 2];
      }
      return [from(x[0], data.x), from(x[1], data.x), from(y[0], data.y), from(y[1], data.y)];
    }
    function show(r) {
      if (!r.every(isFinite)) return;
      view = r === home ? home.slice() : r;
      root.classList.toggle("is-zoomed", r !== home);
      if (!plot) return;
      var s = settled(view);
      plot.batch(function () {
        plot.setScale("x", { min: s[0], max: s[1] });
        plot.setScale("y", { min: s[2], max: s[3] });
      });
    }
    // Equal scales need the plot area's size, which is known only after the axes have been laid out.
    function again() {
      if (data.equal) requestAnimationFrame(function () { show(root.classList.contains("is-zoomed") ? view : home); });
    }
    function current() { return [plot.scales.x.min, plot.scales.x.max, plot.scales.y.min, plot.scales.y.max]; }
    // Zooms by factors about a place given as shares of the plot area, then shifts by shares of it.
    function change(fx, fy, px, py, dx, dy) {
      var c = current();
      function one(lo, hi, f, p, d, axis) {
        var a = to(lo, axis), b = to(hi, axis), m = a + p * (b - a), s = (b - a) * f;
        a = m - p * s - d * s;
        return [from(a, axis), from(a + s, axis)];
      }
      var x = one(c[0], c[1], fx, px, dx, data.x), y = one(c[2], c[3], fy, py, dy, data.y);
      show([x[0], x[1], y[0], y[1]]);
    }

    function draw(u) {
      var g = u.ctx, k = u.pxRatio || devicePixelRatio || 1, b = u.bbox;
      function X(v) { return u.valToPos(v, "x", true); }
      function Y(v) { return u.valToPos(v, "y", true); }
      g.save(); g.beginPath(); g.rect(b.left, b.top, b.width, b.height); g.clip();
      g.lineJoin = "round"; g.lineCap = "round";
      data.series.forEach(function (s, i) {
        if (!shown[i]) return;
        var colour = variable(s.role), n = s.x.length, j;
        g.strokeStyle = g.fillStyle = colour; g.lineWidth = 1.6 * k; g.globalAlpha = 1;
        g.setLineDash(s.dashed ? [6 * k, 4 * k] : []);
        function curve(y, steps) {
          var pen = false, old = 0;
          g.beginPath();
          for (j = 0; j < n; j++) {
            if (s.x[j] == null || y[j] == null) { pen = false; continue; }
            var px = X(s.x[j]), py = Y(y[j]);
            if (!pen) g.moveTo(px, py);
            else { if (steps) g.lineTo(px, old); g.lineTo(px, py); }
            old = py; pen = true;
          }
          g.stroke();
        }
        function disc(r) {
          g.beginPath();
          for (j = 0; j < n; j++) if (s.x[j] != null && s.y[j] != null) {
            var px = X(s.x[j]), py = Y(s.y[j]);
            g.moveTo(px + r, py); g.arc(px, py, r, 0, 6.2832);
          }
          g.fill();
        }
        if (s.shape === "line" || s.shape === "steps") curve(s.y, s.shape === "steps");
        else if (s.shape === "points") { g.globalAlpha = 0.75; disc(2.2 * k); }
        else if (s.shape === "band") {
          var run = [];
          g.globalAlpha = 0.2;
          for (j = 0; j <= n; j++) {
            if (j < n && s.x[j] != null && s.low[j] != null && s.high[j] != null) { run.push(j); continue; }
            if (run.length) {
              g.beginPath();
              run.forEach(function (q) { g.lineTo(X(s.x[q]), Y(s.high[q])); });
              run.reverse().forEach(function (q) { g.lineTo(X(s.x[q]), Y(s.low[q])); });
              g.closePath(); g.fill();
            }
            run = [];
          }
          g.globalAlpha = 1;
          if (s.y.length) curve(s.y, false);
        } else if (s.shape === "bars") {
          g.globalAlpha = 0.85;
          var base = data.y.log ? b.top + b.height : Y(0);
          for (j = 0; j < n; j++) if (s.x[j] != null && s.y[j] != null) {
            var l = X(s.x[j] + s.offset - s.width / 2), r = X(s.x[j] + s.offset + s.width / 2), t = Y(s.y[j]);
            g.fillRect(l, Math.min(t, base), r - l, Math.abs(base - t));
          }
        } else if (s.shape === "errors") {
          g.lineWidth = 1.3 * k; g.beginPath();
          for (j = 0; j < n; j++) if (s.x[j] != null && s.y[j] != null && s.high[j] != null) {
            var c = X(s.x[j]), hi = Y(s.high[j]), lo = s.low[j] == null ? b.top + b.height : Y(s.low[j]), w = 4 * k;
            g.moveTo(c, lo); g.lineTo(c, hi); g.moveTo(c - w, lo); g.lineTo(c + w, lo); g.moveTo(c - w, hi); g.lineTo(c + w, hi);
          }
          g.stroke(); disc(3 * k);
        }
      });
      g.restore();
      marks(u, g, k, b, X, Y);
    }
    function marks(u, g, k, b, X, Y) {
      var ink = variable("marker"), paper = variable("card"), rows = [], taken = [];
      // A label leaves neither the plot nor crosses the line of another marker, if the left of its own line is free of both.
      function leftwards(p, w) {
        function crossed(from, to) {
          return data.markers.some(function (m) { var q = m.vertical && X(m.at); return m.vertical && q !== p && q > from && q < to; });
        }
        return p + w > b.left + b.width || crossed(p, p + w) && p - w > b.left && !crossed(p - w, p);
      }
      g.save(); g.font = FONT.replace("12px", 12 * k + "px"); g.lineJoin = "round";
      data.markers.forEach(function (m) {
        var p = m.vertical ? X(m.at) : Y(m.at), w = g.measureText(m.label).width, x, y;
        if (m.vertical ? p < b.left || p > b.left + b.width : p < b.top || p > b.top + b.height) return;
        g.strokeStyle = ink; g.lineWidth = 1.1 * k; g.setLineDash([2 * k, 3 * k]); g.beginPath();
        if (m.vertical) {
          g.moveTo(p, b.top); g.lineTo(p, b.top + b.height);
          x = p + 6 * k; if (leftwards(p, w + 10 * k)) x = p - 6 * k - w;
          var row = 0;
          while ((rows[row] || (rows[row] = [])).some(function (q) { return x < q[1] && q[0] < x + w; })) row++;
          rows[row].push([x, x + w]); y = b.top + (13 + 16 * row) * k;
        } else {
          g.moveTo(b.left, p); g.lineTo(b.left + b.width, p);
          var up = p - 18 * k > b.top;
          x = b.left + b.width - w - 4 * k; y = up ? p - 5 * k : p + 15 * k;
          while (taken.some(function (q) { return Math.abs(q - y) < 13 * k; })) y += (up ? -13 : 13) * k;
          taken.push(y);
        }
        g.stroke(); g.setLineDash([]);
        g.strokeStyle = paper; g.lineWidth = 3 * k; g.textAlign = "left"; g.textBaseline = "alphabetic";
        g.strokeText(m.label, x, y); g.fillStyle = ink; g.fillText(m.label, x, y);
      });
      g.restore();
    }

    // The sample nearest to the cursor: along x where x grows, else in the plane.
    var forward = data.series.map(function (s) {
      if (s.shape === "points") return false;
      for (var j = 1; j < s.x.length; j++) if (s.x[j] == null || s.x[j - 1] == null || s.x[j] < s.x[j - 1]) return false;
      return true;
    });
    function nearest(u, i, left, top) {
      var s = data.series[i], best = -1, least = Infinity;
      for (var j = 0; j < s.x.length; j++) {
        var v = s.y.length ? s.y[j] : s.high[j];
        if (s.x[j] == null || v == null) continue;
        var dx = u.valToPos(s.x[j] + s.offset, "x") - left, d = Math.abs(dx);
        if (!forward[i]) { var dy = u.valToPos(v, "y") - top; d = Math.sqrt(dx * dx + dy * dy); }
        if (d < least) { least = d; best = j; }
      }
      return best;
    }
    function cursor(u) {
      var left = u.cursor.left, top = u.cursor.top;
      var at = left >= 0 ? u.posToVal(left, "x") : null, unit = /\(([^()]*)\)$/.exec(data.x.title);
      place.textContent = at == null ? "" : data.x.names.length ? data.x.names[Math.round(at)] || ""
        : "at " + reading(at, u.scales.x.max - u.scales.x.min, data.x.log) + (unit ? " " + unit[1] : "");
      data.series.forEach(function (s, i) {
        var dot = dots[i], j = left >= 0 && shown[i] ? nearest(u, i, left, top) : -1;
        if (j < 0) { dot.style.display = "none"; values[i].textContent = ""; return; }
        var span = u.scales.y.max - u.scales.y.min, v = s.y.length ? s.y[j] : null;
        var text = s.shape === "band" ? reading(s.low[j], span, data.y.log) + " … " + reading(s.high[j], span, data.y.log)
          : reading(v, span, data.y.log);
        if (s.shape === "errors") text += " ± " + reading((s.high[j] - s.low[j]) / 2, span, data.y.log);
        values[i].textContent = text;
        if (v == null) { dot.style.display = "none"; return; }
        var x = u.valToPos(s.x[j] + s.offset, "x"), y = u.valToPos(v, "y");
        var inside = x >= 0 && y >= 0 && x <= u.over.clientWidth && y <= u.over.clientHeight;
        dot.style.display = inside ? "block" : "none";
        dot.style.left = x + "px"; dot.style.top = y + "px"; dot.style.background = variable(s.role);
      });
    }

    function axis(which, room) {
      // From the whole figure's size: that of the plot area is not known before the ticks are.
      function count(u) {
        var length = which === "x" ? u.width - 70 : u.height - 36;
        return Math.max(2, Math.min(12, Math.floor(length / room)));
      }
      return {
        scale: which, stroke: function () { return variable("quiet"); }, font: FONT, gap: 6,
        grid: { stroke: function () { return variable("grid"); }, width: 1 },
        ticks: { show: false }, border: { show: true, stroke: function () { return variable("axis"); }, width: 1 },
        splits: function (u, i, lo, hi) {
          return ticks(data[which], lo, hi, count(u)).map(function (t) { return t[0]; });
        },
        filter: function (u, s) { return s; },
        values: function (u, splits) {
          var sc = u.scales[which], all = ticks(data[which], sc.min, sc.max, count(u));
          return splits.map(function (v, i) { return all[i] ? all[i][1] : ""; });
        },
        size: which === "x" ? 28 : function (u, texts) {
          var g = u.ctx, widest = 0, k = devicePixelRatio || 1;
          g.save(); g.font = FONT.replace("12px", 12 * k + "px");
          (texts || []).forEach(function (t) { widest = Math.max(widest, g.measureText(t || "").width / k); });
          g.restore();
          return Math.max(30, Math.ceil(widest) + 12);
        }
      };
    }

    function make() {
      // Before its size is asked for: what is not displayed has none.
      root.classList.add("is-live");
      var s = size();
      function scale(which) {
        return { time: false, auto: false, distr: data[which].log ? 3 : 1, log: 10, range: function (u, lo, hi) { return [lo, hi]; } };
      }
      plot = new uPlot({
        width: s.width, height: s.height, padding: [8, 14, 0, 0],
        scales: { x: scale("x"), y: scale("y") }, axes: [axis("x", 62), axis("y", 36)],
        series: [{}, { scale: "y", show: true, paths: function () { return null; }, points: { show: false } }],
        legend: { show: false },
        cursor: {
          y: false, points: { show: false }, bind: { dblclick: function () { return function () { show(home); return null; }; } },
          drag: { x: true, y: true, uni: 24, dist: 6, setScale: false }
        },
        hooks: {
          draw: [draw], setCursor: [cursor],
          setSelect: [function (u) {
            var r = u.select, c = current();
            if (r.width < 4 && r.height < 4) return;
            var x = r.width >= 4 ? [u.posToVal(r.left, "x"), u.posToVal(r.left + r.width, "x")] : [c[0], c[1]];
            var y = r.height >= 4 ? [u.posToVal(r.top + r.height, "y"), u.posToVal(r.top, "y")] : [c[2], c[3]];
            u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            show([x[0], x[1], y[0], y[1]]);
          }]
        }
      }, [[home[0], home[1]], [home[2], home[3]]], box);
      data.series.forEach(function () {
        var d = document.createElement("div"); d.className = "dot"; plot.over.appendChild(d); dots.push(d);
      });
      show(home);
      again();
      hands(plot.over);
    }

    // Fingers: two zoom, one moves sideways where zoomed; up and down remain the page's.
    function hands(over) {
      var old = null, tap = 0;
      function state(e) {
        var r = over.getBoundingClientRect(), t = e.touches, a = t[0], b = t[1] || t[0];
        return { n: t.length, x: (a.clientX + b.clientX) / 2 - r.left, y: (a.clientY + b.clientY) / 2 - r.top,
          d: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), w: r.width, h: r.height };
      }
      over.addEventListener("touchstart", function (e) {
        old = state(e);
        if (old.n === 2) e.preventDefault();
        if (old.n === 1) {
          if (e.timeStamp - tap < 300) { show(home); e.preventDefault(); }
          tap = e.timeStamp;
        }
      }, { passive: false });
      over.addEventListener("touchmove", function (e) {
        var now = state(e);
        if (!old || now.n !== old.n) { old = now; return; }
        var dx = now.x - old.x, dy = now.y - old.y;
        if (now.n === 2) {
          e.preventDefault();
          var f = now.d > 10 && old.d > 10 ? old.d / now.d : 1;
          change(f, f, now.x / now.w, 1 - now.y / now.h, dx / now.w, -dy / now.h);
        } else if (root.classList.contains("is-zoomed") && Math.abs(dx) > Math.abs(dy)) {
          if (e.cancelable) e.preventDefault();
          change(1, 1, 0.5, 0.5, dx / now.w, 0);
        }
        tap = 0; old = now;
      }, { passive: false });
      over.addEventListener("touchend", function () { old = null; });
      over.addEventListener("wheel", function (e) {
        if (!e.ctrlKey && !e.shiftKey) return;
        e.preventDefault();
        var r = over.getBoundingClientRect(), f = Math.exp(Math.max(-0.5, Math.min(0.5, (e.deltaY || e.deltaX) * 0.004)));
        change(f, e.shiftKey ? 1 : f, (e.clientX - r.left) / r.width, 1 - (e.clientY - r.top) / r.height, 0, 0);
      }, { passive: false });
    }
    live.addEventListener("keydown", function (e) {
      if (!plot || e.ctrlKey || e.metaKey || e.altKey) return;
      var move = { "+": [0.7, 0], "=": [0.7, 0], "-": [1 / 0.7, 0], ArrowLeft: [1, 0.15], ArrowRight: [1, -0.15] }[e.key];
      if (e.key === "0" || e.key === "Escape") show(home);
      else if (move) change(move[0], 1, 0.5, 0.5, move[1], 0);
      else return;
      e.preventDefault();
    });

    this.fit = function () {
      if (!live.parentNode.clientWidth) return;
      if (!plot) { make(); return; }
      var s = size();
      if (s.width !== plot.width || s.height !== plot.height) { plot.setSize(s); again(); }
    };
    this.redraw = function () { if (plot) plot.redraw(false, true); };
  }

  var figures = [];
  Array.prototype.forEach.call(document.querySelectorAll("figure"), function (root) {
    if (!root.querySelector("script.data")) return;
    var figure = new Figure(root);
    figures.push(figure);
    // Figures in closed folds have no width yet: they are made when unfolded.
    if (window.ResizeObserver) new ResizeObserver(function () { requestAnimationFrame(figure.fit); }).observe(root);
    figure.fit();
  });
  if (window.matchMedia) {
    var dark = matchMedia("(prefers-color-scheme: dark)");
    if (dark.addEventListener) dark.addEventListener("change", function () { figures.forEach(function (f) { f.redraw(); }); });
  }

  // Paper shows what is folded; afterwards the folds are as before.
  var closed = [];
  window.addEventListener("beforeprint", function () {
    closed = Array.prototype.filter.call(document.querySelectorAll("details"), function (d) { return !d.open; });
    closed.forEach(function (d) { d.open = true; });
  });
  window.addEventListener("afterprint", function () { closed.forEach(function (d) { d.open = false; }); });

  // The table of contents shows where the reader is.
  var links = {}, seen = {};
  Array.prototype.forEach.call(document.querySelectorAll(".toc a"), function (a) { links[a.getAttribute("href").slice(1)] = a; });
  if (window.IntersectionObserver) {
    var watch = new IntersectionObserver(function (entries) {
      entries.forEach(function (e) { seen[e.target.id] = e.isIntersecting; });
      var found = false;
      Object.keys(links).forEach(function (id) {
        var here = !found && !!seen[id];
        links[id].classList.toggle("here", here);
        found = found || here;
      });
    }, { rootMargin: "-5% 0px -60% 0px" });
    Array.prototype.forEach.call(document.querySelectorAll("main > section"), function (s) { if (links[s.id]) watch.observe(s); });
  }
})();
