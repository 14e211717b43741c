# SPDX-License-Identifier: Apache-2.0
"""Voltage and torque of a perturbed drive as functions of its measured currents, docs/theory/information-bound.md.

Units    SI; complex numbers d + jq in the controller's frame; amplitude-invariant
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.sample import Sample

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STATES: Final = ("resistance", "magnet", "lq", "ld_slope", "cross", "dead_time", "device_drop", "vdc_gain",
                 "current_gain", "angle", "iron")  # fmt: skip
"""Everything uncertain that acts on means over whole turns; factors, but the drop in V and the angle in rad."""


KEPT: Final = 40
"""Sets of currents: a voltage needs four, and eight voltages lie between two that have them in common."""


@dataclass(frozen=True)
class Physics:
    """Constants of the model."""

    machine: Machine
    iron_k_h: float
    iron_k_e: float
    dead_V: float  # nominal loss of a leg to dead time
    r_ohm: float  # at the reported temperature
    kept: dict[tuple[tuple[int, ...], bytes], tuple[Array, Array, Array]] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )

    def split(self, x: Array) -> dict[str, float]:
        """The state vector by name."""
        return dict(zip(STATES, x, strict=True))

    def _linkages(self, i: Complex) -> tuple[Array, Array, Array]:
        """Nominal psi_d without i_d, psi_d and psi_q.

        Most columns of a Jacobian begin with the same currents, and those of the states that do not act on the flux
        have the same ones throughout. Therefore the last ones are kept.
        """
        model, key = self.machine.model, (np.shape(i), i.tobytes())
        if key not in self.kept:
            while len(self.kept) >= KEPT:
                del self.kept[next(iter(self.kept))]
            self.kept[key] = model.psi_d(0.0, i.imag), model.psi_d(i.real, i.imag), model.psi_q(i.real, i.imag)
        self.kept[key] = self.kept.pop(key)  # the last one used is the last one dropped
        return self.kept[key]

    def _flux(self, s: dict[str, float], i: Complex) -> Complex:
        psi_f = self.machine.model.psi_d(0.0, 0.0)
        axis, at_d, at_q = self._linkages(i)
        psi_d = s["magnet"] * psi_f + s["cross"] * (axis - psi_f) + s["ld_slope"] * (at_d - axis)
        return np.asarray(psi_d + 1j * s["lq"] * at_q)

    def _inside(self, s: dict[str, float], i_seen: Complex, omega: Array) -> tuple[Complex, Complex, Complex]:
        """True current (IB-1), magnetising current (IB-2) and flux."""
        i = i_seen / s["current_gain"] * np.exp(1j * s["angle"])
        per_flux = s["iron"] * (self.iron_k_h * np.sign(omega) + self.iron_k_e * omega) / 1.5
        i_m = i
        for _ in range(3):  # the iron-loss current is a few percent of the current; three steps leave 1e-6 of it
            i_m = i - 1j * per_flux * self._flux(s, i_m)
        return i, i_m, self._flux(s, i_m)

    def voltage(self, x: Array, i_seen: Complex, omega: Array) -> Complex:
        """(IB-3): the voltage that the controller must command, in its frame, for the currents that it measures."""
        s = self.split(x)
        i, _, psi = self._inside(s, i_seen, omega)
        lost = 4.0 / np.pi * (s["dead_time"] * self.dead_V + s["device_drop"])
        u = s["resistance"] * self.r_ohm * i + 1j * omega * psi + lost * i / np.maximum(np.abs(i), 1e-9)
        return np.asarray(s["vdc_gain"] * u * np.exp(-1j * s["angle"]))

    def torque(self, x: Array, i_seen: Complex, omega: Array) -> Array:
        """(IB-4): air-gap torque at the currents that the controller measures."""
        _, i_m, psi = self._inside(self.split(x), i_seen, omega)
        return np.asarray(1.5 * self.machine.pole_pairs * (np.conj(psi) * i_m).imag)

    def seen(self, x: Array, i_true: Complex) -> Complex:
        """The inverse of (IB-1): the current that the controller measures."""
        s = self.split(x)
        return np.asarray(i_true * s["current_gain"] * np.exp(-1j * s["angle"]))


def physics_of(machine: Machine, drawn: Sample) -> Physics:
    """Nominal constants; the resistance is that of the reported temperature."""
    plant = machine.motor.plant
    told = machine.motor.r_ohm * (1.0 + machine.r_temp_coeff_per_K * (drawn.plant["winding_C"] - 20.0))
    dead = machine.vdc_V * plant["dead_time_s"] * plant["pwm_hz"]
    return Physics(machine, machine.nominal.iron_k_h, machine.nominal.iron_k_e, dead, told)


def truth_of(machine: Machine, drawn: Sample) -> Array:
    """The state vector with the plant's true values."""
    f = drawn.factors
    r_told = machine.motor.r_ohm * (1.0 + machine.r_temp_coeff_per_K * (drawn.plant["winding_C"] - 20.0))
    gain = float(np.mean([f[f"current_gain_{phase}"] for phase in "abc"]))
    return np.array([
        machine.motor.r_ohm * f["resistance_scale"] / r_told, f["magnet_scale"], f["lq_scale"], f["ld_slope_scale"],
        f["cross_saturation_scale"], f["dead_time_scale"], drawn.plant["device_drop_V"], f["vdc_gain"], gain,
        np.radians(f["angle_offset_deg"]), f["iron_loss_scale"],
    ])  # fmt: skip
