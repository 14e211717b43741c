// SPDX-License-Identifier: Apache-2.0
// Latched faults with explanation and advice, their reset, and the freeze frames of the first one: that of the 1 kHz
// steps is drawn here, that of the PWM periods by the oscilloscope.
import { send } from "./connection.js";
import { frameIsPast, showFreezeFrame } from "./freeze.js";
import { $, element } from "./page.js";
import { reason, wordsOf } from "./reasons.js";

const SIGNALS = ["DriveFaults", "EcuFaults"];
const CHECK = "INV_Configuration.MotorCheck";

let hasScope = false; // the server can read the oscilloscope

function bits(hello, signal, word) {
  return Object.entries(hello.words[`INV_Faults.${signal}`]).filter(([bit]) => Math.floor(word / 2 ** bit) % 2)
    .map(([, words]) => words);
}

// The configuration fault is followed by the check of the motor data that failed.
function active({ hello, last }) {
  const found = SIGNALS.flatMap((signal) => bits(hello, signal, last.INV_Faults?.[signal] || 0));
  const check = last.INV_Configuration?.MotorCheck;
  const at = found.findIndex(([name]) => name === "config");
  if (at >= 0 && check) found.splice(at + 1, 0, wordsOf(hello, CHECK, check));
  return found;
}

export function startFaults() {
  $("reset").onclick = () => send({ type: "reset" });
  $("freeze").onclick = () => {
    send({ type: "freeze" });
    if (hasScope) send({ type: "scope_kept" });
  };
  $("freeze-close").onclick = () => showFreezeFrame(null, { frozen: false });
}

export function showFaults(view) {
  const { hello, live, mayAct, last, status } = view;
  const known = live && Boolean(last?.INV_Faults);
  hasScope = Boolean(hello.scope);
  const found = known ? active(view) : [];
  const key = JSON.stringify([known, found]);
  if ($("faults").dataset.key !== key) {
    $("faults").dataset.key = key;
    const rows = found.map((words) => reason(words, "bad"));
    $("faults").replaceChildren(...(rows.length ? rows : [element("li", known ? "none" : "–", "quiet")]));
  }
  $("reset").disabled = !(mayAct && status.state === "fault");
  $("freeze").disabled = !(live && hello.tuning && found.length);
  $("freeze-close").disabled = !live;
  if (known && !found.length) frameIsPast();
}
