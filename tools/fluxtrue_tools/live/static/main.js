// SPDX-License-Identifier: Apache-2.0
// Puts the parts of the page together: one view of what the server has said, shown by every part.
import { onCapture } from "./capture.js";
import { chartsChanged, showCharts, startCharts, stats } from "./charts.js";
import { arrived, connect, isStale, leave, send, sendText, setStale, showConnection, tellDrawn, watch } from "./connection.js";
import { showControl } from "./control.js";
import { showFaults, startFaults } from "./faults.js";
import { showFreezeFrame } from "./freeze.js";
import { showNumbers, startNumbers } from "./numbers.js";
import { offerScope, onScope, showScope, startScope } from "./oscilloscope.js";
import { say, show } from "./page.js";
import { onParameters, showParameters, startParameters } from "./parameters.js";
import { ranges, recolor } from "./plot.js";
import { onRecording, showRecording, startRecording } from "./recording.js";
import { showReasons } from "./reasons.js";
import { offerReplay, showReplay, startReplay } from "./replay.js";
import { addGroups, rings } from "./rings.js";
import { setStandRange, showStand, startStand } from "./stand.js";
import { startTheme } from "./theme.js";
import { setTorqueRange, showTorque, startTorque } from "./torque.js";
import { offerWizard, showWizard, startWizard } from "./wizard.js";

const PARTS = [showTorque, showReasons, showNumbers, showFaults, showStand, showParameters, showRecording, showControl,
  showCharts, showScope, showWizard];
const NONE = { replay: false, scope: null, tuning: false, commission: null, title: "", words: {}, factors: {}, stand: {} }; // before the greeting
const said = { hello: NONE, status: null, last: null, scope: null, commission: null, control: "free" };

// What the parts show. The page is present while it receives messages from the server. If the inverter sends, too, it is
// live; otherwise it shows no values, and none of its controls acts but the end of a recording.
function view() {
  const { hello, status } = said;
  const present = status !== null && !isStale();
  const live = present && status.state !== "", mayCommand = !hello.replay && said.control !== "other";
  return { ...said, present, live, mayAct: live && mayCommand, mayEnd: present && mayCommand };
}

function showAll() {
  const now = view();
  document.body.classList.toggle("stale", !now.live);
  PARTS.forEach((part) => part(now));
  showConnection(now.hello.replay, now.status?.state);
}

function onHello(hello) {
  Object.assign(said, { hello, status: null, last: null, scope: null, commission: null, control: "free" });
  show("title", hello.title);
  setStale(hello.stale_s);
  setTorqueRange(hello);
  setStandRange(hello);
  offerReplay(hello);
  showFreezeFrame(hello, { frozen: false });
  offerScope(hello);
  offerWizard(hello);
  startCharts(!hello.commission);
}

function onRows(message) {
  const { control } = said;
  stats.rows += addGroups(message.run, message.groups);
  stats.batches++;
  arrived(message.batch);
  said.control = message.control;
  if (message.status) Object.assign(said, { status: message.status, last: message.last, scope: message.scope });
  if (message.commission) said.commission = message.commission;
  if (message.status || control !== said.control) showAll();
  else if (message.commission) showWizard(view());
  showReplay(message.replay);
  chartsChanged(message.run);
  if (document.hidden) tellDrawn();
}

// A control that an answer enables acts from the answer on, not only from the next state on.
function answered(show) {
  return (message) => { show(message); showAll(); };
}

const HANDLERS = {
  hello: onHello,
  rows: onRows,
  refused: (message) => say(message.text),
  recording: onRecording,
  parameters: answered(onParameters),
  scope: onScope,
  capture: onCapture,
  freeze: (message) => showFreezeFrame(said.hello, message),
};

[startTorque, startNumbers, startFaults, startStand, startParameters, startRecording, startReplay, startScope, startWizard].forEach((start) => start());
startTheme(() => { recolor(); showWizard(view()); });
document.addEventListener("visibilitychange", () => { if (document.hidden) tellDrawn(); });
window.addEventListener("pagehide", leave);
connect((message) => HANDLERS[message.type](message), showAll);
watch(showAll);
window.fluxtrue = { ranges, rings, stats, send, sendText, say }; // read by the browser tests
