// SPDX-License-Identifier: Apache-2.0
// What can arrive during the step ACTIVE of the wizard, or after the last step: progress, a result, a refusal, the folder.
const { steps } = still.hello.commission, arrive = still.tamper;
const ROWS = Array.from({ length: 12 }, (_, k) => [`Quantity ${k} with a long name`, `${k}.45 mΩ`, "0.02 mΩ", "± at most 0.21 mΩ"]);
const REFUSED = "A reason of several lines: ".repeat(10);
const CARDS = [{ state: "running", step_s: 3 }, { state: "running", step_s: 999 }, { state: "found", rows: ROWS, number: 1 },
  { state: "refused", refused: REFUSED }, { state: "found", rows: ROWS.slice(1), number: 2 }, { state: "next" }];
const FINISH = [{ state: "writing" }, { state: "written", report: "A line of the report\n".repeat(60) }];
let cycle = 0;

still.tamper = (message) => {
  const told = arrive(message);
  if (told.type !== "rows") return told;
  const none = { state: "waiting", rows: [], refused: "", step_s: 0, number: 0 };
  const card = (name, k) => {
    if (k < ACTIVE) return { ...message.commission.cards[name], state: "accepted" };
    return { ...none, ...(k === ACTIVE ? CARDS[cycle % CARDS.length] : {}) };
  };
  const end = ACTIVE < steps.length ? { state: "waiting" } : FINISH[cycle % FINISH.length];
  cycle++;
  return { ...told, commission: {
    cards: Object.fromEntries(steps.map(({ name }, k) => [name, card(name, k)])),
    known: { name: "my-motor", psi_f_mVs: 160.8, open: cycle % 3 > 0, source: cycle % 2 ? "" : "a data sheet with a long name" },
    finish: { refused: "", report: "", ...end } } };
};
