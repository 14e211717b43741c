# SPDX-License-Identifier: Apache-2.0
"""motor build: writes all files or none."""

from pathlib import Path

from fluxtrue_tools.motor.emit_c import motor_si_c, motor_tables_c
from fluxtrue_tools.motor.emit_json import motor_json
from fluxtrue_tools.motor.motor import Motor, load_motor, naming
from fluxtrue_tools.motor.names import BUILT, DBC_NAME, HTML, PLOTS, TEXT, source_files
from fluxtrue_tools.motor.report import report_text
from fluxtrue_tools.outputs import Outputs


def generate(motor: Motor) -> dict[str, str]:
    """Every file as text; refuses numbers that do not fit the firmware's formats."""
    return {
        "motor_tables.c": motor_tables_c(motor),
        "motor_si.c": motor_si_c(motor),
        "motor.json": motor_json(motor),
        DBC_NAME: motor.bus.dbc,
        TEXT: report_text(motor),
    }


def build(folder: Path, out: Path, report: bool) -> Motor:
    """The function of `motor build` for other tools."""
    outputs = Outputs()
    outputs.reads(folder, *source_files(folder))
    outputs.folder("--out", out, BUILT)
    with outputs:
        return build_into(folder, outputs, out, report)


def build_into(folder: Path, outputs: Outputs, out: Path, report: bool) -> Motor:
    """Generate everything for one motor. Old files stay until every new one is complete."""
    motor = load_motor(folder)
    with naming(folder):
        files = generate(motor)
    staging = outputs.scratch(out)
    for name, text in files.items():
        (staging / name).write_text(text, encoding="utf-8")
    drawn: list[str] = []
    if report:
        from fluxtrue_tools.motor.html import write_report

        drawn = write_report(motor, files[TEXT], staging)
    for name in {HTML, *PLOTS} - set(drawn):  # a file of an older build would seem to belong to these tables
        outputs.remove(out, name)
    return motor
