// SPDX-License-Identifier: Apache-2.0
// Why torque is refused or limited, and what to do: in the words that the server sends with its greeting.
import { $, element, show } from "./page.js";

const STATE = "INV_Status.State";

export function wordsOf(hello, path, value) {
  return hello.words[path][value] || [`${path} ${value}`, "Not known to this page.", ""];
}

export function reason([name, text, advice], kind = "") {
  const row = element("li", "", kind);
  row.append(element("b", name), element("span", text), element("em", advice));
  return row;
}

// Signals that give a reason, and the states in which they do.
const RUNNING = ["run", "derate"];
const SHOWN = [
  ["INV_DcLink", "RefusedReason", (state) => !RUNNING.includes(state), "Refused"],
  ["INV_DcLink", "DeratingReason", (state) => RUNNING.includes(state), "Derated"],
  ["INV_Limits", "RequestLimit", (state) => RUNNING.includes(state), "Limited"],
];

function reasons({ hello, live, last, status }) {
  if (!live || !last) return [];
  return SHOWN.filter(([message, signal, when]) => last[message]?.[signal] && when(status.state))
    .map(([message, signal, , title]) => {
      const [name, ...rest] = wordsOf(hello, `${message}.${signal}`, last[message][signal]);
      return [`${title}: ${name}`, ...rest];
    });
}

export function showReasons(view) {
  const { hello, live, last, control } = view;
  const found = reasons(view);
  const key = JSON.stringify(found);
  if ($("reasons").dataset.key !== key) {
    $("reasons").dataset.key = key;
    $("reasons").replaceChildren(...found.map((words) => reason(words)));
  }
  const state = last?.INV_Status?.State;
  if (!live) show("hint", "No values: this page is not connected to the inverter. Check server, bus and supply.");
  else if (hello.replay) show("hint", "A recorded drive: nothing is commanded.");
  else if (control === "other") show("hint", "Another page has control. This page shows values; Stop acts from here, too.");
  else show("hint", state === undefined ? "" : wordsOf(hello, STATE, state).slice(1, hello.commission ? 2 : 3).join(" "));
}
