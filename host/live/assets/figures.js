// Figures over time that share their view and their cursors.
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
const colours = {};
function colour(name) {
  return colours[name] || (colours[name] = getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim());
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const name in colours) delete colours[name];
  figures.forEach(f => f.recolour());
});

const figures = [];
const view = { length: 10, end: null, from: 0, to: 10, cursors: [null, null], chosen: 0, hover: null };
let changed = true;

class Figure {
  // spec: title, unit, height, series [{name, colour, column, factor, dash, band}], least (smallest span), names, picture(a, b, pixels)
  constructor(parent, spec) {
    this.spec = spec;
    this.range = null;
    this.visible = true;
    this.root = document.createElement("figure");
    const caption = document.createElement("figcaption"), title = document.createElement("b");
    title.textContent = spec.title + " ";
    const unit = document.createElement("span");
    unit.className = "unit"; unit.textContent = spec.unit ? "(" + spec.unit + ")" : "";
    title.append(unit); caption.append(title);
    this.outputs = spec.series.filter(s => s.name).map(s => {
      const legend = document.createElement("span"), line = document.createElement("i"), value = document.createElement("output");
      legend.className = "legend"; line.style.background = "var(--" + s.colour + ")"; value.setAttribute("aria-live", "off");
      legend.append(line, s.name, value); caption.append(legend);
      return value;
    });
    this.note = document.createElement("span"); this.note.className = "unit"; caption.append(this.note);
    this.box = document.createElement("div"); this.box.className = "plot";
    this.root.append(caption, this.box);
    parent.append(this.root);
    this.make();
    new ResizeObserver(() => { this.plot.setSize(this.size()); changed = true; }).observe(this.box);
    new IntersectionObserver(seen => { this.visible = seen[seen.length - 1].isIntersecting; changed = true; }, { rootMargin: "100px" }).observe(this.root);
    figures.push(this);
  }
  size() { return { width: Math.max(this.box.clientWidth, 160), height: this.spec.height || 190 }; }
  make() {
    const spec = this.spec, axis = { stroke: () => colour("quiet"), font: FONT, grid: { stroke: () => colour("grid"), width: 1 }, ticks: { show: false }, gap: 4 };
    // The fewest digits that show the step between two ticks exactly.
    const digits = splits => {
      const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) : 0.01;
      let d = 0;
      while (d < 9 && Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) > 1e-6 * step * 10 ** d) d++;
      return d;
    };
    this.plot = new uPlot({
      ...this.size(), padding: [8, 10, 0, 0], legend: { show: false }, pxAlign: 0,
      scales: { x: { time: false, auto: false, range: (u, a, b) => [a, b] }, y: { auto: false, range: (u, a, b) => [a, b] } },
      axes: [
        { ...axis, space: 64, size: 26, values: (u, s) => s.map(v => fixed(v, digits(s)) + (v === s[s.length - 1] ? " s" : "")) },
        { ...axis, space: 26, size: spec.names ? 74 : 62, splits: spec.names ? () => spec.names.map((_, i) => i) : undefined,
          values: (u, s) => spec.names ? spec.names : s.map(v => fixed(v, digits(s))) }
      ],
      series: [{}].concat(spec.series.map(s => ({
        stroke: () => s.band ? "transparent" : colour(s.colour), width: 1.4, dash: s.dash, points: { show: false }, spanGaps: false,
        paths: s.steps ? uPlot.paths.stepped({ align: 1 }) : undefined
      }))),
      bands: spec.bands ? spec.bands.map(b => ({ series: b.series, fill: () => colour(b.colour) + "33" })) : undefined,
      cursor: { sync: { key: "rig" }, y: false, points: { show: false }, drag: { x: true, y: false, dist: 6, setScale: false },
        bind: { dblclick: () => () => { follow(); return null; } } },
      hooks: {
        draw: [u => this.lines(u)],
        setCursor: [u => { if (u.cursor.event || u.cursor.left < 0) { view.hover = u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null; } }],
        setSelect: [u => {
          const s = u.select;
          if (s.width > 5) show(u.posToVal(s.left, "x"), u.posToVal(s.left + s.width, "x"));
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }]
      }
    }, [[0, 1]].concat(spec.series.map(() => [null, null])), this.box);
    this.hands(this.plot.over);
  }
  recolour() { this.plot.redraw(false, true); changed = true; }
  // The two cursors, and what a figure draws besides.
  lines(u) {
    const k = devicePixelRatio || 1, g = u.ctx;
    g.save();
    if (this.spec.draw) this.spec.draw(u, g, k);
    view.cursors.forEach((t, i) => {
      if (t == null || t < view.from || t > view.to) return;
      const x = u.valToPos(t, "x", true);
      g.strokeStyle = g.fillStyle = colour("ink"); g.lineWidth = k; g.setLineDash(i ? [5 * k, 3 * k] : []);
      g.beginPath(); g.moveTo(x, u.bbox.top); g.lineTo(x, u.bbox.top + u.bbox.height); g.stroke();
      g.font = FONT.replace("12px", "bold " + 12 * k + "px"); g.textAlign = "left"; g.textBaseline = "top";
      g.fillText("AB"[i], x + 3 * k, u.bbox.top);
    });
    g.restore();
  }
  draw() {
    if (!this.visible) return;
    const pixels = Math.max(100, Math.round(this.plot.bbox.width / (devicePixelRatio || 1)));
    const data = this.spec.picture(view.from, view.to, pixels);
    if (!this.spec.names) this.fit(data);
    const u = this.plot;
    u.batch(() => {
      u.setData(data, false);
      u.setScale("x", { min: view.from, max: view.to });
      u.setScale("y", this.spec.names ? { min: -0.6, max: this.spec.names.length - 0.4 } : { min: this.range[0], max: this.range[1] });
    });
  }
  // Widens the range at once and narrows it when half of it is empty, so that it does not breathe.
  fit(data) {
    let low = Infinity, high = -Infinity;
    for (let i = 1; i < data.length; i++) {
      for (const v of data[i]) if (v != null) { if (v < low) low = v; if (v > high) high = v; }
    }
    if (!(low <= high)) { low = 0; high = 0; }
    const span = Math.max(high - low, this.spec.least), middle = (low + high) / 2, old = this.range;
    low = Math.min(low, middle - span / 2); high = Math.max(high, middle + span / 2);
    if (!old || low < old[0] || high > old[1] || span < 0.55 * (old[1] - old[0])) this.range = [low - 0.1 * span, high + 0.1 * span];
  }
  // Click and tap place a cursor, the wheel and two fingers zoom; one finger up and down scrolls the page.
  hands(over) {
    let down = null, pinch = null;
    const time = x => this.plot.posToVal(x - over.getBoundingClientRect().left, "x");
    over.addEventListener("pointerdown", e => { down = [e.clientX, e.clientY]; });
    over.addEventListener("click", e => {
      if (!down || Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 5) return;
      place(e.shiftKey ? 1 : view.chosen, time(e.clientX));
    });
    over.addEventListener("wheel", e => {
      if (!e.ctrlKey && !e.shiftKey) return;
      e.preventDefault();
      const turn = e.deltaY || e.deltaX;
      if (e.shiftKey) pan(turn / 900); else zoom(Math.exp(Math.max(-0.5, Math.min(0.5, turn * 0.004))), time(e.clientX));
    }, { passive: false });
    const state = e => ({ n: e.touches.length, x: (e.touches[0].clientX + e.touches[e.touches.length - 1].clientX) / 2,
      d: Math.abs(e.touches[0].clientX - e.touches[e.touches.length - 1].clientX) });
    over.addEventListener("touchstart", e => { pinch = state(e); if (pinch.n === 2) e.preventDefault(); }, { passive: false });
    over.addEventListener("touchmove", e => {
      const now = state(e);
      if (pinch && now.n === 2 && pinch.n === 2) {
        e.preventDefault();
        if (now.d > 10 && pinch.d > 10) zoom(pinch.d / now.d, time(now.x));
        pan((pinch.x - now.x) / over.clientWidth);
      }
      pinch = now;
    }, { passive: false });
  }
  read(values) { this.outputs.forEach((o, i) => { o.textContent = values[i]; }); }
}

// Changes of the view. Every one but `follow` stops the scrolling.
function show(from, to) {
  const length = Math.max(to - from, 0.005);
  view.length = length; view.end = from + length; changed = true; viewChanged();
}
function zoom(factor, around) { show(around - (around - view.from) * factor, around + (view.to - around) * factor); }
function pan(share) { const d = share * (view.to - view.from); show(view.from + d, view.to + d); }
function follow() {
  view.end = null;
  if (![2, 10, 60, 600].includes(view.length)) view.length = 10;
  changed = true; viewChanged();
}
function place(which, time) { view.cursors[which] = time; changed = true; viewChanged(); }
