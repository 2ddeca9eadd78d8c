"""Reference problems with what is known of them."""

import jax.numpy as jnp
import numpy as np
import scipy.integrate
import scipy.optimize

# Period of the Van der Pol limit cycle at μ = 1; van_der_pol_cycle finds the same to 1e-11 by another integrator.
VAN_DER_POL_PERIOD = 6.663286859323130


def van_der_pol(t, x, u, mu):
    """x'' = μ (1 − x²) x' − x + u cos ωt with u = (amplitude, ω)."""
    position, rate = x["position"], x["rate"]
    force = u[0] * jnp.cos(u[1] * t)
    return {"position": rate, "rate": mu * (1 - position**2) * rate - position + force}


def van_der_pol_cycle(mu=1.0):
    """Period and amplitude by DOP853 with events, independent of the package."""

    def rhs(t, x):
        return [x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]]

    def top(t, x):
        return x[1]

    top.direction = -1
    run = scipy.integrate.solve_ivp(rhs, (0, 120), [2.0, 0.0], "DOP853", rtol=1e-13, atol=1e-13, events=top)
    times, states = run.t_events[0], run.y_events[0]
    return times[-1] - times[-2], states[-1][0]


def peaked(t, x, a):
    """x' + x = f(t) with the solution x = 1/(a − cos t): harmonics fall as (a − √(a² − 1))^k."""
    bottom = a - jnp.cos(t)
    return 1 / bottom - jnp.sin(t) / bottom**2 - x


def turning(t, x, rate):
    """Linear system seen from axes that turn with the time: x = P(t) z, z' = F z, P' = S P, of period 2π.

    Monodromy P(0) exp(2πF) P(0)⁻¹ in closed form; A(t) = S + P F Pᵀ.
    """
    c, s = jnp.cos(t), jnp.sin(t)
    p = jnp.array([[c, -s], [s, c]])
    spin = jnp.array([[0.0, -1.0], [1.0, 0.0]])
    return (spin + p @ (rate * F) @ p.T) @ x


F = jnp.array([[-0.3, 0.8], [-0.1, -0.2]])


def mathieu(t, x, delta, epsilon):
    """x'' + (δ + ε cos t) x = 0."""
    return jnp.stack([x[1], -(delta + epsilon * jnp.cos(t)) * x[0]])


def rms(v):
    return float(np.sqrt(np.mean(np.square(v))))
