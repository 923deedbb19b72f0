"""meshsdf.report.color_loss: what a texture in space keeps of a mesh's colours."""

from dataclasses import replace

import numpy as np
import pytest

from meshsdf import marching_cubes, mesh_to_band
from meshsdf.errors import MemoryLimitError, ReportError
from meshsdf.mesh import Material, Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.color_difference import ColorDifference, delta_e, hexadecimal
from meshsdf.report.color_loss import ColorCarrier, color_loss
from meshsdf.report.notation import written
from meshsdf.report.roundtrip import roundtrip
from meshsdf.report.words import roundtrip_table

from ..models import model, needs_models

WHITE, BLACK = (1, 1, 1, 1), (0, 0, 0, 1)
RED, BLUE = (1, 0, 0, 1), (0, 0, 1, 1)
EDGE = 0.0137
EIGHT_BITS = 0.6  # ΔE that rounding to 8 bits of sRGB can make


def colors(*rows) -> np.ndarray:
    return np.array(rows, np.float32)


def painted(mesh: Mesh, color) -> Mesh:
    """Vertex colours by position."""
    rgba = np.ones((mesh.n_vertices, 4), np.float32)
    rgba[:, :3] = color(mesh.vertices)
    return replace(mesh, vertex_colors=rgba)


def one_color(mesh: Mesh, rgba) -> Mesh:
    """All faces of one material."""
    index = np.zeros(mesh.n_faces, np.int32)
    return replace(mesh, material_index=index, materials=(Material("", colors(rgba)[0]),))


def striped() -> Mesh:
    """A flat square of side 2 with a border between black and white along x = EDGE."""
    places = (-1.0, EDGE, EDGE, 1.0)
    corners = np.array([[x, y, 0.0] for x in places for y in (-1, 1)])
    faces = np.array([[0, 2, 1], [1, 2, 3], [4, 6, 5], [5, 6, 7]], np.int32)
    materials = Material("", colors(BLACK)[0]), Material("", colors(WHITE)[0])
    index = np.array([0, 0, 1, 1], np.int32)
    return Mesh(corners, faces, material_index=index, materials=materials)


def pictured(edge: float) -> Mesh:
    """The same square with an image, black left of x = edge and white right of it."""
    corners = np.array([[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)])
    image = np.zeros((2, 1000, 3), np.uint8)
    image[:, round(1000 * (0.5 + edge / 4)) :] = 255
    return Mesh(
        corners,
        np.array([[0, 2, 1], [1, 2, 3]], np.int32),
        uv=corners[:, :2] / 4 + 0.5,  # away from where the image begins anew
        material_index=np.zeros(2, np.int32),
        materials=(Material("", colors(WHITE)[0], image),),
    )


def two_sided(thickness: float) -> Mesh:
    """A plate, red above and blue below."""
    plate = box_mesh((2.0, 2.0, thickness))
    index = (plate.triangles[:, :, 2].mean(axis=1) < 0).astype(np.int32)
    materials = Material("", colors(RED)[0]), Material("", colors(BLUE)[0])
    return replace(plate, material_index=index, materials=materials)


def came_back(mesh: Mesh, resolution: int) -> tuple[Mesh, float]:
    band = mesh_to_band(mesh, resolution=resolution)
    return marching_cubes(band), band.voxel_size


@pytest.mark.parametrize("rgba", [RED, (0.21, 0.5, 0.03, 1), WHITE, (0.002, 0.001, 0.003, 1)])
def test_a_mesh_of_one_colour_keeps_it(rgba):
    mesh = one_color(icosphere(subdivisions=2), rgba)
    surface, texel = came_back(mesh, 12)
    loss = color_loss(mesh, surface, texel=texel, n_points=5000)
    for found in (loss.sharp, loss.filtered):
        assert 0 <= found.mean <= found.largest < EIGHT_BITS
        assert found.expected == hexadecimal(colors(rgba)[0])
    assert loss.sharp.largest > 0 or rgba in (RED, WHITE)  # those have a number of 8 bits


@pytest.mark.parametrize("texel", [0.2, 0.1, 0.05])
def test_a_border_of_black_and_white_costs_what_a_ramp_over_one_texel_does(texel):
    # Texels left of the border are black, those right of it white, and between two of them light
    # grows in proportion: lightness is off by L(u) before the border, by 100 - L(u) behind it
    u = (np.arange(10_000) + 0.5) / 10_000
    ramp = np.where(u > 216 / 24389, 116 * np.cbrt(u) - 16, u * 24389 / 27)
    off = np.where(u < EDGE / texel, ramp, 100 - ramp)
    n_points = 50_000
    loss = color_loss(striped(), striped(), texel=texel, n_points=n_points)
    share = texel / 2  # of the square's area that lies between the two columns of texels
    spread = np.sqrt(share * (off**2).mean() / n_points)
    assert loss.sharp.mean == pytest.approx(share * off.mean(), abs=4 * spread)
    assert 0 <= loss.sharp.where[0] <= texel
    assert off.max() - 3 < loss.sharp.largest < off.max() + 0.01  # the sum's steps


def test_blur_is_told_from_what_is_misplaced():
    texel, shift = 0.05, 0.15
    flat, moved = pictured(0.0), pictured(shift)
    carrier = ColorCarrier(flat)
    kept = carrier.loss(carrier.texture(texel), flat, n_points=20_000)
    assert kept.filtered.mean < 0.5 * kept.sharp.mean
    wrong = carrier.loss(ColorCarrier(moved).texture(texel), flat, n_points=20_000)
    for found in (wrong.sharp, wrong.filtered):
        # All between the two borders is black and not white, 100 apart, but for some blur
        assert found.mean == pytest.approx(100 * shift / 2, rel=0.15)


def test_both_sides_of_a_thin_plate_keep_their_colours():
    mesh = two_sided(0.15)
    surface, texel = came_back(mesh, 20)
    assert surface.n_faces > 0
    loss = color_loss(mesh, surface, texel=texel, n_points=20_000)
    # Red and blue are 176 apart; they meet on the rim alone, 8 x 0.15 of an area of 9.2
    assert delta_e(colors(RED), colors(BLUE))[0] == pytest.approx(176.3, abs=0.5)
    assert 0 < loss.sharp.mean < 176 * 1.2 / 9.2


def test_a_sheet_nearer_to_the_other_side_belongs_to_the_side_it_looks_to():
    plate = two_sided(0.09)
    mesh = replace(
        plate, vertices=plate.vertices + np.array([0, 0, 0.05])
    )  # texels lie at 0 and 0.1
    corners = np.array([[x, y, 0.04] for x in (-0.5, 0.5) for y in (-0.5, 0.5)])
    for order, color in (([0, 1, 2], "#ff0000"), ([0, 2, 1], "#0000ff")):
        faces = np.array([[0, 2, 1], [1, 2, 3]], np.int32)[:, order]
        loss = color_loss(mesh, Mesh(corners, faces), texel=0.1, n_points=1000)
        assert loss.sharp.largest < EIGHT_BITS
        assert (loss.sharp.expected, loss.sharp.found) == (color, color)


@needs_models
def test_a_checker_on_a_real_mesh_fades_with_the_voxels():
    from meshsdf.io import read_mesh

    read = read_mesh(model("spot.obj"))
    squares = (np.indices((512, 512)) // 32).sum(axis=0) % 2
    image = np.repeat((255 * squares).astype(np.uint8)[:, :, None], 3, axis=2)
    mesh = replace(read, materials=(replace(read.materials[0], image=image),))
    losses = []
    for resolution in (24, 48, 96):
        surface, texel = came_back(mesh, resolution)
        losses.append(color_loss(mesh, surface, texel=texel, n_points=20_000))
    means = [loss.sharp.mean for loss in losses]
    assert means[0] > 1.3 * means[1] > 1.3 * 1.3 * means[2] > 0
    assert all(loss.filtered.mean < loss.sharp.mean for loss in losses)


def test_numbers_are_those_of_the_differences():
    points = np.arange(30.0).reshape(10, 3)
    greys = np.linspace(0, 1, 10, dtype=np.float32)
    expected = np.ones((10, 4), np.float32)
    found = np.stack([greys, greys, greys, np.ones(10, np.float32)], axis=1)
    lightness = np.where(greys > 216 / 24389, 116 * np.cbrt(greys) - 16, greys * 24389 / 27)
    told = ColorDifference.between(points, expected, found)
    assert told.mean == pytest.approx((100 - lightness).mean(), rel=1e-6)
    assert told.percentile_95 == pytest.approx(np.percentile(100 - lightness, 95), rel=1e-6)
    assert told.largest == pytest.approx(100)
    assert told.where.tolist() == [0, 1, 2]
    assert (told.expected, told.found) == ("#ffffff", "#000000")


def test_a_lost_alpha_is_a_loss_whatever_the_colour():
    clear, solid = colors((0, 0, 0, 0), (1, 1, 1, 0.5)), colors(BLACK, WHITE)
    difference = delta_e(clear, solid)
    assert difference[0] == pytest.approx(100)  # over white
    assert difference[1] == pytest.approx(100 - (116 * 0.5 ** (1 / 3) - 16), abs=1e-3)  # over black
    assert delta_e(clear, clear).max() == 0
    assert hexadecimal(clear[0]) == "#00000000"


def test_the_same_seed_gives_the_same_numbers():
    mesh = striped()
    once, again, other = (
        color_loss(mesh, mesh, texel=0.1, n_points=1000, seed=seed).to_json() for seed in (0, 0, 1)
    )
    assert once == again
    assert once != other


def test_roundtrip_carries_colours_only_if_asked():
    mesh = painted(icosphere(subdivisions=2), lambda at: (at + 1) / 2)
    methods = ("marching-cubes", "dual-contouring")
    plain = roundtrip(mesh, (8,), methods=methods)
    assert plain.rows[0].colors is None
    assert all("colors" not in row for row in plain.rows_to_json())
    assert "colours" not in roundtrip_table(plain)
    trip = roundtrip(mesh, (8, 16), methods=methods, carry_texture=True)
    for row, told in zip(trip.rows, trip.rows_to_json(), strict=True):
        direct = color_loss(mesh, row.surface, texel=row.voxel_size)
        assert told["colors"] == direct.to_json()
        assert set(row.seconds) == {"distance", "surface", "compare", "colors"}
        assert row.colors.sharp.mean < 3  # colours change slowly; the just seen is 2.3
    words = roundtrip_table(trip)
    assert words.startswith(roundtrip_table(replace(trip, has_colors=False)))
    assert words.count("colours at ") == 4
    mean = written(trip.rows[3].colors.sharp.mean, digits=3)
    assert f"colours at 16 by dual-contouring: ΔE {mean} on average" in words


def test_what_does_not_come_back_has_no_colours():
    plate = box_mesh((2.0, 2.0, 0.01))
    mesh = one_color(Mesh(plate.vertices + 0.06, plate.faces), RED)
    trip = roundtrip(mesh, (6,), carry_texture=True)
    assert trip.rows_to_json()[0]["colors"] is None
    assert "colours at 6: nothing came back" in roundtrip_table(trip)


def test_a_mesh_without_colours_is_refused():
    message = "no colours: neither vertex colours nor a material on any of its 12 faces"
    with pytest.raises(ReportError, match=message):
        color_loss(box_mesh(), box_mesh(), texel=0.1)
    unused = replace(one_color(box_mesh(), RED), material_index=np.full(12, -1, np.int32))
    with pytest.raises(ReportError, match=message):
        roundtrip(unused, (8,), carry_texture=True)


def test_no_points_and_too_little_memory_are_refused():
    mesh = one_color(box_mesh(), RED)
    with pytest.raises(ReportError, match="0 points say nothing"):
        color_loss(mesh, mesh, texel=0.1, n_points=0)
    with pytest.raises(MemoryLimitError, match="100 MB are allowed"):
        ColorCarrier(mesh, max_memory=1e8).texture(1e-3)
