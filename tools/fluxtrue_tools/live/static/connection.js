// SPDX-License-Identifier: Apache-2.0
// The connection to the server: messages, reconnection, and the time since the last batch.
import { badge } from "./page.js";

const RECONNECT_MS = 1000;
const CHECK_MS = 200;

let socket = null;
let newest = 0; // when the last batch arrived, in ms
let staleMs = null;
let batch = -1; // its number

export function send(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

export function sendText(text) {
  socket.send(text);
}

// The page reports that it has drawn what has arrived. A page in the background draws nothing and reports that.
export function tellDrawn() {
  if (batch >= 0) send({ type: "drawn", batch, visible: !document.hidden });
}

export function arrived(number) {
  newest = Date.now();
  batch = number;
}

export function setStale(seconds) {
  staleMs = seconds === null ? null : 1000 * seconds;
}

function isOpen() {
  return socket !== null && socket.readyState === WebSocket.OPEN && batch >= 0;
}

export function isStale() {
  return !isOpen() || (staleMs !== null && Date.now() - newest > staleMs);
}

export function showConnection(replay, received) {
  if (!isOpen()) badge("connection", "disconnected", "bad");
  else if (isStale()) badge("connection", "stale", "bad");
  else if (replay) badge("connection", "replay", "warn");
  else if (!received) badge("connection", "no bus", "bad");
  else badge("connection", "live", "good");
}

export function connect(receive, changed) {
  socket = new WebSocket(`ws://${location.host}/ws`);
  socket.onmessage = (event) => receive(JSON.parse(event.data));
  socket.onclose = () => {
    batch = -1;
    changed();
    setTimeout(() => connect(receive, changed), RECONNECT_MS);
  };
}

// A page that is left ends its connection at once. A page in the background reports each batch when it arrives, and one
// that is being closed still does so for a moment, during which simulated time and the torque would go on. If the browser
// keeps the page and shows it again, it connects again.
export function leave() {
  if (socket === null) return;
  socket.onmessage = null;
  socket.close();
}

export function watch(changed) {
  let before = true;
  setInterval(() => {
    if (isStale() !== before) {
      before = isStale();
      changed();
    }
  }, CHECK_MS);
}
