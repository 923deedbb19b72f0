"""``meshsdf info``: what is in a file."""

import click

from ..errors import IoError
from .console import YES, Console, file_size, plural
from .options import json_option, path


@click.command(epilog="Example: meshsdf info bunny.npz")
@click.argument("file", type=path)
@json_option
def command(file: str, as_json: bool) -> int:
    """What is in FILE: a mesh, a texture, a volume or samples, these two from their headers."""
    if file.lower().endswith(".mtex"):
        from .texture_out import info

        return click.get_current_context().invoke(info, texture=file, as_json=as_json)
    console = Console("info", as_json=as_json)
    from ..io import check_input, kind_of, probe_samples, probe_volume, stored_bytes
    from ..io.registry import checked_input, suffix_of, suffixes

    checked_input(file)
    if suffix_of(file) and suffix_of(file) not in suffixes():
        what = f"nothing is known of files with suffix {suffix_of(file)!r}"
        raise IoError(what, f"file {file}", f"use one of {', '.join((*suffixes(), '.mtex'))}")
    check_input(file)
    n_bytes = stored_bytes(file)
    facts = probe_samples(file) if file.lower().endswith((".npz", ".ply")) else None
    if facts is not None or kind_of(file) == "volume":
        facts = facts or probe_volume(file)
        console.result(_volume_words(file, n_bytes, facts))
        console.json({"input": file, "bytes": n_bytes} | facts)
        return YES
    from ..io import read_mesh

    with console.stage("load"):
        loaded = read_mesh(file, warn=console.warn)
    box = loaded.box
    facts = {
        "kind": "mesh",
        "n_vertices": loaded.n_vertices,
        "n_faces": loaded.n_faces,
        "lower": box.lower.tolist(),
        "upper": box.upper.tolist(),
        "has_uv": loaded.uv is not None,
        "has_vertex_colors": loaded.vertex_colors is not None,
        "materials": [material.name for material in loaded.materials],
        "n_images": sum(material.image is not None for material in loaded.materials),
    }
    console.result(_mesh_words(file, n_bytes, facts))
    head = {"input": file, "bytes": n_bytes}
    console.json(head | facts | {"warnings": console.warnings})
    return YES


def _mesh_words(file: str, n_bytes: int, facts: dict) -> str:
    carried = [
        text
        for text, has in (
            ("uv", facts["has_uv"]),
            ("vertex colours", facts["has_vertex_colors"]),
            (plural(len(facts["materials"]), "material"), facts["materials"]),
            (plural(facts["n_images"], "image"), facts["n_images"]),
        )
        if has
    ]
    ranges = zip("xyz", facts["lower"], facts["upper"], strict=True)
    return (
        f"{file}: mesh, {plural(facts['n_vertices'], 'vertex', 'vertices')}, "
        f"{plural(facts['n_faces'], 'face')}, {file_size(n_bytes)}\n"
        + "  ".join(f"{axis} {low:.6g} to {high:.6g}" for axis, low, high in ranges)
        + f"\ncarries: {', '.join(carried) or 'shape only'}"
    )


def _volume_words(file: str, n_bytes: int, facts: dict) -> str:
    kind = facts["kind"].replace("_", " ")
    lines = [f"{file}: {kind}, {file_size(n_bytes)}"]
    lines += _fact_lines({key: value for key, value in facts.items() if key != "kind"}, "  ")
    return "\n".join(lines)


def _fact_lines(facts: dict, indent: str) -> list[str]:
    """One line per fact; a list of things with facts of their own becomes a list below it."""
    lines = []
    for key, value in facts.items():
        words = f"{indent}{key.replace('_', ' ')}:"
        if isinstance(value, list) and value and isinstance(value[0], dict):
            lines.append(words)
            for item in value:
                first, *others = _fact_lines(item, indent + "    ")
                lines += [f"{indent}  - {first.strip()}", *others]
        elif isinstance(value, dict):
            lines += [words, *(f"{indent}  {name}: {_plain(each)}" for name, each in value.items())]
        else:
            lines.append(f"{words} {_plain(value)}")
    return lines


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_plain(item) for item in value)
    return f"{value:.9g}" if isinstance(value, float) else str(value)
