// SPDX-License-Identifier: Apache-2.0
// What can arrive, one extreme after the other: states, words, numbers, faults, refusals, control, the scope's texts.
const LONG = "A text of the server that is as long as an explanation can become, with a path /var/lib/fluxtrue/records/"
  + "2026-11-27T04-18-26-hsm1-a-drive-with-a-long-name.mf4, a number 123456.789, and what to do about it all.";
const EXTREMES = { Speed: [0, -12000, 12000], TorqueEstimated: [0, -131.9, 131.9], TorqueMax: [0, 132, 9.9],
  DcVoltage: [0, 999.9, 375], DcCurrent: [0, -999.9, 999.9], PsiF: [0, 299.99, 71], PsiQuality: [0, 100, 50],
  Resistance: [0, 999.99, 12], ResistanceQuality: [100, 0, 50], Winding: [-40, 200, 20], WindingValid: [1, 0, 1],
  Inverter: [-40, 150, 20], InverterValid: [0, 1, 1] };
const SCOPE = ["idle", "armed", "triggered", "reading"];
const { words, replay } = still.hello;
let count = 0, known = null;

const turn = (list, every = 1) => list[Math.floor(count / every) % list.length];
const values = (path) => Object.keys(words[path]).map(Number);

function extreme(last) {
  for (const signals of Object.values(last)) {
    for (const signal of Object.keys(signals)) if (EXTREMES[signal]) signals[signal] = turn(EXTREMES[signal]);
  }
  for (const [path, every] of [["INV_DcLink.RefusedReason", 1], ["INV_DcLink.DeratingReason", 1],
    ["INV_Limits.RequestLimit", 2], ["INV_Configuration.MotorCheck", 1]]) {
    const [message, signal] = path.split(".");
    (last[message] ??= {})[signal] = turn(values(path), every);
  }
  const bits = (path) => values(path).reduce((sum, bit) => sum + 2 ** bit, 0);
  last.INV_Faults = { DriveFaults: turn([0, bits("INV_Faults.DriveFaults"), 128]),
    EcuFaults: turn([0, bits("INV_Faults.EcuFaults"), 0], 2) };
}

still.tamper = (message) => {
  if (message.type !== "rows") return message;
  if (message.status) known = { status: message.status, last: message.last, scope: message.scope };
  if (!known) return message;
  count++;
  const told = JSON.parse(JSON.stringify(known)), states = values("INV_Status.State");
  const state = turn(states, 2), named = words["INV_Status.State"][state][0].replaceAll(" ", "_");
  extreme(told.last);
  (told.last.INV_Status ??= {}).State = state;
  Object.assign(told.status, { state: SILENT && count % 11 === 0 ? "" : named, stopped: turn(["", LONG, "Stop was pressed."]),
    recording: turn([false, true], 3), target_Nm: turn([0, -131.9, 131.9]) });
  if (told.scope) Object.assign(told.scope, { state: turn(SCOPE, 2), text: turn(["", LONG]) });
  fluxtrue.say(turn(["", LONG, "A message"], 2));
  return { ...message, ...told, control: replay ? "free" : turn(["mine", "other", "free"], 2) };
};
