// SPDX-License-Identifier: Apache-2.0
// The contrast of every visible text and of what else must be seen, as WCAG 2.1 (1.4.3, 1.4.11) defines it: rows of
// text, ratio, least ratio. Disabled controls, which are exempt there, are enabled for the measurement.
const rgba = (text) => {
  const [r, g, b, a = 1] = text.match(/[\d.]+/g).map(Number);
  return [r, g, b, a];
};
const over = ([r, g, b, a], below) => [r, g, b].map((one, k) => one * a + below[k] * (1 - a));
const luminance = (color) => color.map((one) => one / 255)
  .map((one) => (one <= 0.03928 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4))
  .reduce((sum, one, k) => sum + one * [0.2126, 0.7152, 0.0722][k], 0);
const ratio = (one, other) => {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
};

function ground(element) {
  const layers = [];
  for (let one = element; one; one = one.parentElement) layers.unshift(rgba(getComputedStyle(one).backgroundColor));
  return layers.reduce((below, layer) => over(layer, below), [255, 255, 255]);
}

function row(element, text, style) {
  const below = ground(element), size = parseFloat(style.fontSize);
  let opacity = 1;
  for (let one = element; one; one = one.parentElement) opacity *= Number(getComputedStyle(one).opacity);
  const [r, g, b, a] = rgba(style.color);
  const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
  return [text, ratio(over([r, g, b, a * opacity], below), below), isLarge ? 3 : 4.5];
}

// States in which the page is not now.
const table = document.getElementById("tuning"), body = table.tBodies[0];
table.hidden = false;
body.innerHTML = "<tr class='differs'><td>differs</td><td>3.5</td></tr><tr><td>same</td></tr>";
document.getElementById("reasons").innerHTML = "<li><b>Refused</b><span>why</span><em>what to do</em></li>";
const disabled = [...document.querySelectorAll(":disabled")];
disabled.forEach((control) => { control.disabled = false; });
const badges = ["", "good", "warn", "bad"].map((kind) => {
  const badge = Object.assign(document.createElement("span"), { className: `badge ${kind}`, textContent: `badge ${kind}` });
  document.querySelector(".badges").append(badge);
  return badge;
});

const rows = [];
for (const element of document.querySelectorAll("body *")) {
  if (!element.getClientRects().length) continue;
  const text = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.data.trim()).join(" ");
  const style = getComputedStyle(element);
  if (text.trim()) rows.push(row(element, text.trim(), style));
  else if (element.matches("select, input:not([type=range], [type=checkbox])")) rows.push(row(element, element.id, style));
}
const entry = document.getElementById("torque-entry");
rows.push(row(entry, entry.placeholder, getComputedStyle(entry, "::placeholder")));

// Lines of the charts, borders of the fields, and the mark of the focus.
const root = getComputedStyle(document.documentElement);
const named = (name) => {
  const hex = root.getPropertyValue(`--${name}`).trim();
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
};
for (const name of ["blue", "orange", "green", "violet", "red", "quiet", "border"]) {
  for (const below of ["card", "ground"]) rows.push([`${name} on ${below}`, ratio(named(name), named(below)), 3]);
}
rows.push(["text of the axes", ratio(named("quiet"), named("card")), 4.5]);

badges.forEach((badge) => badge.remove());
disabled.forEach((control) => { control.disabled = true; });
body.replaceChildren();
table.hidden = true;
document.getElementById("reasons").replaceChildren();
delete document.getElementById("reasons").dataset.key;
return rows;
