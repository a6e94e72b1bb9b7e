// The connection, the controls and the loop that draws.
const $ = id => document.getElementById(id);
const still = matchMedia("(prefers-reduced-motion: reduce)");
if (location.search.includes("token=")) history.replaceState(null, "", location.pathname);

let ring = null, hello = null, status = null, socket = null, estimates = [], missed = 0, orders = 0, waiting = {};
let stopAsked = null, stopCount = 0, shown = "";
// Read by the browser test.
const live = window.rigLive = { received: 0, missed: 0, unordered: 0, draws: 0, drawTime: 0, worstDraw: 0, behind: 0, get status() { return status; }, get ring() { return ring; }, get view() { return view; } };

function open() {
  const scheme = location.protocol === "https:" ? "wss://" : "ws://";
  socket = new WebSocket(scheme + location.host + "/live");
  socket.binaryType = "arraybuffer";
  socket.onmessage = e => typeof e.data === "string" ? take(JSON.parse(e.data)) : packet(e.data);
  socket.onclose = () => {
    const ended = status && status.ended;
    status = null; waiting = {};
    mode("no connection", "offline");
    alarm(ended || "There is no connection to rig live. The rig stops by itself if the program has ended; the page connects again.");
    controls();
    setTimeout(open, 1000);
  };
}

function take(message) {
  if (message.op === "hello") { begin(message); return; }
  if (message.op === "status") { told(message); return; }
  if (message.op === "missed") { missed = live.missed = message.total; return; }
  const done = waiting[message.id];
  delete waiting[message.id];
  say(message.text, !message.ok);
  $("shifted").hidden = !message.shift;
  if (done) done(message);
  controls();
}

function packet(buffer) {
  const head = new DataView(buffer), count = head.getUint32(4, true), values = new Float64Array(buffer, 16);
  if (head.getUint32(0, true) === 2) {
    estimates.push(values);
    if (estimates.length > 12000) estimates.splice(0, 2000);
    return;
  }
  if (!ring) return;
  const n = hello.columns.length, row = new Array(n + 2);
  for (let k = 0; k < count; k++) {
    for (let c = 0; c < n; c++) row[c] = values[c * count + k];
    row[n] = row[Q.ref1] - row[Q.q1];
    row[n + 1] = row[Q.i1] * hello.torque_per_ampere;
    if (ring.count && row[0] <= ring.at(0, ring.count - 1)) live.unordered++;
    ring.push(row);
  }
  live.received += count;
  live.last = performance.now();
  changed = true;
}

const Q = {};
function begin(message) {
  hello = message;
  $("source").textContent = message.source + ", " + message.sample_rate + " samples/s";
  message.columns.forEach((name, i) => { Q[name] = i; });
  Q.error = message.columns.length; Q.torque = Q.error + 1;
  estimates = [];
  if (ring) { ring.count = 0; live.received = 0; live.missed = missed = 0; view.cursors = [null, null]; }
  else { ring = new Ring(message.columns.concat("error", "torque")); ring.period = 1 / message.sample_rate; build(); }
  alarm("");
}

function build() {
  const samples = columns => (from, to, pixels) => ring.picture(columns, ring.find(from) - 1, ring.find(to) + 1, pixels);
  const scaled = (columns, factor) => {
    const draw = samples(columns);
    return (from, to, pixels) => draw(from, to, pixels).map((c, i) => i ? c.map(v => v == null ? v : v * factor) : c);
  };
  const make = (title, unit, least, series, factor) => new Figure($("figures"), { title, unit, least, factor: factor || 1, columns: series.map(s => s[1]),
    series: series.map(s => ({ name: s[0], colour: s[2], dash: s[3] })), picture: factor ? scaled(series.map(s => s[1]), factor) : samples(series.map(s => s[1])) });
  make("Position", "rad", 0.02, [["position", Q.q1, "measured"], ["reference", Q.ref1, "model", [6, 3]]]);
  make("Tracking error", "mrad", 0.5, [["reference - position", Q.error, "residual"]], 1000);
  make("Current", "A", 0.1, [["motor current", Q.i1, "measured"]]);
  make("Torque at the joint", "N·m", 0.1, [["by current", Q.torque, "measured"], ["command", Q.tau_cmd1, "model"]]);
  make("Velocity", "rad/s", 0.05, [["estimated by the rig", Q.qd1, "measured"]]);
  make("Voltage", "V", 0.5, [["motor voltage", Q.u1, "measured"]]);
  const bars = hello.limits, names = bars.map(l => l[1]).concat(hello.modes), base = bars.length;
  new Figure($("figures"), { title: "Mode and limits", unit: "", height: 230, names, columns: [Q.mode],
    series: [{ name: "mode", colour: "measured", steps: true }],
    picture: (from, to, pixels) => { const p = samples([Q.mode])(from, to, pixels); p[1] = p[1].map(v => v == null ? v : v + base); return p; },
    draw: (u, g, k) => {
      const p = ring.picture([Q.limits], ring.find(view.from), ring.find(view.to), 400);
      g.fillStyle = colour("residual");
      bars.forEach(([bit], row) => p[0].forEach((t, i) => {
        if (!(p[1][i] & bit)) return;
        const x = u.valToPos(t, "x", true), next = i + 1 < p[0].length ? u.valToPos(p[0][i + 1], "x", true) : x + k;
        g.fillRect(x, u.valToPos(row + 0.3, "y", true), Math.max(next - x, 2 * k), u.valToPos(row - 0.3, "y", true) - u.valToPos(row + 0.3, "y", true));
      }));
    } });
  figures[figures.length - 1].mode = true;
  figures[figures.length - 1].root.classList.add("wide");
  const meanings = { J: "inertia J", gc: "gravity gc", gs: "gravity gs", fv: "viscous friction fv", fc: "Coulomb friction fc", off: "constant torque off" };
  const count = hello.parameters.length;
  hello.parameters.forEach((name, i) => {
    const known = hello.described ? hello.described[i] : null;
    new Figure($("parameters"), { title: meanings[name] || name, unit: hello.parameter_units[i].replace("*", "·").replace("*", "·").replace("^2", "²"), height: 150, parameter: i,
      least: Math.max(1e-3, 0.05 * Math.abs(known || 0)),
      series: [{ name: "estimate", colour: "measured" }, { colour: "measured", band: true }, { colour: "measured", band: true }, { colour: "reference", dash: [4, 4] }],
      bands: [{ series: [3, 2], colour: "measured" }],
      picture: (from, to, pixels) => {
        let a = estimates.length; while (a > 0 && estimates[a - 1][0] >= from) a--;
        const step = Math.max(1, Math.ceil((estimates.length - a) / pixels)), out = [[], [], [], [], []];
        for (let k = Math.max(0, a - 1); k < estimates.length; k += step) {
          const e = estimates[k], v = e[2 + i], s = 2 * e[2 + count + i];
          if (e[0] > to) break;
          out[0].push(e[0]); out[1].push(v); out[2].push(v - s); out[3].push(v + s); out[4].push(known);
        }
        return out;
      } });
  });
  const rows = [["t", "s", 0, 1]];
  figures.forEach(f => f.spec.columns && !f.mode && f.spec.series.forEach((s, i) =>
    rows.push([f.spec.series.length > 1 ? (f.spec.unit === "N·m" ? "torque " : "") + s.name : f.spec.title.toLowerCase(), f.spec.unit, f.spec.columns[i], f.spec.factor])));
  rows.forEach(r => {
    const tr = document.createElement("tr"), th = document.createElement("th");
    th.scope = "row"; th.textContent = r[0] + " (" + r[1] + ")"; tr.append(th);
    for (let i = 0; i < 3; i++) tr.append(document.createElement("td"));
    tr.spec = r; $("cursor-rows").append(tr);
  });
  viewChanged();
}

function told(now) {
  const before = status;
  status = now;
  if (!before || before.mode !== now.mode) mode(now.mode, now.mode);
  if (!before || before.fault !== now.fault || before.ended !== now.ended) alarm(now.ended || now.fault || "");
  if (now.notice && (!before || before.notice !== now.notice)) say(now.notice, true);
  // A stop from before this page was opened is not its news, nor is one before the rig was armed again.
  if (!before) { stopCount = now.stop.count; shown = now.stop.phase; }
  if (before && before.mode === "disarmed" && now.mode === "holding" && !stopAsked) stopSay("");
  stopTold(now.stop);
}

function stopTold(stop) {
  if (stop.count === 0 || (stop.count === stopCount && stop.phase === shown)) return;
  stopCount = stop.count; shown = stop.phase;
  if (stop.phase !== "sent") stopAsked = null;
  const ms = v => fixed(v, 1) + " ms";
  const text = { sent: "Stop is sent; the board has not answered yet.",
    confirmed: "The board has confirmed the stop (" + ms(stop.answer_ms || 0) + "); the link comes to rest.",
    off: "Stopped: the board has confirmed that the bridge is off (" + ms(stop.off_ms || 0) + " after the stop).",
    failed: "THE BOARD HAS NOT CONFIRMED THE STOP. Cut the supply." }[stop.phase];
  stopSay(text || "", stop.phase === "failed");
}
function stopSay(text, bad) { $("stop-state").textContent = text; $("stop-state").classList.toggle("bad", !!bad); }

// Stop goes first and past everything else; without the socket it goes by a request of its own.
function stop() {
  const asked = stopAsked = performance.now();
  stopSay("Stop is being sent …");
  if (socket && socket.readyState === 1) socket.send('{"op":"stop"}');
  else fetch("/stop", { method: "POST" }).catch(() => stopSay("STOP COULD NOT BE SENT: there is no connection. Cut the supply.", true));
  setTimeout(() => { if (stopAsked === asked) stopSay("THE BOARD HAS NOT CONFIRMED THE STOP YET. Cut the supply if the link moves.", true); }, 500);
}

function order(op, more, done) {
  const id = ++orders;
  if (!socket || socket.readyState !== 1) { say("There is no connection to rig live.", true); return; }
  waiting[id] = done || (() => {});
  $("shifted").hidden = true;
  socket.send(JSON.stringify({ op, id, ...more }));
}

async function load(file) {
  if (!file) return;
  try {
    const answer = await fetch("/motion?name=" + encodeURIComponent(file.name), { method: "POST", body: file });
    const text = (await answer.text()).trim();
    say(answer.status === 413 ? file.name + " is larger than 1 MiB; a trajectory file is not." : text, !answer.ok);
  } catch (error) { say(file.name + " could not be sent: " + error.message + ".", true); }
}

function mode(text, kind) { const m = $("mode"); m.textContent = text; m.className = "pill " + kind; }
function alarm(text) { const a = $("alarm"); if (a.textContent !== text) a.textContent = text; a.hidden = !text; }
// A sentence about what was done goes by itself; one about what was refused stays.
let goes = 0;
function say(text, bad) {
  clearTimeout(goes);
  if (text && !bad) goes = setTimeout(say, 8000, "");
  $("message-text").textContent = text;
  $("message").hidden = !text; $("message").classList.toggle("bad", !!bad);
}

function put(id, text, warn) {
  const e = $(id);
  if (e.textContent !== text) e.textContent = text;
  if (e.parentNode.tagName === "DIV") e.parentNode.classList.toggle("warn", !!warn);
}
function controls() {
  const m = status ? status.mode : "";
  $("arm").disabled = m !== "disarmed";
  $("start").disabled = m !== "holding" || !status.motion;
  $("start").title = m === "holding" ? (status.motion ? "" : "Load a motion file first") : "Arm the rig first";
  $("clear").hidden = m !== "fault";
  $("record").disabled = !status;
  const recording = status && status.recording;
  $("record").setAttribute("aria-pressed", String(!!recording));
  $("record").textContent = recording ? "End recording" : "Record";
  if (!status) return;
  const motion = status.motion;
  put("motion", motion ? motion.file + ", " + fixed(motion.duration, 1) + "\u00a0s" : "none");
  put("recording", recording ? recording.file + ": " + recording.samples + " samples, " + recording.missing + " missing" : "off");
  const acting = hello ? hello.limits.filter(l => status.limits & l[0]).map(l => l[1]) : [];
  put("limits", acting.join(", ") || "none", acting.length);
  const slow = status.speed != null && status.speed < 0.97;
  put("samples", String(live.received) + (slow ? " (" + fixed(100 * status.speed, 0) + " % of real time)" : ""), slow);
  put("lost", status.missing || status.bad_frames ? status.missing + " samples in " + status.gaps + " gaps, " + status.bad_frames + " bad frames" : "none", status.missing || status.bad_frames);
  put("missed", missed ? missed + " samples" : "none", missed);
}

function viewChanged() {
  const paused = view.end != null;
  $("pause").setAttribute("aria-pressed", String(paused));
  $("pause").textContent = paused ? "Go on" : "Pause";
  document.querySelectorAll("[data-window]").forEach(b => b.setAttribute("aria-pressed", String(+b.dataset.window === view.length)));
  $("cursor-a").setAttribute("aria-pressed", String(view.chosen === 0));
  $("cursor-b").setAttribute("aria-pressed", String(view.chosen === 1));
  $("cursors").hidden = view.cursors[0] == null && view.cursors[1] == null;
}

// Which rows the estimator has used, and why it learns nothing.
function learning() {
  const e = estimates[estimates.length - 1];
  if (!e) { $("learning").textContent = ""; return; }
  const [used, masked, uninformative, state] = e.slice(-4), all = used + masked + uninformative;
  $("learning").textContent = (state ? "Nothing is learnt now: " + hello.learning[state] + ". " : "The estimator learns. ") +
    used + " of " + all + " rows used; " + masked + " left out, because the model does not describe them; " + uninformative + " showed nothing new.";
}

function readings() {
  learning();
  if (!ring || !ring.count) return;
  const at = view.hover != null ? view.hover : view.end != null ? view.to : Infinity, k = ring.nearest(at);
  $("place").textContent = (view.hover != null ? "at " : "t = ") + fixed(ring.at(0, k), 3) + " s";
  figures.forEach(f => {
    if (f.mode) f.read([hello.modes[ring.at(Q.mode, k)] || ""]);
    else if (f.spec.columns) {
      const digits = Math.max(0, Math.ceil(3.2 - Math.log10(f.range ? f.range[1] - f.range[0] : 1)));
      f.read(f.spec.columns.map(c => fixed(ring.at(c, k) * f.spec.factor, digits)));
    }
    else {
      const e = estimates[estimates.length - 1], i = f.spec.parameter, n = hello.parameters.length;
      if (!e) return;
      f.read([significant(e[2 + i], 4)]);
      f.note.textContent = "± " + significant(2 * e[2 + n + i], 2) + (e[2 + 2 * n + i] ? ", trusted" : ", not yet trusted");
    }
  });
  const places = view.cursors.map(t => t == null ? -1 : ring.nearest(t));
  if (!$("cursors").hidden) for (const tr of $("cursor-rows").children) {
    const [, , column, factor] = tr.spec, values = places.map(p => p < 0 ? null : ring.at(column, p) * factor);
    const show = v => v == null ? "-" : column ? significant(v, innerWidth < 640 ? 4 : 6) : fixed(v, 4);
    [values[0], values[1], values[0] == null || values[1] == null ? null : values[1] - values[0]].forEach((v, i) => { tr.children[i + 1].textContent = show(v); });
  }
}

let drawn = 0, read = 0;
function loop(now) {
  requestAnimationFrame(loop);
  if (now - read > (still.matches ? 500 : 150)) { read = now; readings(); controls(); }
  if (!changed || !ring || !ring.count || now - drawn < (still.matches && view.end == null ? 500 : 40)) return;
  drawn = now; changed = false;
  const start = performance.now(), newest = ring.at(0, ring.count - 1);
  view.to = view.end != null ? view.end : newest;
  view.from = view.to - view.length;
  figures.forEach(f => f.draw());
  live.draws++;
  const took = performance.now() - start;
  live.drawTime += took; live.worstDraw = Math.max(live.worstDraw, took);
}

function save(blob, name) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(blob); a.download = name; a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
function saveCsv() {
  if (!ring || !ring.count) return;
  const n = hello.columns.length, lines = [hello.columns.join(",")], a = ring.find(view.from), b = ring.find(view.to + 1e-9);
  for (let k = a; k < b; k++) { const row = []; for (let c = 0; c < n; c++) row.push(ring.at(c, k)); lines.push(row.join(",")); }
  save(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }), "live-view.csv");
  say((b - a) + " samples were saved as live-view.csv.");
}
function savePng() {
  const k = devicePixelRatio || 1, all = figures.filter(f => f.spec.columns), title = 24 * k;
  const width = Math.max(...all.map(f => f.plot.ctx.canvas.width)), height = all.reduce((sum, f) => sum + f.plot.ctx.canvas.height + title, 0);
  const canvas = document.createElement("canvas"), g = canvas.getContext("2d");
  canvas.width = width; canvas.height = height;
  g.fillStyle = colour("card"); g.fillRect(0, 0, width, height);
  let y = 0;
  all.forEach(f => {
    f.visible = true; f.draw();
    g.font = FONT.replace("12px", "bold " + 13 * k + "px"); g.textBaseline = "middle"; g.fillStyle = colour("ink");
    const named = f.spec.title + (f.spec.unit ? " (" + f.spec.unit + ")" : "");
    g.fillText(named, 8 * k, y + title / 2);
    let x = 24 * k + g.measureText(named).width;
    g.font = FONT.replace("12px", 12 * k + "px");
    f.spec.series.forEach(s => { g.fillStyle = colour(s.colour); g.fillText(s.name, x, y + title / 2); x += g.measureText(s.name).width + 14 * k; });
    g.drawImage(f.plot.ctx.canvas, 0, y + title);
    y += title + f.plot.ctx.canvas.height;
  });
  canvas.toBlob(blob => { save(blob, "live-view.png"); say("The figures were saved as live-view.png."); });
}

function togglePause() { if (view.end == null) { view.end = view.to; changed = true; viewChanged(); } else follow(); }
function length(seconds) { view.length = seconds; changed = true; viewChanged(); }
function choose(which) { view.chosen = which; if (view.cursors[which] == null) place(which, (view.from + view.to) / 2); viewChanged(); }
function clearCursors() { view.cursors = [null, null]; changed = true; viewChanged(); }

$("stop").onclick = stop;
$("arm").onclick = () => order("arm");
$("start").onclick = () => order("start");
$("shifted").onclick = () => order("start", { shifted: true });
$("clear").onclick = () => order("clear");
$("record").onclick = () => order("record", { on: !(status && status.recording) });
$("dismiss").onclick = () => say("");
$("keys").onclick = () => $("help").show();
$("help-close").onclick = () => { $("help").close(); $("keys").focus(); };
$("pause").onclick = togglePause;
$("cursor-a").onclick = () => { view.chosen = 0; viewChanged(); };
$("cursor-b").onclick = () => { view.chosen = 1; viewChanged(); };
$("cursor-off").onclick = clearCursors;
$("save-csv").onclick = saveCsv;
$("save-png").onclick = savePng;
$("file").onchange = e => { load(e.target.files[0]); e.target.value = ""; };
document.querySelectorAll("[data-window]").forEach(b => { b.onclick = () => length(+b.dataset.window); });

// Space and Escape stop, wherever the focus is; a button is pressed with Enter.
addEventListener("keydown", e => {
  if (e.key === " " || e.key === "Escape") {
    e.preventDefault(); e.stopPropagation();
    if (!e.repeat) stop();
    if (e.key === "Escape" && $("help").open) $("help").close();
    return;
  }
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const move = sign => {
    const step = (e.shiftKey ? 10 : 1) * (view.to - view.from) / 500, t = view.cursors[view.chosen];
    if (t == null) pan(sign * 0.15); else place(view.chosen, t + sign * step);
  };
  const keys = { "?": () => $("help").open ? $("help").close() : $("help").show(), p: togglePause, a: () => choose(0), b: () => choose(1), c: clearCursors, "0": follow,
    "1": () => length(2), "2": () => length(10), "3": () => length(60), "4": () => length(600),
    "+": () => zoom(0.7, (view.from + view.to) / 2), "-": () => zoom(1 / 0.7, (view.from + view.to) / 2),
    ArrowLeft: () => move(-1), ArrowRight: () => move(1) };
  if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
}, true);
addEventListener("keyup", e => { if (e.key === " ") { e.preventDefault(); e.stopPropagation(); } }, true);

addEventListener("dragover", e => { e.preventDefault(); document.body.classList.add("dropping"); });
addEventListener("dragleave", e => { if (!e.relatedTarget) document.body.classList.remove("dropping"); });
addEventListener("drop", e => { e.preventDefault(); document.body.classList.remove("dropping"); load(e.dataTransfer.files[0]); });

new ResizeObserver(() => document.documentElement.style.setProperty("--bar", document.querySelector(".controls").offsetHeight + "px")).observe(document.querySelector(".controls"));
open();
requestAnimationFrame(loop);
