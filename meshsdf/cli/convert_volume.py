"""A volume to another format, or another form."""

from dataclasses import replace

from .console import YES, Console, plural
from .convert_mesh import volume_words

USUAL_NAMES = ("surface", "distance")
"""What our own writers call a volume; other names are worth a word."""


def convert_volume(console: Console, source: str, out: str, options: dict) -> int:
    """Convert as the options of `convert` say; return the exit code."""
    from ..io import check_input, check_volume_output, probe_volume, read_volume, stored_bytes
    from ..io.losses import file_losses, metadata_losses, require_accepted, volume_losses
    from ..io.registry import format_of

    force, name = options["force"], options["grid"]
    check_input(source, kind="volume")
    check_volume_output(out, force=force)
    target = format_of(out, "volume", "writer")
    told = probe_volume(source)
    losses = file_losses(told, name, is_named=name is not None)
    with console.stage("load"):
        # What is left out of a file is told as a loss already
        volume = read_volume(source, grid=name, warn=_unless(console, losses))
    name, grid_class = _labels(told, name)
    is_dense = _is_dense(volume, target, options, grid_class)
    losses += volume_losses(volume, target, is_dense=is_dense, half=options["half"])
    require_accepted(losses, out, force=force, warn=console.warn)
    notes = metadata_losses(told, name, target)
    require_accepted(notes, out, force=True, warn=console.warn)
    with console.stage("convert"):
        volume = _formed(console, volume, options, is_dense=is_dense)
        volume = _without_lost(volume, target.holds)
    facts = volume.facts()
    writer = options["writer"] | _naming(console, target, name, grid_class, is_dense=is_dense)
    writer |= _carried(source, told, name, target)
    with console.stage("write"):
        _write(console, out, volume, options, writer)
    n_bytes = stored_bytes(out)
    seconds = console.timings("load", "convert", "write")
    words = volume_words(out, facts, n_bytes, seconds["total"])
    console.result(f"{source}: {told['kind'].replace('_', ' ')}\n{words}")
    console.json(
        {"input": source, "output": out, "bytes": n_bytes}
        | facts
        | {"sign_reason": "as the input tells it", "losses": losses + notes}
        | {"seconds": seconds, "warnings": console.warnings}
    )
    return YES


def _unless(console: Console, losses: list[str]):
    """A warn callback that passes over what other grids there are, where that is told already."""

    def warn(sentence: str) -> None:
        if not (losses and sentence.startswith("read the ")):
            console.warn(sentence)

    return warn


def _labels(told: dict, name: str | None) -> tuple[str | None, str]:
    """The name of what is read, and its class, as far as the file tells them."""
    if "grids" not in told:
        return told.get("array") if name is None else name, ""
    name = told["default_grid"] if name is None else name
    found = next((grid for grid in told["grids"] if grid["name"] == name), {})
    return name, found.get("class", "")


def _is_dense(volume, target, options: dict, grid_class: str) -> bool:
    """Whether a full grid is written; IoError where a band is asked for and cannot be."""
    from ..errors import IoError
    from ..grid import NarrowBand

    if options["sparse"]:
        if "band" not in target.holds:
            what = f"{target.name} has no narrow bands"
            raise IoError(what, "--sparse", "leave it out, or write .vdb, .npz or .zarr")
        if grid_class == "fog volume":
            what = "a fog volume holds densities, so nothing tells how far the surface is"
            raise IoError(what, "--sparse", "leave it out")
        return False
    return not isinstance(volume, NarrowBand) or options["dense"] or "band" not in target.holds


def _formed(console: Console, volume, options: dict, *, is_dense: bool):
    """The volume as a full grid, or as a band."""
    from ..grid import NarrowBand
    from ..grid.cut_band import cut_band, reaches_border
    from ..io.dense_form import full_grid

    is_band = isinstance(volume, NarrowBand)
    if is_dense and is_band:
        grid = full_grid(volume, max_memory=options["max_memory"])
        nodes = " x ".join(map(str, grid.values.shape))
        clipped = f"clipped to +-{grid.background:.6g} beyond {grid.half_width:g} voxels"
        console.warn(f"written as a full grid of {nodes} nodes, {clipped}")
        return grid
    if not is_dense and not is_band:
        band = cut_band(volume, options["half_width"])
        n = plural(volume.values.size - band.n_active, "node")
        console.warn(f"beyond {band.half_width:g} voxels only the side is kept, of {n}")
        if reaches_border(volume):
            console.warn("the inside reaches the border of the grid; beyond it all is outside now")
        return band
    if options["sparse"]:
        console.warn("it is a narrow band already; written as it is")
    return volume


def _without_lost(volume, holds: frozenset[str]):
    """The volume without what the format has no place for, whose loss is accepted by now."""
    from ..grid import NarrowBand

    if not isinstance(volume, NarrowBand):
        return volume
    fields = {
        "closest": ("closest_face", "barycentric"),
        "hermite": ("hermite",),
        "uncertain": ("uncertain",),
    }
    lost = [name for word, names in fields.items() if word not in holds for name in names]
    return replace(volume, **dict.fromkeys(lost))


def _naming(console: Console, target, name: str | None, grid_class: str, *, is_dense: bool) -> dict:
    """What the writer has to know of the name and class."""
    is_fog, is_named = grid_class == "fog volume", name and name not in USUAL_NAMES
    if target.has_names:
        options = {"name": name} if is_named else {}
        if target.name == "OpenVDB" and is_fog and is_dense:
            return options | {"grid_class": grid_class}
    else:
        options = {}
        if is_named:
            console.warn(f"{target.name} has no names: {name!r} is not kept")
    if is_fog:
        console.warn("these are densities of a fog volume, which is not told in the output")
    return options


def _carried(source: str, told: dict, name: str | None, target) -> dict:
    """What the writer is given of a file's metadata."""
    if "grids" not in told or "metadata" not in target.holds:
        return {}
    from ..io import read_vdb_metadata

    return {"metadata": read_vdb_metadata(source, grid=name)}


def _write(console: Console, out: str, volume, options: dict, writer: dict) -> None:
    from ..io import write_volume

    half, force = options["half"], options["force"]
    write_volume(out, volume, half=half, force=force, warn=console.warn, options=writer)
