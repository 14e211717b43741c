# SPDX-License-Identifier: Apache-2.0
"""What noise makes uncertain in a burst, and equations without common errors."""

import numpy as np
import pytest

from fluxtrue_tools.commission.bursts import Raw, integrate, mean_sign
from fluxtrue_tools.commission.noise import Noise, of_signs, sign_variance

NOISE_A, PERIOD_S, DRAWS = 0.6, 1e-4, 20000
PAIRS = [(0.0, 0.0), (0.3, -0.5), (1.0, 1.2), (-2.0, 9.0), (-15.0, 15.0), (3.0, 8.0)]


@pytest.mark.parametrize(("begins", "ends"), PAIRS)
def test_the_variance_of_a_sign_is_that_of_many_draws(begins: float, ends: float) -> None:
    rng = np.random.default_rng(1)
    drawn = mean_sign(*(mean + NOISE_A * rng.standard_normal(DRAWS) for mean in (begins, ends)))
    (found,) = sign_variance(np.array([begins, ends]), NOISE_A)
    assert found == pytest.approx(float(np.var(drawn)), rel=0.15, abs=0.005)


def test_errors_of_signs_stay_in_all_later_flux_linkages() -> None:
    """The second phase carries no current in the third period only."""
    i = 50.0 * np.exp(1j * np.array([1.4, 1.4, np.pi / 6.0, np.pi / 6.0, 1.4, 1.4]))
    raw = Raw(i, np.zeros(6, complex), np.zeros(6), np.zeros(6), PERIOD_S)
    (column,) = of_signs(raw, NOISE_A).T
    assert not column[:3].any()
    assert np.ptp(column[3:]) == 0.0
    b = (i * np.exp(-2j * np.pi / 3.0)).real[2:4]
    sigma = float(np.sqrt(sign_variance(b, NOISE_A)[0]))
    assert column[3] == pytest.approx(2.0 / 3.0 * np.exp(2j * np.pi / 3.0) * PERIOD_S * sigma)
    certain = integrate(Raw(i[:1].repeat(6), raw.u, raw.theta, raw.zero, PERIOD_S), 0.0).of_level[1]
    assert abs(column[3]) == pytest.approx(abs(certain) / 2.0 * sigma, rel=1e-9), "all three legs lose 4/3 of one"


def test_whitened_equations_have_independent_errors_of_variance_one() -> None:
    rng = np.random.default_rng(2)
    sigma, common = rng.uniform(0.5, 2.0, 12), rng.standard_normal((12, 4))
    sigma[3] = np.inf
    used = np.isfinite(sigma)
    root = np.zeros((12, 11))
    root[used] = np.linalg.cholesky(np.diag(sigma[used] ** 2) + common[used] @ common[used].T)
    white = Noise(sigma, common).whitened(root)
    assert white.shape == (11, 11)
    assert white @ white.T == pytest.approx(np.eye(11), abs=1e-9)
    alone = Noise(sigma, np.zeros((12, 0))).whitened(np.ones((12, 1)))
    assert alone[:, 0] == pytest.approx(1.0 / sigma[used])
