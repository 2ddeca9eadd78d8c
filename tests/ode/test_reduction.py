import numpy as np
import pytest
import scipy.integrate

from rotorjax.errors import InputError
from rotorjax.ode.models import LinearModel
from rotorjax.ode.reduction import (
    balance,
    balance_beside,
    balance_in_band,
    balance_rest,
    bode_error_db,
    history_gap,
    residualise,
    step_error,
)


def model(a, b, c, d=None):
    a, b, c = (np.atleast_2d(np.asarray(m, float)) for m in (a, b, c))
    d = np.zeros((c.shape[0], b.shape[1])) if d is None else np.atleast_2d(d)
    return LinearModel(
        a,
        b,
        c,
        d,
        tuple(f"x[{i}]" for i in range(len(a))),
        tuple(f"u[{i}]" for i in range(b.shape[1])),
        tuple(f"y[{i}]" for i in range(c.shape[0])),
        ("-",) * b.shape[1],
        ("-",) * c.shape[0],
    )


def heat(n=30):
    """A rod heated at one end, measured in the middle, and a lightly damped pair beside it."""
    a = 20 * (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1))
    a = np.block([[a, np.zeros((n, 2))], [np.zeros((2, n)), np.array([[-0.1, 1.5], [-1.5, -0.1]])]])
    b = np.zeros((n + 2, 2))
    b[0, 0] = b[n, 1] = 20
    c = np.zeros((2, n + 2))
    c[0, n // 2], c[1, 3], c[1, n + 1] = 1, 1, 0.02
    return model(a, b, c)


def error(full, small, omega):
    return np.linalg.norm(small.response(omega) - full.response(omega), 2, axis=(1, 2)).max()


@pytest.mark.parametrize("steady", [True, False])
@pytest.mark.parametrize("order", [4, 8, 12])
def test_balanced_error_is_within_its_bound(order, steady):
    full = heat()
    small = balance(full, order, steady=steady)
    omega = np.concatenate([[0.0], np.logspace(-3, 3, 200)])
    assert small.model.order == order
    assert 0 < error(full, small.model, omega) <= small.bound * (1 + 1e-9)
    assert small.model.poles().real.max() < 0


def test_balanced_state_of_order_two_by_hand():
    """Decoupled modes b²c²-weighted: Hankel singular values of 1/(s + p) are 1/(2p)."""
    small = balance(model(np.diag([-1.0, -50.0]), np.eye(2), np.eye(2)), 1)
    np.testing.assert_allclose(small.singular, [0.5, 0.01], rtol=1e-12)
    np.testing.assert_allclose(small.bound, 0.02, rtol=1e-12)


def test_steady_response_is_kept():
    full = heat()
    for small in (residualise(full, 6), balance(full, 6)):
        np.testing.assert_allclose(small.model.response(np.zeros(1)), full.response(np.zeros(1)), rtol=1e-9, atol=1e-14)


def test_residualise_keeps_the_slowest_poles():
    full = heat()
    small = residualise(full, 6).model
    np.testing.assert_allclose(np.sort(small.poles().real), np.sort(full.poles()[:6].real), rtol=1e-9)
    pair = residualise(model(np.array([[-1, 5], [-5, -1]]), np.eye(2), np.eye(2)), 2)
    assert pair.model.order == 2


def test_residualise_does_not_part_a_pair():
    a = np.block([[np.array([[-1.0]]), np.zeros((1, 2))], [np.zeros((2, 1)), np.array([[-1.0, 5], [-5, -1]])]])
    assert residualise(model(a, np.eye(3), np.eye(3)), 2).model.order == 1
    with pytest.raises(InputError, match="part the slowest complex pair"):
        residualise(model(a[1:, 1:], np.eye(2), np.eye(2)), 1)


def test_unstable_modes_are_kept():
    full = heat()
    a = full.a.copy()
    a[-2:, -2:] = np.array([[0.2, 1.5], [-1.5, 0.2]])
    a[0, -1] = 3.0
    full = model(a, full.b, full.c)
    small = balance(full, 9)
    np.testing.assert_allclose(small.model.poles()[np.argmax(small.model.poles().real)].real, 0.2, rtol=1e-9)
    omega = np.concatenate([[0.0], np.logspace(-2, 2, 60)])
    assert error(full, small.model, omega) <= small.bound * (1 + 1e-9)
    with pytest.raises(InputError, match=r"\[2, 32\] \(2 unstable modes are kept\), but is 1"):
        balance(full, 1)


def test_states_are_kept_where_the_others_grow():
    """A step over a revolution by a third of the states, of others that grow by a factor of three and a half in it."""
    full = heat()
    a = full.a.copy()
    a[-2:, -2:] = np.array([[0.2, 1.5], [-1.5, 0.2]])
    a[0, -1], a[-1, 0] = 3.0, 0.1
    full, times = model(a, full.b, full.c), np.linspace(0, 2 * np.pi, 49)
    rest = full.a[2:, 2:]
    assert np.linalg.eigvals(rest).real.max() > 0.15
    errors = {}
    for order in (6, 11, 32):
        small = balance_rest(full, (0, 1), order, 2.0).model
        assert small.order <= order
        assert small.states[:2] == full.states[:2]
        np.testing.assert_allclose(small.response(np.zeros(1)), full.response(np.zeros(1)), rtol=1e-8)
        errors[order] = history_gap(full.step(times), small.step(times)).max()
    assert errors[32] < 1e-6
    assert errors[11] < 0.01
    assert errors[11] < errors[6]


def test_others_that_grow_by_themselves_and_are_damped_in_the_whole():
    """Up to 2 rad/s by half the states that balancing them as a system of their own takes, and damped."""
    full = heat()
    a, c = full.a.copy(), full.c.copy()
    a[-2:, -2:] = np.array([[0.05, 1.5], [-1.5, 0.05]])
    a[0, -1], a[-1, 0], c[0, -1] = -3.0, 3.0, 0.1
    full, omega = model(a, full.b, c), np.geomspace(0.01, 2.0, 60)
    assert np.linalg.eigvals(full.a[2:, 2:]).real.max() > 0.04
    assert full.poles().real.max() < -0.01
    small, other = (balance(full, (0, 1), 8, 2.0).model for balance in (balance_beside, balance_rest))
    assert small.order == 8
    assert small.states[:2] == full.states[:2]
    np.testing.assert_allclose(small.a[:2, :2], full.a[:2, :2])
    assert small.poles().real.max() < 0
    errors = [bode_error_db(full, one, omega).max() for one in (small, other)]
    assert errors[0] < 0.05
    assert errors[0] < 0.5 * errors[1]
    with pytest.raises(InputError, match=r"\[3, 32\]"):
        balance_beside(full, (0, 1), 2, 2.0)


def test_band_beats_the_whole_in_its_band():
    full = heat()
    omega = np.linspace(0.05, 2.0, 40)
    band, whole = balance_in_band(full, 7, 2.0, tail=0.0), balance(full, 7)
    real = ([0, 1, 1], [0, 0, 1])  # the pair does not reach the rod: that response is zero in the full model
    found = bode_error_db(full, band.model, omega)[real].max()
    assert found < 0.1
    assert found < 0.3 * bode_error_db(full, whole.model, omega)[real].max()
    assert np.abs(band.model.response(omega)[:, 0, 1]).max() < 1e-4


def test_whole_tail_is_plain_balancing():
    """With weight 1 above the band the sampled Gramians are the whole ones: the same singular values."""
    full = heat()
    one = model(full.a[:30, :30], full.b[:30, :1], full.c[:1, :30])
    ratio = balance_in_band(one, 4, 2.0, tail=1.0, points=200).singular[:4] / balance(one, 4).singular[:4]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)


def test_band_does_not_mind_units():
    """Outputs and inputs in other units: the same reduced responses."""
    full = heat()
    inputs, outputs = np.array([1e3, 0.02]), np.array([[1e-4], [50.0]])
    scaled = model(full.a, full.b * inputs, outputs * full.c)
    omega = np.linspace(0.05, 2.0, 10)
    one, two = (balance_in_band(m, 6, 2.0).model.response(omega) for m in (full, scaled))
    np.testing.assert_allclose(two, outputs * one * inputs, rtol=1e-6, atol=1e-12)


def test_measures():
    one = model([[-1.0]], [[1.0]], [[1.0]])
    two = model([[-1.0]], [[1.0]], [[2.0]])
    np.testing.assert_allclose(bode_error_db(one, two, np.array([0.1, 1.0])), 20 * np.log10(2))
    np.testing.assert_allclose(step_error(one, two, np.linspace(0, 3, 31)), 1.0)
    assert bode_error_db(one, one, np.array([0.1])) == 0


def test_step_response_is_exact():
    full, t = heat(6), np.linspace(0, 2, 21)
    for k in range(2):
        run = scipy.integrate.solve_ivp(
            lambda s, x, k=k: full.a @ x + full.b[:, k], (0, 2), np.zeros(8), "LSODA", t, rtol=1e-10, atol=1e-12
        )
        np.testing.assert_allclose(full.step(t)[:, :, k], (full.c @ run.y).T, atol=1e-7)


def test_bad_input():
    full = heat()
    for reduce in (residualise, balance, lambda m, n: balance_in_band(m, n, 1.0)):
        with pytest.raises(InputError, match=r"`order` must lie in \[1, 32\], but is 33"):
            reduce(full, 33)
    with pytest.raises(InputError, match="positive frequency"):
        balance_in_band(full, 3, -1.0)
    with pytest.raises(InputError, match="`b` must have shape"):
        model(np.eye(2), np.eye(3), np.eye(2))
    with pytest.raises(InputError, match="equally spaced"):
        full.step(np.array([0, 1.0, 3.0]))
