# SPDX-License-Identifier: Apache-2.0
"""The demagnetisation limit of i_d over the temperature of the magnets, docs/theory/limits.md (LM-10).

motor.toml gives the limit at 20 °C and its decrease per kelvin: between and beyond two measured temperatures that is a
straight line. The limit acts on i_d alone. The knee of the magnets' characteristic, the field of i_q in parts of a
magnet, and what a demagnetised magnet has lost are not modelled.
"""

from fluxtrue_tools.motor.config import MotorConfig

COLD_C = 20.0  # the temperature of magnet.i_d_demag_A


def limit_A(config: MotorConfig, celsius: float) -> float:
    """Magnitude of the most negative i_d that the magnets withstand."""
    assert config.magnet.i_d_demag_A is not None
    return max(config.magnet.i_d_demag_A - config.magnet.i_d_demag_A_per_K * (celsius - COLD_C), 0.0)


def hottest_C(config: MotorConfig) -> float:
    """The hottest magnets that the firmware calculates with: assumed, or as hot as the winding at its trip."""
    return max(config.magnet.assumed_C, config.thermal.winding_trip_C)


def withstands_C(config: MotorConfig, current_A: float) -> float | None:
    """Magnet temperature at which the limit is this current; None where the limit does not depend on temperature."""
    assert config.magnet.i_d_demag_A is not None
    slope = config.magnet.i_d_demag_A_per_K
    return COLD_C + (config.magnet.i_d_demag_A - current_A) / slope if slope else None


def demagnetisation_lines(config: MotorConfig) -> list[str]:
    """The lines of report.txt."""
    magnet, i_max = config.magnet, config.machine.i_max_A
    if magnet.i_d_demag_A is None:
        return ["demagnetisation limit: magnet.i_d_demag_A is not given, only i_max_A limits i_d"]
    hottest, reached = hottest_C(config), withstands_C(config, i_max)
    slope = f"{magnet.i_d_demag_A_per_K:g} A less per K" if reached is not None else "the same at any temperature"
    lines = [
        f"demagnetisation limit: i_d from -{magnet.i_d_demag_A:g} A at {COLD_C:g} °C, {slope}; not contained in the "
        "envelope, losses and current references of this report"
    ]
    if reached is None:
        return lines
    for celsius in sorted({magnet.assumed_C, hottest}):
        lines.append(f"  magnets at {celsius:>3g} °C   -{limit_A(config, celsius):.4g} A")
    if reached > COLD_C:
        lines.append(f"  i_max_A            withstood up to {min(reached, hottest):.0f} °C")
    return lines
