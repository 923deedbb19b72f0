"""What a page shows, in plain numpy: the octree's tables, a brick, eight nodes, as its shader does.

Nothing here uses the texture's own lookup; only the octree's tables and the bricks on the wire.
"""

import itertools

import numpy as np

from meshsdf.server.wire_records import brick_records
from meshsdf.srgb import linear_from_srgb

ABSENT, NO_ENTRY, FIRST_GROUP = -1, -1, -3


def unpacked(payload, picture="base"):
    """Bricks of a BRICKS payload: entry -> (9, 9, 9, 4) numbers times the last, NaN where unsent.

    That is alpha or coverage; colours are linear.
    """
    told = ((entry, brick) for entry, _, brick in brick_records(payload))
    return unpacked_bricks(told, picture)


def unpacked_bricks(told, picture):
    """The same of (entry, brick) pairs."""
    bricks = {}
    for entry, brick in told:
        state, n = brick[0], int.from_bytes(brick[2:4], "little")
        if state == 0:
            bricks.pop(entry, None)
            continue
        if state == 1:
            codes = np.tile(np.frombuffer(brick[4:8], np.uint8), (729, 1))
            sent = np.ones(729, bool)
        else:
            sent = np.unpackbits(np.frombuffer(brick[4:96], np.uint8), bitorder="little")[:729] > 0
            codes = np.frombuffer(brick[96:], np.uint8).reshape(n, 4)
        nodes = np.full((729, 4), np.nan)
        nodes[sent] = numbers_of(codes, picture)
        bricks[entry] = nodes.reshape(9, 9, 9, 4)
    return bricks


def numbers_of(codes, picture):
    """(n, 4) numbers that (n, 4) bytes stand for, by the words of PROTOCOL.md."""
    out = np.zeros((len(codes), 4))
    if picture == "height":
        half, coverage = codes.copy().view("<f2"), codes.copy().view("<u2")
        out[:, 0], out[:, 3] = half[:, 0], coverage[:, 1] / 65535
        return out
    low = codes[:, :3]
    out[:, :3] = linear_from_srgb(low / 255) if picture == "base" else low.view(np.int8) / 127
    out[:, 3] = codes[:, 3] / 255
    return out


def codes_of(numbers, picture):
    """(n,) uint32 codes of (n, 4) float32 numbers of a texture, by the words of PROTOCOL.md."""
    told = numbers[:, :3] * numbers[:, 3:]
    if picture == "height":
        halves = told[:, :1].astype("<f2") + np.float16(0)  # no -0
        coverage = np.rint(65535 * numbers[:, 3:]).astype("<u2")
        return np.hstack([halves.view("<u2"), coverage]).view("<u4")[:, 0]
    steps = np.floor(127 * told.astype(np.float64) + 0.5).astype(np.int8).view(np.uint8)
    coverage = np.floor(255 * numbers[:, 3:].astype(np.float64) + 0.5).astype(np.uint8)
    return np.hstack([steps, coverage]).view("<u4")[:, 0]


def hiding(octree, present, saying):
    """Entries whose brick says nothing, but must hide that a coarser one says something.

    ``present`` are the entries that have a brick, ``saying`` those whose brick says something.
    Nothing is hidden where the brick above is there on all sheets and says nothing; where it is
    there on some of them, the one above that decides, too.
    """
    tables = octree.tables
    sheets = {}
    for entry, (level, brick) in enumerate(zip(tables.levels.tolist(), tables.bricks, strict=True)):
        sheets.setdefault((level, *brick.tolist()), set()).add(entry)
    found = set()
    for entry in present - saying:
        level, brick = int(tables.levels[entry]), tables.bricks[entry]
        goes_on = True
        while goes_on and level + 1 < octree.n_levels:
            level, brick = level + 1, brick >> 1
            above = sheets.get((level, *brick.tolist()), set())
            if above & saying or not above & present:
                found.add(entry)
                break
            goes_on = not above <= present
    return found


def found_entries(tables, level, bricks, normals):
    """(n,) entries of bricks by the page table, of sheets the one that looks most along normals."""
    near = bricks - tables.heads[level, :3]
    inside = ((near >= 0) & (near < 4096)).all(axis=1)
    code = np.full(len(bricks), tables.heads[level, 3])
    for shift in (8, 4, 0):
        digit = (near >> shift) & 15
        code[inside] = tables.pages[code[inside], (digit @ [256, 16, 1])[inside]]
        inside &= code >= 0 if shift else inside
        code[~inside] = NO_ENTRY
    many = np.flatnonzero(code <= FIRST_GROUP)
    for i in many:
        first, count = tables.groups[FIRST_GROUP - code[i]]
        code[i] = first + np.argmax(tables.sheets[first : first + count] @ normals[i])
    return code


def page_colors(octree, slots, bricks, points, normals):
    """(n, 4) numbers at points, still multiplied by the last, and which points are plain.

    Where no brick was sent they are NaN. A point is plain if it is clear whose texels the corners
    of its cell are: its entry's sheet has them all. Where the next brick has several sheets and
    this one has not, just the sheet that the point's normal chooses has them; and if some are not
    stored, a sheet is not two a level above.
    """
    out, plain = np.full((len(points), 4), np.nan), np.zeros(len(points), bool)
    tables = octree.tables
    sent = np.full(octree.n_entries + 1, -1)  # the last answers for NO_ENTRY
    sent[list(bricks)] = np.arange(len(bricks))
    nodes = np.array(list(bricks.values())).reshape(-1, 9, 9, 9, 4)
    waiting = np.arange(len(points))
    for level in range(octree.n_levels):
        places = points[waiting] / octree.spacing(level)
        low = np.floor(places).astype(int)
        entries = found_entries(tables, level, low >> 3, normals[waiting])
        here = sent[entries] >= 0
        facing = normals[waiting[here]]
        entries, node, share = entries[here], low[here] & 7, (places - low)[here]
        color, held = np.zeros((len(entries), 4)), np.ones(len(entries), bool)
        is_stored = np.ones(len(entries), bool)
        for step in itertools.product((0, 1), repeat=3):
            weight = np.prod(np.where(step, share, 1 - share), axis=1, keepdims=True)
            i, j, k = (node + step).T
            values = nodes[sent[entries], i, j, k]
            color += np.where(weight > 0, weight * values, 0)
            holders, one_held = holders_of(tables, entries, node + step, facing)
            held &= one_held
            is_stored &= slots[holders] != ABSENT
        out[waiting[here]], plain[waiting[here]] = color, held
        if level + 1 < octree.n_levels:
            above = found_entries(tables, level + 1, low[here] >> 4, facing)
            parts_above = in_group(tables, above) & ~in_group(tables, entries)
            plain[waiting[here]] &= is_stored | ~parts_above
        waiting = waiting[~here]
    return out, plain


def in_group(tables, entries):
    """Whether entries are sheets of bricks of several."""
    member = np.zeros(len(tables.masks) + 1, bool)
    for first, count in tables.groups:
        member[first : first + count] = True
    return member[entries]


def holders_of(tables, entries, nodes, normals):
    """Which entries hold nodes of 0 to 8 of entries, and whether just these might."""
    holders = tables.neighbors[entries, 13 + (nodes >> 3) @ [9, 3, 1]].copy()
    t = (nodes & 7) @ [64, 8, 1]
    held = (holders >= 0) & has_texel(tables, holders, t)
    for n in np.flatnonzero(holders <= FIRST_GROUP):
        first, count = tables.groups[FIRST_GROUP - holders[n]]
        sheets = np.arange(first, first + count)
        nearest = np.argmax(tables.sheets[sheets] @ normals[n])
        held[n] = has_texel(tables, sheets, t[n]).tolist() == [s == nearest for s in range(count)]
        holders[n] = sheets[nearest]
    return holders, held


def has_texel(tables, entries, t):
    """Whether entries have texel t."""
    rows = tables.masks[entries, t >> 6] >> (t & 63).astype(np.uint64)
    return rows & np.uint64(1) == 1
