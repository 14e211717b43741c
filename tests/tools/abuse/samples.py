# SPDX-License-Identifier: Apache-2.0
"""Valid files of every kind that a command reads."""

import io
import json
import os
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from port_samples import SCRIPT, SOURCE

SCENARIO = """motor = "paper"
duration_s = 0.01
seed = 3
record_every_s = 1e-3
[controller]
torque_loop = true
[profile]
torque_Nm = [[0, 0], [0.005, 20]]
speed_rpm = 500
vdc_V = 340
[plant]
current_gain = [1.0, 1.01, 1.0]
current_noise_A_rms = 0.1
dead_time_s = 1e-6
[[event]]
t = 0.005
set = { identification = false, "plant.magnet_scale" = 0.9 }
[window]
from_s = 0.002
to_s = 0.009
"""
CAMPAIGN = """motor = "paper"
cases = 4
seed = 7
[nominal]
device_drop_V = 1.0
[spread]
lq_scale = [0.9, 1.1]
[plant]
angle_bits = 12
[drive]
duration_s = 2
[windows]
speed_rpm = [[500, 5500, 1]]
low_speed_rpm = [250]
torque_min_Nm = 10
[[controller]]
name = "tables"
set = { torque_loop = false, identification = false }
[check]
controllers = ["tables"]
"""
FAULTS = """fmea = "fmea.csv"
points = [[0.2, 0.5], [0.8, -0.5]]
signs = [1, -1]
[[machine]]
motor = "paper"
current_A = 1000
vdc_V = 500
"""
FMEA_HEAD = """id,element,failure,setup,injection,points,reaction,expected,detect_ms,torque_Nm,torque_ms,against_cm,
current_share,vdc_share,watch_ms,status,witness,result,reference"""
FMEA = (
    FMEA_HEAD.replace("\n", "")
    + """
open,sensor,input open,request=0,plant.current_open_a=1;plant.vdc_gain=x0.7@5..9,rpm>=500;torque!=0,safe_state,\
over_current,5,,50,,,,60,open,paper/0/+,measured,
"""
)
LIST = """device = "CHIP"
guard = "CHIP_REGISTERS_H"
[blocks.tim]
instances = ["TIM"]
interrupts = ["TIM_Overflow"]
[blocks.tim.registers]
SC = ["CLK", "EN"]
"R*" = []
"""
PORT = """core_Hz = 112_000_000
flash_bytes = 98304
ram_bytes = 28672
busy_share_max = 0.75
[pwm]
timer_Hz = 112_000_000
period_ticks_max = 65532
dead_time_ticks_max = 4092
dead_time_share_max = 0.125
"""


def motor_json() -> str:
    """What `target fits` reads of a motor's build."""
    machine = {"pole_pairs": 3, "speed_max_rpm": 10e3}
    return json.dumps({"machine": machine, "inverter": {"pwm_hz": 10e3, "dead_time_s": 2e-6}}, indent=1)


@cache
def elf() -> bytes:
    """A firmware that serves XCP: the virtual ECU, with those of its symbols alone that the tools look for."""
    from fluxtrue_tools.a2l.elf import MOTOR as MOTOR_OBJECT
    from fluxtrue_tools.a2l.elf import OBJECT

    program = Path(os.environ["FLUXTRUE_BUILD_DIR"]) / "motors" / "hsm1" / "fluxtrue_vecu"
    with tempfile.TemporaryDirectory() as folder:
        short = Path(folder) / "elf"
        kept = [f"--keep-symbol={name}" for name in (OBJECT, MOTOR_OBJECT)]
        subprocess.run(["objcopy", "--strip-all", *kept, str(program), str(short)], check=True)
        return short.read_bytes()


@cache
def image() -> bytes:
    """A linked image of a port, for this computer's processor."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.c").write_text(SOURCE)
        (Path(folder) / "a.ld").write_text(SCRIPT)
        command = ["gcc", "-nostdlib", "-static", "-no-pie", "-fno-pie", "-fcf-protection=none", "-Wl,--build-id=none",
                   "-T", "a.ld", "a.c", "-o", "a.elf"]  # fmt: skip
        subprocess.run(command, cwd=folder, check=True)
        return (Path(folder) / "a.elf").read_bytes()


@cache
def dbc() -> str:
    """The DBC of the bus."""
    from fluxtrue_tools.bus.interface import read_interface

    return read_interface().text


@cache
def recording(text: str | None = None) -> bytes:
    """A drive of a few frames with their DBC, or with another text in its place."""
    import can

    from fluxtrue_tools.bus.interface import Interface, read_interface
    from fluxtrue_tools.vecu.mdf import BusLog, Group

    interface, log, torque = read_interface(), BusLog(), Group({"truth.torque_Nm": "Nm"})
    message = interface.message("INV_Status")
    values = {"Crc": 0, "Counter": 0, "State": 4, "TorqueEstimated": 0.0, "TorqueCommanded": 40.0, "Speed": 2000.0}
    for k in range(20):
        data = message.encode(values | {"TorqueEstimated": k})
        log(can.Message(timestamp=7.0 + 0.01 * k, arbitration_id=message.frame_id, data=data, is_extended_id=False))
        torque.add(7.0 + 0.01 * k, float(k))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.mf4"
        log.write(path, Interface("a DBC", text if text is not None else interface.text), [torque])
        return path.read_bytes()


@cache
def steps() -> str:
    """The finished steps of a commissioning, as its work folder keeps them for the valid call."""
    from hashlib import sha256

    import numpy as np
    from abused import MAP, MOTOR

    from fluxtrue_tools.commission import bursts, connection, drag, harmonics, levels, plan, spin, turning, work
    from fluxtrue_tools.commission.steps import Found

    wiring = turning.Connection(4, True, 0.25)
    raw = bursts.Raw(np.array([0j, 1.5 - 2j]), np.array([3j, 4.0 + 0j]), np.array([0.1, 0.2]), np.zeros(2), 1e-4)
    uneven = harmonics.Harmonics([0.01 - 0.02j, 3e-3j, 0j, 1e-4j], [1e-4] * 4, [1e-5j] * 4, 0.07, True)
    found = Found(0.5 - 0.25j, connection.Followed(7.5, -4.01, 0.1, wiring),
                  spin.Spun(wiring, 0.08, 1e-4, 2e-4, 1e-5, 150.0, uneven),
                  drag.Drag(0.06, 1e-4, 0.1, 2e-3, 3e-6, 10.0, 100.0),
                  levels.Resistance(0.02, 1e-5, 1.5, 0.5, np.array([10.0, 20.0]), np.array([0.2, 0.4])),
                  plan.First(2e-4, 5e-4, 200.0), [raw])  # fmt: skip
    belongs = {"--motor": sha256((MOTOR + MAP).encode()).hexdigest(), "--machine": "hsm1", "--seed": "1",
               "connection": "True", "bus": "none"}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        work.Work(Path(folder), belongs).save(("offsets", "resistance"), found)
        return (Path(folder) / work.NAME).read_text()


def arrays() -> dict[str, object]:
    """A flux map by the names of every layout."""
    import numpy as np
    from abused import MAP

    d, q, psi_d, psi_q = np.array([[float(cell) for cell in line.split(",")] for line in MAP.splitlines()[1:]]).T
    return {"i_s": d + 1j * q, "psi_s": psi_d + 1j * psi_q, "Id": d, "Iq": q, "Fd": psi_d, "Fq": psi_q,
            "OP_matrix": np.column_stack((d, d, q)) / 2**0.5,
            "Phi_dqh_mean": np.column_stack((psi_d, psi_q, d))}  # fmt: skip


@cache
def npz() -> bytes:
    """A map in NumPy's format."""
    import numpy as np

    file = io.BytesIO()
    np.savez(file, **arrays())  # type: ignore[arg-type]
    return file.getvalue()


@cache
def mat() -> bytes:
    """A map in MATLAB's format, version 5."""
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, arrays())
    return file.getvalue()
