import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.fourier import fourier_differentiation, fourier_interpolation, fourier_nodes


@pytest.mark.parametrize("nodes", [1, 2, 3, 8, 9, 24, 25])
def test_exact_below_half(nodes):
    psi = fourier_nodes(nodes)
    for k in range((nodes + 1) // 2):
        f, slope = np.cos(k * psi + 0.3), -k * np.sin(k * psi + 0.3)
        np.testing.assert_allclose(fourier_differentiation(nodes) @ f, slope, atol=1e-12)
        where = np.linspace(-1, 9, 23)
        np.testing.assert_allclose(fourier_interpolation(nodes, where) @ f, np.cos(k * where + 0.3), atol=1e-12)


def test_no_nodes_are_refused():
    with pytest.raises(InputError, match="nodes"):
        fourier_nodes(0)
