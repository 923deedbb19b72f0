"""``meshsdf compare``: how far apart two meshes are."""

import click

from .console import NO, YES, Console
from .options import Length, PositiveNumber, json_option, path

SHARE = 1e-3  # of a limit, or of the distance: how narrow the interval is to be


@click.command(epilog="Example: meshsdf compare scan.ply cad.obj --max-error 0.1")
@click.argument("a", type=path)
@click.argument("b", type=path)
@click.option(
    "--tolerance",
    type=PositiveNumber(),
    help="Exit 1 if they may be farther apart than this, world units.",
)
@click.option(
    "--max-error",
    type=Length(),
    help="The same, and also in voxels: 0.01 (world units), or 0.5vox with --voxel-size.",
)
@click.option(
    "--voxel-size",
    type=PositiveNumber(),
    help="Also give distances in voxels of this size, world units.",
)
@click.option(
    "--time-budget",
    type=PositiveNumber(),
    help="Seconds after which the interval is left as wide as it is; reading the files, "
    "measuring all vertices and statistics come on top.",
)
@click.option(
    "--statistics/--no-statistics",
    default=True,
    help="Enclose mean, rms and percentiles too, which takes longer.  [default: statistics]",
)
@json_option
def command(
    a: str,
    b: str,
    tolerance: float | None,
    max_error: tuple[float, bool] | None,
    voxel_size: float | None,
    time_budget: float | None,
    statistics: bool,
    as_json: bool,
) -> int:
    """How far apart are the surfaces of A and B, at most, in the mean, and where?

    The largest distance is given as an interval that contains the truth.
    """
    if max_error is not None and max_error[1] and voxel_size is None:
        text = f"--max-error {max_error[0]:g}vox needs --voxel-size, the length of a voxel"
        raise click.UsageError(text)
    console = Console("compare", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..report.compare import compare
    from ..report.tolerance import Tolerance

    for name in (a, b):
        check_input(name, kind="mesh")
    limits = _limits(tolerance, max_error, voxel_size)
    width = None if not limits else Tolerance(SHARE * min(limits.values()), SHARE)
    with console.stage("load"):
        first = read_mesh(a, warn=lambda text: console.warn(f"{a}: {text}"))
        second = read_mesh(b, warn=lambda text: console.warn(f"{b}: {text}"))
    options = {"voxel_size": voxel_size, "tolerance": width, "time_budget": time_budget}
    options["statistics"] = statistics
    with console.stage("compare"):
        comparison = compare(first, second, **options, progress=console.progress)
    missed = [word for word, limit in limits.items() if comparison.distance.upper > limit]
    console.result(f"{a} and {b}:\n{comparison.describe()}")
    for word in missed:
        console.say(_sentence(comparison.distance, word, limits[word]))
    head = {"a": a, "b": b, "tolerance": tolerance, "passed": not missed}
    head["max_error"] = None if max_error is None else list(limits.values())[-1]
    seconds = console.timings("load", "compare")
    console.json(head | comparison.to_json() | {"warnings": console.warnings, "seconds": seconds})
    return NO if missed else YES


def _limits(
    tolerance: float | None, max_error: tuple[float, bool] | None, voxel_size: float | None
) -> dict[str, float]:
    """What the distance is held against, world units, by the words of the command line."""
    limits = {}
    if tolerance is not None:
        limits[f"--tolerance {tolerance:g}"] = tolerance
    if max_error is not None:
        value, in_voxels = max_error
        word = f"--max-error {value:g}{'vox' if in_voxels else ''}"
        limits[word] = value * voxel_size if in_voxels else value
    return limits


def _sentence(distance, word: str, limit: float) -> str:
    """Whether they are too far apart, or are only not known to be near enough."""
    from ..report.enclosure import ceil_digits, floor_digits

    if distance.lower > limit:
        return f"they are {floor_digits(distance.lower)} apart, above {word}"
    return f"they may be {ceil_digits(distance.upper)} apart, above {word}"
