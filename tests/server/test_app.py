"""The whole server over HTTP: the page, and what pages ask for."""

import struct
import threading

import httpx
import numpy as np
import pytest

from meshsdf.kernels.blending import MODES
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.client import Painter
from meshsdf.server.wire_records import brick_records
from meshsdf.texture.brush import Brush
from meshsdf.texture.procedural import PROCEDURALS
from meshsdf.texture.sdf_patterns import ON_SHAPE

from .running import head, raw, running, status_of


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running(tmp_path_factory.mktemp("served")) as running_server:
        yield running_server


def test_without_a_bundled_page_the_address_says_how_to_add_it(server):
    answer = httpx.get(server.base)
    assert answer.status_code == 200
    assert "python -m meshsdf.server.bundle" in answer.text
    assert "<script" not in answer.text
    assert "style" not in answer.text
    assert httpx.get(server.base + "/static/main.js").status_code == 404
    assert httpx.get(server.base + "/favicon.ico").status_code == 204


def test_a_bundled_page_is_served_as_what_it_is(tmp_path):
    static = tmp_path / "static"
    static.mkdir()
    (static / "index.html").write_text("<!doctype html><p>paint")
    (static / "main.js").write_text("export {}")
    (tmp_path / "secret.txt").write_text("treasure")
    (static / "link.txt").symlink_to(tmp_path / "secret.txt")
    with running(tmp_path, static) as server:
        page = httpx.get(server.base)
        assert page.text.endswith("paint")
        assert page.headers["content-type"].startswith("text/html")
        script = httpx.get(server.base + "/static/main.js")
        assert script.headers["content-type"].startswith("text/javascript")
        for path in ("../secret.txt", "%2e%2e/secret.txt", "..%2fsecret.txt", "link.txt", "%00"):
            answer = raw(server, head(server, f"GET /static/{path}", "Connection: close"))
            assert status_of(answer) in (400, 404), path
            assert b"treasure" not in answer, path


def test_every_answer_keeps_browsers_from_doing_more_than_they_should(server):
    with server.client() as client:
        answers = [client.get(path) for path in ("/", "/api/project", "/api/none", "/static/x")]
        answers += [httpx.get(server.base + "/api/project"), client.post("/")]
    for answer in answers:
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert f"connect-src 'self' ws://127.0.0.1:{server.gate.port}" in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "no-referrer"
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"
        assert "server" not in answer.headers
        assert not [name for name in answer.headers if name.startswith("access-control")]
    assert answers[1].headers["cache-control"] == "no-store"


def test_the_facts_are_all_that_a_page_needs(server):
    with server.client() as client:
        facts = client.get("/api/project").json()
    octree = server.studio.texture.octree
    assert facts["texel"] == octree.texel == 2 / 32
    assert (facts["levels"], facts["entries"]) == (octree.n_levels, octree.n_entries)
    assert (facts["vertices"], facts["faces"]) == (642, 1280)
    assert facts["resolution"] == 32
    assert np.allclose(facts["box"], [[-1, -1, -1], [1, 1, 1]])
    assert facts["blend_modes"] == list(MODES)
    patterns = {one["kind"]: one for one in facts["procedurals"]}
    assert set(patterns) == {*PROCEDURALS, *ON_SHAPE}
    assert {kind for kind, one in patterns.items() if one["sees_shape"]} == set(ON_SHAPE)
    by_name = {one["name"]: one for one in patterns["wood"]["parameters"]}
    assert by_name["seed"]["most"] == 2**31 - 1
    assert by_name["scale"]["default"] == 2.0  # as long as the ball
    assert Brush.from_dict(facts["brush"]["defaults"]).radius == pytest.approx(0.08)
    assert [one["suffix"] for one in facts["exports"]] == [
        ".glb", ".obj", ".ply", ".png", ".exr", ".vdb", ".mtex",
    ]  # fmt: skip


def test_every_pattern_can_be_filled_with_as_it_is_offered(server):
    address = server.address
    with Painter(address) as painter:
        painter.operation("add-layer", name="patterns")
        painter.wait()
        number = painter.state["layers"][-1]["number"]
        for pattern in painter.facts["procedurals"]:
            given = {one["name"]: one["default"] for one in pattern["parameters"]}
            painter.operation("bake", layer=number, texture_kind=pattern["kind"], **given)
            painter.wait()
        painter.operation("drop-layer", layer=number)


def test_the_mesh_comes_bit_by_bit_as_it_is(server):
    mesh = icosphere(subdivisions=3)
    with server.client() as client:
        data = client.get("/api/mesh").content
        origin = np.array(client.get("/api/project").json()["origin"])
    n_vertices, n_faces = struct.unpack_from("<II", data)
    points = np.frombuffer(data, "<f4", 3 * n_vertices, 8).reshape(-1, 3)
    faces = np.frombuffer(data, "<u4", 3 * n_faces, 8 + points.nbytes).reshape(-1, 3)
    assert len(data) == 8 + points.nbytes + faces.nbytes
    assert np.array_equal(points, (mesh.vertices - origin).astype(np.float32))
    assert np.array_equal(faces, mesh.faces)


@pytest.mark.parametrize("path", ["/api/mesh", "/api/octree", "/api/bricks?first=0&last=40"])
def test_what_a_page_has_already_is_not_sent_again(server, path):
    with server.client() as client:
        first = client.get(path)
        again = client.get(path, headers={"if-none-match": first.headers["etag"]})
        other = client.get(path, headers={"if-none-match": '"other"'})
    assert first.status_code == 200
    assert (again.status_code, again.content) == (304, b"")
    assert other.content == first.content


@pytest.mark.parametrize(
    "asked", ["", "?first=0", "?first=5&last=4", "?first=-1&last=4", "?first=0&last=99999999999",
              "?first=0&last=5000", "?first=a&last=b", "?first=١&last=٢",
              "?first=0&last=9&picture=mask", "?first=0&last=9&picture="],
)  # fmt: skip
def test_ranges_that_make_no_sense_are_refused(server, asked):
    with server.client() as client:
        answer = client.get(f"/api/bricks{asked}")
    assert answer.status_code == 400
    assert set(answer.json()) == {"what", "where", "fix"}


def test_bricks_of_every_picture_are_to_be_had(tmp_path):
    pole = np.array([[0.0, 0.0, 1.0]])
    with running(tmp_path) as server, server.client() as client:
        facts = client.get("/api/project").json()
        assert facts["pictures"] == ["base", "normal", "height"]
        assert facts["displays"] == ["color", "normal", "displacement"]
        with Painter(server.address) as painter:
            painter.begin(0, Brush(0.3, channel="height", value=2.0))
            painter.dabs(pole, pole)
            painter.end()
            painter.catch_up()
            held = painter.pictures
        for picture, asked in (
            ("base", ""),
            ("base", "base"),
            ("height", "height"),
            ("normal", "normal"),
        ):
            query = {"first": 0, "last": facts["entries"]} | ({"picture": asked} if asked else {})
            payload = client.get("/api/bricks", params=query).content
            told = {entry: brick for entry, _, brick in brick_records(payload)}
            assert told == {entry: brick for entry, brick in held[picture].items() if brick[0]}
            assert bool(told) == (picture != "normal")


def test_what_is_not_there_is_said_in_json(server):
    with server.client() as client:
        answer = client.get("/api/nothing")
    assert answer.status_code == 404
    assert set(answer.json()) == {"what", "where", "fix"}


def test_two_requests_at_once_are_both_answered(server):
    codes = []

    def ask():
        with server.client() as client:
            codes.append(client.get("/api/digest").status_code)

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert codes == [200] * 8
