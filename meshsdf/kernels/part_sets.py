"""Sheets divided among the numbers of their faces, and the number next to every texel."""

import numpy as np
from numba import njit

from .face_numbers import MOST_NUMBERS
from .sheet_parts import MOST_PARTS, place_face, sheet_of_faces
from .sheets import encode_normal, mark_texels, pack_bits

MOST_SETS = 4  # that a sheet is divided into; with what needs more, colours mix
NO_SET = -1


@njit(cache=True, nogil=True)
def find_sets(rows, first, faces, labels, clash, second, n_parts, numbers, sets, bits):
    """Sets of numbers that may share texels, for each sheet of the bricks ``rows``.

    The other arguments are as `sheet_parts.find_parts` leaves them. ``sets[r, sheet, number]`` is
    the set of a number, or NO_SET; ``bits[r, sheet, set]`` int32 the numbers of a set, 0 for none.
    """
    used, apart = np.zeros(MOST_PARTS, np.uint32), np.zeros(MOST_NUMBERS, np.uint32)
    for r in range(len(rows)):
        i = rows[r]
        used[:] = 0
        for s in range(first[i], first[i + 1]):
            used[labels[s]] |= np.uint32(1) << np.uint32(numbers[faces[s]])
        for sheet in range(2):
            present = np.uint32(0)
            apart[:] = 0
            for a in range(n_parts[i]):
                if (second[i] >> np.uint32(a)) & np.uint32(1) != sheet:
                    continue
                present |= used[a]
                others = np.uint32(0)
                for b in range(n_parts[i]):
                    if (clash[i, a] >> np.uint32(b)) & np.uint32(1):
                        others |= used[b]
                for number in range(MOST_NUMBERS):
                    if (used[a] >> np.uint32(number)) & np.uint32(1):
                        apart[number] |= others
            for number in range(MOST_NUMBERS):
                sets[r, sheet, number] = NO_SET
                if not (present >> np.uint32(number)) & np.uint32(1):
                    continue
                k = 0
                while k < MOST_SETS - 1 and np.uint32(bits[r, sheet, k]) & apart[number]:
                    k += 1
                sets[r, sheet, number] = k
                bits[r, sheet, k] |= np.int32(np.uint32(1) << np.uint32(number))


@njit(cache=True, nogil=True)
def divide(
    triangles, normals, numbers, scale, bricks, first, faces, n_sheets, entry_first, row_of, sets,
    only_masks, begin, end, masks, texel_first, texel_normals, texel_parts,
):  # fmt: skip
    """Fill in what the numbers of faces say of the bricks ``begin ... end - 1``.

    Those with a row, ``row_of[i] >= 0``, are divided into ``sets[row]``, one entry each, from
    ``entry_first[i]`` on. With ``only_masks``, the masks of their entries; else, for these, the
    normals of texels, and for all bricks the number of a face next to each texel: the first of
    those that differ from what most faces of the brick have, or else that.
    """
    most = 2 * MOST_SETS
    marked, own = np.zeros((most, 512), np.bool_), np.zeros(512, np.bool_)
    sums, number = np.zeros((most, 512, 3), np.float32), np.zeros((most, 512), np.uint8)
    no_sums = np.zeros((512, 3), np.float32)
    pole, local = np.zeros((2, 3)), np.empty((3, 3))
    longest = 1
    for i in range(begin, end):
        longest = max(longest, first[i + 1] - first[i])
    sheet = np.empty(longest, np.uint8)
    for i in range(begin, end):
        entry, row = entry_first[i], row_of[i]
        n = entry_first[i + 1] - entry
        if row < 0 and only_masks:
            continue
        usual, is_alone = _usual_number(numbers, faces, first[i], first[i + 1])
        if row < 0:
            texel_parts[texel_first[entry] : texel_first[entry + n]] = usual
            if is_alone:
                continue
        marked[:n] = False
        if row >= 0:
            sums[:n] = 0.0
            number[:n] = usual
        sheet_of_faces(normals, faces, first[i], first[i + 1], n_sheets[i] > 1, pole, sheet)
        second = _n_sets(sets, row, 0) if row >= 0 else 1
        for s in range(first[i], first[i + 1]):
            face = faces[s]
            if row < 0 and numbers[face] == usual:
                continue
            k = second if sheet[s - first[i]] and n > 1 else 0
            if row >= 0:
                k += sets[row, sheet[s - first[i]], numbers[face]]
            place_face(triangles, face, scale, bricks, i, local)
            own[:] = False
            mark_texels(local, normals, face, own, sums[k] if row >= 0 else no_sums)
            _note_number(own, numbers[face], usual, marked[k], number[k])
        if only_masks:
            for k in range(n):
                pack_bits(marked[k], masks[entry + k])
        else:
            _write(
                marked, number, sums, row >= 0, entry, n, masks, texel_first, texel_normals,
                texel_parts,
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _note_number(own, this, usual, marked, number):
    """Mark a face's own texels, and note its number where there is none yet but the usual one."""
    for t in range(512):
        if own[t] and (not marked[t] or number[t] == usual):
            marked[t], number[t] = True, this


@njit(cache=True, nogil=True)
def _write(
    marked, number, sums, is_divided, entry, n, masks, texel_first, texel_normals, texel_parts
):
    """Put the numbers of marked texels, and their normals if the brick is divided, in place."""
    for k in range(n):
        at = texel_first[entry + k]
        for t in range(512):
            if (masks[entry + k, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                if is_divided:
                    encode_normal(sums[k, t], texel_normals[at])
                if marked[k, t]:
                    texel_parts[at] = number[k, t]
                at += 1


@njit(cache=True, nogil=True)
def _usual_number(numbers, faces, start, stop):
    """The number that most faces have, the least of several; and whether all have it."""
    counts = np.zeros(MOST_NUMBERS, np.int64)
    for s in range(start, stop):
        counts[numbers[faces[s]]] += 1
    usual = 0
    for number in range(1, MOST_NUMBERS):
        if counts[number] > counts[usual]:
            usual = number
    return np.uint8(usual), counts[usual] == stop - start


@njit(cache=True, nogil=True)
def _n_sets(sets, row, sheet):
    most = NO_SET
    for number in range(MOST_NUMBERS):
        most = max(most, sets[row, sheet, number])
    return most + 1
