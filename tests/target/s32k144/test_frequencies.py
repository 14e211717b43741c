# SPDX-License-Identifier: Apache-2.0
"""The image at other PWM frequencies, for machines of tests/motors: times on the bus, watchdog, processor load.

The image differs from that of test_faults.py only in the data of the machine.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from in_process import fluxtrue
from load_table import IDENTIFICATIONS, load_row
from planting import PlantedError, relinked, with_error, with_motor

from fluxtrue_tools.bench import baseline, disassembly, figures, sizes
from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import ROOT, Parts
from fluxtrue_tools.emulate.core import Core, State
from fluxtrue_tools.emulate.library import COUNTING
from fluxtrue_tools.motor.bases import periods_per_step
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.target import fits

BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"])
KHZ = (5, 8, 10, 16, 20, 40)
REFRESH = 0xB480_A602
LPO_HZ, LPO_SLOWEST_HZ, LPO_FASTEST_HZ = 128e3, 113e3, 143e3
STARTED_S = 0.08  # start-up, including self-test and start of the watchdog
POLL_S = 10e-6
LOADED_MS = 50
CYCLES, MOST = 2, 4  # columns of Stand.rows()


@pytest.fixture(scope="module")
def hsm1() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", flashed=True)


def _motor(khz: int) -> motors.Motor:
    name = "hsm1" if khz == 10 else f"hsm1_{khz}kHz"
    return motors.read(MotorFolder(name, BUILD / "motors" / name))


def _tables(khz: int) -> Path:
    return _motor(khz).folder.folder / "motor_tables.c"


@pytest.fixture(scope="module", params=KHZ, ids="{}kHz".format)
def parts(request: pytest.FixtureRequest, hsm1: Parts, tmp_path_factory: pytest.TempPathFactory) -> Parts:
    """The image for hsm1 at this frequency, and the emulation's libraries of that machine."""
    if request.param == 10:
        return hsm1
    folder = tmp_path_factory.mktemp(f"{request.param}kHz")
    elf = relinked(hsm1.image, with_motor(hsm1.image, _tables(request.param)), folder)
    return Parts(_motor(request.param), elf, hsm1.layout)


def _step_s(parts: Parts) -> float:
    pwm_hz = parts.motor.plant["pwm_hz"]
    return periods_per_step(pwm_hz) / pwm_hz


def _advance(core: Core, seconds: float) -> None:
    end = core.now_s + seconds
    while end - core.now_s > 1e-8:
        core.run(end - core.now_s)


def _started(parts: Parts, elf: Path | None = None) -> Core:
    core = Core.of_program(parts.emulated().library, elf or parts.image)
    _advance(core, STARTED_S)
    return core


def _services(core: Core, seconds: float) -> list[float]:
    """The times at which the watchdog's counter restarted."""
    found, before, end = [], core.load("WDOG.CNT"), core.now_s + seconds
    while core.now_s < end:
        _advance(core, POLL_S)
        count = core.load("WDOG.CNT")
        if count < before:
            found.append(core.now_s)
        before = count
    return found


def _check_service_once_per_step(parts: Parts, elf: Path | None = None) -> None:
    """Every service lies well inside the open window, for each oscillator frequency within the tolerance."""
    step_s = _step_s(parts)
    with _started(parts, elf) as core:
        assert core.resets == 0
        closed, timeout = core.register("WDOG.WIN"), core.register("WDOG.TOVAL")
        times = _services(core, 10.5 * step_s)
        gaps = [b - a for a, b in pairwise(times)]
        assert len(gaps) >= 9
        assert min(gaps) * LPO_SLOWEST_HZ > 1.5 * closed > 0
        assert max(gaps) * LPO_FASTEST_HZ < timeout / 5
        assert (times[-1] - times[0]) / len(gaps) == pytest.approx(step_s, abs=2 * POLL_S)
        assert core.resets == 0


def _command_before_the_link(folder: Path) -> str:
    """The check of the machine, as the build calls it."""
    command = ["ninja", "-t", "commands", "fluxtrue.elf"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    link = next(line for line in done.stdout.splitlines() if "-o fluxtrue.elf" in line)
    return next(part for part in link.partition("-o fluxtrue.elf")[0].split(" && ") if "target fits" in part)


SHORTEST = ("encoder", "resolver")  # at 40 kHz their fast ISR leaves enough time for the task


@pytest.mark.parametrize("angle", build.FLASHED)
def test_a_machine_is_checked_with_the_sensor_of_its_image_before_it_is_linked(hsm1: Parts, angle: str) -> None:
    """The machines that fits() refuses are tested in tests/tools/target/test_fits.py; here one at 40 kHz."""
    folder = hsm1.image.parent if angle == "encoder" else build.prepare("hsm1", angle=angle, flashed=True).image.parent
    command = _command_before_the_link(folder)
    own = re.search(r"\S+/motor\.json(?= --budget \S+/hal/s32k144/budget\.toml)", command)
    assert own is not None
    for motor, refused in ((own[0], False), (_motor(40).folder.folder / "motor.json", angle not in SHORTEST)):
        words = shlex.split(command.replace(own[0], str(motor)))
        done = fluxtrue(*words[words.index("fluxtrue_tools") + 1 :], cwd=folder)
        assert (done.returncode != 0) == refused, done.stdout + done.stderr
        assert f"with the angle sensor {angle}," in done.stdout + done.stderr


def test_the_times_of_the_bus_hold_within_a_step(parts: Parts, tmp_path: Path) -> None:
    """tests/hil/test_times.py on the image. The discharge time of 5 s is tested on the virtual ECU only."""
    command = [sys.executable, "-m", "pytest", "-q", "-c", str(ROOT / "tests" / "pytest.ini"), "-p",
               "no:cacheprovider", "-p", "no:hypothesispytest", f"--vecu={parts.program}", f"--report={tmp_path}",
               "-k", "not after_5_s", str(ROOT / "tests" / "hil" / "test_times.py")]  # fmt: skip
    environment = os.environ | parts.environment
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert "3 passed" in done.stdout and "skipped" not in done.stdout, done.stdout[-300:]


def _loads(parts: Parts, identification: str) -> tuple[float, float]:
    """Shares of the processor while 80 N·m are requested and the machine accelerates: estimated cycles without wait
    states, and with the most waiting for memories (docs/performance.md)."""
    motor, functions = parts.emulated(COUNTING), disassembly.read(parts.image)
    built = fits.read(motor.folder.folder / "motor.json")
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 1.0, "current_noise_A_rms": 0.5}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        stand = Stand(loop, periods_per_ms=round(built.inverter.pwm_hz / 1000.0))
        loop.set("identification_mode", figures.MODES[identification])
        stand.power_up()
        stand.command.values["TorqueRequested"] = 80.0
        stand.profile(functions, memories=True)
        rows: list[tuple[int, ...]] = []
        for k in range(LOADED_MS):
            stand.run_ms({"plant.speed_rad_s": (5.0 * k, 5.0 * (k + 1))})
            rows += stand.rows()
        assert loop.get("fault_word") == 0
        assert loop.get("truth.torque_Nm") > 50.0
    whole = 1e-3 * LOADED_MS * figures.budget()["core_Hz"]
    return sum(row[CYCLES] for row in rows) / whole, sum(row[MOST] for row in rows) / whole


@pytest.mark.parametrize("identification", ["paper", "robust"])
def test_the_processor_load_is_below_the_share_that_the_build_assumes(parts: Parts, identification: str) -> None:
    """And the README of the port states it."""
    built, port = fits.read(parts.motor.folder.folder / "motor.json"), figures.budget()
    measured = json.loads(fits.MEASURED.read_text(encoding="utf-8"))
    load, waiting = _loads(parts, identification)
    max_load = fits.busy_share(built, port["core_Hz"], measured)
    khz = built.inverter.pwm_hz / 1000.0
    stated = f"{100 * load:.1f} %", f"{100 * waiting:.1f} %"
    print(f"{khz:g} kHz, {identification}: {stated}, at most {100 * max_load:.1f} %")
    assert 0.3 * max_load < load < max_load <= port["busy_share_max"]
    assert load < waiting < 1.0
    if baseline.other_compiler(measured, sizes.compiler()) is None:
        assert load_row(khz)[IDENTIFICATIONS[identification]] == stated


def test_the_watchdog_is_served_in_its_open_window(parts: Parts) -> None:
    _check_service_once_per_step(parts)


def test_a_service_in_the_closed_window_resets_and_a_later_one_does_not(parts: Parts) -> None:
    with _started(parts) as core:
        closed_s = core.register("WDOG.WIN") / LPO_HZ
        snapshot = core.save()
        for after_s, resets in ((0.8 * closed_s, 1), (1.2 * closed_s, 0)):
            core.restore(snapshot)
            before = core.resets
            while not _services(core, POLL_S):
                pass
            _advance(core, after_s)
            core.store("WDOG.CNT", REFRESH)
            _advance(core, POLL_S)
            assert core.resets - before == resets, f"serviced {after_s} s after the last service"
        core.free(snapshot)


@pytest.mark.parametrize("stuck", ["core", "task"])
def test_a_stuck_task_resets(parts: Parts, stuck: str) -> None:
    """core: all interrupts are masked. task: the fast ISR continues, but the task's interrupt no longer comes."""
    with _started(parts) as core:
        timeout_s = core.register("WDOG.TOVAL") / LPO_HZ
        if stuck == "core":
            core.core_state(State.STUCK)
        else:
            core.store("LPIT0.MIER", 0)
        _advance(core, timeout_s - 1.5 * _step_s(parts))
        assert core.resets == 0
        _advance(core, 2 * _step_s(parts))
        assert core.resets == 1


TEN_PERIODS = PlantedError("main.c", "drivable ? motor.bases.periods_per_step", "drivable ? 10U")


def test_a_task_of_ten_periods_at_40_khz_is_found(hsm1: Parts, tmp_path: Path) -> None:
    """With the planted error a step is always ten periods, 0.25 ms here: the watchdog resets, because it is serviced
    in its closed window."""
    parts = Parts(_motor(40), hsm1.image, hsm1.layout)
    elf = relinked(hsm1.image, with_motor(hsm1.image, _tables(40)) | with_error(TEN_PERIODS, tmp_path), tmp_path)
    with pytest.raises(AssertionError, match=r"\.resets"):
        _check_service_once_per_step(parts, elf)
