"""Which way of telling inside from outside suits a mesh, and why."""

from dataclasses import dataclass
from typing import Literal

from ..errors import SdfError
from ..mesh.two_set import TwoSetReport

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


def choose_sign(report: TwoSetReport, sign: SignMethod = "auto") -> SignChoice:
    """Choose the sign method from the answer of `check`, or confirm the one asked for.

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
    if sign == "auto":
        sign, reason = report.recommended_sign, report.recommended_sign_reason
    else:
        reason = "as asked"
    if sign == "unsigned":
        return SignChoice("unsigned", False, reason, ("distances carry no sign",))
    if sign == "parity":
        if not report.two_set:
            raise SdfError(
                f"{report.n_open_edges} open edges, so crossings do not tell inside from outside",
                'mesh_to_band(sign="parity")',
                'pass sign="winding", or close the mesh',
            )
        return SignChoice("parity", True, reason)
    if report.oriented:
        return SignChoice("winding", True, reason)
    warnings = ("inside is where the generalised winding number exceeds 1/2 in magnitude",)
    if not report.two_set:
        n = len(report.holes)
        warnings += (f"{n} hole{'s' * (n != 1)}: the sign near an opening is an estimate",)
    return SignChoice("winding", False, reason, warnings)
