// SPDX-License-Identifier: Apache-2.0
// The commissioning of an unknown motor: one card for each step, in their order. A step begins when the user asks for it;
// its result counts when the user accepts it.
import { send } from "./connection.js";
import { $, element, entered, say, show } from "./page.js";

const BADGES = {
  waiting: ["later", ""], next: ["next", "warn"], running: ["measuring", "warn"], found: ["accept or repeat", "warn"],
  accepted: ["accepted", "good"], refused: ["no result", "bad"], writing: ["writing", "warn"], written: ["finished", "good"],
};
const COLUMNS = ["Quantity", "Found", "±", "Bound"];
const NOW = "next";
let cards = {};
let pictures = {};
let isMagnetMeasured = false; // by a step
const mayBegin = {}; // by step: it can be done now, with the consent to a movement if it turns the shaft

function button(id, text, kind, act) {
  const made = Object.assign(element("button", text, kind), { id, type: "button", hidden: true, disabled: true });
  made.onclick = act;
  return made;
}

function ask(type, step, more = {}) {
  say("");
  send({ type, step, ...more });
}

// The consent to a movement is given for one time.
function begin(name) {
  const box = $(`${name}-free`);
  ask("commission_do", name, { may_turn: Boolean(box?.checked) });
  if (box) box.checked = false;
}

function consent(name, limit) {
  const made = Object.assign(element("div", "", "consent"), { id: `${name}-consent` }), label = element("label", "", "check");
  label.append(Object.assign(element("input"), { type: "checkbox", id: `${name}-free`, disabled: true, onchange: () => showBegin(name) }),
    "I confirm that the shaft is free and that nothing can be caught by it. It may turn as described above.");
  made.append(element("p", "To stop: press Stop or Escape, or hide or close this page. Switching is then disabled, and the shaft "
    + `runs down by itself. Beyond ${Math.round(limit)} rpm the inverter disables switching.`), label);
  return made;
}

function heading(id, text) {
  const title = Object.assign(element("h2", text), { id: `${id}-title` });
  title.append(Object.assign(element("span", "", "badge"), { id: `${id}-state` }));
  return title;
}

function results(name) {
  const table = Object.assign(element("table", "", "values results"), { id: `${name}-results`, hidden: true });
  const head = table.createTHead().insertRow();
  head.append(...COLUMNS.map((text) => Object.assign(element("th", text), { scope: "col" })));
  table.createTBody();
  return table;
}

function makeCard({ name, title, does, seconds, turns }, k, limit) {
  const card = Object.assign(element("li", "", "card step"), { id: `step-${name}` });
  card.setAttribute("aria-labelledby", `${name}-title`);
  const bar = Object.assign(element("progress"), { id: `${name}-bar`, max: seconds });
  bar.setAttribute("aria-label", `Progress of the step ${title}`);
  const progress = Object.assign(element("div", "", "progress"), { id: `${name}-progress`, hidden: true });
  progress.append(bar, Object.assign(element("span", "", "quiet"), { id: `${name}-time` }));
  const refused = Object.assign(element("p", "", "warning"), { id: `${name}-refused` });
  refused.setAttribute("role", "alert");
  // The buttons and the progress have one place, above everything that grows.
  const actions = element("div", "", "bar"), stage = Object.assign(element("div", "", "stage"), { id: `${name}-stage` });
  actions.append(button(`${name}-do`, "Do this step", "primary", () => begin(name)),
    button(`${name}-accept`, "Accept", "primary", () => ask("commission_accept", name)));
  stage.append(actions, progress);
  card.append(heading(name, `${k + 1} ${title}`), element("p", `${does[0].toUpperCase()}${does.slice(1)}.`, "does"),
    element("p", `About ${Math.ceil(seconds)} s on the bus. Nothing is changed before the result is accepted.`, "quiet"),
    ...(turns ? [consent(name, limit)] : []), stage, refused, results(name), Object.assign(element("div", "", "pictures"), { id: `${name}-pictures` }));
  return card;
}

// A hidden page has no cards; a reconnected one makes them again.
export function offerWizard(hello) {
  const on = Boolean(hello.commission);
  document.body.classList.toggle("commissioning", on);
  $("wizard").hidden = !on;
  if (!on) return;
  ({ pictures } = hello.commission);
  isMagnetMeasured = hello.commission.measures_magnet;
  document.body.classList.toggle("turning", isMagnetMeasured);
  show("drive-title", "Inverter");
  cards = Object.fromEntries(hello.commission.steps.map((step, k) => [step.name, makeCard(step, k, hello.commission.most_rpm)]));
  $("wizard-steps").replaceChildren(...Object.values(cards));
}

function use(event) {
  event.preventDefault();
  say("");
  const psi_f_mVs = entered($("known-psi"));
  if (isMagnetMeasured) send({ type: "commission_know", name: $("known-name").value });
  else if (psi_f_mVs === null) say("Nothing was changed: the field of the magnet holds no number.");
  else send({ type: "commission_know", name: $("known-name").value, psi_f_mVs, source: $("known-source").value });
}

async function copy() {
  try {
    await navigator.clipboard.writeText($("finish-command").textContent);
    show("finish-copied", "Copied.");
  } catch {
    show("finish-copied", "The browser does not allow it: select the text.");
  }
}

export function startWizard() {
  $("known-form").onsubmit = use;
  $("finish-copy").onclick = copy;
}

function setBadge(id, state) {
  const [text, kind] = BADGES[state];
  show(`${id}-state`, text);
  $(`${id}-state`).className = `badge ${kind}`.trim();
}

// Changes only what differs, so that an open page does not flicker at each batch.
function changed(element, key) {
  if (element.dataset.key === key) return false;
  element.dataset.key = key;
  return true;
}

function showRows(name, rows) {
  const table = $(`${name}-results`);
  table.hidden = !rows.length;
  if (!changed(table, JSON.stringify(rows))) return;
  table.tBodies[0].replaceChildren(...rows.map((row) => {
    const line = document.createElement("tr");
    line.append(...row.map((text) => element("td", text)));
    return line;
  }));
}

// The server draws them in the colours of the theme; a click shows one in its full size.
function showPictures(name, number) {
  const box = $(`${name}-pictures`), { theme } = document.documentElement.dataset;
  if (!changed(box, JSON.stringify([number, theme]))) return;
  const shown = number ? pictures[name] : [];
  box.replaceChildren(...shown.map((alt, k) => {
    const src = `/commission/${name}-${k}.png?number=${number}&theme=${theme}`;
    const link = Object.assign(document.createElement("a"), { href: src, target: "_blank" });
    link.append(Object.assign(document.createElement("img"), { src, alt, width: 832, height: 640 }));
    return link;
  }));
}

function showBegin(name) {
  const box = $(`${name}-free`);
  if (box) box.disabled = !mayBegin[name];
  $(`${name}-do`).disabled = !mayBegin[name] || box?.checked === false;
}

function showCard(name, card, mayAct, isFree) {
  const { state, rows, refused, step_s } = card, can = { do: ["next", "refused", "found"].includes(state), accept: state === "found" };
  setBadge(name, state);
  cards[name].ariaCurrent = state === "waiting" || state === "accepted" ? null : "step";
  for (const [what, shown] of Object.entries(can)) $(`${name}-${what}`).hidden = !shown;
  $(`${name}-accept`).disabled = !(can.accept && mayAct && isFree);
  mayBegin[name] = can.do && mayAct && isFree;
  showBegin(name);
  show(`${name}-do`, state === NOW ? "Do this step" : "Repeat");
  $(`${name}-do`).classList.toggle("primary", state === NOW);
  $(`${name}-progress`).hidden = state !== "running";
  $(`${name}-stage`).hidden = state === "waiting" || state === "accepted";
  if ($(`${name}-consent`)) $(`${name}-consent`).hidden = $(`${name}-stage`).hidden;
  const { max } = $(`${name}-bar`), late = step_s > max;
  $(`${name}-bar`).value = Math.min(step_s, max);
  show(`${name}-time`, late ? `${step_s.toFixed(0)} s: takes longer than usual.` : `${step_s.toFixed(0)} s of about ${Math.ceil(max)} s on the bus. `
    + "Then the result is computed. Stop, or hiding this page, ends the step.");
  show(`${name}-refused`, refused);
  showRows(name, rows);
  showPictures(name, rows.length ? card.number : 0);
}

function showKnown({ name, psi_f_mVs, source, open }, mayAct) {
  for (const id of ["known-name", "known-psi", "known-source", "known-use"]) $(id).disabled = !(mayAct && open);
  const psi = `${Number(psi_f_mVs.toPrecision(4))} mV·s`;
  if (isMagnetMeasured) return show("known-text", `The folder's name will be ${name}. The magnet is measured.`);
  return show("known-text", source ? `Used for ${name}: magnet ${psi} (${source}).`
    : `Without an entry the guess of the nameplate is used, ${psi}: the torque is then as uncertain as this guess.`);
}

function commands(name) {
  return `unzip ${name}.zip
tools/fluxtrue motor check ${name}
cmake --preset host -DFLUXTRUE_MOTOR=$PWD/${name} && cmake --build --preset host
tools/fluxtrue live --motor ${name}`;
}

function showFinish({ state, refused, report }, name) {
  const is = state === "written";
  setBadge("finish", state);
  show("finish-text", is ? "The folder has motor.toml, flux_map.csv, commission.txt and commission.png."
    : state === "writing" ? "The folder is being written." : "After the last step the motor's folder can be downloaded here.");
  show("finish-refused", refused);
  $("finish-result").hidden = !is;
  if (!is) return;
  show("finish-command", commands(/[^\w.+-]/.test(name) ? `'${name}'` : name));
  show("finish-report", report);
  showPictures("finish", 1);
}

export function showWizard({ hello, commission, mayAct }) {
  if (!hello.commission || !commission) return;
  const states = Object.values(commission.cards).map(({ state }) => state), isFree = !states.includes("running");
  for (const [name, card] of Object.entries(commission.cards)) showCard(name, card, mayAct, isFree);
  showKnown(commission.known, mayAct && isFree);
  showFinish(commission.finish, commission.known.name);
}
