"""The Biot–Savart sum as one primitive with a hand-written rule for forward and for reverse mode.

`jax.custom_vjp` would forbid forward mode, which linearisation needs, and `jax.custom_jvp` cannot share the pairs
between value and tangent nor keep reverse mode from storing every pair. A primitive of `jax.experimental.hijax` takes
both rules. Second derivatives differentiate the rules themselves.
"""

from typing import TYPE_CHECKING

import jax
from jax import Array
from jax.experimental import hijax
from jax.experimental.hijax import Zero, instantiate_zeros

from rotorjax.wake.kernel_sweeps import KernelSegments, KernelSettings, cotangents, velocity, velocity_and_tangent

if TYPE_CHECKING:
    from jax.experimental.hijax import VJPHiPrimitive as HiPrim
else:  # its name since jax 0.11, and before
    HiPrim = hijax.HiPrim if hasattr(hijax, "HiPrim") else hijax.VJPHiPrimitive


class BiotSavart(HiPrim):
    """Velocity (3, N) at points (3, N) induced by segments, with O(N + S) memory in every mode."""

    settings: KernelSettings

    def __init__(self, settings: KernelSettings, points: Array, segments: KernelSegments):
        """Make the primitive for the shapes of these arguments."""
        self.in_avals = (jax.typeof(points), jax.tree.map(jax.typeof, segments))
        self.out_aval = jax.typeof(points)
        self.params = {"settings": settings}
        super().__init__()

    def expand(self, points, segments):
        """Value."""
        return velocity(self.settings, points, segments)

    def jvp(self, primals, tangents):
        """Forward mode: value and tangent share their pairs."""
        return velocity_and_tangent(self.settings, *primals, *_dense(tangents))

    def vjp_fwd(self, nzs_in, points, segments):
        """Reverse mode, forwards: keep the inputs alone."""
        return self(points, segments), (points, segments)

    def vjp_bwd_retval(self, res, outgrad):
        """Reverse mode, backwards."""
        points, segments = res
        return cotangents(self.settings, points, segments, _dense(outgrad))

    def lin(self, nzs_in, *primals):
        """Linearise: as forward mode, at a kept point.

        The value is plain, for jax 0.10 traces a program that holds a primitive of hijax anew in every call, and
        Newton's method calls no other program as often.
        """
        return self.expand(*primals), primals

    def linearized(self, residuals, *tangents):
        """Apply the linear map."""
        return velocity_and_tangent(self.settings, *residuals, *_dense(tangents))[1]

    def batch_dim_rule(self, axis_data, in_dims):
        """Put the batch axis of the result first, where there is one."""
        return None if all(dim is None for dim in jax.tree.leaves(in_dims, is_leaf=lambda d: d is None)) else 0


def _dense(tree):
    """Symbolic zeros as arrays."""
    return jax.tree.map(instantiate_zeros, tree, is_leaf=lambda x: isinstance(x, Zero))
