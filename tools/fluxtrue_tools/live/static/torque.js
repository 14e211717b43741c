// SPDX-License-Identifier: Apache-2.0
// The torque: estimated and requested, slider and number, and the buttons of the inverter.
import { send } from "./connection.js";
import { $, badge, DASH, entered, inCounts, say, show } from "./page.js";

const STEP_COUNTS = 5; // of the slider
const ECHO_BATCHES = 10; // for the server to answer with the request that it took
const DISCHARGED_BY_OFF = ["precharge", "ready", "run", "derate", "safe_state", "fault"];
const KINDS = { run: "good", derate: "warn", ready: "good", fault: "bad", safe_state: "bad" };

let limit = 0;
let pending = null; // a request that the server has not confirmed yet
let waited = 0;

function text(hello, torque) {
  return inCounts(hello, torque, "VCU_TorqueRequest", "TorqueRequested");
}

function request(torque) {
  say("");
  pending = torque;
  waited = 0;
  $("torque").value = torque;
  send({ type: "torque", torque_requested_Nm: torque });
}

function setEntered(event) {
  event.preventDefault();
  const torque = entered($("torque-entry"));
  if (torque === null) say("Nothing was set: the field holds no number.");
  else if (Math.abs(torque) > limit) say(`Nothing was set: allowed are ${-limit} … ${limit} N·m.`);
  else request(torque);
}

export function stop() {
  pending = null;
  send({ type: "stop" });
}

export function startTorque() {
  $("ready").onclick = () => send({ type: "ready" });
  $("enable").onclick = () => send({ type: "drive" });
  $("off").onclick = () => send({ type: "off" });
  $("stop").onclick = stop;
  $("zero").onclick = () => request(0);
  $("torque").oninput = () => request(Number($("torque").value));
  $("torque-form").onsubmit = setEntered;
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") stop();
  });
}

export function setTorqueRange(hello) {
  const count = hello.factors.VCU_TorqueRequest.TorqueRequested;
  limit = Number((Math.floor(hello.torque_max_Nm / count + 1e-9) * count).toFixed(3));
  const step = STEP_COUNTS * count;
  const end = Math.floor(limit / step + 1e-9) * step;
  Object.assign($("torque"), { min: -end, max: end, step });
}

function showNumbers({ hello, live, last, status }) {
  const torque = last?.INV_Status?.TorqueEstimated;
  show("torque-estimated", live && torque !== undefined ? inCounts(hello, torque, "INV_Status", "TorqueEstimated") : DASH);
  const requested = live && !hello.replay ? status.target_Nm : null;
  show("torque-value", requested === null ? DASH : text(hello, requested));
  if (pending !== null && (requested === pending || ++waited > ECHO_BATCHES)) pending = null;
  if (pending === null && !$("torque").matches(":active")) $("torque").value = requested ?? 0;
}

export function showTorque(view) {
  const { present, live, mayAct, status } = view;
  const state = live ? status.state : "";
  const running = state === "run" || state === "derate";
  const driving = mayAct && running && status.wish === "drive";
  badge("state", state ? state.replace("_", " ") : "no bus", KINDS[state]);
  for (const id of ["torque", "torque-entry", "torque-set", "zero"]) $(id).disabled = !driving;
  $("ready").disabled = !(mayAct && (state === "standby" || state === "discharge"));
  $("enable").disabled = !(mayAct && state === "ready");
  $("off").disabled = !(mayAct && DISCHARGED_BY_OFF.includes(state));
  $("stop").disabled = !live || view.hello.replay;
  show("stopped", present ? status.stopped : "");
  showNumbers(view);
}
