"""The report of two meshes compared as Markdown: the numbers of the page, without pictures."""

from .compare_report import main_unit, units_of, words_of
from .markdown import directions, escaped, lost_lines, made, measures_table
from .notation import interval


def compare_markdown(data: dict) -> str:
    """Write the report from its dict; see `compare_data`."""
    says, told = words_of(data), data["comparison"]
    a, b = escaped(says.a), escaped(says.b)
    parts = [f"# {a} and {b}: compared", escaped(data["verdict"]["sentence"])]
    parts += [f"**{escaped(sentence)}**" for sentence in data["limits"]["missed"]]
    parts += ["## Distances", *directions(told, (f"{a} → {b}", f"{b} → {a}"), units_of(data))]
    if told["backward"]["signed_mean"]:
        unit, words = main_unit(data)
        signed = interval(told["backward"]["signed_mean"][unit])
        parts.append(f"Counted negative inside {a}, the mean distance of {b} is {signed} {words}.")
    if data["voxel_size"] is not None:
        parts += lost_lines(told["forward"], a, f"missing from {b}")
        parts += lost_lines(told["backward"], b, f"missing from {a}")
    parts += ["## Sizes and counts", measures_table(told["measures"], (a, b))]
    parts.append("## Is there an inside?")
    for key, name in (("a", a), ("b", b)):
        lines = [f"- {escaped(line)}" for line in data["two_set"][key]["words"]]
        parts += [f"### {name}", "\n".join(lines)]
    if data["warnings"]:
        lines = [f"- {escaped(line)}" for line in data["warnings"]]
        parts += ["## Warnings", "\n".join(lines)]
    return "\n\n".join([*parts, "## How it was made", *made(data)]) + "\n"
