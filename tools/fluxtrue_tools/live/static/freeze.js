// SPDX-License-Identifier: Apache-2.0
// The freeze frame: charts of the last steps before the first fault.
import { $, element, show } from "./page.js";
import { atLeast, discard, line, plot } from "./plot.js";
import { wordsOf } from "./reasons.js";

const CHARTS = [
  ["Currents", "A", 20, [["i_d", "green", "i_d_A"], ["i_q", "violet", "i_q_A"]]],
  ["Torque", "N·m", 20, [["commanded", "quiet", "torque_commanded_Nm"], ["estimated", "blue", "torque_estimated_Nm"]]],
  ["Voltages", "V", 20, [["u_d", "green", "u_d_V"], ["u_q", "violet", "u_q_V"]]],
  ["Dc voltage", "V", 20, [["v_dc", "orange", "v_dc_V"]]],
  ["Speed", "rpm", 100, [["speed", "blue", "speed_rpm"]]],
];

function drawChart({ t_ms, signals }, [title, unit, span, lines]) {
  const figure = element("figure");
  const caption = element("figcaption", `${title} `);
  caption.append(element("small", unit));
  figure.append(caption);
  $("freeze-charts").append(figure);
  const styles = lines.map(([label, hue], k) => line(label, hue, k ? "dashed" : "solid"));
  plot(figure, styles, atLeast(span), (ms) => `${ms} ms`).setData([t_ms, ...lines.map(([, , name]) => signals[name])]);
}

// A frame stays until it is closed, also when its fault is reset: what is below it does not move by itself.
export function frameIsPast() {
  show("freeze-title", "Before a fault that has been reset");
}

export function showFreezeFrame(hello, message) {
  $("freeze-frame").hidden = !message.frozen;
  show("freeze-title", "Before the first fault");
  discard($("freeze-charts"));
  $("freeze-charts").replaceChildren();
  if (!message.frozen) return;
  const { time_ms: time, state } = message.values;
  $("freeze-text").textContent = `${(time / 1000).toFixed(3)} s after the start, in state `
    + `${wordsOf(hello, "INV_Status.State", state)[0]}; the fault is at 0 ms`
    + (hello.scope ? "; the PWM periods around it: see the oscilloscope" : "");
  CHARTS.forEach((chart) => drawChart(message, chart));
}
