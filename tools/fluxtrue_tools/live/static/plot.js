// SPDX-License-Identifier: Apache-2.0
// One chart of uPlot in a figure: fills it, has a legend in the caption, follows the theme.
import { element } from "./page.js";
import { color } from "./theme.js";

const made = new Map(); // plots by the box that they fill
const DASHES = { solid: undefined, dashed: [8, 5], dotted: [2, 3] };

export function line(label, hue, style = "solid", options = {}) {
  return { label, hue, style, options };
}

function series({ label, hue, style, options }) {
  return { label, stroke: () => color(hue), width: style === "solid" ? 2 : 1.5, dash: DASHES[style], points: { show: false },
    ...options };
}

function axis(options) {
  const grid = { stroke: () => color("grid"), width: 1 };
  return { stroke: () => color("quiet"), grid, ticks: grid, font: "12px system-ui, sans-serif", ...options };
}

function legend(lines) {
  const list = element("span", "", "legend");
  for (const { label, hue, style } of lines) {
    const entry = element("span", "", style);
    const mark = document.createElement("i");
    mark.style.borderTopColor = `var(--${hue})`;
    entry.append(mark, label);
    list.append(entry);
  }
  return list;
}

export function plot(figure, lines, range, seconds = (s) => `${+s.toFixed(3)} s`) {
  if (lines.length > 1) figure.querySelector("figcaption").append(legend(lines));
  const box = element("div", "", "plot");
  figure.append(box);
  const size = () => ({ width: Math.max(box.clientWidth, 60), height: Math.max(box.clientHeight, 60) });
  const drawn = new uPlot({
    ...size(), series: [{}, ...lines.map(series)], legend: { show: false }, cursor: { show: false },
    padding: [6, 22, 0, 0],
    axes: [axis({ values: (_, times) => times.map(seconds), size: 26, space: 70, gap: 2 }),
      axis({ size: 48, space: 24, gap: 4 })],
    scales: { x: { time: false }, y: { range } },
  }, [[], ...lines.map(() => [])], box);
  new ResizeObserver(() => drawn.setSize(size())).observe(box);
  made.set(box, drawn);
  return drawn;
}

// Draws every plot that is still on the page with the colours of the present theme.
export function recolor() {
  for (const [box, drawn] of made) {
    if (box.isConnected) drawn.redraw(false, true);
    else made.delete(box);
  }
}

// At least so wide: noise of a resting value must not fill the picture.
export function atLeast(span) {
  return (_, lo, hi) => {
    if (lo == null) return [-span / 2, span / 2];
    const margin = Math.max(span - (hi - lo), 0.08 * (hi - lo)) / 2;
    return [lo - margin, hi + margin];
  };
}
