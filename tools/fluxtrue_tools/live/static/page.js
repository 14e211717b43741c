// SPDX-License-Identifier: Apache-2.0
// Small helpers for the elements of the page.

export const $ = (id) => document.getElementById(id);
export const DASH = "–";

export function element(tag, textContent = "", className = "") {
  return Object.assign(document.createElement(tag), { textContent, className });
}

// Writes only what has changed: a screen reader then reads only news, and nothing flickers.
export function show(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}

export function badge(id, text, kind = "") {
  show(id, text);
  $(id).className = `badge ${kind}`.trim();
}

export function say(text) {
  $("message").textContent = text;
}

// As many decimals as one count of the signal has: its factor belongs to the motor.
export function inCounts(hello, value, message, signal) {
  const text = value.toFixed(Math.max(0, Math.ceil(-Math.log10(hello.factors[message][signal]) - 1e-9)));
  return Number(text) === 0 ? text.replace("-", "") : text;
}

// The number in a field; null if the field is empty or holds no number.
export function entered(input) {
  const text = input.value.trim();
  const value = Number(text);
  return text === "" || !Number.isFinite(value) ? null : value;
}
