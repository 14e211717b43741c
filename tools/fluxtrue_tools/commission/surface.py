# SPDX-License-Identifier: Apache-2.0
"""One co-energy through all bursts, together with the errors of the integrated voltages: (CM-13), (CM-14).

The same splines, penalty and choice of the smoothing as for an imported map (motor/map_import/coenergy.py). Besides the
coefficients of the energy, the least squares have an error of the resistance, of the level of the voltage that a
leg of the inverter loses, and the flux linkage at the start of each burst: while the phase currents are about zero, the
voltage of a leg is unknown.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from fluxtrue_tools.commission.bursts import Linkage, Raw, integrate
from fluxtrue_tools.commission.noise import Noise, of_signs
from fluxtrue_tools.motor.flux_model import Array, FluxModel
from fluxtrue_tools.motor.map_import.coenergy import Basis, CoEnergy, System

INTERVALS = 16  # over the longer side of the plane
MARGIN_D = 0.15  # of i_max on the magnetising side
MEASURED, GIVEN, GUESSED = 0.01, 0.1, 0.5  # errors of the magnet's flux linkage, by where it comes from
ERROR, STEADY = 0.05, 0.5  # of psi, rms, and of i_max: until there is a map, a sample's error is ERROR/(STEADY + i)
RESOLUTION = 0.001  # of psi, rms: error of a sample beside its noise
R_PRIOR, LEVEL_PRIOR_V, START_PRIOR = 0.002, 0.1, 0.05  # of R; volts; of psi, rms
PRICE, LEAST = 1.4, 1.0  # of an unknown in the score of the smoothing; the least smoothing
RASTER = 49  # values of each current from 0 to i_max at which both flux linkages must rise


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


class Rising:
    """(CM-50): whether each flux linkage rises with its own current, in the whole rectangle of the map."""

    def __init__(self, basis: Basis) -> None:
        u_d, u_q = np.meshgrid(np.linspace(-1.0, 0.0, RASTER), np.linspace(0.0, 1.0, RASTER))
        self.count = basis.count
        self.slopes = sparse.vstack([basis.rows(u_d.ravel(), u_q.ravel(), *order) for order in ((2, 0), (0, 2))])

    def __call__(self, x: Array) -> bool:
        """Of a solution that begins with the coefficients of the energy."""
        return bool(np.all(self.slopes @ x[: self.count] > 0.0))


class _Fit:
    """Rows of all bursts; the unknowns are scaled so that each is about 1."""

    def __init__(self, raws: Sequence[Raw], i_max_A: float, r_ohm: float, knee_A: float) -> None:
        self.raws, self.i_max, self.r = raws, i_max_A, r_ohm
        self.bursts = [integrate(raw, r_ohm, knee_A) for raw in raws]
        self.basis = Basis(_plane(self.bursts, i_max_A), INTERVALS)
        self.scale = float(np.sqrt(np.mean(np.concatenate([np.abs(b.psi) ** 2 for b in self.bursts]))))
        zero = np.zeros(1)
        self.magnet = self.basis.rows(zero, zero, 1, 0)
        self.zero = self.basis.rows(zero, zero, 0, 0)
        self.rising = Rising(self.basis)
        self.others = 2 + 2 * len(raws)
        self.rows = [self._rows(n) for n in range(len(raws))]

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

    def _rows(self, n: int) -> Array:
        """All unknowns of a burst's equations, per unit of scale."""
        return np.hstack((self._energy(self.bursts[n]).toarray(), self._errors(n)))

    def values(self, n: int) -> Array:
        """The flux linkages of a burst, per unit of scale."""
        return _parts(self.bursts[n].psi) / self.scale

    def energy(self, x: Array) -> CoEnergy:
        """The energy of a solution."""
        return CoEnergy(self.basis, x[: self.basis.count] * self.scale * self.i_max, self.i_max)

    def _unused(self, n: int) -> Array:
        """Infinite where an axis of a burst has no weight."""
        with np.errstate(divide="ignore"):
            return np.repeat(1.0 / np.array(self.bursts[n].axes), len(self.bursts[n].i))

    def guessed_noise(self, n: int) -> Noise:
        """Without a map: what is seen in many machines."""
        one = ERROR / (STEADY + np.abs(self.bursts[n].i) / self.i_max)
        return Noise(np.tile(one, 2) * self._unused(n), np.zeros((2 * len(one), 0)))

    def noise(self, n: int, model: CoEnergy, level_V: float, noise_A: float) -> Noise:
        """(CM-31)."""
        i = self.bursts[n].i
        slopes = model.psi_d(i.real, i.imag, nd=1), model.psi_d(i.real, i.imag, nq=1), model.psi_q(i.real, i.imag, nq=1)
        sigma = np.concatenate([np.hypot(slopes[k], slopes[k + 1]) * noise_A / self.scale for k in range(2)])
        of_legs = of_signs(self.raws[n], noise_A) * level_V / self.scale
        return Noise(np.hypot(sigma, RESOLUTION) * self._unused(n), np.vstack((of_legs.real, of_legs.imag)))

    def solve(self, noises: Iterable[Noise], magnet: tuple[float, float], level_V: float) -> tuple[float, Array]:
        """Effective number of unknowns, and all of them; magnet: its flux linkage and the relative error of it."""
        count = self.basis.count
        system = System(count + self.others)
        for n, noise in enumerate(noises):
            system.add(noise.whitened(self.rows[n]), noise.whitened(self.values(n)[:, None])[:, 0])
        psi_f, error = magnet[0] / self.scale, magnet[0] * magnet[1] / self.scale
        for row, value in ((self.magnet, psi_f), (self.zero, 0.0)):
            known = sparse.hstack((row, sparse.csr_matrix((1, self.others))), format="csr") / error
            system.add(sparse.csr_matrix(known), np.array([value / error]), counted=False)
        prior = sparse.hstack((sparse.csr_matrix((self.others, count)), sparse.eye(self.others)), format="csr")
        centre = np.zeros(self.others)
        centre[1] = level_V / LEVEL_PRIOR_V
        system.add(prior, centre, counted=False)
        penalty = np.zeros((count + self.others,) * 2)
        penalty[:count, :count] = self.basis.penalty()
        return system.solve(penalty, slack=1.0, price=PRICE, least=LEAST, accepted=self.rising)


def fit(raws: Sequence[Raw], noise_A: float, i_max_A: float, r_ohm: float, magnet: tuple[float, float],
        level_V: float, knee_A: float = 0.0) -> Surface:  # fmt: skip
    """All unknowns at once, twice: the first map says how much flux linkage the noise of a current is.

    noise_A   of one component of a sample's current
    magnet    its flux linkage, V·s, and the relative error of it
    knee_A    of the voltage that a leg loses
    """
    work = _Fit(raws, i_max_A, r_ohm, knee_A)
    bursts = range(len(raws))
    _, x = work.solve((work.guessed_noise(n) for n in bursts), magnet, level_V)
    model = work.energy(x)
    unknowns, x = work.solve((work.noise(n, model, level_V, noise_A) for n in bursts), magnet, level_V)
    return _surface(work, x, unknowns)


def _surface(work: _Fit, x: Array, unknowns: float) -> Surface:
    left, psi = [], []
    model, count = work.energy(x), work.basis.count
    for n, burst in enumerate(work.bursts):
        rest = (work.values(n) - work.rows[n] @ x) * work.scale
        half = len(burst.i)
        left.append(rest[:half] + 1j * rest[half:])
        psi.append(model.psi_d(burst.i.real, burst.i.imag) + 1j * model.psi_q(burst.i.real, burst.i.imag) + left[-1])
    level_V = float(x[count + 1]) * LEVEL_PRIOR_V
    r_ohm = work.r + float(x[count]) * R_PRIOR * work.r
    currents, weights = tuple(burst.i for burst in work.bursts), tuple(burst.axes for burst in work.bursts)
    return Surface(model, r_ohm, level_V, currents, tuple(left), tuple(psi), weights, unknowns)
