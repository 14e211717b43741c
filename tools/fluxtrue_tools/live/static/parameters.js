// SPDX-License-Identifier: Apache-2.0
// Calibration values: read, written one by one, compared with those of the build, saved to and loaded from a file.
import { send } from "./connection.js";
import { $, element, entered, say } from "./page.js";

const FORMAT = "fluxtrue-parameters";
const UNITS = { "Nm/s": "N·m/s" };
const rows = new Map(); // by name
let values = []; // as the ECU holds them
let title = "";
let mayWrite = false;

const written = (value) => String(Number(value.toPrecision(6)));
const differs = ({ value, default: built }) => written(value) !== written(built);

function write(shown) {
  const { input, info: { name, value } } = shown;
  const wanted = entered(input);
  shown.entered = input.value;
  if (wanted === null) {
    say(`${name}: nothing was written, the field holds no number.`);
    input.value = shown.entered = written(value);
  } else if (wanted !== Number(input.defaultValue)) {
    send({ type: "tune", name, value: wanted });
  }
}

// A field in which the user has begun to enter the next value keeps it.
function fill(shown, info) {
  const { made, input, cells } = shown, { default: built, lo, hi, unit } = info;
  const isEdited = document.activeElement === input && input.value !== shown.entered;
  shown.info = info;
  made.className = differs(info) ? "differs" : "";
  [written(built), `${written(lo)} … ${written(hi)}`, UNITS[unit] || unit].forEach((text, k) => { cells[k].textContent = text; });
  input.defaultValue = written(info.value);
  if (!isEdited) input.value = shown.entered = input.defaultValue;
}

function row(info) {
  const { name, text, unit } = info, cells = [element("td"), element("td"), element("td")];
  const made = document.createElement("tr");
  const input = Object.assign(document.createElement("input"), {
    type: "number", step: "any", name, disabled: !mayWrite, ariaLabel: `${text}, ${unit || "no unit"}` });
  const shown = { made, input, info, cells, entered: "" };
  rows.set(name, shown);
  input.addEventListener("change", () => write(shown));
  const label = element("td", name.replace(/_(rad|Nm)_.*$/, "").replaceAll("_", " "));
  label.title = text;
  const field = document.createElement("td");
  field.append(input);
  made.append(label, field, ...cells);
  return made;
}

// Fields that are on the page stay: a press is lost with the element on which it began.
function makeRows() {
  if (values.length === rows.size && values.every(({ name }) => rows.has(name))) return;
  rows.clear();
  $("tuning").tBodies[0].replaceChildren(...values.map(row));
}

// No value without an inverter; the fields keep their places.
function empty() {
  values = [];
  for (const shown of rows.values()) {
    shown.made.className = "";
    shown.input.value = shown.input.defaultValue = shown.entered = "";
  }
  $("tune-text").textContent = "Press Read to see the inverter's values and how they differ from those of the build.";
}

export function onParameters(message) {
  values = message.values;
  $("tuning").hidden = false;
  makeRows();
  values.forEach((info) => fill(rows.get(info.name), info));
  say(message.told);
  const count = values.filter(differs).length;
  $("tune-text").textContent = count ? `${count} of ${values.length} differ from the values of the build.`
    : "All values are those of the build.";
}

// The browser reads a download after the click has returned: its URL must stay until the next one.
let saved = "";

function save() {
  const held = Object.fromEntries(values.map(({ name, value }) => [name, value]));
  const text = JSON.stringify({ format: FORMAT, inverter: title, values: held }, null, 2);
  URL.revokeObjectURL(saved);
  saved = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  Object.assign(document.createElement("a"), { href: saved, download: "parameters.json" }).click();
}

async function load() {
  const [file] = $("tune-file").files;
  $("tune-file").value = "";
  try {
    const content = JSON.parse(await file.text());
    if (content?.format !== FORMAT) throw new Error(`its format is not ${FORMAT}`);
    send({ type: "tune_load", values: content.values });
  } catch (error) {
    say(`${file.name} was not loaded: ${error.message}`);
  }
}

export function startParameters() {
  $("tune-read").onclick = () => { say("Reading …"); send({ type: "tune_list" }); };
  $("tune-save").onclick = save;
  $("tune-load").onclick = () => $("tune-file").click();
  $("tune-file").onchange = load;
  $("tune-restore").onclick = () => send({ type: "tune_restore" });
}

export function showParameters({ hello, live, mayAct }) {
  title = hello?.title ?? "";
  const known = live && hello.tuning;
  mayWrite = known && mayAct;
  $("tune-read").disabled = !known;
  $("tune-save").disabled = !(known && values.length);
  $("tune-load").disabled = $("tune-restore").disabled = !mayWrite;
  for (const input of $("tuning").querySelectorAll("input")) input.disabled = !mayWrite;
  if (!live) empty();
}
