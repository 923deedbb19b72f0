"""meshsdf.cli: misuse is told by exit code 2, too little memory by 3 before the work starts."""

import pytest

from meshsdf.cli.main import COMMANDS

from .examples import ball


@pytest.fixture
def mesh(tmp_path):
    return ball(tmp_path / "ball.ply")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("0", "0 is not above 0"),
        ("-4", "-4 is not above 0"),
        ("abc", "'abc' is not a number"),
        ("", "'' is not a number"),
        ("nan", "nan is not a finite number"),
        ("inf", "inf is not a finite number"),
        ("1e999", "1e999 is not a finite number"),
    ],
)
@pytest.mark.parametrize("option", ["--resolution", "--voxel-size", "--half-width"])
def test_sizes_are_finite_and_above_zero(cli, mesh, tmp_path, option, value, words):
    outcome = cli("convert", mesh, tmp_path / "a.npz", f"{option}={value}")
    assert outcome.code == 2
    assert f"Invalid value for '{option}': {words}" in outcome.err


MISUSE = {
    "both sizes": (
        ["convert", "M", "O", "--resolution", "9", "--voxel-size", "1"],
        "give --resolution or --voxel-size, not both",
    ),
    "closest of a grid": (["convert", "M", "O", "--dense", "--closest"], "leave out --dense"),
    "unknown sign": (
        ["convert", "M", "O", "--sign", "guess"],
        "'auto', 'parity', 'winding', 'unsigned'",
    ),
    "slip in an option": (["convert", "M", "O", "--resolutoin", "9"], "--resolution"),
    "no size of memory": (["convert", "M", "O", "--max-memory", "1Q"], "write 500M, 4G"),
    "negative memory": (["convert", "M", "O", "--max-memory", "-1G"], "write 500M, 4G"),
    "no memory": (["convert", "M", "O", "--max-memory", "0"], "0 is not above 0"),
    "dots for a size": (["convert", "M", "O", "--max-memory", "..G"], "'..' is not a number"),
    "no output": (["convert", "M"], "Missing argument 'OUT'"),
    "level": (["mesh", "M", "O", "--level", "nan"], "nan is not a finite number"),
    "border": (["mesh", "M", "O", "--border", "round"], "'open', 'cap', 'pad'"),
    "error without number": (["roundtrip", "M", "--max-error", "vox"], "'vox' is no length"),
    "error in words": (["roundtrip", "M", "--max-error", "2voxels"], "0.5vox (voxels)"),
    "error below zero": (["roundtrip", "M", "--max-error", "-1vox"], "-1 is not above 0"),
    "until zero": (["roundtrip", "M", "--until", "0"], "0 is not above 0"),
    "until words": (["roundtrip", "M", "--until", "1vox"], "'1vox' is not a number"),
    "resolutions": (["roundtrip", "M", "--resolution", "8,,9"], "write 64 or 64,128,256"),
    "no resolutions": (["roundtrip", "M", "--resolution", ""], "write 64 or 64,128,256"),
    "word among them": (["roundtrip", "M", "--resolution", "8,x"], "'x' is not a number"),
    "tolerance": (["compare", "M", "M", "--tolerance", "wide"], "'wide' is not a number"),
    "one mesh": (["compare", "M"], "Missing argument 'B'"),
    "no command": (["chek", "M"], "there is no command 'chek'; did you mean 'check'?"),
    "a file": (["ball.ply"], "write: meshsdf info ball.ply"),
    "far off": (["qqq"], f"there are {', '.join(COMMANDS)}"),
}


@pytest.mark.parametrize("name", MISUSE)
def test_misuse_says_what_would_be_right(cli, mesh, tmp_path, name):
    arguments, words = MISUSE[name]
    places = {"M": mesh, "O": tmp_path / "a.npz"}
    outcome = cli(*(places.get(argument, argument) for argument in arguments))
    assert outcome.code == 2
    assert outcome.out == ""
    assert words in " ".join(outcome.err.split())
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize(
    "options",
    [
        ["--resolution", "1e7"],
        ["--resolution", "1e12"],
        ["--voxel-size", "1e-9"],
        ["--resolution", "200000", "--closest"],
        ["--resolution", "20000", "--dense"],
        ["--resolution", "1e12", "--dense"],
    ],
    ids=" ".join,
)
def test_what_would_not_fit_is_refused_with_the_number_before_the_work(
    cli, mesh, tmp_path, monkeypatch, options
):
    def work(*_):
        raise AssertionError("the work has started")

    monkeypatch.setattr("meshsdf.sdf.narrow_band.BandBuilder.prepare", work)
    outcome = cli("convert", mesh, tmp_path / "a.npz", *options)
    assert outcome.code == 3
    assert "MemoryLimitError: " in outcome.err
    assert "B would be needed" in outcome.err
    assert "lower the resolution" in outcome.err
    assert not (tmp_path / "a.npz").exists()


def test_the_limit_can_be_set(cli, mesh, tmp_path):
    out = tmp_path / "a.npz"
    for limit in ("100k", "0.1M", "1e5"):
        outcome = cli("convert", mesh, out, "--max-memory", limit)
        assert outcome.code == 3
        assert "100 kB are allowed" in outcome.err
    assert cli("convert", mesh, out, "--resolution", 8, "--max-memory", "1GB").code == 0
    outcome = cli("roundtrip", mesh, "--resolution", "100", "--max-memory", "1M")
    assert outcome.code == 3
    assert "1 MB are allowed" in outcome.err


@pytest.mark.parametrize("size", ["1e40", "1e-40"])
def test_voxels_that_float32_cannot_express_are_refused(cli, mesh, tmp_path, size):
    outcome = cli("convert", mesh, tmp_path / "a.npz", "--voxel-size", size)
    assert outcome.code == 3
    assert f"voxels would be {float(size):g} wide" in outcome.err
    for resolution in ("1e300", "1e-300", "1e-20"):
        assert cli("convert", mesh, tmp_path / "a.npz", "--resolution", resolution).code == 3


def test_a_half_width_below_one_voxel_is_refused(cli, mesh, tmp_path):
    outcome = cli("convert", mesh, tmp_path / "a.npz", "--half-width", "0.5")
    assert outcome.code == 3
    assert "half_width is 0.5 voxels" in outcome.err
