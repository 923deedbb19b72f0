"""Draw the pictures that the README shows.

Usage: python data_gen/gallery/make.py --out DIR
"""

import argparse
import hashlib
from pathlib import Path

from meshsdf.mesh.tubes import trefoil_tube
from meshsdf.report.figures import draw_errors, draw_surfaces
from meshsdf.report.roundtrip import roundtrip


def main() -> None:
    """Write surfaces.png and errors.png, and print their sizes and SHA-256."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    knot = trefoil_tube(n_along=480, n_around=48)
    trip = roundtrip(knot, [32, 64, 128])
    draw_errors(trip, out / "errors.png", title="Trefoil knot, mesh to volume to mesh")
    pair = [("mesh", knot), ("after 32 voxels", trip.rows[0].surface)]
    draw_surfaces(pair, out / "surfaces.png")
    for path in sorted(out.glob("*.png")):
        data = path.read_bytes()
        print(f"{path.name}: {len(data)} bytes, sha256 {hashlib.sha256(data).hexdigest()}")


if __name__ == "__main__":
    main()
