// SPDX-License-Identifier: Apache-2.0
// The charts of the last seconds. They can be paused and zoomed into; values and commands go on meanwhile.
import { tellDrawn } from "./connection.js";
import { $, show } from "./page.js";
import { atLeast, line, plot } from "./plot.js";
import { columns, rings, WINDOW_S } from "./rings.js";

export const stats = { batches: 0, draws: 0, rows: 0 };
const SPAN_MIN = 0.05; // seconds
let charts = [];
let isStarted = false;
let dirty = false;
let held = null; // { data, from, to, ends }: what paused charts show
let isDragged = false; // a range is being chosen with the mouse
let run = null;

// The simulated machine's torque comes on its own times: joined for one picture.
function torque() {
  return uPlot.join([columns("INV_Status", "TorqueCommanded", "TorqueEstimated"), columns("truth", "Torque")]);
}

function chart(id, lines, range, data) {
  const made = plot($(id), lines, range, undefined, { zoom });
  made.over.addEventListener("mousedown", (event) => { isDragged = event.button === 0; });
  return { made, data };
}

function makeCharts() {
  charts = [
    chart("chart-torque", [line("commanded", "quiet", "dashed", { spanGaps: true }),
      line("estimated", "blue", "solid", { spanGaps: true }),
      line("true, simulated machine only", "orange", "dotted", { spanGaps: true })], atLeast(20), torque),
    chart("chart-currents", [line("i_d", "green"), line("i_d*", "green", "dashed"), line("i_q", "violet"),
      line("i_q*", "violet", "dotted")], atLeast(40), () => columns("INV_Currents", "Id", "IdRef", "Iq", "IqRef")),
    chart("chart-speed", [line("speed", "blue")], atLeast(400), () => columns("INV_Status", "Speed")),
    chart("chart-psi", [line("ψ̂", "orange")], atLeast(10), () => columns("INV_Identification", "PsiF")),
    chart("chart-r", [line("R̂", "green")], atLeast(10), () => columns("INV_Identification", "Resistance")),
  ];
}

function newestRange() {
  const times = rings.INV_Status.data[0];
  const newest = times.length ? times[times.length - 1] : 0;
  return { from: Math.max(newest - WINDOW_S, Math.min(times[0] ?? 0, newest - 1)), to: newest };
}

function redraw() {
  const { from, to } = held ?? newestRange();
  charts.forEach(({ made, data }, k) => made.batch(() => {
    made.setData(held ? held.data[k] : data(), false);
    made.setScale("x", { min: from, max: to });
  }));
}

function showHeld() {
  $("charts-pause").ariaPressed = String(held !== null);
  show("charts-pause", held ? "Continue" : "Pause");
  show("charts-text", held ? `Paused: ${held.from.toFixed(2)} … ${held.to.toFixed(2)} s. The drive goes on.` : "");
}

function release() {
  held = null;
  dirty = true;
  showHeld();
}

// Shows a range of what was there when the charts were paused. Without arguments the charts follow the time again.
function zoom(from, to) {
  if (from === undefined) return release();
  held ??= { data: charts.map(({ data }) => data().map((column) => column.slice())), ends: newestRange() };
  const { ends } = held;
  const span = Math.min(Math.max(to - from, SPAN_MIN), ends.to - ends.from);
  held.from = Math.min(Math.max(from, ends.from), ends.to - span);
  held.to = held.from + span;
  redraw();
  return showHeld();
}

// The range moves by a share of its length, and its length changes by a factor.
function move(share, factor) {
  const { from, to } = held ?? newestRange();
  const middle = (from + to) / 2 + share * (to - from), half = factor * (to - from) / 2;
  zoom(middle - half, middle + half);
}

function draw() {
  if (dirty) {
    dirty = false;
    if (!held && !isDragged) redraw();
    stats.draws++;
    tellDrawn();
  }
  requestAnimationFrame(draw);
}

// A page that measures an unknown motor has no charts; it reports that it has drawn all the same.
export function startCharts(hasCharts) {
  if (isStarted) return;
  isStarted = true;
  if (hasCharts) makeCharts();
  document.addEventListener("mouseup", () => { isDragged = false; });
  window.addEventListener("blur", () => { isDragged = false; });
  $("charts-pause").onclick = () => (held ? release() : move(0, 1));
  $("charts-in").onclick = () => move(0, 0.5);
  $("charts-out").onclick = () => move(0, 2);
  $("charts-earlier").onclick = () => move(-0.5, 1);
  $("charts-later").onclick = () => move(0.5, 1);
  requestAnimationFrame(draw);
}

// Values of another run do not continue those that paused charts show.
export function chartsChanged(number) {
  if (held && number !== run) release();
  run = number;
  dirty = true;
}

export function showCharts({ live }) {
  for (const button of $("charts-bar").querySelectorAll("button")) button.disabled = !live;
  if (!live && held) release();
}
