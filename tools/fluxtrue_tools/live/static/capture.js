// SPDX-License-Identifier: Apache-2.0
// The captured signals: one chart for each unit, two cursors, zoom, spectrum, export.
import { send } from "./connection.js";
import { $, element, show } from "./page.js";
import { discard, line, plot } from "./plot.js";
import { color } from "./theme.js";

const HUES = ["blue", "orange", "green", "violet", "red", "quiet"];
const SHOWN = { deg: "°", Nm: "N·m", "rad_s": "rad/s" };
const TRIGGER = "T";
const CONTROLS = ["scope-pause", "scope-spectrum", "scope-zoom", "scope-whole", "scope-a", "scope-b"];

let capture = null; // the one that is drawn
let newest = 0; // number of the newest that the server has
let asked = 0; // number of the one that was asked for
let shown = null; // { x, unit, columns }: samples or spectrum
let grouped = ""; // the units and signals that have a chart
let isSpectrum = false;
let isPaused = false;
let charts = [];
let cursors = [0, 0]; // rows

const short = (value) => String(Number(value.toPrecision(5)));
export const shownUnit = (unit) => SHOWN[unit] ?? unit;
const unitOf = (name) => shownUnit(capture.units[name]);

function samples() {
  const { trigger, step_s: step, columns } = capture;
  const count = Object.values(columns)[0].length;
  return { x: Array.from({ length: count }, (_, k) => 1e3 * step * (k - trigger)), unit: "ms", columns };
}

function frequencies() {
  const { step_Hz: step, columns } = capture.spectrum;
  const count = Object.values(columns)[0].length;
  return { x: Array.from({ length: count }, (_, k) => step * k), unit: "Hz", columns };
}

function range(_, lo, hi) {
  if (lo == null) return [-1, 1];
  const margin = 0.08 * (hi - lo) || 0.05 * Math.abs(hi) || 1;
  return [lo - margin, hi + margin];
}

function mark(drawn, x, text, hue) {
  const { ctx, bbox } = drawn, at = drawn.valToPos(x, "x", true);
  if (at < bbox.left || at > bbox.left + bbox.width) return;
  const isLeft = at > bbox.left + bbox.width / 2, gap = (isLeft ? -4 : 4) * devicePixelRatio;
  ctx.save();
  Object.assign(ctx, { strokeStyle: color(hue), fillStyle: color(hue), lineWidth: 1.5 * devicePixelRatio,
    font: `${12 * devicePixelRatio}px system-ui, sans-serif`, textAlign: isLeft ? "right" : "left" });
  ctx.beginPath();
  ctx.moveTo(at, bbox.top);
  ctx.lineTo(at, bbox.top + bbox.height);
  ctx.stroke();
  ctx.fillText(text, at + gap, bbox.top + (text === TRIGGER ? bbox.height - 4 * devicePixelRatio : 10 * devicePixelRatio));
  ctx.restore();
}

function paint(drawn) {
  if (!shown) return;
  if (!isSpectrum) mark(drawn, 0, TRIGGER, "quiet");
  cursors.forEach((row, k) => mark(drawn, shown.x[row], "AB"[k], "text"));
}

function values() {
  const [a, b] = cursors, { x, unit, columns } = shown;
  const rows = [[isSpectrum ? "Frequency" : "Time from the trigger", x[a], x[b], unit],
    ...Object.entries(columns).map(([name, column]) => [name, column[a], column[b], unitOf(name)])];
  $("scope-values").tBodies[0].replaceChildren(...rows.map(([name, at, then, its]) => {
    const row = document.createElement("tr");
    row.append(...[name, short(at), short(then), short(then - at), its].map((text) => element("td", text)));
    return row;
  }));
}

function showCursors() {
  cursors.forEach((row, k) => { $(["scope-a", "scope-b"][k]).value = row; });
  values();
  charts.forEach((drawn) => drawn.redraw(false, false));
}

function moveCursor(k, row) {
  cursors[k] = Math.min(Math.max(Math.round(row), 0), shown.x.length - 1);
  showCursors();
}

// A click moves the cursor that is nearer to it.
function pick(x) {
  const step = shown.x.length > 1 ? shown.x[1] - shown.x[0] : 1;
  const row = (x - shown.x[0]) / step;
  moveCursor(Math.abs(row - cursors[0]) <= Math.abs(row - cursors[1]) ? 0 : 1, row);
}

function zoom(from, to) {
  const { x } = shown;
  const min = from ?? x[0], max = to ?? x[x.length - 1];
  if (max > min) charts.forEach((drawn) => drawn.setScale("x", { min, max }));
}

function chart(unit, names) {
  const figure = element("figure"), caption = element("figcaption", names.length > 1 ? "" : `${names[0]} `);
  caption.append(element("small", isSpectrum ? `${unit}, amplitude without the mean` : unit));
  figure.append(caption);
  $("scope-charts").append(figure);
  const lines = names.map((name, k) => line(name, HUES[k % HUES.length], k < HUES.length ? "solid" : "dashed"));
  return plot(figure, lines, range, (x) => `${short(x)} ${shown?.unit ?? ""}`, { zoom, pick, paint });
}

// The mean is in the table only: drawn, it would hide the amplitudes.
function columnsOf(names) {
  return [shown.x, ...names.map((name) => (isSpectrum ? [null, ...shown.columns[name].slice(1)] : shown.columns[name]))];
}

function fill(drawn, names, staysZoomed) {
  const { min, max } = drawn.scales.x;
  drawn.batch(() => {
    drawn.setData(columnsOf(names), !staysZoomed);
    if (staysZoomed) drawn.setScale("x", { min, max });
  });
}

function removeCharts() {
  discard($("scope-charts"));
  $("scope-charts").replaceChildren();
  charts = [];
  grouped = "";
}

function placeCursors() {
  const last = shown.x.length - 1;
  cursors = [isSpectrum ? 0 : Math.min(capture.trigger, last), last];
  for (const id of ["scope-a", "scope-b"]) $(id).max = last;
}

// A capture of the same signals is drawn into the same charts, and one over the same times leaves zoom and cursors: a
// repeated capture interrupts neither a press nor a drag.
function draw() {
  const before = shown?.x, units = {};
  shown = isSpectrum ? frequencies() : samples();
  for (const name of Object.keys(shown.columns)) (units[unitOf(name)] ??= []).push(name);
  const groups = Object.entries(units), key = JSON.stringify([isSpectrum, groups]), isNew = key !== grouped;
  const staysZoomed = !isNew && [0, shown.x.length - 1].every((row) => before[row] === shown.x[row]) && before.length === shown.x.length;
  if (isNew) {
    removeCharts();
    grouped = key;
    charts = groups.map(([unit, names]) => chart(unit, names));
  }
  if (!staysZoomed) placeCursors();
  groups.forEach(([, names], k) => fill(charts[k], names, staysZoomed));
  showCursors();
}

function download(kind) {
  Object.assign(document.createElement("a"), { href: `/capture.${kind}?number=${capture.number}`, download: "" }).click();
}

export function onCapture(message) {
  if (isPaused && capture) {
    asked = 0;
    return;
  }
  capture = message;
  isSpectrum &&= capture.spectrum !== null;
  $("scope-result").hidden = false;
  draw();
  showCapture(true);
}

// The server has another capture: it is fetched, unless the picture is paused.
export function newestCapture(number) {
  newest = number;
  if (!number || number === asked || number === capture?.number || (isPaused && capture)) return;
  asked = number;
  send({ type: "capture" });
}

export function startCapture() {
  $("scope-pause").onclick = () => { isPaused = !isPaused; newestCapture(newest); showCapture(true); };
  $("scope-spectrum").onclick = () => { isSpectrum = !isSpectrum; draw(); showCapture(true); };
  $("scope-zoom").onclick = () => zoom(...cursors.map((row) => shown.x[row]).sort((one, other) => one - other));
  $("scope-whole").onclick = () => zoom();
  $("scope-a").oninput = () => moveCursor(0, Number($("scope-a").value));
  $("scope-b").oninput = () => moveCursor(1, Number($("scope-b").value));
  $("scope-csv").onclick = () => download("csv");
  $("scope-mf4").onclick = () => download("mf4");
}

export function clearCapture() {
  capture = shown = null;
  newest = asked = 0;
  isPaused = isSpectrum = false;
  removeCharts();
  $("scope-result").hidden = true;
  $("scope-values").tBodies[0].replaceChildren();
}

export function showCapture(known) {
  const drawn = known && capture !== null;
  for (const id of CONTROLS) $(id).disabled = !drawn;
  $("scope-spectrum").disabled ||= capture?.spectrum === null;
  // The server keeps the newest capture only: an older one that is still drawn cannot be exported.
  $("scope-csv").disabled = $("scope-mf4").disabled = !(drawn && capture.number === newest);
  $("scope-pause").ariaPressed = String(isPaused);
  $("scope-spectrum").ariaPressed = String(isSpectrum);
  show("scope-pause", isPaused ? "Continue" : "Pause");
  show("scope-spectrum", isSpectrum ? "Samples" : "Spectrum");
  const name = drawn ? `${capture.is_freeze_frame ? "Freeze frame" : "Capture"} ${capture.number}` : "";
  const text = drawn && isPaused && capture.number !== newest ? `${name}, paused; there is a newer one` : name;
  show("scope-told", drawn && capture.warning ? `${text}: ${capture.warning}` : text);
}
