# SPDX-License-Identifier: Apache-2.0
"""A small machine in the frame of the rotor, with noise of the sensors: it can be copied at any instant."""

import math

import numpy as np

SUBSTEPS, PERIOD_S = 5, 1e-4
POLE_PAIRS, R, L_D, L_Q, PSI_F, V_DC = 4, 0.021, 0.2e-3, 0.5e-3, 0.93 * 0.084, 350.0  # near the data of motor paper


class Plant:
    """Ideal inverter; the speed approaches its reference in 0.1 s."""

    def __init__(self, speed_rpm: float, noise_A: float = 0.3) -> None:
        self.reference, self.noise_A = speed_rpm * 2 * math.pi / 60, noise_A
        self.psi_d, self.psi_q, self.theta_m, self.omega_m = PSI_F, 0.0, 0.0, 0.0
        self.out = (0.5, 0.5, 0.5, 0.0)
        self.random = np.random.default_rng(8)

    def sample(self) -> tuple[float, ...]:
        """The six inputs of a period."""
        i_d, i_q, theta = (self.psi_d - PSI_F) / L_D, self.psi_q / L_Q, POLE_PAIRS * self.theta_m
        angles = [theta - k * math.tau / 3 for k in range(3)]
        noise = self.random.normal(0.0, self.noise_A, 3)
        phases = [float(i_d * math.cos(x) - i_q * math.sin(x) + n) for x, n in zip(angles, noise, strict=True)]
        return (*phases, V_DC, self.theta_m, 35.0)

    def advance(self, out: tuple[float, ...]) -> None:
        """One period with the outputs of the period before; without switching the current decays."""
        h = PERIOD_S / SUBSTEPS
        for _ in range(SUBSTEPS):
            self.omega_m += h / 0.1 * (self.reference - self.omega_m)
            self.theta_m = (self.theta_m + self.omega_m * h) % math.tau
            theta, omega = POLE_PAIRS * self.theta_m, POLE_PAIRS * self.omega_m
            if self.out[3]:
                u = [V_DC * x * 2 / 3 for x in self.out[:3]]
                u_d = sum(x * math.cos(theta - k * math.tau / 3) for k, x in enumerate(u))
                u_q = -sum(x * math.sin(theta - k * math.tau / 3) for k, x in enumerate(u))
                d, q = self.psi_d - PSI_F, self.psi_q
                self.psi_d += h * (u_d - R / L_D * d + omega * self.psi_q)
                self.psi_q += h * (u_q - R / L_Q * q - omega * (d + PSI_F))
            else:
                self.psi_d = PSI_F + 0.5 * (self.psi_d - PSI_F)
                self.psi_q *= 0.5
        self.out = tuple(out)
