# SPDX-License-Identifier: Apache-2.0
"""motor.toml and flux_map.csv of the imported machine."""

import json
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.config import FULL_SCALE_PER_I_MAX, Machine, MotorConfig, complaint
from fluxtrue_tools.motor.map_import.grid import Grid
from fluxtrue_tools.motor.names import FILE_NAME

MAP = "flux_map.csv"
SOURCES = ("flux_map", "ld_H", "lq_H", "psi_f_Vs")
KEY = re.compile(r"[a-z]+\.[A-Za-z0-9_]+")
LEFT_OUT = tuple(f"machine.{name}" for name in SOURCES)  # of --motor: the imported map takes their place
ASSUMED: dict[str, Any] = {
    "machine.r_temp_coeff_per_K": 0.00393,  # copper
    "inverter.dead_time_s": 2e-6,
    "inverter.adc_bits": 12,
}
FULL_SCALES = (1.5, 2.0, 2.7)  # of i_max: the first one that fits
TORQUE_SHARE = 0.98  # of what the map gives
TORQUE_MOST_NM = 1e5  # what motor.toml allows; more is a wrong unit, which is named when the motor is checked


@dataclass
class Settings:
    """Dotted keys of motor.toml, and where each came from."""

    values: dict[str, Any] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)

    def put(self, key: str, value: Any, origin: str) -> None:
        """Set a key; a later origin replaces an earlier one."""
        self.values[key], self.origin[key] = value, origin

    def default(self, key: str, value: Any) -> None:
        """Assume a value where none is given."""
        if key not in self.values:
            self.put(key, value, "assumed")

    def assumed(self) -> list[str]:
        """`key = value` of everything that is assumed."""
        return [f"{key} = {_toml(self.values[key])}" for key, origin in self.origin.items() if origin == "assumed"]

    def need(self, path: Path, *keys: str) -> None:
        """Refuse with every missing key at once."""
        missing = [key for key in keys if key not in self.values]
        if missing:
            raise FluxtrueError(
                f"{path}: missing for motor.toml: {', '.join(missing)}; give them with --set KEY=VALUE, or "
                "with --motor a motor.toml that has them"
            )

    def number(self, key: str, lowest: float) -> float:
        """A value that is needed before motor.toml is checked as a whole."""
        value = self.values[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not lowest <= value < 1e9:
            raise FluxtrueError(f"{self.origin[key]}: {key} = {str(value)[:60]}, allowed: from {lowest:g}")
        return float(value)


NEEDED = ("machine.pole_pairs", "machine.r_ohm", "machine.speed_max_rpm", "machine.inertia_kgm2", "inverter.vdc_V",
          "inverter.pwm_hz")  # fmt: skip


def _keys(data: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for section, values in data.items():
        if isinstance(values, dict):
            flat |= {f"{section}.{key}": value for key, value in values.items()}
        else:
            flat[section] = values
    return flat


def _given(text: str) -> tuple[str, Any]:
    """KEY=VALUE of --set."""
    key, sign, value = text.partition("=")
    allowed = "allowed: SECTION.KEY=VALUE of motor.toml, as in machine.pole_pairs=4"
    if not sign or not KEY.fullmatch(key.strip()):
        raise FluxtrueError(f"--set {text[:60]!r}: {allowed}")
    try:
        return key.strip(), tomllib.loads(f"value = {value.strip()}")["value"]
    except (ValueError, RecursionError):
        raise FluxtrueError(f"--set {text[:60]!r}: not a TOML value; {allowed}, text in quotation marks") from None


def _check_form(origin: Path | str, key: str, value: Any) -> None:
    """Whether motor.toml can have the key and the value at all; what they mean is checked with all of them."""
    if not KEY.fullmatch(key):
        raise FluxtrueError(f"{origin}: {key[:60]!r}: unknown key, allowed: keys of the sections "
                            f"{', '.join(MotorConfig.model_fields)}")  # fmt: skip
    if not isinstance(value, str | int | float):
        raise FluxtrueError(f"{origin}: {strict.quantity(key, value)}, allowed: a number or text")


def _check_left_out(motor: Path, key: str, value: Any) -> None:
    """A value that the imported map replaces must be possible all the same: a typing error is one anywhere."""
    field = Machine.model_fields[key.removeprefix("machine.")]
    try:
        TypeAdapter(field.annotation, config=ConfigDict(strict=True, allow_inf_nan=False)).validate_python(value)
    except ValidationError:
        allowed = strict.allowed(MotorConfig, tuple(key.split(".")), complete=True)
        raise FluxtrueError(f"{motor}: {strict.quantity(key, value)}, allowed: {allowed}; or leave it out, "
                            "the imported map gives the flux") from None  # fmt: skip


def settings(path: Path, facts: dict[str, Any], motor: Path | None, given: tuple[str, ...]) -> Settings:
    """The settings of the file, replaced by --motor, then by --set."""
    found = Settings()
    for key, value in facts.items():
        found.put(key, value, str(path))
    if motor is not None:
        for key, value in _keys(strict.loads(strict.read_text(motor), str(motor))).items():
            _check_form(motor, key, value)
            if key in LEFT_OUT:
                _check_left_out(motor, key, value)
            else:
                found.put(key, value, str(motor))
    for text in given:
        key, value = _given(text)
        if key in LEFT_OUT:
            raise FluxtrueError(f"--set {key}: has no effect, the imported map gives the flux")
        _check_form("--set", key, value)
        found.put(key, value, "--set")
    for key, value in ASSUMED.items():
        found.default(key, value)
    return found


def name_from(folder: Path) -> str:
    """A machine's name from a folder's."""
    kept = re.sub(r"[^A-Za-z0-9 _.+-]", "_", folder.absolute().name)[:48].lstrip(" _.+-")
    return kept or "imported"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


LATER = ("machine.i_max_A", "machine.torque_max_Nm", "inverter.current_full_scale_A")


def check(found: Settings) -> None:
    """Refuse unknown keys and values out of range before any work, by where they came from."""
    whole = Settings(dict.fromkeys(LATER, 1.0) | found.values, found.origin)
    try:
        strict.parse(MotorConfig, motor_toml(whole), FILE_NAME, complaint)
    except FluxtrueError as error:
        said = str(error).removeprefix(f"{FILE_NAME}: ")
        key = re.match(r"[A-Za-z]+\.[A-Za-z0-9_]+", said)
        origin = found.origin.get(key[0], FILE_NAME) if key else FILE_NAME
        raise FluxtrueError(f"{origin}: {said}") from None


def motor_toml(found: Settings) -> str:
    """The file."""
    sections: dict[str, list[str]] = {"machine": [], "inverter": []}
    values = found.values | {"machine.flux_map": MAP}
    for key, value in values.items():
        section, _, name = key.partition(".")
        note = "  # assumed" if found.origin.get(key) == "assumed" else ""
        sections.setdefault(section, []).append(f"{name} = {_toml(value)}{note}")
    lines = []
    for section, keys in sections.items():
        lines += [f"[{section}]", *keys, ""]
    return "\n".join(lines)


def full_scale(i_max_A: float, factor: float) -> float:
    """A current range that leaves a margin for the trip, in two digits."""
    value = factor * i_max_A
    step = 10.0 ** (len(str(int(value))) - 2) if value >= 10.0 else 0.1
    rounded = round(value / step) * step
    return float(f"{max(rounded, FULL_SCALE_PER_I_MAX * i_max_A):.6g}")


def flux_map_csv(grid: Grid, title: str) -> str:
    """The file; the last column is ignored when it is read."""
    lines = [
        f"# {title}",
        "# extrapolated = 1: beyond the points of the source",
        "id_A,iq_A,psi_d_Vs,psi_q_Vs,extrapolated",
    ]
    for k, i_d in enumerate(grid.id_A):
        for j, i_q in enumerate(grid.iq_A):
            lines.append(f"{i_d:.9g},{i_q:.9g},{grid.psi_d_Vs[k, j]:.10g},{grid.psi_q_Vs[k, j]:.10g},"
                         f"{int(grid.extrapolated[k, j])}")  # fmt: skip
    return "\n".join(lines) + "\n"
