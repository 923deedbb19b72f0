"""``meshsdf sample``: points with their signed distances to a mesh."""

import os

import click

from .console import YES, Console, file_size, plural
from .options import (
    Counts,
    Number,
    PositiveNumbers,
    force_option,
    json_option,
    max_memory_option,
    path,
    sign_option,
)


@click.command(epilog="Example: meshsdf sample bunny.obj bunny.npz --normalize unit-sphere")
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@click.option(
    "--n",
    type=click.IntRange(1),
    help="How many samples; the kinds get equal parts.  [default: 500000]",
)
@click.option(
    "--kind",
    "kinds",
    type=Counts("near", "uniform", "surface"),
    help="Where: near the surface, uniform in a box around the mesh, on the surface; or counts of "
    "each, such as near=9000,surface=1000.  [default: 94% near and 6% uniform, as DeepSDF]",
)
@click.option(
    "--normalize",
    type=click.Choice(["none", "unit-sphere", "unit-cube"]),
    default="none",
    show_default=True,
    help="Move and scale the samples so that the mesh fills the unit sphere (radius 1) or the unit "
    "cube (side 1), but for the margin. Told in the file.",
)
@click.option(
    "--margin",
    type=Number(),
    default=0.03,
    show_default=True,
    help="Room around the mesh, as a part of its size.",
)
@click.option(
    "--variance",
    "variances",
    type=PositiveNumbers(),
    default=(0.0025, 0.00025),
    help="Of the steps off the surface, where the sphere around the mesh has radius 1; each point "
    "makes one step of each.  [default: 0.0025,0.00025]",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the chance.")
@sign_option
@click.option(
    "--layout",
    type=click.Choice(["plain", "deepsdf"]),
    default="plain",
    show_default=True,
    help="How .npz files are laid out: deepsdf has pos and neg, (k, 4) float32.",
)
@click.option("--double", "is_double", is_flag=True, help="Store 64-bit floats.")
@click.option("--closest", is_flag=True, help="Also store closest points and their faces.")
@max_memory_option
@force_option
@json_option
def command(
    mesh: str,
    out: str,
    n: int | None,
    kinds: dict[str, int | None] | None,
    normalize: str,
    margin: float,
    variances: tuple[float, ...],
    seed: int,
    sign: str,
    layout: str,
    is_double: bool,
    closest: bool,
    max_memory: float | None,
    force: bool,
    as_json: bool,
) -> int:
    """Draw points around MESH and write them with their exact signed distances, OUT (.npz or .ply).

    The same seed gives the same bytes.
    """
    counts = _counts(n, kinds)
    if margin < 0:
        raise click.UsageError(f"--margin {margin:g} is below 0")
    if layout == "deepsdf" and (is_double or closest):
        raise click.UsageError("--layout deepsdf holds 32-bit points and distances, no more")
    console = Console("sample", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..io.samples import check_samples_output, write_samples
    from ..mesh.two_set import check
    from ..sdf import sample_distances

    check_input(mesh, kind="mesh")
    check_samples_output(out, layout=layout, force=force)
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    with console.stage("check"):
        report = check(loaded, self_intersections=False)
    with console.stage("samples"):
        samples = sample_distances(
            loaded,
            counts,
            normalize=normalize,
            margin=margin,
            variances=variances,
            seed=seed,
            sign=sign,
            report=report,
            is_double=is_double,
            closest=closest,
            max_memory=max_memory,
            progress=console.progress,
        )
    with console.stage("write"):
        write_samples(out, samples, layout=layout, force=force)
    for warning in samples.warnings:
        console.warn(warning)
    if layout == "deepsdf":
        for warning in _deepsdf_words(samples):
            console.warn(warning)
    seconds = console.timings("load", "check", "samples", "write")
    console.result(_words(mesh, out, samples, seconds["total"]))
    space = samples.normalization
    placing = {"name": space.name, "center": space.center.tolist(), "scale": space.scale}
    drawn = {"n": samples.n, "kinds": samples.counts(), "seed": seed, "layout": layout}
    console.json(
        {"input": mesh, "output": out, "bytes": os.path.getsize(out)}
        | drawn
        | {"normalization": placing, "sign": samples.sign, "sign_reason": samples.reason}
        | {"n_uncertain": samples.n_uncertain, "n_inside": int((samples.distance < 0).sum())}
        | {"seconds": seconds, "warnings": console.warnings}
    )
    return YES


def _counts(n: int | None, kinds: dict[str, int | None] | None) -> int | dict[str, int]:
    """How many of each kind, or in all; UsageError where the options do not say it."""
    if kinds is None:
        return 500_000 if n is None else n
    told = [count for count in kinds.values() if count is not None]
    if not told:
        n = 500_000 if n is None else n
        bounds = [n * part // len(kinds) for part in range(len(kinds) + 1)]
        return {kind: bounds[i + 1] - bounds[i] for i, kind in enumerate(kinds)}
    if len(told) < len(kinds):
        raise click.UsageError("--kind: give a count to each kind, or to none")
    if n is not None:
        raise click.UsageError("give --n or counts in --kind, not both")
    if sum(told) < 1:
        raise click.UsageError("--kind: ask for one sample at least")
    return dict(kinds)


def _deepsdf_words(samples) -> list[str]:
    """What a loader of this layout does not know, or cannot take."""
    words = []
    if samples.normals is not None:
        words.append("normals have no place in DeepSDF's layout; left out")
    n_inside = int((samples.distance <= 0).sum())
    if n_inside in (0, samples.n):
        which = "neg" if n_inside == 0 else "pos"
        words.append(f"{which} is empty: DeepSDF's loader needs samples on both sides")
    return words


def _words(mesh: str, out: str, samples, total: float) -> str:
    kinds = [f"{count} {kind}" for kind, count in samples.counts().items() if count]
    space = samples.normalization
    center = ", ".join(f"{x:.6g}" for x in space.center)
    placing = f"scale {space.scale:.6g} about {center} ({space.name})"
    return (
        f"{mesh}: sign: {samples.sign} ({samples.reason})\n"
        f"{'world units' if space.name == 'none' else placing}\n"
        f"{out}: {plural(samples.n, 'sample')} ({', '.join(kinds)}), "
        f"{file_size(os.path.getsize(out))}, {total:.2f} s"
    )
