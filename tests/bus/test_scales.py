# SPDX-License-Identifier: Apache-2.0
"""Every motor's quantities fit its signals, and the bus of a small and of a large machine carries their torque."""

import json
import math
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import cantools
import numpy as np
import pytest
from cantools.database.can.signal import Signal
from ecu import BUILD, COMMAND, ROOT, Ecu

from fluxtrue_tools.bus.interface import CONFIGURATION, Interface, read_interface
from fluxtrue_tools.bus.scales import (
    QUANTITIES,
    Need,
    carriers,
    dbc_of,
    declared,
    factors_for,
    standard,
    standard_factors,
)  # fmt: skip
from fluxtrue_tools.motor.build import build
from fluxtrue_tools.motor.bus import needs
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.sim import motor as sim_motor
from fluxtrue_tools.sim.build import MotorFolder

MACHINES = sorted(
    path.parent for top in ("firmware/motors", "tests/motors") for path in (ROOT / top).glob("*/motor.toml")
)
RESOLUTION, RESERVE = 1e-3, 1.2
RANDOM = 1000
SPEED_SHARE = 0.3  # of maximum speed
RPM = math.pi / 30.0


def scaled(text: str) -> list[Signal]:
    """Every signal with a quantity that scales with the motor."""
    messages = cantools.database.load_string(text, "dbc").messages  # type: ignore[union-attr]
    return [signal for message in messages for signal in message.signals if signal.unit in QUANTITIES]


def assert_carried(text: str, wanted: dict[str, Need]) -> None:
    """Resolution and range of every scaled signal, as cantools reads the DBC."""
    for signal in scaled(text):
        need = wanted[QUANTITIES[str(signal.unit)]]
        assert signal.scale <= RESOLUTION * need.rated * (1 + 1e-9), (signal.name, signal.scale, need)
        assert signal.maximum >= RESERVE * need.largest * (1 - 1e-9), (signal.name, signal.maximum, need)
        bits = signal.length - signal.is_signed
        assert signal.maximum <= (2**bits - 1) * signal.scale * (1 + 1e-9), signal.name
        if signal.is_signed:
            assert signal.minimum == -signal.maximum


@pytest.mark.parametrize("folder", MACHINES, ids=lambda folder: folder.name)
def test_the_bus_carries_every_machine_of_the_project(folder: Path) -> None:
    motor = load_motor(folder)
    assert_carried(motor.bus.dbc, needs(motor.config, motor.derived))


def test_the_bus_carries_any_machine_of_the_ranges_of_motor_toml() -> None:
    rng = np.random.default_rng(12)
    spans = {"torque_Nm": (0.01, 1e5), "speed_rpm": (1.0, 2e5), "resistance_mohm": (0.01, 1e5), "flux_mVs": (0.01, 1e5),
             "current_A": (0.1, 5e3), "voltage_V": (5.0, 2e3), "power_kW": (1e-3, 1e4)}  # fmt: skip
    reach = {"resistance_mohm": 6.6, "flux_mVs": 1.15, "current_A": 1.2, "voltage_V": 1.25}
    for _ in range(RANDOM):
        rated = {name: float(np.exp(rng.uniform(math.log(low), math.log(high)))) for name, (low, high) in spans.items()}
        wanted = {name: Need(value, value * reach.get(name, 1.0)) for name, value in rated.items()}
        factors = factors_for(wanted)
        for name, carrier in carriers(standard()).items():
            assert factors[name] <= Decimal(repr(rated[name])) / 1000
            assert factors[name] * carrier.counts >= Decimal("1.2") * Decimal(repr(wanted[name].largest))
            assert f"{factors[name]:e}"[0] in "125"


def test_where_no_factor_does_both_the_range_is_kept() -> None:
    wanted = {name: Need(100.0, 100.0) for name in QUANTITIES.values()} | {"flux_mVs": Need(1.0, 1000.0)}
    assert factors_for(wanted)["flux_mVs"] == Decimal("0.02")  # 0.01 reaches 655, 0.001 of 1 would be 0.001


def test_the_reference_machine_has_the_standard_dbc_byte_for_byte() -> None:
    assert (BUILD / "motors" / "hsm1" / "fluxtrue.dbc").read_bytes() == standard().encode()
    assert dbc_of(standard_factors()) == standard()


def test_a_scale_changes_factors_and_ranges_and_nothing_else() -> None:
    text = dbc_of(standard_factors() | {"torque_Nm": Decimal("0.0005")})
    changed = [(a, b) for a, b in zip(standard().splitlines(), text.splitlines(), strict=True) if a != b]
    assert {a.split()[1] for a, _ in changed if a.startswith(" SG_")} == {
        s.name for s in scaled(text) if s.unit == "Nm"
    }
    assert [a.split()[:3] for a, _ in changed if not a.startswith(" SG_")] == [["VAL_", "545", "InterfaceHash"]]
    assert ' SG_ TorqueRequested : 16|16@1- (0.0005,0) [-5|5] "Nm" INV' in text
    assert " SG_ Resistance : 16|20@1+ (0.001,0) [0|1048.575]" in text


def test_the_hash_changes_with_every_declaration_and_with_nothing_else() -> None:
    text = standard()
    hashes = {Interface("", text).hash}
    for line in (" SG_ Speed :", " SG_ PsiF :", " SG_ Id :"):
        start = text.index(line)
        for before, after in ((line[5:-2], "Other"), ("|16@", "|15@"), ("(", "(2"), ("@1", "@0")):
            at = text.index(before, start)
            hashes.add(Interface("", text[:at] + after + text[at + len(before) :]).hash)
    assert len(hashes) == 13
    assert Interface("", text.replace("Mechanical speed.", "Speed.")).hash in hashes
    assert len(declared(text)) == sum(len(m.signals) for m in read_interface().database.messages)


@pytest.fixture(scope="module", params=["servo", "truck", "hsm1"])
def machine(request: pytest.FixtureRequest) -> sim_motor.Motor:
    """A machine of 2.4 N·m, one of 1150 N·m, and the reference machine."""
    return sim_motor.read(MotorFolder(request.param, BUILD / "motors" / request.param))


@pytest.fixture
def running(machine: sim_motor.Motor) -> Iterator[Ecu]:
    """An ECU in state run, at a third of its speed."""
    ecu = Ecu(machine)
    ecu.power_up(machine.plant["vdc_V"])
    assert ecu.state == "run"
    end_rad_s = SPEED_SHARE * machine.speed_max_rpm * RPM
    for step in range(500):
        ecu.speed_rad_s = end_rad_s * (step + 1) / 500
        ecu.run(1)
    yield ecu
    ecu.close()


@pytest.mark.parametrize("share", [0.013, 0.31, -0.5, 0.97, 1.0, -1.0])
def test_the_torque_that_is_asked_for_is_received_commanded_and_made(running: Ecu, share: float) -> None:
    motor, count = running.motor, running.dbc.get_message_by_name(COMMAND).get_signal_by_name("TorqueRequested").scale
    asked = share * motor.torque_max_Nm
    running.run(400, TorqueRequested=asked)
    base = json.loads(motor.folder.data.read_text())["bases"]["torque_Nm"] / 32768
    assert count <= RESOLUTION * motor.torque_max_Nm
    assert running.get("torque_arbitrated_Nm") == pytest.approx(asked, abs=0.5 * count + base)
    told = running.last["INV_Status"]
    assert told["TorqueCommanded"] == pytest.approx(asked, abs=count + 2 * base)
    assert running.truth("torque_mean_Nm") == pytest.approx(asked, abs=0.015 * motor.torque_max_Nm)
    assert told["TorqueEstimated"] == pytest.approx(asked, abs=0.01 * motor.torque_max_Nm)
    assert str(running.last["INV_Limits"]["RequestLimit"]) == "none"


def test_what_the_bus_tells_are_the_values_of_the_machine(running: Ecu) -> None:
    motor = running.motor
    running.run(600, TorqueRequested=0.5 * motor.torque_max_Nm)
    status, link, identified = (running.last[name] for name in ("INV_Status", "INV_DcLink", "INV_Identification"))
    assert status["Speed"] == pytest.approx(SPEED_SHARE * motor.speed_max_rpm, rel=2e-3)
    assert link["DcVoltage"] == pytest.approx(motor.plant["vdc_V"], rel=5e-3)
    assert identified["PsiF"] == pytest.approx(1e3 * motor.psi_f_Vs, rel=0.02)
    assert identified["Resistance"] == pytest.approx(1e3 * motor.r_ohm, rel=0.3)
    currents = running.last["INV_Currents"]
    assert math.hypot(currents["Id"], currents["Iq"]) == pytest.approx(
        math.hypot(currents["IdRef"], currents["IqRef"]), rel=0.03)  # fmt: skip


def test_a_request_beyond_the_rated_torque_is_limited_and_one_beyond_the_range_refused(running: Ecu) -> None:
    rated = running.motor.torque_max_Nm
    running.run(400, TorqueRequested=1.2 * rated)
    assert str(running.last["INV_Limits"]["RequestLimit"]) == "rated_torque"
    assert running.last["INV_Status"]["TorqueCommanded"] == pytest.approx(rated, rel=0.002)
    before = running.run_until("INV_DiagReceive")["RangeErrors"]
    message = running.dbc.get_message_by_name(COMMAND)
    signal = message.get_signal_by_name("TorqueRequested")
    assert signal.maximum >= RESERVE * rated
    signal.maximum = None  # this sender does not hold to the range
    running.run(10, TorqueRequested=running.torque_end_Nm + signal.scale)
    running.run(30, TorqueRequested=0.0)
    assert running.run_until("INV_DiagReceive")["RangeErrors"] == before + 1


def test_the_inverter_tells_the_hash_of_the_dbc_that_was_built_for_it(machine: sim_motor.Motor) -> None:
    ecu = Ecu(machine)
    ecu.run(150)
    own = read_interface(machine.folder.dbc)
    configuration = ecu.last[CONFIGURATION]
    assert str(configuration["InterfaceHash"]) == "this_file"
    told = {"InterfaceHash": own.hash}
    assert own.mismatch(told) == "" == own.mismatch(None)
    if machine.name != "hsm1":
        message = read_interface().mismatch(told)
        assert f"{own.hash:08X}" in message and f"{read_interface().hash:08X}" in message
        assert "does not describe this inverter" in message and "motor build" in message
    ecu.close()


@pytest.mark.parametrize(("before", "after"), [('(0.1,0) [-1000|1000] "Nm"', '(0.1,0) [-1000|1000] "A"'),
                                               ('(0.1,0) [-1000|1000] "Nm"', '(0.6,0) [-6000|6000] "Nm"')])  # fmt: skip
def test_a_request_in_another_unit_is_obeyed_but_told_before_the_drive_is_enabled(before: str, after: str) -> None:
    """What users of other drives were hurt by: amperes of one version are N·m of the next. No count on the bus shows
    its unit, so the inverter gives six times the torque; the hash tells the vehicle while nothing is enabled yet."""
    signal = f" SG_ TorqueRequested : 16|16@1- {before}"
    assert signal in standard()
    vehicle = Interface("", standard().replace(signal, signal.replace(before, after)))
    ecu = Ecu()
    ecu.run(150)
    assert ecu.state == "standby"
    told = {"InterfaceHash": int(ecu.last[CONFIGURATION]["InterfaceHash"].value)}
    assert "does not describe this inverter" in vehicle.mismatch(told)
    assert Interface("", standard()).mismatch(told) == ""
    ecu.power_up(ecu.motor.plant["vdc_V"])
    meant_Nm = 15.0
    ecu.run(400, TorqueRequested=6.0 * meant_Nm)
    assert ecu.truth("torque_mean_Nm") == pytest.approx(6.0 * meant_Nm, rel=0.03)
    ecu.close()


def test_motor_build_writes_the_dbc_and_the_hash(tmp_path: Path) -> None:
    motor = build(ROOT / "tests" / "motors" / "servo", tmp_path, report=False)
    own = read_interface(tmp_path / "fluxtrue.dbc")
    assert own.largest(COMMAND, "TorqueRequested") == pytest.approx(20.0)
    assert f".interface_hash = {own.hash}u," in (tmp_path / "motor_tables.c").read_text()
    assert json.loads((tmp_path / "motor.json").read_text())["bus"]["interface_hash"] == own.hash
    assert f"interface hash 0x{own.hash:08X}" in (tmp_path / "report.txt").read_text()
    assert motor.bus.interface_hash == own.hash
    per_count = round(0.002 / motor.bases.torque_Nm * 2**31)
    assert f".torque_per_count = {per_count}," in (tmp_path / "motor_tables.c").read_text()
