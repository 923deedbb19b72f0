"""The report of a round trip as Markdown: the same numbers as the page, without pictures."""

from unicodedata import category

from .notation import count, interval, place, written
from .pointers import distance_pointers, look_up
from .verdict import METHOD_WORDS

NOT_SHOWN = {"Cc", "Cs", "Zl", "Zp"}  # control, half a character, ends of lines and paragraphs
UNITS = (("world", "world units"), ("voxels", "voxels"), ("percent", "% of diagonal"))
MEASURES = (
    ("n_vertices", "vertices"),
    ("n_faces", "faces"),
    ("area", "area"),
    ("volume", "volume"),
    ("euler_number", "Euler number"),
    ("n_components", "components"),
    ("genus", "genus"),
    ("n_boundary_loops", "boundary loops"),
    ("is_watertight", "watertight"),
)


def markdown(data: dict) -> str:
    """Write the report from its dict; see `report_data`."""
    parts = [f"# {_escaped(data['input']['name'])}: mesh to volume to mesh"]
    parts += [_escaped(sentence) for sentence in data["verdict"]["sentences"]]
    parts += [f"**{_escaped(sentence)}**" for sentence in data["limits"]["missed"]]
    parts += ["## Every resolution", _rows(data)]
    for index in data["last_rows"]:
        if not data["rows"][index]["is_empty"]:
            parts += _last(data["rows"][index])
    parts += ["## The two-set check and the sign", *_check(data)]
    parts += ["## How it was made", *_made(data)]
    return "\n\n".join(parts) + "\n"


def _rows(data: dict) -> str:
    head = ["resolution", "method", "voxel size", "largest, world units", "in voxels"]
    head += ["% of diagonal", "mean, voxels", "RMS, voxels", "topology"]
    body = []
    for row in data["rows"]:
        first = [written(row["resolution"], digits=6), METHOD_WORDS[row["method"]]]
        first.append(written(row["voxel_size"]))
        if row["is_empty"]:
            body.append([*first, "nothing came back", *[""] * 5])
            continue
        largest = [interval(row["largest"][unit]) for unit, _ in UNITS]
        spread = [interval(row["forward"][name]["voxels"]) for name in ("mean", "rms")]
        measures = row["measures"]
        euler = [written(measures[side]["euler_number"]) for side in ("before", "after")]
        body.append([*first, *largest, *spread, f"Euler number {' → '.join(euler)}"])
    lines = [_table(head, body)]
    lines += [
        f"Observed order, {METHOD_WORDS[fit['method']]}: {written(fit['order'], digits=3)}"
        for fit in data["orders"]
        if fit["order"] is not None
    ]
    return "\n\n".join(lines)


def _last(row: dict) -> list[str]:
    title = f"{METHOD_WORDS[row['method']]} at {written(row['resolution'], digits=6)}"
    parts = [f"## {title[0].upper()}{title[1:]}"]
    for name, words in (("forward", "Mesh → round trip"), ("backward", "Round trip → mesh")):
        side = row[name]
        body = [
            [label, *(interval(look_up(side, f"{at}/{unit}")) for unit, _ in UNITS)]
            for at, label in distance_pointers(side)
        ]
        parts.append(_table([words, *(label for _, label in UNITS)], body))
    measures = row["measures"]
    body = [
        [
            label,
            written(measures["before"].get(key), digits=6),
            written(measures["after"].get(key), digits=6),
        ]
        for key, label in MEASURES
    ]
    parts.append(_table(["measure", "before", "after"], body))
    parts += _lost(row)
    if row["backward"]["signed_mean"]:
        signed = interval(row["backward"]["signed_mean"]["voxels"])
        parts.append(
            "Counted negative inside the mesh, the mean distance of what came back is "
            f"{signed} voxels."
        )
    if row["budget"]:
        parts.append(_escaped(row["conditioning"]["words"]))
        parts.append(_escaped(row["budget"]["words"]))
    return parts


def _lost(row: dict) -> list[str]:
    if row["forward"]["n_lost_parts"] is None:
        return []
    n, parts = row["forward"]["n_lost_parts"], row["forward"]["lost_parts"]
    if n == 0:
        return ["No part of the mesh is lost."]
    lines = [f"{count(n, 'part')} of the mesh {'is' if n == 1 else 'are'} lost:", ""]
    for part in parts:
        lines.append(
            f"- near {place(part['center'])}: {count(part['n_faces'], 'face')}, area "
            f"{written(part['area'])}, up to {interval(part['largest']['voxels'])} voxels away"
        )
    return ["\n".join(lines)]


def _check(data: dict) -> list[str]:
    lines = [f"- {_escaped(line)}" for line in data["two_set"]["words"]]
    sign = data["sign"]
    lines.append(f"- sign by {sign['method']}: {_escaped(sign['reason'])}")
    lines += [f"- {_escaped(text)}" for text in sign["warnings"]]
    return ["\n".join(lines)]


def _made(data: dict) -> list[str]:
    parts = [f"    {_printable(data['command'])}"] if data["command"] else []
    versions = ", ".join(f"{name} {text}" for name, text in data["versions"].items())
    parts.append(f"{versions}.")
    if data["seconds"] is not None:
        spent = ", ".join(f"{name} {written(time)}" for name, time in data["seconds"].items())
        parts.append(f"Seconds: {spent}.")
    return parts


def _table(head: list[str], body: list[list[str]]) -> str:
    rule = ["---", *["---:"] * (len(head) - 1)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *body])


def _escaped(text: str) -> str:
    """Names of files and parts of sentences may hold what Markdown takes as marks."""
    return "".join(f"\\{c}" if c in "\\`*_[]<>#|&" else c for c in _printable(text))


def _printable(text: str) -> str:
    """Names of files may hold ends of lines, and bytes that are no letters."""
    return "".join("\N{REPLACEMENT CHARACTER}" if category(c) in NOT_SHOWN else c for c in text)
