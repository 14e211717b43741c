# SPDX-License-Identifier: Apache-2.0
"""fluxtrue motor start: a folder for a motor of which only the nameplate is known.

The firmware needs some inductance, flux and resistance to be built at all. They are guessed from voltage, current and
speed: the magnet's back-EMF reaches the dc voltage at a third of the maximum speed, and its flux divided by the maximum
current is the inductance, as in a machine whose short-circuit current is its maximum current. The gains of the current
control come from a tenth of that inductance, so that the loop gain is never higher than in a finished motor while the
true inductances are at least a tenth of the guess; with larger ones the control is slower.
tests/commission/test_guess.py measures what this leaves from a tenth to ten times the guess.
"""

import math
from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.names import FILE_NAME

ORIGIN = "# Nameplate of a motor, by `fluxtrue motor start`"
BASE_SPEED_SHARE = 1.0 / 3.0  # of the maximum speed
SAFE_SHARE = 0.1  # of the guessed inductance
DROP_SHARE = 0.01  # of the phase voltage across the resistance at i_max
ASSUMED_TURN_PERIODS = 30.0  # PWM periods of a turn of the field at maximum speed, where no speed is given
FULL_SCALE_PER_I_MAX = 1.5
TORQUE_SHARE = 0.95
SPEED = "speed_max_rpm"  # the only datum of the machine that may also be given
INERTIA_PER_NM = 3e-4  # kg m^2: assumed, nothing depends on it before it is measured


def guess(
    i_max_A: float, vdc_V: float, pwm_hz: float, pole_pairs: int, speed_max_rpm: float | None
) -> dict[str, float]:
    """Machine data that follow from the nameplate; a speed that is given is not changed."""
    given_rpm = speed_max_rpm
    if speed_max_rpm is None:
        speed_max_rpm = float(f"{60.0 * pwm_hz / (ASSUMED_TURN_PERIODS * pole_pairs):.3g}")
    omega = pole_pairs * speed_max_rpm * 2.0 * math.pi / 60.0
    phase_V = vdc_V / math.sqrt(3.0)
    psi_f = phase_V / (BASE_SPEED_SHARE * omega)
    torque = TORQUE_SHARE * 1.5 * pole_pairs * psi_f * i_max_A
    inductance = psi_f / i_max_A
    found = {"r_ohm": DROP_SHARE * phase_V / i_max_A, "torque_max_Nm": torque, "speed_max_rpm": speed_max_rpm,
             "inertia_kgm2": INERTIA_PER_NM * torque, "ld_H": SAFE_SHARE * inductance, "lq_H": SAFE_SHARE * inductance,
             "psi_f_Vs": psi_f}  # fmt: skip
    rounded = {key: float(f"{value:.4g}") for key, value in found.items()}
    return rounded if given_rpm is None else rounded | {SPEED: given_rpm}


def text(name: str, i_max_A: float, vdc_V: float, pwm_hz: float, pole_pairs: int, full_scale_A: float,
         data: dict[str, float], is_speed_given: bool) -> str:  # fmt: skip
    """motor.toml with the data of guess()."""
    lines = [f"{ORIGIN}; `fluxtrue commission` replaces what is guessed.",
             "", "[machine]", f'name = "{name}"', f"pole_pairs = {pole_pairs}", f"i_max_A = {i_max_A:g}",
             "r_temp_coeff_per_K = 0.00393   # copper"]  # fmt: skip
    notes = {"ld_H": "   # a tenth of the guess: gains for any inductance from here on", "lq_H": "   # the same"}
    if is_speed_given:
        notes[SPEED] = ""
    lines += [f"{key} = {value!r}{notes.get(key, '   # guessed')}" for key, value in data.items()]
    lines += ["", "[inverter]", f"vdc_V = {vdc_V:g}", f"pwm_hz = {pwm_hz:g}",
              f"dead_time_s = {min(2e-6, 0.02 / pwm_hz)!r}   # assumed", f"current_full_scale_A = {full_scale_A:g}",
              "adc_bits = 12   # assumed", ""]  # fmt: skip
    return "\n".join(lines)


def _check_free(out: Path) -> None:
    """Guesses replace guesses only: never the data of a motor that was measured or written by hand."""
    path = out / FILE_NAME
    if path.is_file() and ORIGIN not in path.read_text(encoding="utf-8", errors="replace"):
        raise FluxtrueError(f"--out {out}: has a {FILE_NAME} that is not of motor start, allowed: another folder")


def _check(staging: Path, guessed: list[str]) -> None:
    """What motor build would refuse is refused here; a key that the user has not given is said to be guessed."""
    from fluxtrue_tools.motor.motor import load_motor

    try:
        load_motor(staging)
    except FluxtrueError as error:  # its file is in a folder that the user never sees
        said = str(error).replace(f"{staging / FILE_NAME}: ", "nameplate: ")
        if any(said.startswith(f"nameplate: machine.{key} ") for key in guessed):
            said += "; it was guessed from --i-max, --vdc, --pole-pairs and --speed-max: check these"
        raise FluxtrueError(said) from None


@click.command("start", cls=paths.Command)
@click.option("--out", required=True, type=paths.OutputFolder(FILE_NAME), metavar="DIR", help="The motor's folder.")
@click.option("--i-max", required=True, type=kinds.Finite(min=0.1, max=5000.0), metavar="A",
              help="Largest phase current, peak.")  # fmt: skip
@click.option("--vdc", required=True, type=kinds.Finite(min=5.0, max=2000.0), metavar="V", help="Dc voltage.")
@click.option("--pwm", required=True, type=kinds.Finite(min=4.0, max=40.0), metavar="kHz", help="PWM frequency.")
@click.option("--pole-pairs", required=True, type=click.IntRange(1, 50), help="Not measured yet.")
@click.option("--speed-max", type=kinds.Finite(min=1.0, max=200000.0), metavar="rpm",
              help="Largest speed.  [default: guessed]")  # fmt: skip
@click.option("--full-scale", type=kinds.Finite(min=0.1, max=10000.0), metavar="A",
              help="Range of the current measurement.  [default: 1.5 i_max]")  # fmt: skip
def start(out: Path, i_max: float, vdc: float, pwm: float, pole_pairs: int, speed_max: float | None,
          full_scale: float | None) -> None:  # fmt: skip
    """Make a motor folder from a nameplate, for `fluxtrue commission`."""
    from fluxtrue_tools.motor.map_import.folder import name_from

    _check_free(out)
    data = guess(i_max, vdc, 1e3 * pwm, pole_pairs, speed_max)
    guessed = [key for key in data if key != SPEED or speed_max is None]
    with paths.outputs() as outputs:
        staging = outputs.scratch(out)
        wanted = text(name_from(out), i_max, vdc, 1e3 * pwm, pole_pairs, full_scale or FULL_SCALE_PER_I_MAX * i_max,
                      data, speed_max is not None)  # fmt: skip
        (staging / FILE_NAME).write_text(wanted, encoding="utf-8")
        _check(staging, guessed)
    click.echo(f"nameplate written to {out}; guessed: " + ", ".join(f"{key} = {data[key]:g}" for key in guessed))
