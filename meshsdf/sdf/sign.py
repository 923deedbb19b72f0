"""Which way of telling inside from outside suits a mesh, and why."""

from dataclasses import dataclass
from typing import Literal

from ..arrays import Number
from ..errors import SdfError
from ..mesh import Mesh
from ..mesh.two_set_report import FLAT, TwoSetReport

CRACK_SHARE = 0.5  # of a voxel: wider cracks could be seen by a node, and get winding numbers

SignMethod = Literal["auto", "parity", "winding", "unsigned"]


@dataclass(frozen=True)
class SignChoice:
    """How inside will be told.

    Attributes
    ----------
    method : str
        "parity", "winding" or "unsigned".
    by_crossings : bool
        True when integer crossings decide it exactly; False for generalised winding numbers.
    reason : str
        In words for people.
    warnings : tuple of str
        What the user should know about the result.
    """

    method: str
    by_crossings: bool
    reason: str
    warnings: tuple[str, ...] = ()


def choose_sign(
    report: TwoSetReport, sign: SignMethod = "auto", *, voxel_size: Number | None = None
) -> SignChoice:
    """Choose the sign method from the answer of `check`, or confirm the one asked for.

    Parameters
    ----------
    report : TwoSetReport
        What `check` found.
    sign : "auto", "parity", "winding" or "unsigned"
        What the user wants.
    voxel_size : float, optional
        World units. Cracks narrower than half of it are zipped for the sign.

    Raises
    ------
    SdfError
        An unknown method; or parity asked of a mesh without the two-set property.
    """
    if sign not in ("auto", "parity", "winding", "unsigned"):
        raise SdfError(
            f'there is no sign method "{sign}"',
            "mesh_to_band(sign=...)",
            "choose auto, parity, winding or unsigned",
        )
    zipped = report.repair is not None and (
        voxel_size is None or report.repair.width < CRACK_SHARE * voxel_size
    )
    oriented = report.oriented or (zipped and report.repair.oriented)
    closed = report.two_set or zipped
    reason = report.recommended_sign_reason if sign == "auto" else "as asked"
    if sign == "auto":
        sign = report.recommended_sign
        if not closed and sign == "parity":
            sign, reason = "winding", "its cracks are too wide for these voxels"
    warnings = _crack_warnings(report) if zipped and sign != "unsigned" else ()
    if sign == "unsigned":
        return SignChoice("unsigned", False, reason, (_unsigned_words(report),))
    if sign == "parity":
        if not closed:
            raise SdfError(
                f"{report.n_open_edges} open edges, so crossings do not tell inside from outside",
                'mesh_to_band(sign="parity")',
                'pass sign="winding", or close the mesh',
            )
        return SignChoice("parity", True, reason, warnings)
    if oriented:
        return SignChoice("winding", True, reason, warnings)
    return SignChoice("winding", False, reason, _opening_warnings(report))


def small_words(mesh: Mesh, voxel_size: Number, sign: str) -> tuple[str, ...]:
    """What to tell of a mesh that is smaller than a voxel along an axis; nothing if it is not.

    Parameters
    ----------
    mesh : Mesh
        At least one face.
    voxel_size : float
        World units.
    sign : str
        The method taken. Around unsigned faces a shell is kept, however thin the mesh is.
    """
    size = mesh.box.size
    narrow = float(size.max() if sign == "unsigned" else size.min())
    if narrow >= voxel_size:
        return ()
    sides = " x ".join(f"{side:.3g}" for side in size)
    fix = [f"take voxels of {narrow / 4:.2g} or less"] if narrow > 0 else []
    if sign == "unsigned":
        becomes = "no more than a blob remains"
    else:
        becomes = "specks of it remain, or nothing"
        fix.append("unsigned distances, which keep a shell")
    where = "smaller than" if sign == "unsigned" else "in part thinner than"
    return (
        f"the mesh is {sides}, {where} a voxel of {voxel_size:.3g}: {becomes}; {', or '.join(fix)}",
    )


def _unsigned_words(report: TwoSetReport) -> str:
    return f"{FLAT}; distances carry no sign" if report.flat else "distances carry no sign"


def _crack_warnings(report: TwoSetReport) -> tuple[str, ...]:
    n, repair = len(report.holes), report.repair
    cracks = "1 crack" if n == 1 else f"{n} cracks"
    if repair.certain_beyond is None:
        return (f"{cracks} up to {repair.width:.2g} units wide zipped for the sign",)
    return (
        f"{cracks} zipped for the sign, which is proved further than "
        f"{repair.certain_beyond:.2g} units from the surface",
    )


def _opening_warnings(report: TwoSetReport) -> tuple[str, ...]:
    warnings = ("inside is where the generalised winding number exceeds 1/2 in magnitude",)
    if not report.two_set:
        n = len(report.holes)
        holes = "1 hole" if n == 1 else f"{n} holes"
        warnings += (f"{holes}: the sign near an opening is an estimate",)
    return warnings
