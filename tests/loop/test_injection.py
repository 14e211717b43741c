# SPDX-License-Identifier: Apache-2.0
"""The open current loop measured by injection is the sampled linear model; the motor in simulation is the built one."""

import ctypes
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.motor.current_loop import CurrentLoop, Response, current_loop, model_response
from fluxtrue_tools.motor.current_steps import steps
from fluxtrue_tools.motor.injection import measure
from fluxtrue_tools.motor.loop_report import PHASE_MARGIN_MIN_DEG
from fluxtrue_tools.motor.margins import margins
from fluxtrue_tools.motor.motor import Motor, load_motor
from fluxtrue_tools.motor.simulated import Simulated, simulated
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import load

ROOT = Path(__file__).resolve().parents[2]
# A saturated map and dead time; a high resistance at a low voltage; the law for a field that turns far in a period.
MACHINES = {"hsm1": ROOT / "firmware" / "motors" / "hsm1"} | {
    name: ROOT / "tests" / "motors" / name for name in ("spm_12V", "prius")
}
FROM, TO = 0.1, 2.0  # of the crossover

Drive = tuple[Motor, Simulated]


@pytest.fixture(scope="module", params=MACHINES)
def drive(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Drive]:
    motor = load_motor(MACHINES[request.param])
    yield motor, simulated(motor, tmp_path_factory.mktemp(request.param))


def deviation(measured: Response, model: CurrentLoop, pwm_hz: float, crossover_Hz: float) -> tuple[float, float]:
    """Largest ones of gain, dB, and phase, degrees, around the crossover, both directions."""
    size = np.abs(measured.frequency_Hz)
    near = (size >= FROM * crossover_Hz) & (size <= TO * crossover_Hz)
    assert np.count_nonzero(near) >= 10
    ratio = measured.gain[near] / model.gain(np.exp(2j * np.pi * measured.frequency_Hz[near] / pwm_hz))
    return float(np.abs(20 * np.log10(np.abs(ratio))).max()), float(np.abs(np.degrees(np.angle(ratio))).max())


def compared(drive: Drive, share: float, inductance: float, assumed: float = 1.0) -> tuple[float, float]:
    """Measured with so many times the inductances of a model that itself assumes a multiple of the data."""
    motor, data = drive
    speed_rpm, pwm_hz = share * motor.config.machine.speed_max_rpm, motor.config.inverter.pwm_hz
    measured = measure(data, motor, speed_rpm, inductance)
    computed = margins(model_response(motor, speed_rpm, inductance))
    model = current_loop(motor, speed_rpm, assumed * inductance)
    gain_dB, phase_deg = deviation(measured, model, pwm_hz, computed.crossover_Hz)
    print(f"{motor.config.machine.name} {speed_rpm:g} rpm, L {100 * inductance:g} %: {gain_dB:.2f} dB, "
          f"{phase_deg:.2f}°; measured {margins(measured)}, model {computed}")  # fmt: skip
    return gain_dB, phase_deg


@pytest.mark.parametrize("inductance", [0.75, 1.0, 1.25])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_gain_and_phase_are_those_of_the_model(drive: Drive, share: float, inductance: float) -> None:
    """What remains at speed is the iron loss (hsm1) and the dead time (prius), which the model does not know."""
    gain_dB, phase_deg = compared(drive, share, inductance)
    assert gain_dB <= 1.0
    assert phase_deg <= 5.0


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_without_iron_loss_and_dead_time_they_are_exactly_those_of_the_model(drive: Drive, share: float) -> None:
    motor, data = drive
    ideal = {"iron_k_h": 0.0, "iron_k_e": 0.0, "ideal_inverter": 1.0}
    gain_dB, phase_deg = compared((motor, replace(data, plant=data.plant | ideal)), share, 1.0)
    assert gain_dB <= 0.3
    assert phase_deg <= 2.0


@pytest.mark.parametrize(("share", "torque_sign"), [(0.5, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
def test_the_measured_phase_margin_is_40_degrees_and_more_in_each_quadrant(
    drive: Drive, share: float, torque_sign: float
) -> None:
    """With 25 % less inductance than the data, which is the worst."""
    motor, data = drive
    found = margins(measure(data, motor, share * motor.config.machine.speed_max_rpm, 0.75, torque_sign))
    print(f"{motor.config.machine.name}, {share:g} of top speed, torque {torque_sign:+g}: {found}")
    assert found.phase_deg >= PHASE_MARGIN_MIN_DEG


def test_a_model_that_is_wrong_is_found(drive: Drive) -> None:
    """Inductances 15 % off, and half a period of delay left out."""
    assert compared(drive, 0.0, 1.0, assumed=1.15)[0] > 1.0
    motor, data = drive
    measured = measure(data, motor, 0.0)
    pwm_hz = motor.config.inverter.pwm_hz
    early = Response(measured.frequency_Hz, measured.gain * np.exp(1j * np.pi * measured.frequency_Hz / pwm_hz))
    assert deviation(early, current_loop(motor, 0.0), pwm_hz, margins(measured).crossover_Hz)[1] > 5.0


def test_the_data_alone_make_the_drive_that_is_built_for_them(tmp_path: Path) -> None:
    """To the last bit, for a machine with a map: torque steps at speed with everything that identifies."""
    folder = ROOT / "tests" / "motors" / "leaf"
    built = load(str(folder))
    plant = {"imposed_speed": 1.0, "speed_rad_s": 200.0, "current_noise_A_rms": 0.5}
    rows = []
    for loop in (Loop(built.library, built.plant | plant, built.flux_map),
                 simulated(load_motor(folder), tmp_path).loop(plant)):  # fmt: skip
        with loop:
            loop.set("enable", 1.0)
            loop.record(("truth.i_d_A", "truth.i_q_A", "torque_estimated_Nm", "psi_f_Vs", "fault_word"))
            parts = []
            for torque in (0.3, -0.6):
                loop.set("torque_requested_Nm", torque * built.torque_max_Nm)
                parts.append(loop.run(3000))
            rows.append(np.concatenate(parts))
    assert rows[0][:, 4].max() == 0.0 and np.abs(rows[0][-1, 1]) > 10.0
    assert np.array_equal(rows[0], rows[1])


def test_data_of_another_size_are_refused(drive: Drive) -> None:
    _, data = drive
    address = ctypes.addressof(ctypes.c_char.in_dll(data.data, "motor"))
    assert data.library.sim_create_for(address, 8) is None


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_steps_begin_with_the_reference_and_overshoot_as_little_as_they_may(drive: Drive, share: float) -> None:
    """The voltage of the sample at time 0 acts from one period later on; before it nothing moves."""
    motor, data = drive
    for inductance in (0.8, 1.0):
        for step in steps(data, motor, share * motor.config.machine.speed_max_rpm, inductance).values():
            moved = step.change_A[step.axis] / step.step_A
            periods = np.round(step.time_s * motor.config.inverter.pwm_hz)
            print(f"{motor.config.machine.name}, {share:g} of top speed, L {100 * inductance:g} %: i_{step.axis} "
                  f"overshoots by {100 * step.overshoot():.1f} %")  # fmt: skip
            assert abs(moved[periods <= 1].mean()) < 0.05
            assert moved[periods == 3] > (0.1 if motor.config.is_turning else 0.3)
            assert moved[-20:].mean() == pytest.approx(1.0, abs=0.05)
            assert step.overshoot() < 0.15
            assert share or not step.is_limited
