# SPDX-License-Identifier: Apache-2.0
"""The times of docs/howto/can.md at other PWM frequencies, in simulated time, within one step of the task."""

from collections import defaultdict

import pytest
from ecu import BUILD, Ecu

from fluxtrue_tools.motor.bases import periods_per_step
from fluxtrue_tools.sim import motor as sim_motor
from fluxtrue_tools.sim.build import MotorFolder

# Machines of tests/motors. 22.5 kHz: a step of 1.022 ms.
KHZ = (5.0, 8.0, 16.0, 20.0, 22.5, 40.0)
TORQUE = "torque_commanded_Nm"


class Clocked(Ecu):
    """An ECU at another frequency, one step of its task at a time; `now_ms` is true time."""

    def __init__(self, motor: sim_motor.Motor, pwm_hz: float) -> None:
        super().__init__(motor)
        self.periods = periods_per_step(pwm_hz)
        self.step = 1e3 * self.periods / pwm_hz
        self.steps = 0

    @property
    def now_ms(self) -> float:
        return self.steps * self.step

    def run_for(self, ms: float, **command: object) -> None:
        """Run the steps that cover a time; a command is sent in the step in which its 10 ms have passed."""
        self.command.update(command)
        end = self.now_ms + ms - 1e-6
        while self.now_ms < end:
            due = self.now_ms // 10.0 != (self.now_ms - self.step) // 10.0
            self.step_once(self.periods, due)
            self.steps += 1

    def wait_for(self, state: str, ms: float = 6000.0) -> float:
        """Run until the bus reports this state; the result is the time that it took."""
        start = self.now_ms
        while "INV_Status" not in self.last or self.state != state:
            assert self.now_ms - start < ms, f"{state} wanted, still {self.state}"
            self.run_for(self.step)
        return self.now_ms - start


@pytest.fixture(scope="module", params=KHZ, ids="{:g}kHz".format)
def built(request: pytest.FixtureRequest) -> tuple[sim_motor.Motor, float]:
    """hsm1 with another frequency."""
    name = f"hsm1_{request.param:g}kHz"
    return sim_motor.read(MotorFolder(name, BUILD / "motors" / name)), 1e3 * request.param


@pytest.fixture
def ecu(built: tuple[sim_motor.Motor, float]):
    """An ECU that has just started."""
    made = Clocked(*built)
    yield made
    made.close()


@pytest.fixture
def running(ecu: Clocked) -> Clocked:
    """In state run, without torque."""
    ecu.run_for(100)
    ecu.run_for(20, Mode="torque")
    ecu.run_for(200)
    ecu.run_for(40, Enable=1)
    assert ecu.state == "run"
    return ecu


def test_frames_come_in_their_cycle_within_a_step_and_exactly_in_the_mean(ecu: Clocked) -> None:
    ecu.run_for(1000)
    ecu.sent.clear()
    begin = ecu.now_ms
    seen: dict[int, list[float]] = defaultdict(list)
    for _ in range(round(2000 / ecu.step)):
        before = len(ecu.sent)
        ecu.run_for(ecu.step)
        for _, identifier, _ in ecu.sent[before:]:
            seen[identifier].append(ecu.now_ms)
    for identifier, times in seen.items():
        cycle = ecu.dbc.get_message_by_frame_id(identifier).cycle_time
        assert len(times) == pytest.approx((ecu.now_ms - begin) / cycle, abs=1.01)
        late = [t - times[0] - k * cycle for k, t in enumerate(times)]
        assert max(late) - min(late) < ecu.step + 1e-6, hex(identifier)
    assert set(seen) == {m.frame_id for m in ecu.dbc.messages if "INV" in m.senders and m.cycle_time}


def test_a_lost_command_is_noticed_after_30_ms_and_torque_is_gone_within_50(running: Clocked) -> None:
    running.run_for(300, TorqueRequested=1000.0)
    full = running.get(TORQUE)
    assert full == pytest.approx(132.0, abs=0.1)
    while running.now_ms % 10.0 >= running.step:
        running.run_for(running.step)
    running.run_for(running.step)  # the last command comes in this step
    last = running.now_ms - running.step
    running.talking = False
    falls = gone = 0.0
    while gone == 0.0:
        running.run_for(running.step)
        torque = running.get(TORQUE)
        falls = falls or (running.now_ms - last if torque < full - 0.5 else 0.0)
        gone = running.now_ms - last if torque == 0.0 else 0.0
    assert 30.0 - running.step - 1e-6 <= falls <= 30.0 + running.step + 1e-6
    assert gone <= 50.0


def test_full_torque_takes_50_ms_from_zero(running: Clocked) -> None:
    """The slew rate gives full torque in 40 ms; the jerk limit adds 10 ms."""
    start = running.now_ms
    running.command["TorqueRequested"] = 1000.0
    while running.get(TORQUE) == 0.0:
        running.run_for(running.step)
    first = running.now_ms - running.step
    while running.get(TORQUE) < 132.0 - 0.1:
        running.run_for(running.step)
        assert running.now_ms - start < 200.0
    assert running.now_ms - first == pytest.approx(50.0, abs=2.0 * running.step)


def test_states_last_as_long_as_they_should(ecu: Clocked) -> None:
    """Init lasts at least 50 ms; 2 s without a charged dc link are a fault; the status is sent every 10 ms."""
    ecu.set("precharge_open", 1.0)
    took = ecu.wait_for("standby")
    assert 50.0 <= took <= 50.0 + 10.0 + 2.0 * ecu.step
    ecu.command["Mode"] = "torque"
    ecu.wait_for("precharge")
    took = ecu.wait_for("fault")
    assert took == pytest.approx(2000.0, abs=10.0 + 2.0 * ecu.step)
