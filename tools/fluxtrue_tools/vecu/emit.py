# SPDX-License-Identifier: Apache-2.0
"""motor.json -> machine_data.c: the plant that fits the firmware's motor, compiled into the virtual ECU.

Usage: python -m fluxtrue_tools.vecu.emit motor.json machine_data.c
"""

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fluxtrue_tools.outputs import write_text
from fluxtrue_tools.sim.motor import plant_parameters

AXES = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")


def _array(name: str, values: Iterable[float]) -> str:
    return f"static const double {name}[] = {{{', '.join(repr(float(v)) for v in values)}}};\n"


def _flat(values: list[Any]) -> list[float]:
    return [x for row in values for x in row] if isinstance(values[0], list) else values


def machine_data_c(data: dict[str, Any]) -> str:
    """The C source for one motor's data; speed is imposed, as on a dynamometer."""
    machine, flux_map = data["machine"], data["map"]
    values = plant_parameters(machine, data["inverter"])
    values |= {"inertia_kgm2": machine["inertia_kgm2"], "imposed_speed": 1.0}
    rows = "".join(f'    {{"plant.{name}", {float(value)!r}}},\n' for name, value in values.items())
    text = "/* SPDX-License-Identifier: Apache-2.0 */\n/* Generated from motor.json. */\n"
    text += '#include <stddef.h>\n\n#include "machine_data.h"\n\n'
    text += f"static const machine_value_t values[] = {{\n{rows}    {{NULL, 0.0}},\n}};\n"
    fields = [f'.motor = "{machine["name"]}"', ".values = values"]
    if flux_map is not None:
        text += "".join(_array(axis, _flat(flux_map[axis])) for axis in AXES)
        fields += [f".nd = {len(flux_map['id_A'])}", f".nq = {len(flux_map['iq_A'])}"]
        fields += [f".{axis} = {axis}" for axis in AXES]
    return text + f"const machine_data_t machine_data = {{{', '.join(fields)}}};\n"


def main(source: str, target: str) -> None:
    """Command line."""
    data = json.loads(Path(source).read_text(encoding="utf-8"))
    write_text(Path(target), machine_data_c(data))


if __name__ == "__main__":
    main(*sys.argv[1:])
