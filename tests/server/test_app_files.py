"""The whole server over HTTP: pictures in, exports out, while painting goes on."""

import io
import threading

import numpy as np
import pytest
from PIL import Image

from meshsdf.io.pictures import read_picture
from meshsdf.server.client import Painter
from meshsdf.server.exports import FORMATS
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project

from .running import MIB, is_alive, running

POLE = np.array([[0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running(tmp_path_factory.mktemp("files")) as running_server:
        yield running_server


def picture(color=(0, 200, 0), size=(32, 32)) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", size, color).save(out, "PNG")
    return out.getvalue()


def test_a_picture_that_was_sent_can_be_projected(server):
    with server.page() as page, Painter(server.address) as painter:
        answer = page.post("/api/images", content=picture())
        assert answer.status_code == 201
        told = answer.json()
        assert (told["width"], told["height"]) == (32, 32)
        layer = {"name": "photo"}
        painter.operation("add-layer", **layer)
        painter.wait()
        number = painter.state["layers"][-1]["number"]
        options = {"projection": "triplanar", "width": 1.0, "height": 1.0}
        painter.operation("project", layer=number, image=told["id"], **options)
        painter.wait()
        painter.catch_up()
        shown = page.post("/api/exports", json={"name": "green.exr"}).json()
    colors = read_picture(server.folder / shown["name"])[..., :3]
    assert np.allclose(colors, [0, 0.578, 0], atol=0.01)  # 200 of 255 in linear light


@pytest.mark.parametrize(
    ("body", "status"), [(b"", 400), (b"GIF89a", 400), (picture(size=(6000, 6000)), 400)]
)
def test_what_is_no_picture_or_too_large_is_refused_with_a_reason(server, body, status):
    with server.client() as client:
        answer = client.post("/api/images", content=body)
    assert answer.status_code == status
    assert answer.json()["what"].startswith("the picture ")


def test_a_picture_of_more_bytes_than_any_may_have_is_not_read(server):
    with server.client() as client:
        answer = client.post("/api/images", content=(bytes(MIB) for _ in range(70)))
    assert answer.status_code == 413
    assert is_alive(server)


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_export_is_written_and_can_be_fetched(server, suffix):
    with server.page() as page:
        answer = page.post("/api/exports", json={"name": f"out{suffix}"})
        told = answer.json()
        assert answer.status_code == 201, told
        sizes = 0
        for file in told["files"]:
            got = page.get(file["url"])
            assert got.content == (server.folder / file["name"]).read_bytes()
            assert got.headers["content-disposition"].startswith("attachment")
            sizes += len(got.content)
        assert told["bytes"] == sizes
        assert told["url"] == told["files"][0]["url"]


@pytest.mark.parametrize("name", ["ball.mtex", "../x.glb", "x", "..%2fball.mtex", "ball.mtex-lock"])
def test_only_exports_can_be_fetched(server, name):
    with server.client() as client:
        answer = client.get(f"/api/exports/{name}")
    assert answer.status_code == 404


def test_a_saved_copy_is_the_project_as_it_is(server):
    with server.client() as client:
        told = client.post("/api/exports", json={"name": "copy.mtex"}).json()
        digest = client.get("/api/digest").json()["project"]
    with Project.open(server.folder / told["name"]) as copy:
        assert copy.digest() == digest


def test_exports_under_way_neither_stop_painting_nor_see_half_of_it(server):
    codes = []

    def export(number: int) -> None:
        with server.client() as client:
            answer = client.post("/api/exports", json={"name": f"busy-{number}.ply"})
            codes.append(answer.status_code)

    threads = [threading.Thread(target=export, args=(number,)) for number in range(8)]
    with Painter(server.address) as painter:
        for thread in threads:
            thread.start()
        for turn in range(5):
            painter.begin(0, Brush(0.3, color=(turn / 5, 0.0, 1.0, 1.0)))
            painter.dabs(POLE, POLE)
            painter.end()
        painter.wait()
        for thread in threads:
            thread.join()
    assert set(codes) <= {201, 429}
    assert 201 in codes
    assert is_alive(server)
