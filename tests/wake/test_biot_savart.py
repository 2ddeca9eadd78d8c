"""The Biot–Savart sum: values in 50 digits, exact solutions, derivatives in both modes, options, bad input."""

from functools import partial

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from scipy.special import ellipe, ellipk, iv, ivp, kv, kvp

from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import plane
from rotorjax.wake import biot_savart, kernel_sweeps
from rotorjax.wake.biot_savart import filament_velocity, lattice_velocity, segment_velocity

RNG = np.random.default_rng(7)


def normal(*shape):
    return jnp.asarray(RNG.normal(size=shape))


# -- values -----------------------------------------------------------------------------------------------------------


def reference(p, a, b, core, exponent):
    """Velocity of one segment with Γ = 1 in 50 digits, and the size that it would have if seen square on."""
    with mpmath.workdps(50):
        vector = lambda x: mpmath.matrix([mpmath.mpf(float(c)) for c in x])  # noqa: E731
        norm = lambda x: mpmath.sqrt(sum(c * c for c in x))  # noqa: E731
        r1, r2, edge = vector(p) - vector(a), vector(p) - vector(b), vector(b) - vector(a)
        length, d1, d2 = norm(edge), norm(r1), norm(r2)
        if 0 in (length, d1, d2):
            return np.zeros(3), 1.0
        u = edge / length
        c = mpmath.matrix([u[1] * r1[2] - u[2] * r1[1], u[2] * r1[0] - u[0] * r1[2], u[0] * r1[1] - u[1] * r1[0]])
        n, rc = mpmath.mpf(exponent), mpmath.mpf(float(core))
        spread = (norm(c) ** (2 * n) + rc ** (2 * n)) ** (1 / n)
        if spread == 0:
            return np.zeros(3), 1.0
        factor = sum(u[i] * (r1[i] / d1 - r2[i] / d2) for i in range(3)) / (4 * mpmath.pi * spread)
        return np.array([float(x) for x in factor * c]), float(factor * d1)


def random_pairs(count):
    p, a = RNG.normal(size=(2, count, 3))
    return p, a, a + RNG.normal(size=(count, 3)) * 0.3, 10 ** RNG.uniform(-3, 0, count)


def nasty_pairs(count):
    """On the axis between and beyond the nodes, at and next to nodes, tiny cores, tiny lengths, far away."""
    p, a, b, core = random_pairs(count)
    t = RNG.uniform(-2, 3, count)[:, None]
    kind = np.arange(count) % 7
    away = RNG.normal(size=(count, 3))
    p = np.where((kind == 0)[:, None], a + t * (b - a), p)
    p = np.where((kind == 1)[:, None], np.where(t > 0.5, a, b), p)
    p = np.where((kind == 2)[:, None], np.where(t > 0.5, a, b) + 1e-6 * away, p)
    core = np.where(kind == 3, 10.0 ** -RNG.integers(4, 300, count), core)
    b = np.where((kind == 4)[:, None], a + 10.0 ** -RNG.integers(3, 9, (count, 1)) * away, b)
    p = np.where((kind == 5)[:, None], p * 10.0 ** RNG.integers(2, 6, (count, 1)), p)
    p = np.where((kind == 6)[:, None], a + t * (b - a) + 1e-5 * away, p)
    return p, a, b, core


def pairwise(p, a, b, core, exponent):
    """Each segment at its own point."""

    def one(*pair):
        p, a, b, core = (x[None] for x in pair)
        return segment_velocity(p, a, b, jnp.ones_like(core), core, exponent=exponent)[0]

    return jax.jit(jax.vmap(one))(*map(jnp.asarray, (p, a, b, core)))


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-12), (np.float32, 1e-5)])
@pytest.mark.parametrize("exponent", [1, 2])
@pytest.mark.parametrize("make", [random_pairs, nasty_pairs])
def test_values_in_fifty_digits(make, exponent, dtype, tolerance):
    """Relative to the velocity, or on and near the axis (where it cancels) to that of the segment seen square on."""
    pairs = [x.astype(dtype) for x in make(1000 if exponent == 1 else 200)]
    got = pairwise(*pairs, exponent)
    assert got.dtype == dtype
    exact = [reference(*pair, exponent) for pair in zip(*pairs, strict=True)]
    error = [np.linalg.norm(g - v) / s for g, (v, s) in zip(np.asarray(got, float), exact, strict=True)]
    assert max(error) < tolerance


def test_cores_of_any_exponent_agree_with_fifty_digits():
    pairs = random_pairs(20)
    for exponent in (1.5, 3, 8):
        exact = [reference(*pair, exponent)[0] for pair in zip(*pairs, strict=True)]
        np.testing.assert_allclose(pairwise(*pairs, exponent), exact, rtol=1e-11, atol=1e-13)


# -- exact solutions --------------------------------------------------------------------------------------------------


def closed(curve, count):
    """A closed curve of parameter 0…2π as a filament of straight segments."""
    t = jnp.linspace(0, 2 * jnp.pi, count + 1)
    return curve(t)[None]


def one_filament(points, nodes, core=1e-6, **options):
    shape = (1, nodes.shape[1] - 1)
    return filament_velocity(jnp.asarray(points, float), nodes, jnp.ones(shape), jnp.full(shape, core), **options)


def test_long_straight_vortex():
    line = jnp.array([[[0, 0, -1e7], [0, 0, 1.0], [0, 0, 1e7]]])
    v = one_filament([[0.3, 0.4, 0.7]], line, 0.2)
    swirl = 0.5 / (2 * np.pi * (0.25 + 0.04))
    np.testing.assert_allclose(v, [[-0.8 * swirl, 0.6 * swirl, 0]], rtol=1e-12, atol=1e-15)


def ring(t):
    return jnp.stack([jnp.cos(t), jnp.sin(t), 0 * t], axis=-1)


def ring_exact(r, z):
    """Axial and radial velocity of the unit ring with Γ = 1, by elliptic integrals (Lamb §161)."""
    m = 4 * r / ((1 + r) ** 2 + z * z)
    k, e, far, near = ellipk(m), ellipe(m), np.hypot(1 + r, z), (1 - r) ** 2 + z * z
    return (k + (1 - r * r - z * z) / near * e) / (2 * np.pi * far), (
        z / (2 * np.pi * r * far) * (-k + (1 + r * r + z * z) / near * e)
    )


def test_ring_on_its_axis():
    z = np.array([0, 0.3, 1, 4.0])
    v = one_filament(np.stack([0 * z, 0 * z, z], -1), closed(ring, 4000))
    np.testing.assert_allclose(v[:, 2], 0.5 / (1 + z * z) ** 1.5, rtol=2e-6)


def test_ring_off_its_axis_converges_with_the_square_of_the_segment():
    r, z = np.array([0.5, 0.8, 1.2, 2.0]), np.array([0.1, -0.3, 0.2, 0.7])
    axial, radial = ring_exact(r, z)
    errors = []
    for count in (200, 400, 800):
        v = one_filament(np.stack([r, 0 * r, z], -1), closed(ring, count))
        errors.append(np.abs(np.concatenate([v[:, 2] - axial, v[:, 0] - radial])).max())
    order = -np.polyfit(np.log([200, 400, 800]), np.log(errors), 1)[0]
    assert order == pytest.approx(2, abs=0.1)
    assert errors[-1] < 1e-4


def test_ring_translates_itself_at_the_rate_of_a_perpendicular_core():
    """U 4πR/Γ → ½ ln(8R/r_c) with Scully's core, not the uniform core's ln(8R/a) − ¼ (documented shortcoming)."""
    speed = one_filament([[1.0, 0, 0]], closed(ring, 20000), 0.01)[0, 2] * 4 * np.pi
    assert speed == pytest.approx(0.5 * np.log(800), rel=2e-3)


@pytest.mark.parametrize("point", [(0.5, 0.7), (1.4, -0.4)])
def test_infinite_helix(point):
    """Kawada and Hardin: radius 1, pitch 2πl, velocity by modified Bessel functions."""
    pitch, (r, theta) = 0.5, point
    m = np.arange(1, 60)
    if r < 1:
        s = np.sum(m * kvp(m, m / pitch) * iv(m, m * r / pitch) * np.cos(m * theta))
        axial, swirl = 1 / (2 * np.pi * pitch) - s / (np.pi * pitch**2), s / (np.pi * r * pitch)
    else:
        s = np.sum(m * ivp(m, m / pitch) * kv(m, m * r / pitch) * np.cos(m * theta))
        axial, swirl = -s / (np.pi * pitch**2), 1 / (2 * np.pi * r) + s / (np.pi * r * pitch)
    turns, per_turn = 300, 400
    t = jnp.linspace(-turns, turns, 2 * turns * per_turn + 1) * np.pi * 2
    helix = jnp.stack([jnp.cos(t), jnp.sin(t), pitch * t], axis=-1)[None]
    u = one_filament([[r * np.cos(theta), r * np.sin(theta), 0]], helix)[0]
    assert u[2] == pytest.approx(axial, abs=2e-4)
    assert -u[0] * np.sin(theta) + u[1] * np.cos(theta) == pytest.approx(swirl, abs=2e-4)


# -- derivatives ------------------------------------------------------------------------------------------------------


def case(kind):
    """A function of (points, nodes, strength, core) and its arguments, nasty points among them."""
    nodes = normal(2, 5, 3)
    # the first filament runs straight through its third node, where the sum is smooth although each part is not
    nodes = nodes.at[0, 2].set((nodes[0, 1] + nodes[0, 3]) / 2)
    strength = normal(2, 4).at[0, 2].set(1.3).at[0, 1].set(1.3)
    core = (0.2 + jnp.abs(normal(2, 4))).at[0, 1].set(0.4).at[0, 2].set(0.4)
    axis = nodes[1, 0] + jnp.array([[0.3], [1.7], [-0.5]]) * (nodes[1, 1] - nodes[1, 0])
    points = jnp.concatenate([normal(3, 3), axis, nodes[0, 2][None]])
    if kind == "filament":
        return filament_velocity, (points, nodes, strength, core)
    flat = lambda x: x.reshape(-1, *x.shape[2:])  # noqa: E731
    segments = [flat(x) for x in (nodes[:, :-1], nodes[:, 1:], strength, core)]
    return segment_velocity, (points, *segments)


OPTIONS = [
    {},
    {"exponent": 2, "block": 2},
    {"exponent": 1.5, "block": 3},
    {"blades": 3, "plane": plane(1.5, 10.0), "block": 2},
]


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("kind", ["filament", "segment"])
def test_derivatives_against_differences_and_each_other(kind, options):
    velocity, args = case(kind)
    flat, unravel = ravel_pytree(args)
    f = jax.jit(lambda x: velocity(*unravel(x), **options).reshape(-1))
    forward, reverse = jax.jit(lambda x: (jax.jacfwd(f)(x), jax.jacrev(f)(x)))(flat)
    # a small step: beside a node the second derivative jumps, so that central differences are of first order there
    step = 1e-7
    difference = np.stack([(f(flat + d) - f(flat - d)) / (2 * step) for d in step * np.eye(flat.size)], axis=-1)
    for columns in np.split(np.arange(flat.size), np.cumsum([x.size for x in args])[:-1]):
        size = jnp.abs(forward[:, columns]).max()
        assert jnp.abs(forward - reverse)[:, columns].max() < 1e-12 * size
        assert jnp.abs(forward - difference)[:, columns].max() < 1e-6 * size


def test_derivative_on_a_node_is_the_mean_over_directions():
    """A single segment: r̂ := 0, so the rate along any line is the mean of its two one-sided rates."""
    segment = [jnp.array([x]) for x in ([0, 0, 0.0], [1, 0.5, 0.2], 1.0, 0.1)]
    f = jax.jit(lambda p: segment_velocity(p[None], *segment)[0])
    jacobian = jax.jacfwd(f)(segment[0][0])
    for direction in normal(5, 3):
        rate = (f(1e-6 * direction) - f(-1e-6 * direction)) / 2e-6
        np.testing.assert_allclose(jacobian @ direction, rate, rtol=1e-4, atol=1e-8)


def test_no_core_is_finite_everywhere():
    line = jnp.array([[[0, 0, 0.0], [0, 0, 1], [0, 0, 1]]])
    points = jnp.array([[0, 0, 0.0], [0, 0, 0.5], [0, 0, 1], [0, 0, 2], [1, 0, 0]])
    args = points, line, jnp.ones((1, 2)), jnp.zeros((1, 2))
    assert jnp.all(filament_velocity(*args)[:4] == 0)
    for mode in (jax.jacfwd, jax.jacrev):
        assert all(jnp.isfinite(d).all() for d in mode(partial(filament_velocity, block=2), range(4))(*args))


def test_transformations_compose():
    """vmap, linearize, scan under grad and second derivatives: what integrators, GMRES and Newton ask for."""
    _, args = case("filament")
    f = partial(filament_velocity, block=2)  # quicker to compile
    tangents = tuple(normal(*x.shape) for x in args)
    expected = jax.jvp(f, args, tangents)[1]
    np.testing.assert_allclose(jax.linearize(f, *args)[1](*tangents), expected, atol=1e-13)
    many = jnp.stack([args[1], args[1] + 0.1])
    batched = jax.vmap(f, (None, 0, None, None))(args[0], many, *args[2:])
    np.testing.assert_allclose(batched[1], f(args[0], many[1], *args[2:]), atol=1e-13)
    loss = lambda n: jnp.sum(jax.vmap(f, (None, 0, None, None))(args[0], n, *args[2:]) ** 2)  # noqa: E731
    single = lambda n: jnp.sum(f(args[0], n, *args[2:]) ** 2)  # noqa: E731
    np.testing.assert_allclose(jax.grad(loss)(many)[1], jax.grad(single)(many[1]), rtol=1e-10, atol=1e-12)
    march = lambda p: jax.lax.scan(lambda p, _: (p + 0.1 * f(p, *args[1:]), None), p, length=3)[0]  # noqa: E731
    x, w = args[0][:3], normal(3, 3)
    _, forward = jax.jvp(march, (x,), (tangents[0][:3],))
    (reverse,) = jax.vjp(march, x)[1](w)
    assert jnp.sum(w * forward) == pytest.approx(float(jnp.sum(reverse * tangents[0][:3])), rel=1e-12)
    hessian = jax.hessian(lambda g: jnp.sum(f(*args[:2], g, args[3]) ** 2))(args[2])
    jacobian = jax.jacfwd(lambda g: f(*args[:2], g, args[3]))(args[2])
    np.testing.assert_allclose(hessian, 2 * jnp.einsum("ncij,nckl->ijkl", jacobian, jacobian), atol=1e-11)


def test_float32_stays_float32_and_says_what_it_loses():
    _, args = case("filament")
    f = partial(filament_velocity, blades=2, exponent=2, block=2)
    single = [x.astype(jnp.float32) for x in args]
    with jax.numpy_dtype_promotion("strict"):
        v, back = jax.vjp(f, *single)
        gradients = back(v)
        tangent = jax.jvp(f, single, single)[1]
    assert {x.dtype for x in (v, tangent, *gradients)} == {jnp.dtype("float32")}
    exact = jax.vjp(f, *args)[1](jnp.asarray(v, float))
    for got, want in zip(gradients, exact, strict=True):
        assert jnp.abs(got - want).max() < 1e-5 * jnp.abs(want).max()


# -- options ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("block", [1, 3, 8, 100])
def test_any_block_and_both_layouts_give_the_same(block):
    f, args = case("filament")
    g, flat = case_like(args)
    np.testing.assert_allclose(f(*args, block=block), g(*flat), rtol=1e-12, atol=1e-14)


def case_like(args):
    points, nodes, strength, core = args
    return segment_velocity, (
        points,
        nodes[:, :-1].reshape(-1, 3),
        nodes[:, 1:].reshape(-1, 3),
        strength.reshape(-1),
        core.reshape(-1),
    )


@pytest.mark.parametrize("most", [7, 4096])
def test_the_sum_for_an_accelerator_is_the_same(most, monkeypatch):
    """Of loose segments, filaments and several wakes at once, in one step or in many."""
    count = 50 + (most > 50)  # programs of their own
    points, start, end, strength = normal(33, 3), normal(count, 3), normal(count, 3), normal(count)
    core = jnp.full(count, 0.05)

    def sums():
        once = segment_velocity(points, start, end, strength, core, plane=plane(1.0), blades=3, products=True)
        several = jax.vmap(lambda p: segment_velocity(p, start, end, strength, core))(points.reshape(3, 11, 3))
        return once, filament_velocity(points, start[None], strength[None, 1:], core[None, 1:], exponent=2), several

    expected = sums()
    monkeypatch.setattr(biot_savart, "on_cpu", lambda: False)
    monkeypatch.setattr(kernel_sweeps, "AT_ONCE", most)
    for found, usual in zip(sums(), expected, strict=True):
        np.testing.assert_allclose(found, usual, rtol=1e-11, atol=1e-12 * float(jnp.abs(usual).max()))


def test_mirror_is_an_explicit_image_of_opposite_sense():
    f, args = case("filament")
    ground = plane(1.5, 12.0)
    points, nodes, strength, core = args
    image = f(points, ground.reflect_points(nodes), -strength, core)
    np.testing.assert_allclose(f(*args, plane=ground), f(*args) + image, rtol=1e-12, atol=1e-12)


def test_no_flow_through_the_mirror():
    f, (_, *wake) = case("filament")
    ground = plane(1.5, 12.0)
    points = normal(20, 3)
    foot = points - ground.distance(points)[:, None] * ground.normal
    v = f(foot, *wake, plane=ground)
    assert jnp.abs(v @ ground.normal).max() < 1e-12 * jnp.abs(v).max()


@pytest.mark.parametrize("ground", [None, plane(1.5, 12.0)])
def test_blades_are_explicit_copies(ground):
    f, (points, nodes, strength, core) = case("filament")
    turned = [rotate_about_shaft(nodes, jnp.array(a)) for a in np.arange(4) * np.pi / 2]
    copies = [jnp.concatenate(x) for x in (turned, [strength] * 4, [core] * 4)]
    expected = f(points, *copies, plane=ground)
    np.testing.assert_allclose(
        f(points, nodes, strength, core, blades=4, plane=ground), expected, rtol=1e-12, atol=1e-12
    )


def test_lattice_is_the_sum_of_its_rings():
    points, nodes, rings = normal(6, 3), normal(4, 5, 3), normal(3, 4)
    got = lattice_velocity(points, nodes, rings, jnp.full((4, 4), 0.1), jnp.full((3, 5), 0.1))
    r, a = np.indices(rings.shape).reshape(2, -1)
    loops = jnp.stack([nodes[r, a], nodes[r, a + 1], nodes[r + 1, a + 1], nodes[r + 1, a], nodes[r, a]], axis=1)
    strength = jnp.repeat(rings.reshape(-1, 1), 4, axis=1)
    expected = filament_velocity(points, loops, strength, jnp.full_like(strength, 0.1))
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13)


def test_jitted_equals_eager_at_production_size():
    """A canary: XLA has miscompiled reductions of this size before (jax issue 39103)."""
    nodes, points = normal(3, 601, 3), normal(1500, 3)
    args = points, nodes, normal(3, 600), 0.1 + jnp.abs(normal(3, 600))
    jitted = jax.jit(filament_velocity)(*args)
    a, b = (np.asarray(x).reshape(-1, 3) for x in (nodes[:, :-1], nodes[:, 1:]))
    r1, r2 = points[::100, None] - a, points[::100, None] - b
    d1, d2, q = np.linalg.norm(r1, axis=-1), np.linalg.norm(r2, axis=-1), np.sum(r1 * r2, -1)
    c = np.cross(r1, r2)
    bottom = d1 * d2 * (np.sum(c * c, -1) + np.sum((b - a) ** 2, -1) * np.asarray(args[3]).reshape(-1) ** 2)
    k = np.asarray(args[2]).reshape(-1) * (d1 + d2) * (d1 * d2 - q) / bottom / (4 * np.pi)
    np.testing.assert_allclose(jitted[::100], np.einsum("ns,nsc->nc", k, c), rtol=1e-10, atol=1e-11)


# -- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": (4, 2)}, r"`points` must have shape \(N, 3\), but is \(4, 2\)"),
        ({"nodes": (2, 1, 3)}, r"`nodes` must have shape .* but is \(2, 1, 3\)"),
        ({"nodes": (2, 5, 2)}, r"`nodes` must have shape .* but is \(2, 5, 2\)"),
        ({"strength": (2, 5)}, r"`strength` must have one value a segment, \(2, 4\), but is \(2, 5\)"),
        ({"core": (1, 4)}, r"`core` must have one value a segment, \(2, 4\), but is \(1, 4\)"),
    ],
)
def test_wrong_shapes_are_refused_while_tracing(change, message):
    shapes = {"points": (4, 3), "nodes": (2, 5, 3), "strength": (2, 4), "core": (2, 4)} | change
    with pytest.raises(InputError, match=message):
        jax.eval_shape(filament_velocity, *(jax.ShapeDtypeStruct(s, jnp.float64) for s in shapes.values()))


def test_wrong_segments_are_refused():
    good = [jnp.zeros((4, 3)), jnp.zeros((2, 3)), jnp.ones((2, 3)), jnp.ones(2), jnp.ones(2)]
    for index, name in ((1, "start"), (2, "end")):
        with pytest.raises(InputError, match=rf"`{name}` must have shape \(S, 3\), but is \(2, 2\)"):
            segment_velocity(*good[:index], jnp.zeros((2, 2)), *good[index + 1 :])
    with pytest.raises(InputError, match="`end` must have the shape of start"):
        segment_velocity(*good[:2], jnp.zeros((3, 3)), *good[3:])
    with pytest.raises(InputError, match=r"`core` \(2,\) must not be negative"):
        segment_velocity(*good[:4], jnp.array([0.1, -0.1]))
    for option in ({"exponent": 0.5}, {"blades": 0}, {"block": 0}):
        with pytest.raises(InputError, match=next(iter(option))):
            segment_velocity(*good, **option)


def test_wrong_rings_are_refused():
    with pytest.raises(InputError, match=r"`rings`"):
        lattice_velocity(
            jnp.zeros((1, 3)), jnp.zeros((3, 3, 3)), jnp.zeros((3, 3)), jnp.zeros((3, 2)), jnp.zeros((2, 3))
        )
    with pytest.raises(InputError, match=r"`nodes`"):
        lattice_velocity(
            jnp.zeros((1, 3)), jnp.zeros((1, 3, 3)), jnp.zeros((0, 2)), jnp.zeros((1, 2)), jnp.zeros((0, 3))
        )


def test_nothing_to_sum_is_no_velocity():
    assert filament_velocity(jnp.zeros((0, 3)), jnp.zeros((1, 2, 3)), jnp.ones((1, 1)), jnp.ones((1, 1))).shape == (
        0,
        3,
    )
    nothing = jnp.zeros((0, 3)), jnp.zeros((0, 3)), jnp.zeros(0), jnp.zeros(0)
    assert jnp.all(segment_velocity(jnp.ones((2, 3)), *nothing) == 0)
