// SPDX-License-Identifier: Apache-2.0
// The values of the last seconds, message by message.

export const WINDOW_S = 20;

// Columns that share their times.
class Ring {
  constructor(names) {
    this.names = names;
    this.clear();
  }

  clear() {
    this.data = [[], ...this.names.map(() => [])];
  }

  add(columns) {
    this.data[0].push(...columns.t);
    this.names.forEach((name, k) => this.data[k + 1].push(...columns[name]));
    const newest = this.data[0][this.data[0].length - 1];
    let old = 0;
    while (old < this.data[0].length && this.data[0][old] < newest - WINDOW_S) old++;
    // In pieces: moving the whole array at every batch would cost more than drawing it.
    if (old > 500) this.data.forEach((column) => column.splice(0, old));
  }
}

export const rings = {
  INV_Status: new Ring(["TorqueCommanded", "TorqueEstimated", "Speed"]),
  INV_Currents: new Ring(["IdRef", "IqRef", "Id", "Iq"]),
  INV_Identification: new Ring(["PsiF", "Resistance"]),
  truth: new Ring(["Torque"]),
};

let run = null;

// The groups of one batch. Another run means that the time does not continue: a replay has moved, or the server is new.
export function addGroups(number, groups) {
  if (number !== run) clearRings();
  run = number;
  let rows = 0;
  for (const [name, group] of Object.entries(groups)) {
    if (rings[name]) rings[name].add(group);
    rows += group.t.length;
  }
  return rows;
}

export function clearRings() {
  Object.values(rings).forEach((ring) => ring.clear());
}

export function columns(ring, ...names) {
  const { data } = rings[ring];
  return [data[0], ...names.map((name) => data[rings[ring].names.indexOf(name) + 1])];
}
