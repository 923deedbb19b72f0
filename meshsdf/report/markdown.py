"""The report of a round trip as Markdown: the same numbers as the page, without pictures."""

from collections.abc import Sequence
from unicodedata import category

from .color_words import COLOR_KINDS, COLOR_MEASURES, COLOR_WORDS
from .notation import count, interval, place, written
from .pointers import MEASURES, UNITS, distance_pointers, look_up
from .verdict import METHOD_WORDS

NOT_SHOWN = {"Cc", "Cs", "Zl", "Zp"}  # control, half a character, ends of lines and paragraphs


def markdown(data: dict) -> str:
    """Write the report from its dict; see `report_data`."""
    parts = [f"# {escaped(data['input']['name'])}: mesh to volume to mesh"]
    parts += [escaped(sentence) for sentence in data["verdict"]["sentences"]]
    parts += [f"**{escaped(sentence)}**" for sentence in data["limits"]["missed"]]
    parts += ["## Every resolution", _rows(data)]
    parts += _colors(data)
    for index in data["last_rows"]:
        if not data["rows"][index]["is_empty"]:
            parts += _last(data["rows"][index])
    parts += ["## The two-set check and the sign", *_check(data)]
    parts += ["## How it was made", *made(data)]
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


def _colors(data: dict) -> list[str]:
    """What became of the colours, if that was asked."""
    rows = [row for row in data["rows"] if row.get("colors")]
    if not rows:
        return []
    head = ["resolution", "method", "ΔE against", *(label for _, label in COLOR_MEASURES)]
    head += ["near", "was", "became"]
    body = []
    for row in rows:
        for kind, label, _ in COLOR_KINDS:
            found = row["colors"][kind]
            cells = [written(row["resolution"], digits=6), METHOD_WORDS[row["method"]], label]
            cells += [f"≈ {written(found[name], digits=3)}" for name, _ in COLOR_MEASURES]
            cells += [place(found["where"]), *(f"`{found[n]}`" for n in ("expected", "found"))]
            body.append(cells)
    n_points = written(rows[0]["colors"]["n_points"])
    notes = [f"{label.capitalize()}: {words}." for _, label, words in COLOR_KINDS]
    return ["## Colours", n_points.join(COLOR_WORDS), _table(head, body), *notes]


def _last(row: dict) -> list[str]:
    title = f"{METHOD_WORDS[row['method']]} at {written(row['resolution'], digits=6)}"
    parts = [f"## {title[0].upper()}{title[1:]}"]
    parts += directions(row, ("Mesh → round trip", "Round trip → mesh"), UNITS)
    parts.append(measures_table(row["measures"], ("before", "after")))
    parts += lost_lines(row["forward"], "the mesh")
    if row["backward"]["signed_mean"]:
        signed = interval(row["backward"]["signed_mean"]["voxels"])
        parts.append(
            "Counted negative inside the mesh, the mean distance of what came back is "
            f"{signed} voxels."
        )
    if row["budget"]:
        parts.append(escaped(row["conditioning"]["words"]))
        parts.append(escaped(row["budget"]["words"]))
    return parts


def directions(told: dict, heads: tuple[str, str], units: Sequence) -> list[str]:
    """A table of distances for each direction."""
    tables = []
    for name, words in zip(("forward", "backward"), heads, strict=True):
        side = told[name]
        body = [
            [label, *(interval(look_up(side, f"{at}/{unit}")) for unit, _ in units)]
            for at, label in distance_pointers(side)
        ]
        tables.append(_table([words, *(label for _, label in units)], body))
    return tables


def measures_table(measures: dict, heads: tuple[str, str]) -> str:
    """Sizes and counts of both."""
    body = [
        [
            label,
            written(measures["before"].get(key), digits=6),
            written(measures["after"].get(key), digits=6),
        ]
        for key, label in MEASURES
    ]
    return _table(["measure", *heads], body)


def lost_lines(side: dict, name: str, fate: str = "lost") -> list[str]:
    """Parts of what is called ``name`` that are farther than a voxel from the other one."""
    if side["n_lost_parts"] is None:
        return []
    n, parts = side["n_lost_parts"], side["lost_parts"]
    if n == 0:
        return [f"No part of {name} is {fate}."]
    lines = [f"{count(n, 'part')} of {name} {'is' if n == 1 else 'are'} {fate}:", ""]
    for part in parts:
        lines.append(
            f"- near {place(part['center'])}: {count(part['n_faces'], 'face')}, area "
            f"{written(part['area'])}, up to {interval(part['largest']['voxels'])} voxels away"
        )
    return ["\n".join(lines)]


def _check(data: dict) -> list[str]:
    lines = [f"- {escaped(line)}" for line in data["two_set"]["words"]]
    sign = data["sign"]
    lines.append(f"- sign by {sign['method']}: {escaped(sign['reason'])}")
    lines += [f"- {escaped(text)}" for text in sign["warnings"]]
    return ["\n".join(lines)]


def made(data: dict) -> list[str]:
    """The command, versions, and times if they are told."""
    parts = [f"    {_printable(data['command'])}"] if data["command"] else []
    versions = ", ".join(f"{name} {text}" for name, text in data["versions"].items())
    parts.append(f"{versions}.")
    if data.get("seconds") is not None:
        spent = ", ".join(f"{name} {written(time)}" for name, time in data["seconds"].items())
        parts.append(f"Seconds: {spent}.")
    return parts


def _table(head: list[str], body: list[list[str]]) -> str:
    rule = ["---", *["---:"] * (len(head) - 1)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *body])


def escaped(text: str) -> str:
    """Names of files and parts of sentences may hold what Markdown takes as marks."""
    return "".join(f"\\{c}" if c in "\\`*_[]<>#|&" else c for c in _printable(text))


def _printable(text: str) -> str:
    """Names of files may hold ends of lines, and bytes that are no letters."""
    return "".join("\N{REPLACEMENT CHARACTER}" if category(c) in NOT_SHOWN else c for c in text)
