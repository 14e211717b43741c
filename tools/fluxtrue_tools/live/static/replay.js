// SPDX-License-Identifier: Apache-2.0
// A recorded drive: where it is, pause, and a jump to another time.
import { send } from "./connection.js";
import { $, show } from "./page.js";

let paused = false;

export function startReplay() {
  $("pause").onclick = () => send({ type: "pause", on: !paused });
  $("position").oninput = () => send({ type: "seek", position_s: Number($("position").value) });
}

export function offerReplay(hello) {
  $("replay").hidden = !hello.replay;
}

export function showReplay(replay) {
  if (!replay) return;
  paused = replay.paused;
  $("position").max = replay.length_s;
  if (!$("position").matches(":active")) $("position").value = replay.position_s;
  show("position-value", `${replay.position_s.toFixed(1)} of ${replay.length_s.toFixed(1)} s`);
  show("pause", paused ? "Play" : "Pause");
  $("pause").ariaPressed = String(paused);
}
