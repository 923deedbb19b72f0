"""Draw the pictures that the README shows.

Usage: python data_gen/gallery/make.py --out DIR [--bunny FILE]

The Stanford bunny is not part of the project; without its file wood.png is not drawn.
"""

import argparse
import hashlib
from pathlib import Path
from tempfile import TemporaryDirectory

from meshsdf.cli.main import run
from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.report.figures import draw_errors, draw_surfaces
from meshsdf.report.roundtrip import roundtrip


def main() -> None:
    """Write surfaces.png and errors.png, and print their sizes and SHA-256."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--bunny", type=Path, help="a mesh to be drawn as if it were of wood")
    options = parser.parse_args()
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    knot = trefoil_tube(n_along=480, n_around=48)
    trip = roundtrip(knot, [32, 64, 128])
    draw_errors(trip, out / "errors.png", title="Trefoil knot, mesh to volume to mesh")
    pair = [("mesh", knot), ("after 32 voxels", trip.rows[0].surface)]
    draw_surfaces(pair, out / "surfaces.png")
    if options.bunny is not None:
        draw_wood(options.bunny, out / "wood.png")
    for path in sorted(out.glob("*.png")):
        data = path.read_bytes()
        print(f"{path.name}: {len(data)} bytes, sha256 {hashlib.sha256(data).hexdigest()}")


def draw_wood(source: Path, path: Path) -> None:
    """Draw a mesh with the wood grain of `texture procedural`."""
    with TemporaryDirectory() as folder:
        project = str(Path(folder) / "wood.mtex")
        for command in (
            ["texture", "procedural", str(source), project, "--kind", "wood_grain"],
            ["render", project, str(path), "--width", "800", "--view", "25,15", "--force"],
        ):
            if run(command) != 0:
                raise SystemExit(f"meshsdf {' '.join(command)} failed")


if __name__ == "__main__":
    main()
