# SPDX-License-Identifier: Apache-2.0
"""One co-energy through all bursts, together with the errors of the integrated voltages: (CM-13), (CM-14).

The same splines, penalty and choice of the smoothing as for an imported map (motor/map_import/coenergy.py). Besides the
coefficients of the energy, the least squares have an error of the resistance, of the level of the voltage that a
leg of the inverter loses, and the flux linkage at the start of each burst: while the phase currents are about zero, the
voltage of a leg is unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from fluxtrue_tools.commission.bursts import Linkage
from fluxtrue_tools.motor.flux_model import Array, FluxModel
from fluxtrue_tools.motor.map_import.coenergy import Basis, CoEnergy, System

INTERVALS = 16  # over the longer side of the plane
MARGIN_D = 0.15  # of i_max on the magnetising side
KNOWN = 0.1  # weight of what the voltages cannot show: the energy without current, the magnet's flux linkage
STEADY = 0.5  # of i_max: a sample's error falls with the current as 1/(STEADY + i)
ERROR = 0.05  # of psi, rms: a weighted sample's, against which the other errors are weighed
R_PRIOR, LEVEL_PRIOR_V, START_PRIOR = 0.005, 0.1, 0.05  # of R; volts; of the scale of psi


@dataclass(frozen=True)
class WithMagnet:
    """A surface whose flux linkage without current is another one (a FluxModel)."""

    model: FluxModel
    more_Vs: float

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the d axis or a derivative of it."""
        return self.model.psi_d(i_d, i_q, nd, nq) + (self.more_Vs if nd == nq == 0 else 0.0)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the q axis or a derivative of it."""
        return self.model.psi_q(i_d, i_q, nd, nq)


@dataclass(frozen=True)
class Surface:
    """The energy, the other unknowns, and what is left of each burst."""

    model: CoEnergy
    r_ohm: float
    level_V: float  # lost by a leg
    i: tuple[Array, ...]  # complex, A
    left: tuple[Array, ...]  # complex, V·s, rotor frame
    psi: tuple[Array, ...]  # complex: the flux linkages of the samples, corrected by all that was found
    weights: tuple[tuple[float, float], ...]  # of d and q of each burst
    unknowns: float  # effective number

    @property
    def left_Vs(self) -> float:
        """A robust standard deviation of what is left: 1.48 times the median magnitude."""
        used = [part for rest, (of_d, of_q) in zip(self.left, self.weights, strict=True)
                for part in ((rest.real,) if of_d else ()) + ((rest.imag,) if of_q else ())]  # fmt: skip
        return 1.48 * float(np.median(np.abs(np.concatenate(used))))

    def with_magnet(self, psi_f_Vs: float) -> WithMagnet:
        """The bursts contain little information on the magnet: only what the swing of the rotor adds."""
        return WithMagnet(self.model, psi_f_Vs - float(self.model.psi_d(0.0, 0.0)))


def _plane(bursts: Sequence[Linkage], i_max_A: float) -> tuple[float, float, float]:
    i = np.concatenate([burst.i for burst in bursts]) / i_max_A
    return min(float(i.real.min()), -1.0), max(float(i.real.max()), MARGIN_D), max(float(np.abs(i.imag).max()), 1.0)


def _parts(values: Array) -> Array:
    return np.concatenate((values.real, values.imag))


class _Fit:
    """Rows of all bursts; the unknowns are scaled so that each is about 1."""

    def __init__(self, bursts: Sequence[Linkage], i_max_A: float, r_ohm: float) -> None:
        self.bursts, self.i_max, self.r = bursts, i_max_A, r_ohm
        self.basis = Basis(_plane(bursts, i_max_A), INTERVALS)
        self.scale = float(np.sqrt(np.mean(np.concatenate([np.abs(b.psi) ** 2 for b in bursts]))))
        zero = np.zeros(1)
        self.magnet = self.basis.rows(zero, zero, 1, 0)
        self.zero = self.basis.rows(zero, zero, 0, 0)
        self.others = 2 + 2 * len(bursts)

    def _energy(self, burst: Linkage) -> sparse.csr_matrix:
        """The slopes of the energy, without the magnet's flux at the start."""
        u_d, u_q = burst.i.real / self.i_max, burst.i.imag / self.i_max
        d, q = (self.basis.rows(u_d, u_q, *order) for order in ((1, 0), (0, 1)))
        turned = sparse.csr_matrix(burst.turned.real[:, None]), sparse.csr_matrix(burst.turned.imag[:, None])
        return sparse.vstack((d - turned[0] @ self.magnet, q - turned[1] @ self.magnet), format="csr")

    def _errors(self, n: int) -> Array:
        """Columns of everything else: resistance, level, the two of the flux at the start of each burst."""
        burst = self.bursts[n]
        columns = np.zeros((2 * len(burst.i), self.others))
        columns[:, 0] = _parts(burst.of_r) * R_PRIOR * self.r
        columns[:, 1] = _parts(burst.of_level) * LEVEL_PRIOR_V
        first = 2 + 2 * n
        columns[:, first] = _parts(burst.turned) * START_PRIOR * self.scale
        columns[:, first + 1] = _parts(1j * burst.turned) * START_PRIOR * self.scale
        return -columns / self.scale

    def rows(self, n: int) -> sparse.csr_matrix:
        """All unknowns of a burst's equations, per unit of scale."""
        return sparse.hstack((self._energy(self.bursts[n]), sparse.csr_matrix(self._errors(n))), format="csr")

    def weights(self, n: int) -> Array:
        """The inverse of a sample's error, which is largest where the legs' voltages are unknown: at small currents."""
        one = STEADY + np.abs(self.bursts[n].i) / self.i_max
        of_d, of_q = self.bursts[n].axes
        return np.concatenate((of_d * one, of_q * one))


def fit(bursts: Sequence[Linkage], i_max_A: float, r_ohm: float, psi_f_Vs: float, level_V: float) -> Surface:
    """All unknowns at once; psi_f is that of the nameplate, or the one that the step spin has measured."""
    work = _Fit(bursts, i_max_A, r_ohm)
    others = work.others
    system = System(work.basis.count + others)
    values = [_parts(burst.psi) / work.scale for burst in bursts]
    for n in range(len(bursts)):
        weight = sparse.diags(work.weights(n))
        system.add(sparse.csr_matrix(weight @ work.rows(n)), weight @ values[n])
    for row, value in ((work.magnet, psi_f_Vs / work.scale), (work.zero, 0.0)):
        known = sparse.hstack((row, sparse.csr_matrix((1, others))), format="csr") * KNOWN
        system.add(sparse.csr_matrix(known), np.array([KNOWN * value]), counted=False)
    prior = sparse.hstack((sparse.csr_matrix((others, work.basis.count)), ERROR * sparse.eye(others)), format="csr")
    centre = np.zeros(others)
    centre[1] = level_V / LEVEL_PRIOR_V
    system.add(prior, ERROR * centre, counted=False)
    penalty = np.zeros((work.basis.count + others,) * 2)
    penalty[: work.basis.count, : work.basis.count] = work.basis.penalty()
    unknowns, x = system.solve(penalty, slack=1.0)
    return _surface(work, x, values, unknowns)


def _surface(work: _Fit, x: Array, values: list[Array], unknowns: float) -> Surface:
    count = work.basis.count
    left, psi = [], []
    model = CoEnergy(work.basis, x[:count] * work.scale * work.i_max, work.i_max)
    for n, burst in enumerate(work.bursts):
        rest = (values[n] - work.rows(n) @ x) * work.scale
        half = len(burst.i)
        left.append(rest[:half] + 1j * rest[half:])
        psi.append(model.psi_d(burst.i.real, burst.i.imag) + 1j * model.psi_q(burst.i.real, burst.i.imag) + left[-1])
    level_V = float(x[count + 1]) * LEVEL_PRIOR_V
    r_ohm = work.r + float(x[count]) * R_PRIOR * work.r
    currents, weights = tuple(burst.i for burst in work.bursts), tuple(burst.axes for burst in work.bursts)
    return Surface(model, r_ohm, level_V, currents, tuple(left), tuple(psi), weights, unknowns)
