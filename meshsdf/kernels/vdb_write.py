"""Choose which values of a ``.vdb`` node are stored, and put its parts together.

`io.vdb_values` has the layout. A value is ``c`` words of 32 bits, compared bit for bit.
"""

import numpy as np
from numba import njit

from .raw_bytes import copy_bytes, put_number
from .vdb_read import FULL, HAS_MASK, N_TOLD


@njit(cache=True, nogil=True)
def choose_values(values, rows, active, child, sides, is_sparse, codes, told, choices, data, ends):
    """Find the code of each node, what it tells, and gather the values that are stored.

    values : (m, n c) uint32; rows : (k,), the row of each node; active, child : (k, n / 64)
    uint64; sides : (2, c), the background and its opposite; is_sparse : whether inactive values
    are left out. Fills codes : (k,); told : (k, 2, c); choices : (k, n / 64), set where the second
    of two values stands; data : room for k n values and one more; ends : (k,), in words.
    """
    c, end = sides.shape[1], 0
    for i in range(len(rows)):
        row = rows[i]
        codes[i] = FULL
        if is_sparse:
            codes[i] = _code(values, row, active[i], child[i], sides, told[i], choices[i])
        end = _gather(values, row, active[i], codes[i] == FULL, c, data, end)
        ends[i] = end


@njit(cache=True, nogil=True)
def _code(values, row, active, child, sides, told, choices):
    """The code of a node, by whether its inactive values are the background or its opposite."""
    c = sides.shape[1]
    plus, minus = sides[0, 0], sides[1, 0]
    any_plus, any_minus, odd = np.uint64(0), np.uint64(0), np.uint64(0)
    at = 0
    for w in range(len(active)):
        inactive = ~(active[w] | child[w])
        is_plus, is_minus = np.uint64(0), np.uint64(0)
        for bit in range(64):
            one_plus = values[row, at] == plus
            one_minus = values[row, at] == minus
            for k in range(1, c):
                one_plus &= values[row, at + k] == sides[0, k]
                one_minus &= values[row, at + k] == sides[1, k]
            is_plus |= np.uint64(one_plus) << np.uint64(bit)
            is_minus |= np.uint64(one_minus) << np.uint64(bit)
            at += c
        is_plus &= inactive
        is_minus &= inactive & ~is_plus
        choices[w] = is_plus
        any_plus |= is_plus
        any_minus |= is_minus
        odd |= inactive & ~(is_plus | is_minus)
    if odd:
        return _odd_code(values, row, active, child, sides[0], told, choices)
    if any_minus:
        return 3 if any_plus else 1
    return 0


@njit(cache=True, nogil=True)
def _odd_code(values, row, active, child, background, told, choices):
    """The code of a node with an inactive value that is neither; what it tells goes to ``told``."""
    c, n_found, one = len(background), 0, np.uint64(1)
    for w in range(len(active)):
        inactive = ~(active[w] | child[w])
        choices[w] = 0
        for bit in range(64):
            if not (inactive >> np.uint64(bit)) & one:
                continue
            at = (64 * w + bit) * c
            if n_found > 0 and _same(values, row, at, told[0]):
                continue
            if n_found == 2 and not _same(values, row, at, told[1]):
                return FULL
            if n_found < 2:
                for k in range(c):
                    told[n_found, k] = values[row, at + k]
                n_found += 1
            # The very first value is the one that is not chosen
            if n_found == 2:
                choices[w] |= one << np.uint64(bit)
    if n_found == 1:
        return 2
    if _same(told, 1, 0, background):
        return 4
    if _same(told, 0, 0, background):
        for w in range(len(active)):
            choices[w] = ~(active[w] | child[w]) & ~choices[w]
        for k in range(c):
            told[0, k] = told[1, k]
        return 4
    return 5


@njit(cache=True, nogil=True)
def _same(values, row, at, value):
    """Whether the value at a place is this one, in all its words."""
    same = True
    for k in range(len(value)):
        same &= values[row, at + k] == value[k]
    return same


@njit(cache=True, nogil=True)
def _gather(values, row, active, is_full, c, data, end):
    """Append the stored values of a row; where they end."""
    at = 0
    for w in range(len(active)):
        stored = ~np.uint64(0) if is_full else active[w]
        if stored == 0:
            at += 64 * c
            continue
        for _ in range(64):
            # Written always and kept if stored, which is quicker than to ask before
            data[end] = values[row, at]
            for k in range(1, c):
                data[end + k] = values[row, at + k]
            end += c * np.int64(stored & np.uint64(1))
            stored >>= np.uint64(1)
            at += c
    return end


@njit(cache=True, nogil=True)
def join_nodes(heads, codes, told, choices, data, counts, sizes, layout, out, ends):
    """Write whole nodes one after another; where each ends goes to ``ends`` (k,).

    heads : (k, h) uint8, what stands before the code; told : (k, 2 v) uint8; choices : (k, n / 8)
    uint8; data : uint8, one node's after another; counts : (k,), bytes of a node's data; sizes :
    (k,), what to write before them; layout : (3,), v, whether sizes are written, and whether that
    is left out where there are no data.
    """
    width, at, begin = layout[0], 0, 0
    for i in range(len(codes)):
        code = codes[i]
        at = copy_bytes(heads[i], 0, out, at, heads.shape[1])
        out[at] = code
        at = copy_bytes(told[i], 0, out, at + 1, N_TOLD[code] * width)
        if HAS_MASK[code]:
            at = copy_bytes(choices[i], 0, out, at, choices.shape[1])
        if layout[1] and (counts[i] or not layout[2]):
            put_number(out, at, sizes[i], 8)
            at += 8
        at = copy_bytes(data, begin, out, at, counts[i])
        begin += counts[i]
        ends[i] = at
