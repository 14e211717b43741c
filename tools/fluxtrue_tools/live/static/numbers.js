// SPDX-License-Identifier: Apache-2.0
// The last measured values.
import { $, DASH, element, inCounts } from "./page.js";

const NUMBERS = [
  ["Speed", "INV_Status", "Speed", "rpm"], ["Torque available", "INV_Limits", "TorqueMax", "N·m"],
  ["Dc voltage", "INV_DcLink", "DcVoltage", "V"], ["Dc current, estimated", "INV_DcLink", "DcCurrent", "A"],
  ["Magnet flux ψ̂", "INV_Identification", "PsiF", "mVs"], ["Quality of ψ̂", "INV_Identification", "PsiQuality", "%"],
  ["Resistance R̂", "INV_Identification", "Resistance", "mΩ"],
  ["Quality of R̂", "INV_Identification", "ResistanceQuality", "%"],
  ["Winding", "INV_Temperatures", "Winding", "°C", "WindingValid"],
  ["Inverter", "INV_Temperatures", "Inverter", "°C", "InverterValid"],
];
const IDENTIFIED = "INV_Identification"; // not shown while the motor is unknown
const cells = [];

export function startNumbers() {
  const rows = NUMBERS.flatMap(([label, message, , unit]) => {
    const kind = message === IDENTIFIED ? "identified" : "";
    cells.push(element("dd", DASH, kind));
    return [element("dt", label, kind), cells.at(-1), element("dd", unit, kind)];
  });
  $("numbers").replaceChildren(...rows);
}

export function showNumbers({ hello, live, last }) {
  NUMBERS.forEach(([, message, signal, , valid], k) => {
    const value = live && (!valid || last?.[message]?.[valid]) ? last?.[message]?.[signal] : undefined;
    cells[k].textContent = value === undefined ? DASH : inCounts(hello, value, message, signal);
  });
}
