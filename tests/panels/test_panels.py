"""Source panels: exact values, the sphere, no flow through, images, gradients, shapes and mesh files."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.panels.kernel import SOFT, panel_velocity, seen
from rotorjax.panels.shapes import box, slab, terrain, wall
from rotorjax.panels.stl import read_stl
from rotorjax.panels.surface import LEAKY, Panels, floor, influence, leak, normal_flow, refitted, solid, told, watched

SQUARE = jnp.array([[[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
OBLIQUE = jnp.array([[[0.2, 0.1, 0.3], [1.1, 0.2, 0.5], [0.4, 0.9, 0.1], [0.4, 0.9, 0.1]]])


def flux_of(points):
    """Flow of a point source of strength 1 at the hub."""
    return points / (4 * np.pi * np.linalg.norm(points, axis=-1, keepdims=True) ** 3)


def by_points(point, triangle, n=300):
    """The same softened sources summed up one by one over a triangle, density 1."""
    a, b, c = (np.asarray(triangle)[i] for i in range(3))
    u, v = np.meshgrid(*2 * [(np.arange(n) + 0.5) / n], indexing="ij")
    places = a + u[..., None] * ((b - a) + v[..., None] * (c - b))
    weights = u * np.linalg.norm(np.cross(b - a, c - a)) / n**2
    way = point - places
    return np.einsum("ij,ijk->k", weights / (np.sum(way**2, -1) + SOFT**2) ** 1.5, way) / (4 * np.pi)


def test_a_square_on_its_axis():
    """v = Ω/4π, Ω = 4 arcsin(1/(1 + z²)) of a square of side 2, softened as the module says; a half of 1 next to it."""
    z = np.array([0.05, 0.5, 2.0, 30.0])
    points = jnp.asarray(np.column_stack([0 * z, 0 * z, z]))
    found = panel_velocity(points, SQUARE, jnp.ones(1))
    height = np.hypot(z, SOFT)
    np.testing.assert_allclose(found[:, 2], z / height * np.arcsin(1 / (1 + height**2)) / np.pi, rtol=1e-12)
    np.testing.assert_allclose(found[:, :2], 0, atol=1e-15)
    np.testing.assert_allclose(panel_velocity(-points, SQUARE, jnp.ones(1)), -found, atol=1e-15)
    np.testing.assert_allclose(influence(Panels(SQUARE)), [[0.5]], rtol=1e-15)


@pytest.mark.parametrize("point", [(0.5, 0.4, 0.6), (3.0, -1.0, 2.0), (0.6, 0.4, 0.25)])
def test_an_oblique_triangle(point):
    """Against its sources one by one, and from afar against one source of its area (with the centroid, third order)."""
    found = panel_velocity(jnp.asarray([point]), OBLIQUE, jnp.ones(1))[0]
    np.testing.assert_allclose(found, by_points(np.array(point), OBLIQUE[0]), rtol=2e-4)
    panels = Panels(OBLIQUE)
    far = panels.middles[0] + 40 * jnp.asarray(point)
    exact = flux_of(np.asarray(far - panels.middles[0])) * float(panels.areas[0])
    np.testing.assert_allclose(panel_velocity(far[None], OBLIQUE, jnp.ones(1))[0], exact, rtol=1e-3)


def test_every_derivative_is_finite_and_right():
    """Also on an edge, on a corner, in the plane and at the middle; a triangle's double corner makes no NaN."""
    awkward = jnp.array([[1.0, 1, 0], [1, 0.2, 0], [0, 0, 0], [3, 0.5, 0], [0.4, 0.9, 0.1], [0.5, 0.4, 0.4]])
    both = jnp.concatenate([SQUARE, OBLIQUE])

    def total(points, corners):
        return jnp.sum(jnp.sin(panel_velocity(points, corners, jnp.array([1.0, -0.5]))))

    for found in jax.grad(total, (0, 1))(awkward, both):
        assert bool(jnp.all(jnp.isfinite(found)))
    off = awkward + jnp.array([0.02, -0.03, 0.05])
    way = jnp.asarray(np.random.default_rng(1).normal(size=off.shape))
    exact = jax.jvp(lambda p: total(p, both), (off,), (way,))[1]
    step = 1e-6
    differences = (total(off + step * way, both) - total(off - step * way, both)) / (2 * step)
    np.testing.assert_allclose(exact, differences, rtol=1e-7)
    np.testing.assert_allclose(jnp.sum(jax.grad(total)(off, both) * way), exact, rtol=1e-12)


def sphere(n: int) -> Panels:
    """A cube's grid blown up to a sphere of radius 1."""
    corners = np.tan(np.asarray(box((-1, -1, -1), (1, 1, 1), 2 / n).corners) * np.pi / 4)
    corners = corners / np.linalg.norm(corners, axis=-1, keepdims=True)
    return Panels(jnp.asarray(np.concatenate([corners[:, [0, 1, 2, 2]], corners[:, [0, 2, 3, 3]]])))


def test_a_sphere_in_a_stream():
    """Its answer to a stream is a dipole's, (1/2r³)(e − 3 x r/r²): 3 % with 768 flat triangles, and no net source."""
    ball = sphere(8)
    closed = solid(ball)
    through = ball.normals[:, 0]
    points = jnp.array([[1.5, 0, 0], [0, 1.5, 0], [1.2, 0.9, 0.5]])
    r = np.linalg.norm(points, axis=1, keepdims=True)
    exact = (np.eye(3)[0] - 3 * np.asarray(points)[:, :1] * np.asarray(points) / r**2) / (2 * r**3)
    np.testing.assert_allclose(closed.answer(points, through), exact, atol=0.035 * 0.3)
    assert abs(float(closed.densities(through) @ ball.areas)) < 1e-12


def test_no_flow_goes_through():
    """A hangar on the ground beside a source: normal flow at all middles, its own and its answer's, is nothing."""
    ground = plane(1.0)
    closed = solid(box((0.8, -1, -1), (2, 1, 0.3), 0.5), ground)
    panels = closed.panels
    assert np.asarray(panels.middles)[:, 2].min() > -1  # the foot is left out
    own = flux_of(np.asarray(panels.middles)) + flux_of(np.asarray(panels.middles) + np.array([0, 0, 2]))
    through = jnp.sum(jnp.asarray(own) * panels.normals, axis=1)
    density = closed.densities(through, ground)
    np.testing.assert_allclose(normal_flow(panels, ground, density), -through, atol=1e-13)
    np.testing.assert_allclose(influence(panels, ground) @ density, -through, atol=1e-13)
    foot = jnp.array([[0.1, 0.2, -1.0], [0.5, -0.4, -1.0]])
    np.testing.assert_allclose(closed.answer(foot, through, ground)[:, 2], 0, atol=1e-14)


def test_a_large_flat_patch_is_the_image():
    """Of a source a radius above it: to 1 % of the upflow at the rotor with panels of 0.25 R, .3 % with half."""
    points = jnp.array([[0.0, 0, 0], [0.7, 0, 0], [0, 0.9, -0.3]])
    image = flux_of(np.asarray(points) + np.array([0, 0, 2]))[:, 2]
    for panel, most in ((0.25, 0.012), (0.125, 0.003)):
        flat = slab((-12, -12), (12, 12), -1.0, 0.5, panel)
        top = Panels(flat.corners[np.asarray(flat.normals)[:, 2] > 0.5])
        through = jnp.sum(jnp.asarray(flux_of(np.asarray(top.middles))) * top.normals, axis=1)
        found = panel_velocity(points, top.corners, -2 * through)  # panels of one plane leave each other alone
        np.testing.assert_allclose(found[:, 2], image, rtol=most)


def test_what_goes_through_between_the_middles():
    """Panels of one plane leave each other alone: what each cannot answer is the change of the flow from its middle."""
    shares = []
    for panel in (0.5, 0.25):
        flat = slab((-1, -1), (1, 1), -0.4, 0.5, panel)
        top = Panels(flat.corners[np.asarray(flat.normals)[:, 2] > 0.5])
        blown = jnp.asarray(flux_of(np.asarray(watched(top))))[..., 2]
        weights = top.areas[:, None] * top.spots(2)[1]
        change, met = ((weights * v**2).sum() for v in (blown[:, 1:] - blown[:, :1], blown[:, 1:]))
        shares.append(float(leak(solid(top), None, jnp.stack([blown, 2 * blown]))))
        np.testing.assert_allclose(shares[-1], jnp.sqrt(change / met), rtol=1e-6)
    assert shares[1] < 0.6 * shares[0]
    assert told(None) is None
    assert told(LEAKY) is None
    assert "40 % of what blows" in told(0.4)


def test_derivative_by_the_place_of_a_wall():
    """A fixed source beside a wall that moves: reverse mode against differences."""
    probe, still = jnp.array([[0.2, 0.1, 0.4], [-0.5, 0.3, -0.2]]), wall(1.2, -1.0, 1.0, 2.0, thickness=0.4, panel=0.5)

    @jax.jit
    def answer(by):
        closed = solid(still.moved(by * jnp.array([1.0, 0, 0])))
        middles = closed.panels.middles
        square = jnp.sum(middles**2, axis=1, keepdims=True)
        through = jnp.sum(middles / square**1.5 * closed.panels.normals, axis=1) / (4 * jnp.pi)
        return jnp.sum(closed.answer(probe, through) * jnp.array([1.0, 0.3, -0.7]))

    differences = (answer(1e-5) - answer(-1e-5)) / 2e-5
    np.testing.assert_allclose(jax.jit(jax.grad(answer))(0.0), differences, rtol=1e-7)


def test_the_floor_of_a_rotor():
    """A large roof is its own floor, a distant one nothing; half of one counts for half of 1/h."""
    np.testing.assert_allclose(floor(slab((-5, -5), (5, 5), -1.3), None).height, 1.3, rtol=4e-3)
    np.testing.assert_allclose(floor(slab((0, -5), (5, 5), -1.0), plane(2.0)).height, 1 / 0.75, rtol=1e-3)
    np.testing.assert_allclose(floor(wall(4.0, -1, 1), plane(1.0)).height, 1.0, rtol=1e-5)
    np.testing.assert_allclose(floor(wall(4.0, -1, 1), None).height, 100, rtol=1e-2)


def test_shapes_are_closed_and_face_outwards():
    for body in (box((0, 0, 0), (1, 2, 3), 0.7), slab((-4, -4), (4, 4), -1.0), wall(1.2, -1, 1, azimuth_deg=30)):
        np.testing.assert_allclose(jnp.sum(body.areas[:, None] * body.normals, axis=0), 0, atol=1e-12)
        assert float(jnp.sum(body.areas * jnp.sum(body.middles * body.normals, axis=1))) > 0  # 3 volumes
    near = wall(1.2, -1, 1, azimuth_deg=90).corners
    np.testing.assert_allclose(near[..., 1].min(), 1.2)


BINARY = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
TETRAHEDRON = np.array([[[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
                        [[0, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]], float)  # fmt: skip


def write(path, facets, text):
    if text:
        body = "".join("facet normal 0 0 0\n outer loop\n" + "".join(f"  vertex {x} {y} {z}\n" for x, y, z in f)
                       + " endloop\nendfacet\n" for f in facets)  # fmt: skip
        path.write_text(f"solid made up\n{body}endsolid\n")
    else:
        rows = np.zeros(len(facets), BINARY)
        rows["corners"] = facets
        path.write_bytes(b"\0" * 80 + len(facets).to_bytes(4, "little") + rows.tobytes())
    return path


@pytest.mark.parametrize("text", [True, False])
def test_a_mesh_file(tmp_path, text):
    found = read_stl(write(tmp_path / "t.stl", TETRAHEDRON, text), scale=0.5, place=(1, 0, -2))
    np.testing.assert_allclose(np.asarray(found.corners)[:, :3], TETRAHEDRON * 0.5 + [1, 0, -2])
    np.testing.assert_allclose(jnp.sum(found.areas[:, None] * found.normals, axis=0), 0, atol=1e-12)
    with pytest.raises(InputError, match=r"t\.stl: facet 1 has an edge without a neighbour"):
        read_stl(write(tmp_path / "t.stl", TETRAHEDRON[:3], text))
    assert len(read_stl(tmp_path / "t.stl", open_=True)) == 3
    with pytest.raises(InputError, match="point inside"):
        read_stl(write(tmp_path / "t.stl", TETRAHEDRON[:, ::-1], text))
    with pytest.raises(InputError, match="facet 2 has no area"):
        read_stl(write(tmp_path / "t.stl", np.concatenate([TETRAHEDRON[:1], TETRAHEDRON[:1] * [1, 0, 0]]), text))
    turned = np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]])
    with pytest.raises(InputError, match="faces the other way"):
        read_stl(write(tmp_path / "t.stl", turned, text))


def test_a_file_that_is_cut_short(tmp_path):
    path = write(tmp_path / "short.stl", TETRAHEDRON, False)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(InputError, match=r"short\.stl.*promises 4 facets"):
        read_stl(path)
    path.write_text("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\nendloop\nendfacet\nendsolid")
    with pytest.raises(InputError, match="facet 1 does not have three corners"):
        read_stl(path)


def test_bad_input():
    for make, words in (
        (lambda: box((0, 0, 0), (1, 1, 0)), "`high` must lie beyond low"),
        (lambda: box((0, 0, 0), (1, 1, 1), panel=0), "`panel` must be"),
        (lambda: terrain([0, 0], [0, 1], np.zeros((2, 2))), "`x` must be two or more rising numbers"),
        (lambda: solid(box((0, 0, -2), (1, 1, 1)), plane(1.0)), "must stay above the ground, but reaches 1 R below"),
        (lambda: solid(Panels(jnp.zeros((1, 4, 3)))), "panels with an area"),
    ):
        with pytest.raises(InputError, match=words):
            make()
    hover = rj.rotor("knight_hefner_2", 8.0, climb=1.0)
    with pytest.raises(InputError, match="must not climb over ground or surfaces"):
        rj.free_wake(*hover, surfaces=box((2, 0, 0), (3, 1, 1), 1.0))


def test_a_new_inverse_belongs_to_new_numbers():
    here = solid(box((2, 0, 0), (3, 1, 1), 0.5))
    there = refitted(here, None)
    np.testing.assert_allclose(here.inverse, there.inverse, atol=1e-14)


def test_a_closed_surface_is_seen_from_behind_all_round_inside_and_not_at_all_outside():
    slab = box((-3.0, -3.0, -0.3), (3.0, 3.0, 0.2))
    inside, outside = (float(seen(jnp.array([0.0, 0.0, z]), slab.corners)) / (4 * np.pi) for z in (0.0, 0.4))
    assert inside == pytest.approx(-1, abs=1e-4)
    assert outside == pytest.approx(0, abs=1e-4)
