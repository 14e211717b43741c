// SPDX-License-Identifier: Apache-2.0
// Light and dark: as the system, unless the user has chosen.
import { $ } from "./page.js";

const ORDER = ["auto", "light", "dark"];
const KEY = "fluxtrue-theme";
const system = matchMedia("(prefers-color-scheme: dark)");
let palette = {};

export function color(name) {
  return palette[name] ??= getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

function chosen() {
  const found = localStorage.getItem(KEY);
  return ORDER.includes(found) ? found : "auto";
}

export function startTheme(changed) {
  const apply = () => {
    const theme = chosen();
    document.documentElement.dataset.theme = theme === "auto" ? (system.matches ? "dark" : "light") : theme;
    $("theme-name").textContent = theme;
    palette = {};
    changed();
  };
  $("theme").onclick = () => {
    localStorage.setItem(KEY, ORDER[(ORDER.indexOf(chosen()) + 1) % ORDER.length]);
    apply();
  };
  system.addEventListener("change", apply);
  apply();
}
