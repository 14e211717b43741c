// SPDX-License-Identifier: Apache-2.0
"use strict";

const WINDOW_S = 20;
const RECONNECT_MS = 1000;
const COLORS = { blue: "#4ea1ff", orange: "#ffab40", green: "#4cd19a", violet: "#b79cff", quiet: "#8d9bab" };
const AXIS = { stroke: COLORS.quiet, grid: { stroke: "#222c38", width: 1 }, ticks: { stroke: "#222c38" } };

const TIME_AXIS = { ...AXIS, values: (_, seconds) => seconds.map((s) => `${s} s`) };

// One ring per message: columns that share their times.
class Ring {
  constructor(names) {
    this.names = names;
    this.data = [[], ...names.map(() => [])];
  }

  add(columns) {
    this.data[0].push(...columns.t);
    this.names.forEach((name, k) => this.data[k + 1].push(...columns[name]));
    const newest = this.data[0][this.data[0].length - 1];
    let old = 0;
    while (old < this.data[0].length && this.data[0][old] < newest - WINDOW_S) old++;
    // In pieces: moving the whole array at every batch would cost more than drawing it.
    if (old > 500) this.data.forEach((column) => column.splice(0, old));
  }
}

const rings = {
  INV_Status: new Ring(["TorqueCommanded", "TorqueEstimated", "Speed"]),
  INV_Currents: new Ring(["IdRef", "IqRef", "Id", "Iq"]),
  INV_Identification: new Ring(["PsiF", "Resistance"]),
  truth: new Ring(["Torque"]),
};

const stats = { batches: 0, draws: 0, rows: 0 }; // read by the browser test
window.fluxtrueStats = stats;
const $ = (id) => document.getElementById(id);
let socket = null;
let hello = null;
let dirty = false;
let batch = -1; // number of the newest one
let mine = false; // this page has asked for torque
let charts = [];

function line(label, stroke, options = {}) {
  return { label, stroke, width: 1.5, points: { show: false }, ...options };
}

function chart(id, height, series, data, range) {
  const figure = $(id);
  const plot = new uPlot({
    width: figure.clientWidth, height, series: [{ label: "s" }, ...series], legend: { live: false },
    cursor: { show: false }, axes: [TIME_AXIS, { ...AXIS, size: 56, space: 24 }],
    scales: { x: { time: false }, y: { range } },
  }, [[], ...series.map(() => [])], figure);
  new ResizeObserver(() => plot.setSize({ width: figure.clientWidth, height })).observe(figure);
  return { plot, data };
}

// At least so wide: noise of a resting value must not fill the picture.
function atLeast(span) {
  return (_, lo, hi) => {
    if (lo == null) return [-span / 2, span / 2];
    const margin = Math.max(span - (hi - lo), 0.08 * (hi - lo)) / 2;
    return [lo - margin, hi + margin];
  };
}

function columns(ring, ...names) {
  const { data } = rings[ring];
  return [data[0], ...names.map((name) => data[rings[ring].names.indexOf(name) + 1])];
}

// The plant's torque comes on its own times: joined for one picture.
function torqueData() {
  const drive = columns("INV_Status", "TorqueCommanded", "TorqueEstimated");
  if (!hello.stand.speed_rpm) return drive;
  return uPlot.join([drive, rings.truth.data]);
}

function makeCharts() {
  const torque = [line("commanded", COLORS.quiet, { dash: [6, 4] }), line("estimated", COLORS.blue)];
  if (hello.stand.speed_rpm) torque.push(line("shaft (simulated truth)", COLORS.orange, { spanGaps: true }));
  charts = [
    chart("chart-torque", 210, torque, torqueData, atLeast(20)),
    chart("chart-currents", 180, [line("i_d*", COLORS.quiet, { dash: [6, 4] }), line("i_q*", COLORS.quiet, { dash: [2, 3] }),
      line("i_d", COLORS.green), line("i_q", COLORS.violet)],
      () => columns("INV_Currents", "IdRef", "IqRef", "Id", "Iq"), atLeast(40)),
    chart("chart-psi", 150, [line("ψ̂", COLORS.orange)], () => columns("INV_Identification", "PsiF"), atLeast(10)),
    chart("chart-r", 150, [line("R̂", COLORS.green)], () => columns("INV_Identification", "Resistance"), atLeast(10)),
    chart("chart-speed", 120, [line("speed", COLORS.blue)], () => columns("INV_Status", "Speed"), atLeast(400)),
  ];
}

function draw() {
  if (dirty) {
    dirty = false;
    const times = rings.INV_Status.data[0];
    const newest = times.length ? times[times.length - 1] : 0;
    const oldest = Math.max(newest - WINDOW_S, Math.min(times[0] ?? 0, newest - 1));
    charts.forEach(({ plot, data }) => plot.batch(() => {
      plot.setData(data(), false);
      plot.setScale("x", { min: oldest, max: newest });
    }));
    stats.draws++;
    tellDrawn();
  }
  requestAnimationFrame(draw);
}

// The page's sign of life: what has arrived has been drawn. A page in the background draws nothing and says so.
function tellDrawn() {
  if (batch >= 0) send({ type: "drawn", batch, visible: !document.hidden });
}

function send(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function say(text) {
  $("message").textContent = text;
}

function badge(id, text, kind) {
  $(id).textContent = text;
  $(id).className = `badge ${kind}`;
}

// Name and explanation of each fault; the configuration fault with the check of the motor data that failed.
function showFaults(faults, configuration) {
  const active = [];
  const bits = (signal) => Object.entries(hello.explanations[signal])
    .filter(([bit]) => Math.floor((faults[signal] || 0) / 2 ** bit) % 2).map(([, words]) => words);
  for (const words of bits("DriveFaults")) {
    active.push(words);
    const check = configuration.MotorCheck;
    if (words[0] === "config" && check) {
      active.push(hello.explanations.MotorCheck[check] || [`check ${check}`, "Not known to this page."]);
    }
  }
  active.push(...bits("EcuFaults"));
  const rows = active.map(([name, text]) => {
    const row = Object.assign(document.createElement("li"), { textContent: name, className: "active" });
    row.append(Object.assign(document.createElement("small"), { textContent: text }));
    return row;
  });
  if (!rows.length) rows.push(Object.assign(document.createElement("li"), { textContent: "none", className: "quiet" }));
  $("faults").replaceChildren(...rows);
}

const NUMBERS = [
  ["Torque estimated", "INV_Status", "TorqueEstimated", "N·m"], ["Speed", "INV_Status", "Speed", "rpm"],
  ["dc voltage", "INV_DcLink", "DcVoltage", "V"], ["dc current (estimated)", "INV_DcLink", "DcCurrent", "A"],
  ["ψ̂", "INV_Identification", "PsiF", "mVs"], ["quality of ψ̂", "INV_Identification", "PsiQuality", "%"],
  ["R̂", "INV_Identification", "Resistance", "mΩ"], ["quality of R̂", "INV_Identification", "ResistanceQuality", "%"],
  ["winding", "INV_Temperatures", "Winding", "°C"], ["inverter", "INV_Temperatures", "Inverter", "°C"],
];
const TORQUE_STEP_COUNTS = 5; // of the slider

// As many decimals as one count of the signal has: its factor belongs to the motor.
function inCounts(value, message, signal) {
  return value.toFixed(Math.max(0, Math.ceil(-Math.log10(hello.factors[message][signal]) - 1e-9)));
}

function torqueText(torque) {
  return `${inCounts(torque, "VCU_TorqueRequest", "TorqueRequested")} N·m`;
}

function showNumbers(last) {
  const rows = [];
  for (const [label, message, signal, unit] of NUMBERS) {
    const value = last[message] && last[message][signal];
    rows.push(Object.assign(document.createElement("dt"), { textContent: label }));
    rows.push(Object.assign(document.createElement("dd"), {
      textContent: value === undefined ? "–" : `${inCounts(value, message, signal)} ${unit}` }));
  }
  $("numbers").replaceChildren(...rows);
}

function showState(state, wish, target) {
  const kind = { run: "good", derate: "warn", ready: "good", fault: "bad", safe_state: "bad" }[state] || "";
  badge("state", state ? state.replace("_", " ") : "no bus", kind);
  const running = state === "run" || state === "derate";
  $("torque").disabled = hello.replay || !running || wish !== "drive";
  if (wish !== "drive") mine = false;
  if (!mine) {
    $("torque").value = target;
    $("torque-value").textContent = torqueText(target);
  }
}

function onRows(message) {
  for (const [name, group] of Object.entries(message.groups)) {
    if (rings[name]) rings[name].add(group);
    stats.rows += group.t.length;
  }
  const times = rings.INV_Status.data[0];
  if (message.truth_Nm !== undefined && times.length) {
    rings.truth.add({ t: [times[times.length - 1]], Torque: [message.truth_Nm] });
  }
  stats.batches++;
  batch = message.batch;
  dirty = true;
  if (document.hidden) tellDrawn();
  if (message.last) {
    showNumbers(message.last);
    showFaults(message.last.INV_Faults || {}, message.last.INV_Configuration || {});
    showState(message.state, message.wish, message.target_Nm);
    $("stopped").textContent = message.stopped;
  }
}

function showTuning(values) {
  const rows = values.map((value) => {
    const row = document.createElement("tr");
    const input = Object.assign(document.createElement("input"), {
      type: "number", step: "any", value: Number(value.value.toPrecision(6)), name: value.name,
      title: `${value.lo} … ${value.hi} ${value.unit}` });
    input.addEventListener("change", () => send({ type: "tune", name: value.name, value: Number(input.value) }));
    row.title = value.text;
    row.insertCell().textContent = value.name.replaceAll("_", " ");
    row.insertCell().append(input);
    return row;
  });
  $("tuning").replaceChildren(...rows);
}

function onHello(message) {
  hello = message;
  $("title").textContent = message.title;
  const step = TORQUE_STEP_COUNTS * message.factors.VCU_TorqueRequest.TorqueRequested;
  const limit = Math.floor(message.torque_max_Nm / step + 1e-9) * step;
  Object.assign($("torque"), { min: -limit, max: limit, step });
  for (const id of ["ready", "enable", "off", "reset"]) $(id).disabled = message.replay;
  $("record").disabled = message.replay;
  $("tune-read").disabled = !message.tuning;
  if (message.replay) $("hand").textContent = "A recorded drive: nothing is commanded.";
  const knobs = { speed_rpm: ["speed-value", "rpm"], magnet_percent: ["magnet-value", "%"],
    winding_C: ["winding-value", "°C"] };
  for (const [name, [lo, hi, start]] of Object.entries(message.stand)) {
    const [label, unit] = knobs[name];
    const show = () => { $(label).textContent = `${$(name).value} ${unit}`; };
    Object.assign($(name), { min: lo, max: hi, value: start });
    $(name).oninput = () => { show(); send({ type: "knob", name, value: Number($(name).value) }); };
    show();
  }
  $("stand").hidden = !Object.keys(message.stand).length;
  if (!charts.length) {
    makeCharts();
    requestAnimationFrame(draw);
  }
}

const handlers = {
  hello: onHello,
  rows: onRows,
  refused: (message) => say(message.text),
  recording: (message) => {
    $("record").classList.toggle("on", message.on);
    $("record").textContent = message.on ? "Stop" : "Record";
    $("file").textContent = message.file ? `written: ${message.file}` : "";
  },
  tune_list: (message) => showTuning(message.values),
  tuned: (message) => {
    const input = document.querySelector(`#tuning input[name="${message.name}"]`);
    if (input) input.value = Number(message.value.toPrecision(6));
    say(`${message.name} = ${message.value.toPrecision(5)}`);
  },
};

function connect() {
  socket = new WebSocket(`ws://${location.host}/ws`);
  socket.onopen = () => badge("connection", "live", "good");
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    handlers[message.type](message);
  };
  socket.onclose = () => {
    badge("connection", "disconnected", "bad");
    mine = false;
    batch = -1;
    setTimeout(connect, RECONNECT_MS);
  };
}

$("ready").onclick = () => send({ type: "ready" });
$("enable").onclick = () => send({ type: "drive" });
$("off").onclick = () => send({ type: "off" });
$("reset").onclick = () => send({ type: "reset" });
$("tune-read").onclick = () => { say("reading …"); send({ type: "tune_list" }); };
$("record").onclick = () => send({ type: "record", on: !$("record").classList.contains("on") });
$("torque").oninput = () => {
  mine = true;
  const torque = Number($("torque").value);
  $("torque-value").textContent = torqueText(torque);
  send({ type: "torque", torque_requested_Nm: torque });
};
document.addEventListener("visibilitychange", () => { if (document.hidden) tellDrawn(); });
connect();
