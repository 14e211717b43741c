# SPDX-License-Identifier: Apache-2.0
"""Improbable values cause a warning, errors of units are named first, offered values are accepted."""

import dataclasses
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import MOTORS, plane, saturating, straight

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import advice, doubts
from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.motor import load_motor

TESTED = Path(__file__).resolve().parents[2] / "motors"
ID = [-300.0, -200.0, -100.0, 0.0]
IQ = [-300.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0]
HALF = [0.0, 100.0, 200.0, 300.0]
Write = Callable[..., Path]
Psi = Callable[[float, float], tuple[float, float]]

MEANT = ("linear", "saturated", "gem", "prius", "leaf", "pmasynrm", "pmsyrm", "ebike", "spm_12V", "compressor", "servo",
         "truck", "ipmsm_2kW", "estun", "anaheim", "teknic", "hub", "racing", "hsm1_5kHz", "hsm1_8kHz", "hsm1_20kHz",
         "hsm1_40kHz")  # fmt: skip

# A 12 V motor of 30 µH: at any full scale one period of V_b moves the current by more than it.
SMALL: dict[str, dict[str, Any]] = {
    "machine": {"pole_pairs": 4, "r_ohm": 0.015, "i_max_A": 60.0, "torque_max_Nm": 1.0, "speed_max_rpm": 5000.0,
                "inertia_kgm2": 1e-5, "ld_H": 30e-6, "lq_H": 30e-6, "psi_f_Vs": 6e-3},
    "inverter": {"vdc_V": 12.0, "pwm_hz": 20000.0, "current_full_scale_A": 100.0, "dead_time_s": 5e-7},
}  # fmt: skip


def refusal(folder: Path) -> str:
    with pytest.raises(FluxtrueError) as error:
        load_motor(folder)
    text = str(error.value)
    assert text.startswith(str(folder)) and "\n" not in text
    return text


def scaled(psi: Psi, d_factor: float = 1.0, q_factor: float = 1.0, q_offset: float = 0.0, twist: float = 0.0) -> Psi:
    def changed(d: float, q: float) -> tuple[float, float]:
        psi_d, psi_q = psi(d, q)
        return d_factor * psi_d + twist * q * q, q_factor * psi_q + q_offset

    return changed


@pytest.mark.parametrize("motor", [MOTORS / "hsm1", MOTORS / "paper", *(TESTED / name for name in MEANT)],
                         ids=lambda path: path.name)  # fmt: skip
def test_machines_that_are_meant_are_not_doubted(motor: Path) -> None:
    assert doubts.of_motor(load_motor(motor)) == []


def test_dead_time_that_moves_a_small_inductance_by_much_is_doubted(write: Write) -> None:
    """0.02 * 350 V in 0.1 ms on 80 µH: 8.75 A, 3.5 % of 250 A."""
    found = doubts.of_motor(load_motor(write(machine={"ld_H": 80e-6, "torque_max_Nm": 120.0})))
    assert [text for text in found if "move the current by 3.5 % of i_max_A in one PWM period" in text] == found
    assert len(found) == 1
    near = doubts.of_motor(load_motor(write(machine={"ld_H": 92.8e-6, "torque_max_Nm": 120.0})))
    assert "move the current by 3.02 % of i_max_A" in near[0], "not 3 %, which is allowed"
    assert doubts.of_motor(load_motor(write(machine={"ld_H": 100e-6, "torque_max_Nm": 120.0}))) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"psi_f_Vs": 84.0}, "machine.psi_f_Vs = 84 V·s looks like mV·s: .* wanted: V·s .0.084."),
        ({"psi_f_Vs": 100.0}, "machine.psi_f_Vs = 100 V·s looks like mV·s"),
        ({"ld_H": 0.2, "lq_H": 0.5}, "machine.lq_H: .* as if an inductance were in mH; wanted: H"),
        ({"r_ohm": 18.0}, "machine.r_ohm = 18 Ω drops .* as mΩ it would be 0.018 Ω"),
    ],
)
def test_a_slip_of_the_units_is_said_not_its_consequence(write: Write, changes: dict[str, float], words: str) -> None:
    text = refusal(write(machine=changes))
    assert re.search(words, text), text
    assert "too small" not in text and "torque_max_Nm =" not in text


def test_exchanged_axes_of_a_reluctance_machine_are_said_to_be_so(write: Write) -> None:
    """The torque's slope with i_q at i_d = -250 A: 0.084 + 250 (0.5e-3 - 0.9e-3) < 0, -16 mV·s, and -10 mV·s."""
    constants = refusal(write(machine={"ld_H": 0.9e-3, "lq_H": 0.5e-3}))
    assert "machine.ld_H = 0.0009 H, lq_H = 0.0005 H: at i_d = -250 A the torque falls with i_q" in constants
    assert "are the two exchanged?" in constants and "ld_H below 0.000836 H" in constants
    mapped = refusal(write(flux_map=plane(ID, HALF, lambda d, q: (0.19 + 0.9e-3 * d, 0.1e-3 * q))))
    assert "flux_map.csv: at id_A = -250 the torque falls with iq_A" in mapped and "--axes synrm" in mapped
    assert "rad/s" not in constants + mapped


@pytest.mark.parametrize("iq_A", [IQ, HALF])
def test_a_map_in_millivolt_seconds_is_said_to_be_one(write: Write, iq_A: list[float]) -> None:
    text = refusal(write(flux_map=plane(ID, iq_A, scaled(straight, 1e3, 1e3))))
    assert "flux_map.csv: psi_d_Vs = 84 V·s at no current looks like mV·s" in text


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"machine": {"speed_max_rpm": 628.0}},
         r"machine.speed_max_rpm = 628 rpm: .* needs \d+ % .* as rad/s it would be 5997 rpm"),
        ({"machine": {"r_ohm": 2e-5}}, "machine.r_ohm = 2e-05 Ω drops 0.005 V at i_max_A: is it 0.02 Ω"),
        ({"machine": {"inertia_kgm2": 500.0}}, "machine.inertia_kgm2 = 500 kg·m²: .* wanted: kg·m²"),
        ({"identification": {"iron_loss_uncertainty": 0.3}}, "identification.iron_loss_uncertainty has no effect"),
        ({"identification": {"dead_time_uncertainty": 0.3}, "inverter": {"dead_time_s": 0.0, "min_pulse_s": 1e-6}},
         "identification.dead_time_uncertainty has no effect"),
        ({"control": {"dead_time_compensation": 0.9}, "inverter": {"dead_time_s": 0.0}},
         "control.dead_time_compensation has no effect"),
        ({"machine": {"torque_max_Nm": 40.0}}, "torque_max_Nm = 40 N·m: i_max_A = 250 A makes 3.95 times"),
        ({"machine": {"iron_loss_hysteresis": 1300.0}},
         r"iron_loss_hysteresis = 1300, iron_loss_eddy = 0: at \d+ rpm the iron takes .* a warning: 3 %\)"),
        ({"magnet": {"i_d_demag_A": 0.6}}, "magnet.i_d_demag_A = 0.6 A, .* at 150 °C withstand 0.6 A of i_d"),
        ({"magnet": {"i_d_demag_A": 280.0, "i_d_demag_A_per_K": 3.0}}, "magnets at 150 °C withstand 0 A of i_d"),
    ],
)  # fmt: skip
def test_a_value_that_is_hardly_meant_is_warned_of(write: Write, changes: dict[str, Any], words: str) -> None:
    warned = doubts.of_motor(load_motor(write(**changes)))
    assert len(warned) == 1 and re.search(words, warned[0]), warned


@pytest.mark.parametrize("iq_A", [IQ, HALF])
@pytest.mark.parametrize("offset_Vs", [0.02, -0.02])
def test_an_offset_of_psi_q_is_warned_of(write: Write, iq_A: list[float], offset_Vs: float) -> None:
    warned = doubts.of_motor(load_motor(write(flux_map=plane(ID, iq_A, scaled(straight, q_offset=offset_Vs)))))
    assert len(warned) == 1 and f"psi_q_Vs has an offset of {1e3 * offset_Vs:g} mV·s" in warned[0], warned
    assert doubts.of_motor(load_motor(write(flux_map=plane(ID, iq_A, scaled(straight, q_offset=0.004))))) == []


def test_a_map_that_no_energy_belongs_to_is_warned_of(write: Write) -> None:
    """psi_d falls with i_q² while psi_q does not depend on i_d: the curl is 2 twist i_q, by hand 24 % here.

    Mean of i_q² over the half disc: i_max²/4, so rms(curl) = 2·3e-7·125 A = 75 µH; sqrt(0.2·0.5) mH = 316 µH.
    """
    twisted = plane(ID, IQ, scaled(straight, twist=-3e-7))
    motor = load_motor(write(flux_map=twisted, machine={"torque_max_Nm": 100.0}))
    assert doubts.curl(motor.model, 250.0) == pytest.approx(0.237, rel=0.03)
    warned = doubts.of_motor(motor)
    assert any("not reciprocal: d psi_d/d i_q and d psi_q/d i_d differ by 23" in text for text in warned), warned
    assert doubts.curl(load_motor(MOTORS / "hsm1").model, 250.0) < 0.05


@pytest.mark.parametrize(("percent", "is_warned"), [(4.5, False), (5.5, True)])
def test_reciprocity_is_warned_of_from_5_percent_on(write: Write, percent: float, is_warned: bool) -> None:
    """The curl of the test above, 23.7 % at 3e-7, is proportional to the twist."""
    twisted = plane(ID, IQ, scaled(straight, twist=-3e-7 * percent / 23.7))
    warned = doubts.of_motor(load_motor(write(flux_map=twisted, machine={"torque_max_Nm": 100.0})))
    assert bool(warned) == is_warned and all("not reciprocal" in text for text in warned), warned


@pytest.mark.parametrize("place", [0, 2, 15])
@pytest.mark.parametrize(("flux", "error_Vs", "is_warned"), [
    (0, -0.015, True), (0, 0.015, True), (1, 0.045, True), (0, 0.005, False), (1, 0.003, False),
])  # fmt: skip
def test_one_wrong_value_of_a_map_is_warned_of(
    write: Write, place: int, flux: int, error_Vs: float, is_warned: bool
) -> None:
    """Corners and edge of the map; in the mean over the current circle they hardly count."""
    at = [(d, q) for d in ID for q in HALF][place]  # (-300, 0), (-300, 200) or (0, 300)

    def wrong(d: float, q: float) -> tuple[float, float]:
        psi = list(straight(d, q))
        psi[flux] += error_Vs if (d, q) == at else 0.0
        return psi[0], psi[1]

    warned = doubts.of_motor(load_motor(write(flux_map=plane(ID, HALF, wrong), machine={"torque_max_Nm": 100.0})))
    assert bool([text for text in warned if "contradict" in text or "not reciprocal" in text]) == is_warned, warned


def test_tables_that_are_too_coarse_are_warned_of(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    assert (doubts.TABLE_WANTED, doubts.ERROR_WANTED, doubts.ERROR_WANTED_WEAK) == (0.002, 0.0025, 0.005)
    monkeypatch.setattr(doubts, "ERROR_WANTED", 1e-4)
    warned = doubts.of_motor(load_motor(write()))
    assert len(warned) == 1
    assert re.search(r"current references: torque along MTPA is up to .* % of torque_max_Nm = 150 N·m .wanted: 0.01 %.",
                     warned[0])  # fmt: skip


def test_a_map_with_more_detail_than_the_tables_is_warned_of(write: Write) -> None:
    """A machine that saturates within 20 A of its 250 A."""

    def sharp(d: float, q: float) -> tuple[float, float]:
        return 0.084 + 0.2e-3 * d, 0.2e-3 * q + 0.03 * q / (abs(q) + 6.0)

    iq_A = [float(q) for q in (0, 2, 4, 6, 9, 12, 16, 20, 30, 50, 80, 120, 180, 240, 300)]
    folder = write(flux_map=plane(ID, iq_A, sharp), machine={"torque_max_Nm": 100.0})
    warned = doubts.of_motor(load_motor(folder))
    assert any(text.startswith(("current references: torque", "flux tables: torque")) for text in warned), warned


@pytest.mark.parametrize("name", MEANT)
def test_a_top_speed_in_rad_per_s_is_noticed_in_spite_of_field_weakening(name: str) -> None:
    loaded = load_motor(TESTED / name)
    rpm = loaded.config.machine.speed_max_rpm
    machine = loaded.config.machine.model_copy(update={"speed_max_rpm": rpm * math.pi / 30.0})
    config = loaded.config.model_copy(update={"machine": machine})
    warned = doubts.of_motor(dataclasses.replace(loaded, config=config))
    assert any(f"as rad/s it would be {rpm:.0f} rpm" in text for text in warned), warned


def test_the_command_warns_on_the_terminal_and_in_the_report(cli, write: Write, tmp_path: Path) -> None:
    folder = write(machine={"speed_max_rpm": 628.0})
    for arguments in (("check", folder), ("build", folder, "--out", tmp_path / "out", "--no-report")):
        done = cli(*arguments)
        assert done.returncode == 0
        assert done.stderr.startswith("warning: machine.speed_max_rpm = 628 rpm: ") and done.stderr.count("\n") == 1
    assert (tmp_path / "out" / "report.txt").read_text().startswith("warning: machine.speed_max_rpm")


OFFERED = re.compile(r"(\w+\.\w+)(?: = \S+ (?:\S+, )?allowed:)? (up to|from) ([\d.e+-]+)")
UNFIT = [
    {"machine": {"iron_loss_hysteresis": 1e4}},
    {"machine": {"iron_loss_eddy": 1e3}},
    {"inverter": {"v_dc_full_scale_V": 3000.0}},
    *({"machine": {"speed_max_rpm": rpm}} for rpm in (1.0, 2.0, 3.0, 5.0, 7.0)),
]


@pytest.mark.parametrize("full_scale_A", [81.0, 90.0, 100.0, 150.0, 300.0])
def test_a_small_motor_is_accepted_at_any_full_scale_of_its_converter(write: Write, full_scale_A: float) -> None:
    inverter = SMALL["inverter"] | {"current_full_scale_A": full_scale_A}
    assert doubts.of_motor(load_motor(write(machine=SMALL["machine"], inverter=inverter))) == []


@pytest.mark.parametrize("changes", UNFIT, ids=lambda changes: str(list(changes["machine"].items())[-1])
                         if "machine" in changes else "v_dc")  # fmt: skip
def test_what_does_not_fit_is_said_in_the_users_keys_and_the_value_offered_is_accepted(
    write: Write, changes: dict[str, dict[str, Any]]
) -> None:
    text = refusal(write(**changes))
    said = text.split(": the number", 1)[0].split(": between", 1)[0].split("motor.toml: ", 1)[1]
    found = re.match(r"(\w+)\.(\w+) = \S+ ?\S*, allowed: (?:up to|from) (\S+?)(?: |,|$)", said)
    assert found is not None, text
    offers = [(f"{found[1]}.{found[2]}", found[3])]
    offers += re.findall(r"or (\w+\.\w+) (?:up to|from) (\S+)", said)
    for key, value in offers:
        section, name = key.split(".")
        fixed = {k: dict(v) for k, v in changes.items()}
        fixed.setdefault(section, {})[name] = float(value)
        load_motor(write(**fixed))
    assert "-1 to 1" not in text


def test_the_nearest_accepted_value_is_offered_where_accepted_values_have_gaps(write: Write) -> None:
    """As hsm1 at 5 rpm: 12.2 to 14.4 rpm fit, 14.4 to 16.6 rpm do not, from there on all do."""
    config = load_motor(write()).config
    slow = advice.changed(config, "machine.speed_max_rpm", 5.0)
    assert slow is not None

    def fits(tried: MotorConfig) -> None:
        if not (12.13 <= tried.machine.speed_max_rpm <= 14.4 or tried.machine.speed_max_rpm >= 16.6):
            raise FluxtrueError("does not fit")

    text = advice.advice(slow, fits, fits)
    assert text == "machine.speed_max_rpm = 5 rpm, allowed: from 12.2 rpm"


@pytest.mark.parametrize("pole_pairs", [3, 4])
@pytest.mark.parametrize("rpm", range(1, 11))
def test_a_slow_machine_is_accepted_or_refused_by_its_speed(write: Write, rpm: int, pole_pairs: int) -> None:
    folder = write(machine={"speed_max_rpm": float(rpm), "pole_pairs": pole_pairs, "torque_max_Nm": 100.0})
    try:
        load_motor(folder)
    except FluxtrueError as error:
        assert f"motor.toml: machine.speed_max_rpm = {rpm} rpm, allowed: from " in str(error)


@pytest.mark.parametrize(
    ("magnet", "key"),
    [
        ({"i_d_demag_A_per_K": 1.5}, "magnet.i_d_demag_A_per_K: has no effect without magnet.i_d_demag_A"),
        ({"psi_temp_coeff_per_K": -0.002}, "magnet.psi_temp_coeff_per_K: has no effect without magnet"),
        ({"i_d_demag_A": 300.0, "assumed_C": 120.0}, "magnet.assumed_C: has no effect without"),
    ],
)
def test_keys_that_need_another_one_are_refused(write: Write, magnet: dict[str, float], key: str) -> None:
    assert key in refusal(write(magnet=magnet))
    load_motor(write(magnet={"i_d_demag_A": 300.0, "i_d_demag_A_per_K": 0.5} | magnet))


@pytest.mark.parametrize(
    ("iq_A", "psi", "message"),
    [
        (HALF, scaled(saturating, q_factor=-1.0),
         "psi_q_Vs does not rise with iq_A from id_A = -300, iq_A = 0 (line 2) to id_A = -300, iq_A = 100 (line 3); "
         "everywhere: its sign is the other way round, wanted: psi_q_Vs rising with iq_A"),
        (HALF, scaled(straight, q_factor=0.0),
         "to id_A = -300, iq_A = 100 (line 3); it is the same everywhere; wanted: positive incremental inductances"),
        ([-300.0, -200.0, -100.0, 0.0], scaled(saturating, q_factor=-1.0),
         "from id_A = -300, iq_A = 0 (line 5) to id_A = -300, iq_A = -100 (line 4); everywhere: its sign"),
        (HALF, lambda d, q: (0.084 + 0.2e-3 * d, 0.5e-3 * q if q < 300 or d > -300 else 0.01),
         "from id_A = -300, iq_A = 200 (line 4) to id_A = -300, iq_A = 300 (line 5); wanted: positive"),
    ],
)  # fmt: skip
def test_a_flux_that_falls_is_shown_in_the_file(write: Write, iq_A: list[float], psi: Psi, message: str) -> None:
    text = refusal_of_map(write(flux_map=plane(ID, iq_A, psi)))
    assert message in text, text


def refusal_of_map(folder: Path) -> str:
    text = refusal(folder)
    assert "flux_map.csv: " in text
    return text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace(",", ";"), "flux_map.csv:1: columns separated by ';', allowed: by ','"),
        (lambda text: text.replace(",", "\t"), "flux_map.csv:1: columns separated by tabs, allowed: by ','"),
        (lambda text: text.replace("0.024", "1e300", 1), "psi_d_Vs = 1e300, allowed: a finite number from -100000 to"),
    ],
)
def test_a_map_in_another_form_is_named_as_what_it_is(
    write: Write, change: Callable[[str], str], message: str, recwarn: pytest.WarningsRecorder
) -> None:
    text = refusal(write(flux_map=change(plane(ID, HALF, straight))))
    assert message in text, text
    assert not recwarn.list
