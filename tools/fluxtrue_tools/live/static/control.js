// SPDX-License-Identifier: Apache-2.0
// Which page has control, shown on every page.
import { badge, $ } from "./page.js";

const TEXTS = { mine: ["control here", "good"], free: ["control free", ""], other: ["control elsewhere", "warn"] };

export function showControl({ hello, live, control }) {
  badge("control", ...TEXTS[control]);
  $("control").classList.toggle("unseen", !live || hello.replay);
}
