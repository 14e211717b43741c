// SPDX-License-Identifier: Apache-2.0
// One chart of uPlot in a figure: fills it, has a legend in the caption with the values at the cursor, follows the
// theme. The mouse or the arrow keys move the cursor.
import { element } from "./page.js";
import { color } from "./theme.js";

const made = new Map(); // { drawn, observer } by the box that they fill
const NEAR = 60; // rows
const DRAG_MIN = 6, STEP = 10; // pixels
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

// The entries' cells take the values at the cursor; a single line needs no name.
function legend(figure, lines) {
  const list = element("span", "", "legend"), cells = [];
  for (const { label, hue, style } of lines) {
    const entry = element("span", "", style);
    const mark = document.createElement("i");
    mark.style.borderTopColor = `var(--${hue})`;
    cells.push(element("b"));
    entry.append(...(lines.length > 1 ? [mark, label] : []), cells.at(-1));
    list.append(entry);
  }
  cells.push(element("b"));
  list.append(cells.at(-1));
  figure.querySelector("figcaption").append(list);
  return cells;
}

// The value of a column at a row, or in the nearest row that has one: joined columns have gaps.
function nearest(column, row) {
  for (let k = 0; k < NEAR; k++) {
    const value = column[row - k] ?? column[row + k];
    if (value != null) return value;
  }
  return null;
}

function showValues(drawn, cells, seconds) {
  const row = drawn.cursor.idx;
  const [times, ...columns] = drawn.data;
  const texts = [...columns, null].map((column) => {
    if (row == null || times[row] === undefined) return "";
    if (!column) return `at ${seconds(times[row])}`;
    const value = nearest(column, row);
    return value === null ? "" : String(Number(value.toPrecision(4)));
  });
  cells.forEach((cell, k) => { if (cell.textContent !== texts[k]) cell.textContent = texts[k]; });
}

// A range that was dragged over; the rest of uPlot's own zoom would act on this chart only.
function selected(drawn, zoom) {
  const { left, width } = drawn.select;
  drawn.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  if (width >= DRAG_MIN) zoom(drawn.posToVal(left, "x"), drawn.posToVal(left + width, "x"));
}

function followKeys(box, drawn, label) {
  box.tabIndex = 0;
  box.role = "group";
  box.ariaLabel = `${label}: the arrow keys move the cursor`;
  box.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key] * (event.shiftKey ? 1 : STEP);
    if (!by) return;
    event.preventDefault();
    const width = drawn.over.clientWidth, { left } = drawn.cursor;
    drawn.setCursor({ left: Math.min(Math.max((left < 0 ? width / 2 : left) + by, 0), width - 1), top: 0 });
  });
  box.addEventListener("blur", () => drawn.setCursor({ left: -10, top: -10 }));
}

// zoom(from, to)   a range was dragged over; zoom() after a double click
// pick(x)          the chart was clicked
// paint(drawn)     draws on top
export function plot(figure, lines, range, seconds = (s) => `${+s.toFixed(3)} s`, { zoom, pick, paint } = {}) {
  const title = figure.querySelector("figcaption").textContent;
  const cells = legend(figure, lines);
  const box = element("div", "", "plot");
  figure.append(box);
  const size = () => ({ width: Math.max(box.clientWidth, 60), height: Math.max(box.clientHeight, 60) });
  const drawn = new uPlot({
    ...size(), series: [{}, ...lines.map(series)], legend: { show: false },
    cursor: { y: false, points: { show: false }, drag: { x: Boolean(zoom), y: false, setScale: false },
      bind: { dblclick: () => () => zoom?.() } },
    hooks: { setCursor: [(made) => showValues(made, cells, seconds)],
      setSelect: zoom ? [(made) => selected(made, zoom)] : [], draw: paint ? [paint] : [] },
    padding: [6, 26, 0, 0],
    axes: [axis({ values: (_, times) => times.map(seconds), size: 26, space: 70, gap: 2 }),
      axis({ size: 48, space: 24, gap: 4 })],
    scales: { x: { time: false }, y: { range } },
  }, [[], ...lines.map(() => [])], box);
  const observer = new ResizeObserver(() => drawn.setSize(size()));
  observer.observe(box);
  followKeys(box, drawn, title);
  let pressed = 0;
  drawn.over.addEventListener("mousedown", (event) => { pressed = event.clientX; });
  drawn.over.addEventListener("click", (event) => {
    if (pick && Math.abs(event.clientX - pressed) < DRAG_MIN) pick(drawn.posToVal(drawn.cursor.left, "x"));
  });
  made.set(box, { drawn, observer });
  return drawn;
}

// Removes the plots inside an element, with what uPlot keeps of them.
export function discard(inside) {
  for (const [box, { drawn, observer }] of made) {
    if (!inside.contains(box)) continue;
    observer.disconnect();
    drawn.destroy();
    made.delete(box);
  }
}

// The range that each plot on the page shows.
export function ranges() {
  return [...made].filter(([box]) => box.isConnected).map(([, { drawn: { scales: { x } } }]) => [x.min, x.max]);
}

// Draws every plot with the colours of the present theme.
export function recolor() {
  for (const [, { drawn }] of made) drawn.redraw(false, true);
}

// At least so wide: noise of a resting value must not fill the picture.
export function atLeast(span) {
  return (_, lo, hi) => {
    if (lo == null) return [-span / 2, span / 2];
    const margin = Math.max(span - (hi - lo), 0.08 * (hi - lo)) / 2;
    return [lo - margin, hi + margin];
  };
}
