"""The worst place of each direction from near: before and after, with the place marked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Vector3
from ..mesh import Mesh
from ..ray import Camera, Scene, render_mesh
from ..spatial.ray_hits import RayHits
from .compare import Comparison
from .hausdorff import OneSided
from .pair_words import PairWords
from .pictures import Picture, file_bytes

WIDTH, HEIGHT, SAMPLES = 640, 480, 2
REACH_VOXELS, REACH_DISTANCES = 7.0, 2.5
"""Half the height of the picture: so many voxels, or so many times the distance if that is more."""

REACH_DIAGONALS = 0.02  # the same where no voxel is known: so much of the diagonal

AWAY = 4.0  # reaches: from where the picture is taken; what is farther out is not in it
LIFT = 1e-6  # of the reach: where lines of sight start above the surface
DIRECTIONS_AROUND, RINGS = 12, (0.95, 0.8, 0.6, 0.35)
SIGHTS = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * 0.4
"""Where lines of sight start, in reaches from the place along the surface and across."""
BLOCKED = 10.0, 2.0  # what a direction loses if the place, or all that is around it, is hidden


@dataclass(frozen=True, eq=False)
class CloseUp:
    """One place before and after.

    Attributes
    ----------
    title : str
        What it is.
    at : str
        "forward" or "backward": whose witness it is.
    pictures : tuple of Picture
        The surface that strays, with the place marked; the other one, with its nearest point.
    """

    title: str
    at: str
    pictures: tuple[Picture, ...]


def close_ups(
    pair: tuple[Mesh, Mesh], found: Comparison, paints: Sequence[Callable], says: PairWords
) -> tuple[CloseUp, ...]:
    """Draw the worst place of both directions of two surfaces, called as ``says`` says."""
    sides = (
        ("forward", found.forward, 0, f"Where {says.a} is farthest from {says.b_of_a}"),
        ("backward", found.backward, 1, f"Where {says.b} is farthest from {says.a}"),
    )
    if found.voxel_size is None:
        least_reach = REACH_DIAGONALS * found.diagonal
    else:
        least_reach = REACH_VOXELS * found.voxel_size
    # Every face is shown as it is: smooth shading would hide what the methods differ in
    scenes = [Scene(surface, smooth=False) for surface in pair]
    answer = []
    for at, side, own, title in sides:
        order = own, 1 - own
        pictures = _pair(
            [scenes[i] for i in order],
            [paints[i] for i in order],
            [says.starts[i] for i in order],
            side,
            least_reach,
        )
        answer.append(CloseUp(title, at, pictures))
    return tuple(answer)


def _pair(
    scenes: list[Scene],
    paints: list[Callable],
    names: list[str],
    side: OneSided,
    least_reach: float,
) -> tuple[Picture, ...]:
    """Two pictures by one camera."""
    witness = side.witness
    nearest = side.nearest
    reach = max(least_reach, REACH_DISTANCES * side.distance.upper)
    center = 0.5 * (witness + nearest)
    normal = scenes[0].face_normals[side.source_face]
    back = line_of_sight(scenes[0].rays, witness, nearest, normal, reach)
    camera = Camera(
        center + AWAY * reach * back, center, _upward(back), orthographic_height=2 * reach
    )
    pixels, _ = camera.project(np.stack([witness, nearest]), WIDTH, HEIGHT)
    words = "the place is ringed", "its nearest point is ringed"
    pictures = []
    for i in range(2):
        view = render_mesh(
            scenes[i],
            camera,
            width=WIDTH,
            height=HEIGHT,
            paint=paints[i],
            samples=SAMPLES,
            occlusion=False,
        )  # a pocket that no sky lights would be black
        name = f"{names[i]}: {words[i]}"
        pictures.append(Picture(file_bytes(view), WIDTH, HEIGHT, name, name, _marker(pixels, i)))
    return tuple(pictures)


def line_of_sight(
    rays: RayHits, witness: Vector3, nearest: Vector3, normal: Vector3, reach: float
) -> Vector3:
    """Choose the unit vector to the eye: the place is seen, and the way to its nearest point.

    Of directions on the outer side of the witness's face that nothing blocks, there and around,
    the one that shows the way at most length, and the face not too obliquely.
    """
    normal = normal if normal.any() else np.array([0.0, 0.0, 1.0])
    across = _upward(normal)
    across = np.cross(across, normal)
    across /= np.linalg.norm(across)
    along = np.cross(normal, across)
    angles = 2 * np.pi * np.arange(DIRECTIONS_AROUND) / DIRECTIONS_AROUND
    ring = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * along
    directions = np.concatenate(
        [[normal], *(cosine * normal + np.sqrt(1 - cosine**2) * ring for cosine in RINGS)]
    )
    way = nearest - witness
    length = np.linalg.norm(way)
    sideways = np.linalg.norm(np.cross(directions, way / length if length > 0 else normal), axis=1)
    score = sideways + directions @ normal
    starts = witness + LIFT * reach * normal + reach * SIGHTS @ np.stack([across, along])
    origins = np.tile(starts, (len(directions), 1))
    lines = np.repeat(directions, len(starts), axis=0)
    is_hidden = (rays(origins, lines).distance < AWAY * reach).reshape(len(directions), -1)
    score -= BLOCKED[0] * is_hidden[:, 0] + BLOCKED[1] * is_hidden[:, 1:].mean(axis=1)
    return directions[int(score.argmax())]


def _upward(back: Vector3) -> Vector3:
    """What is up in a picture seen from there: y, unless that is along the line of sight."""
    return np.array([0.0, 0.0, -1.0]) if abs(back[1]) > 0.9 else np.array([0.0, 1.0, 0.0])


def _marker(pixels: np.ndarray, which: int) -> str:
    """A ring around one of both places, and the way between them; dark on a light edge."""
    (x, y), (u, v) = pixels[which], pixels[1 - which]
    ring = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="13"/>'
    way = f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}"/>'
    shapes = ring + way
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true" fill="none">'
        f'<g stroke="#fff" stroke-width="5" stroke-linecap="round">{shapes}</g>'
        f'<g stroke="#c8102e" stroke-width="2.2" stroke-linecap="round">{shapes}</g></svg>'
    )
