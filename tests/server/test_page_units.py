"""The painting page's own tests, run by Node; and its lookup of colours beside the program's."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.server.bundle import PAGE, BundleError, find_tools
from meshsdf.server.octree_wire import octree_bytes, wire_origin
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.texture import VolumeTexture
from meshsdf.texture.brush import Brush
from meshsdf.texture.stroke import Stroke

TESTS = sorted((PAGE / "test").glob("*.test.js"))
STEP = 0.5 / 255  # colours on the wire have 8 bits in sRGB

LOOK = """
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
const [page, folder] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(`${page}/src/${name}`));
const { decodeBricks } = await load("net/protocol.js");
const { Bricks } = await load("view/bricks.js");
const { decodeOctree, findBrick } = await load("view/octree.js");
const read = (name) => Uint8Array.from(readFileSync(`${folder}/${name}`)).buffer;
const octree = decodeOctree(read("octree"));
const bricks = new Bricks(octree.nEntries);
for (const brick of decodeBricks(new Uint8Array(read("bricks")))) bricks.put(brick);
const places = new Float64Array(read("places"));
const out = new Float64Array((4 * places.length) / 6);
for (let n = 0; n < places.length / 6; n++) {
  const [x, y, z, ...normal] = places.subarray(6 * n, 6 * n + 6);
  const found = findBrick(octree, (entry) => bricks.has(entry), [x, y, z], normal);
  if (found) out.set(bricks.sample(found.entry, found.local), 4 * n);
}
writeFileSync(`${folder}/colors`, out);
"""


def node() -> Path:
    try:
        return find_tools().node
    except BundleError as error:
        pytest.skip(f"no Node: {error.args[0].splitlines()[0]}")


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.name)
def test_the_pages_own_tests_pass(path):
    command = [str(node()), "--test", str(path)]
    environment = {**os.environ, "NODE_NO_WARNINGS": "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=environment
    )
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]


@pytest.mark.parametrize("shape", ["sphere", "plate"])
def test_the_page_finds_the_colours_that_the_program_does(shape, tmp_path):
    rng = np.random.default_rng(5)
    mesh = icosphere(1.0, subdivisions=3) if shape == "sphere" else box_mesh((2.0, 1.4, 0.02))
    texture = VolumeTexture.around(mesh, resolution=60)
    layer = texture.add_layer(color=(0.2, 0.3, 0.4, 1.0))
    points, normals = _on_faces(mesh, 4000, rng)
    for color in ((0.9, 0.1, 0.0, 1.0), (0.0, 0.7, 0.2, 1.0), (0.1, 0.1, 0.9, 1.0)):
        at = rng.integers(len(points), size=3)
        with Stroke(texture, layer, Brush(0.3, hardness=0.6, color=color)) as stroke:
            stroke.add(points[at], normals[at], np.ones(3))

    origin = wire_origin(texture)
    wire = WireBricks(texture)
    (tmp_path / "octree").write_bytes(octree_bytes(texture))
    (tmp_path / "bricks").write_bytes(wire.range_payload(0, texture.octree.n_entries))
    (tmp_path / "places").write_bytes(np.hstack([points - origin, normals]).tobytes())
    script = tmp_path / "look.mjs"
    script.write_text(LOOK)
    subprocess.run([node(), script, PAGE, tmp_path], check=True, timeout=60)
    found = np.fromfile(tmp_path / "colors").reshape(-1, 4)
    expected = texture.colors(points, normals)
    assert len(np.unique(expected.round(3), axis=0)) > 100
    assert_allclose(found[:, 3], expected[:, 3], atol=1e-6)
    # A node that came from a coarser level was rounded to 8 bits on its way
    assert_allclose(_encoded(found[:, :3]), _encoded(expected[:, :3]), atol=1.5 * STEP)


def test_the_lock_file_names_no_host_and_every_package_by_its_hash():
    lock = json.loads((PAGE / "package-lock.json").read_text())
    packages = {name: one for name, one in lock["packages"].items() if name}
    assert packages
    for name, package in packages.items():
        assert "resolved" not in package, name
        assert package["integrity"].startswith("sha512-"), name
    assert "://" not in json.dumps(lock)
    for system in ("linux-x64", "linux-arm64", "darwin-arm64", "darwin-x64", "win32-x64"):
        assert f"node_modules/@esbuild/{system}" in packages
    wanted = json.loads((PAGE / "package.json").read_text())
    for name, version in (wanted["dependencies"] | wanted["devDependencies"]).items():
        assert packages[f"node_modules/{name}"]["version"] == version


def _on_faces(mesh, n, rng):
    """Random points of a mesh, and the normals of their faces."""
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    face = rng.choice(len(area), n, p=area / area.sum())
    weights = rng.dirichlet(np.ones(3), n)
    points = np.einsum("nc,ncd->nd", weights, corners[face])
    return points, cross[face] / area[face, None]


def _encoded(linear):
    linear = linear.astype(np.float64)
    return np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055
    )
