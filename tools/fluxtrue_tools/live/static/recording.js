// SPDX-License-Identifier: Apache-2.0
// Recording to a file on the server's computer.
import { send } from "./connection.js";
import { $, show } from "./page.js";

let on = false;

export function onRecording(message) {
  on = message.on;
  show("file", message.file ? `Written: ${message.file}` : "");
}

export function startRecording() {
  $("record").onclick = () => send({ type: "record", on: !on });
}

// A recording of an inverter that has become silent can be ended.
export function showRecording({ mayAct, mayEnd, status }) {
  if (status) on = status.recording;
  $("record").disabled = !(mayAct || (mayEnd && on));
  $("record").classList.toggle("on", on);
  $("record").ariaPressed = String(on);
  show("record", on ? "Stop recording" : "Record");
}
