"""Marching cubes on a whole dense grid: ranges of its planes, each range by itself.

Every range looks at its values twice, to count and to fill, and holds no more than four planes of
bits (`marching_planes`).
"""

import numpy as np
from numba import njit

from .marching_planes import (
    classify_plane,
    collect_cells,
    count_cells,
    empty_plane,
    join_planes,
    number_edges,
    write_faces,
    write_vertices,
)


@njit(cache=True, nogil=True)
def _scratch(values, shift):
    """Words of four planes: nodes, edges, first."""
    rows = values.shape[1] + 2 * shift
    words = (values.shape[2] + 2 * shift + 63) >> 6
    nodes = (
        np.zeros((4, rows, words), np.uint64),
        np.zeros((4, rows, words), np.uint64),
        np.zeros((4, rows, words), np.uint64),
    )
    edges = np.zeros((4, 3, rows, words), np.uint64), np.zeros((4, 3, rows, words), np.uint64)
    return nodes, edges, np.zeros((4, 3, rows, words), np.int32)


@njit(cache=True, nogil=True)
def _take(values, threshold, shift, p, nodes):
    """Set the words of plane p, of the grid or around it or beyond."""
    if 0 <= p - shift < len(values):
        classify_plane(values[p - shift], threshold, shift, p, nodes)
    else:
        is_around = 0 <= p < len(values) + 2 * shift
        empty_plane(p, values.shape[2] + 2 * shift if is_around else 0, nodes)


@njit(cache=True, nogil=True)
def _plane(values, i):
    """Plane i, or another if there is none, and whether there is."""
    is_real = 0 <= i < len(values)
    return values[i if is_real else 0], is_real


@njit(cache=True, nogil=True)
def count_planes(values, threshold, shift, sizes, start, stop, counts):
    """Write vertices, faces (without special cells') and special cells of every step."""
    nodes, edges, first = _scratch(values, shift)
    signs, mixed = np.empty(8, np.uint64), np.empty(nodes[0].shape[2], np.uint64)
    _take(values, threshold, shift, start - 1, nodes)
    _take(values, threshold, shift, start, nodes)
    join_planes(start - 1, nodes)
    for p in range(start, stop):
        _take(values, threshold, shift, p + 1, nodes)
        join_planes(p, nodes)
        counts[p, 0] = number_edges(p, nodes, edges, first)
        counts[p, 1], counts[p, 2] = count_cells(p, nodes, sizes, signs, mixed)


@njit(cache=True, nogil=True)
def collect_planes(
    values, threshold, shift, is_special, first_special, start, stop, cells, corners
):
    """Write place and corner values of the special cells; step p's from first_special[p] on."""
    nodes, _, _ = _scratch(values, shift)
    signs, mixed = np.empty(8, np.uint64), np.empty(nodes[0].shape[2], np.uint64)
    for p in range(start, stop):
        if first_special[p] == first_special[p + 1]:
            continue
        _take(values, threshold, shift, p, nodes)
        _take(values, threshold, shift, p + 1, nodes)
        join_planes(p, nodes)
        lower, is_lower = _plane(values, p - shift)
        upper, is_upper = _plane(values, p + 1 - shift)
        collect_cells(
            lower, upper, (is_lower, is_upper), shift, p, nodes, is_special, first_special[p],
            cells, corners, signs, mixed,
        )  # fmt: skip


@njit(cache=True, nogil=True)
def fill_planes(
    values, threshold, shift, place, cases, firsts, special_rows, centers, start, stop,
    vertices, keys, faces,
):  # fmt: skip
    """Write vertices and faces of every step where ``firsts`` (steps + 1, 3) says.

    Its columns: first vertex, first face, first special cell.
    """
    nodes, edges, first = _scratch(values, shift)
    signs, mixed = np.empty(8, np.uint64), np.empty(nodes[0].shape[2], np.uint64)
    for p in range(start - 1, start + 2):
        _take(values, threshold, shift, p, nodes)
    join_planes(start - 1, nodes)
    join_planes(start, nodes)
    number_edges(start, nodes, edges, first)
    for p in range(start, stop):
        _take(values, threshold, shift, p + 2, nodes)
        join_planes(p + 1, nodes)
        number_edges(p + 1, nodes, edges, first)
        lower, is_lower = _plane(values, p - shift)
        upper, is_upper = _plane(values, p + 1 - shift)
        write_vertices(
            lower, upper, (is_lower, is_upper), shift, p, edges, place, firsts[p, 0], vertices, keys
        )
        write_faces(
            p, nodes, edges, first, firsts[p, 0], firsts[p + 1, 0], cases, special_rows, centers,
            firsts[p, 2], firsts[p, 1], faces, signs, mixed,
        )  # fmt: skip
