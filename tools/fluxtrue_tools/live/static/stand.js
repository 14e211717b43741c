// SPDX-License-Identifier: Apache-2.0
// The test stand of a simulated machine: its sliders show the server's values, on every page.
import { send } from "./connection.js";
import { $, DASH, show } from "./page.js";

const KNOBS = { speed_rpm: ["speed-value", "rpm"], magnet_percent: ["magnet-value", "%"], winding_C: ["winding-value", "°C"] };
const ECHO_BATCHES = 10;
const pending = {};

function turn(name) {
  pending[name] = ECHO_BATCHES;
  show(KNOBS[name][0], `${$(name).value} ${KNOBS[name][1]}`);
  send({ type: "knob", name, value: Number($(name).value) });
}

export function startStand() {
  for (const name of Object.keys(KNOBS)) $(name).oninput = () => turn(name);
}

export function setStandRange(hello) {
  for (const [name, [min, max]] of Object.entries(hello.stand)) Object.assign($(name), { min, max });
  $("stand").hidden = !Object.keys(hello.stand).length;
}

export function showStand({ live, mayAct, status }) {
  for (const [name, [label, unit]] of Object.entries(KNOBS)) {
    const value = live ? status.knobs[name] : undefined;
    $(name).disabled = !mayAct;
    if (Number($(name).value) === value) pending[name] = 0;
    if (value !== undefined && pending[name]-- > 0) continue;
    if (value !== undefined) $(name).value = value;
    show(label, value === undefined ? DASH : `${value} ${unit}`);
  }
}
