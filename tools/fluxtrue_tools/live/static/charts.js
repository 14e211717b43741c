// SPDX-License-Identifier: Apache-2.0
// The charts of the last seconds.
import { tellDrawn } from "./connection.js";
import { $ } from "./page.js";
import { atLeast, line, plot } from "./plot.js";
import { columns, rings, WINDOW_S } from "./rings.js";

export const stats = { batches: 0, draws: 0, rows: 0 };
let charts = [];
let dirty = false;

// The simulated machine's torque comes on its own times: joined for one picture.
function torque() {
  return uPlot.join([columns("INV_Status", "TorqueCommanded", "TorqueEstimated"), columns("truth", "Torque")]);
}

function chart(id, lines, range, data) {
  return { made: plot($(id), lines, range), data };
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

function redraw() {
  const times = rings.INV_Status.data[0];
  const newest = times.length ? times[times.length - 1] : 0;
  const oldest = Math.max(newest - WINDOW_S, Math.min(times[0] ?? 0, newest - 1));
  charts.forEach(({ made, data }) => made.batch(() => {
    made.setData(data(), false);
    made.setScale("x", { min: oldest, max: newest });
  }));
}

function draw() {
  if (dirty) {
    dirty = false;
    redraw();
    stats.draws++;
    tellDrawn();
  }
  requestAnimationFrame(draw);
}

export function startCharts() {
  if (charts.length) return;
  makeCharts();
  requestAnimationFrame(draw);
}

export function chartsChanged() {
  dirty = true;
}
