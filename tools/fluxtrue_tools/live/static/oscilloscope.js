// SPDX-License-Identifier: Apache-2.0
// The oscilloscope's settings: what is captured, and when. The server arms the inverter's capture buffer.
import { clearCapture, newestCapture, showCapture, shownUnit, startCapture } from "./capture.js";
import { send } from "./connection.js";
import { $, element, entered, show } from "./page.js";

const TRIGGERS = {
  manual: "Trigger now is pressed", fault: "first fault", rising: "rises through the level",
  falling: "falls through the level", above: "is above the level", below: "is below the level",
};
const STATES = { idle: "", armed: "Armed: waits for the trigger.", triggered: "Triggered: records.",
  reading: "Reads the samples from the inverter …" };
const CHOSEN = ["i_d_A", "i_q_A"]; // at first
const NO_ELF = "The oscilloscope needs the inverter's firmware image: start tools/fluxtrue live with --elf.";
const NUMBERS = { "scope-level": "Level", "scope-before": "Before the trigger", "scope-samples": "Samples",
  "scope-divisor": "PWM periods per sample" };

let offer = null; // what can be captured
let mayArm = false;
let answer = ""; // to what was asked last
let state = ""; // of the capture, at the last showing

const boxes = () => [...$("scope-signals").querySelectorAll("input")];
const chosen = () => boxes().filter((box) => box.checked).map((box) => box.name);
const needsLevel = () => offer.levels.includes($("scope-kind").value);

function option(value, text) {
  return Object.assign(document.createElement("option"), { value, textContent: text });
}

function signalBox({ name, text }) {
  const label = element("label", "", "check");
  const box = Object.assign(document.createElement("input"), { type: "checkbox", name, checked: CHOSEN.includes(name) });
  label.title = text;
  label.append(box, ` ${name}`);
  return label;
}

// Enabled fields are those that have an effect.
function showForm() {
  if (!offer) return;
  const names = chosen(), full = names.length >= offer.signals_max;
  boxes().forEach((box) => { box.disabled = !mayArm || (full && !box.checked); });
  for (const id of ["scope-kind", "scope-before", "scope-samples", "scope-divisor", "scope-repeat"]) {
    $(id).disabled = !mayArm;
  }
  $("scope-on").disabled = $("scope-level").disabled = !mayArm || !needsLevel();
  show("scope-chosen", `Signals: ${names.length} of at most ${offer.signals_max}`);
  show("scope-unit", shownUnit(offer.signals.find(({ name }) => name === $("scope-on").value)?.unit ?? ""));
  const most = Math.floor(offer.words / Math.max(names.length, 1));
  const samples = entered($("scope-samples")), seconds = samples * entered($("scope-divisor")) * offer.period_s;
  show("scope-span", `${samples} samples take ${Number((1e3 * seconds).toPrecision(4))} ms. At most ${most} of each signal.`);
}

function tell(text) {
  answer = text;
  show("scope-text", text);
}

function arm() {
  const empty = Object.entries(NUMBERS).find(([id]) => entered($(id)) === null);
  if (empty) return tell(`Nothing was armed: ${empty[1]} holds no number.`);
  const number = (id) => entered($(id));
  tell("");
  return send({ type: "scope_arm", signals: chosen(), trigger: $("scope-kind").value, on: $("scope-on").value,
    level: number("scope-level"), before: number("scope-before") / 100, samples: number("scope-samples"),
    divisor: number("scope-divisor"), repeat: $("scope-repeat").checked });
}

export function onScope(message) {
  tell(message.text);
}

export function startScope() {
  $("scope-arm").onclick = arm;
  $("scope-trigger").onclick = () => { tell(""); send({ type: "scope_trigger" }); };
  $("scope-end").onclick = () => { tell(""); send({ type: "scope_end" }); };
  $("scope-form").oninput = showForm;
  $("scope-form").onsubmit = (event) => { event.preventDefault(); if (mayArm) arm(); };
  startCapture();
}

// The greeting of a server says what its inverter can capture.
export function offerScope(hello) {
  offer = hello.scope;
  $("scope").hidden = hello.replay;
  $("scope-form").hidden = !offer;
  clearCapture();
  tell(offer || hello.replay ? "" : NO_ELF);
  if (!offer) return;
  $("scope-signals").replaceChildren($("scope-chosen"), ...offer.signals.map(signalBox));
  $("scope-kind").replaceChildren(...offer.triggers.map((name) => option(name, TRIGGERS[name] ?? name)));
  $("scope-on").replaceChildren(...offer.signals.map(({ name, text }) => option(name, `${name}: ${text}`)));
  $("scope-on").value = CHOSEN.at(-1);
  showForm();
}

export function showScope({ live, mayAct, scope }) {
  const known = live && Boolean(offer && scope);
  mayArm = known && mayAct;
  $("scope-arm").disabled = !mayArm || scope.state === "reading";
  $("scope-trigger").disabled = !(mayArm && scope.state === "armed");
  $("scope-end").disabled = !mayArm || scope.state === "reading";
  showForm();
  if (known && scope.state !== state) {
    state = scope.state;
    if (STATES[state]) answer = ""; // it was about the capture before
  }
  if (offer) show("scope-text", known ? answer || STATES[state] || scope.text : "");
  if (known) newestCapture(scope.capture);
  else clearCapture();
  showCapture(known);
}
