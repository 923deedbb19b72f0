"""How numbers are written on a report: with few digits, and never on the wrong side of the truth.

What is at least something is rounded down, what is at most something is rounded up. Digits are
grouped by narrow spaces, and powers of ten are written out, as people read them.
"""

from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from math import floor, log10
from typing import Literal

from ..arrays import Number

Rounding = Literal["down", "nearest", "up"]

DASH = "–"  # in place of a number that does not exist
NARROW_SPACE = "\u202f"
MINUS = "\u2212"
DIGITS = 4

_MODES = {"down": ROUND_FLOOR, "nearest": ROUND_HALF_EVEN, "up": ROUND_CEILING}
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN_FROM, _PLAIN_BELOW = -5, 7  # powers of ten between which a number is written plainly


def written(
    value: Number | bool | None, rounding: Rounding = "nearest", digits: int = DIGITS
) -> str:
    """Write a number, a yes or no, or the lack of one.

    Parameters
    ----------
    value : float, int, bool or None
        Whole numbers of type int are written with all their digits.
    rounding : "down", "nearest" or "up"
        Towards which side of the truth digits are dropped.
    digits : int
        How many significant digits a float keeps.

    Examples
    --------
    >>> written(0.123456, "up"), written(0.123456, "down"), written(1.5e-9), written(86482)
    ('0.1235', '0.1234', '1.5 × 10⁻⁹', '86\u202f482')
    """
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return _grouped(str(abs(value)), value < 0)
    kept = Context(digits, _MODES[rounding]).create_decimal(float(value))
    if not kept.is_finite() or kept == 0:
        return "0" if kept == 0 else str(float(value))
    power = kept.adjusted()
    if _PLAIN_FROM <= power < _PLAIN_BELOW:
        return _grouped(_trimmed(abs(kept)), kept < 0)
    raised = str(power).translate(_RAISED)
    return f"{_grouped(_trimmed(abs(kept).scaleb(-power)), kept < 0)} × 10{raised}"


def read(text: str) -> float:
    """Return the number that `written` wrote.

    >>> read("−1.5 × 10⁻⁹"), read("86\u202f482")
    (-1.5e-09, 86482.0)
    """
    lowered = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    plain = text.replace(NARROW_SPACE, "").replace(MINUS, "-").replace(" × 10", "e")
    return float(plain.translate(lowered))


def interval(span: dict | None, digits: int = DIGITS) -> str:
    """Write ``{"lower": ..., "upper": ...}`` as [lower, upper], or ``{"estimate": x}`` as ≈ x."""
    if span is None:
        return DASH
    if "estimate" in span:
        return f"≈ {written(span['estimate'], digits=digits)}"
    lower, upper = ends(span, digits)
    return lower if span["lower"] == span["upper"] == read(lower) else f"[{lower}, {upper}]"


def ends(span: dict, digits: int = DIGITS) -> tuple[str, str]:
    """Write both ends of an interval, rounded outwards, with equally many decimals."""
    texts = written(span["lower"], "down", digits), written(span["upper"], "up", digits)
    if any("×" in text or text == "0" for text in texts):
        return texts
    n_decimals = max(len(text.partition(".")[2]) for text in texts)
    return texts[0] + _zeros(texts[0], n_decimals), texts[1] + _zeros(texts[1], n_decimals)


def place(point: list[float]) -> str:
    """Write a point of space."""
    return f"({', '.join(coordinates(point))})"


def coordinates(point: list[float], digits: int = DIGITS + 1) -> list[str]:
    """Write all coordinates with as many decimals as the largest needs for so many digits."""
    largest = max(abs(x) for x in point)
    if largest == 0 or not _PLAIN_FROM <= log10(largest) < _PLAIN_BELOW:
        return [written(float(x), digits=digits) for x in point]
    n_decimals = max(digits - 1 - floor(log10(largest)), 0)
    rounded = [Decimal(repr(float(x))).quantize(Decimal(1).scaleb(-n_decimals)) for x in point]
    return [_grouped(_trimmed(abs(x)), x < 0) for x in rounded]


def count(n: int, one: str, many: str = "") -> str:
    """Write ``3 holes``, ``1 hole``, ``no holes``."""
    number = "no" if n == 0 else written(int(n))
    return f"{number} {one if n == 1 else many or one + 's'}"


def _zeros(text: str, n_decimals: int) -> str:
    """What a number lacks to so many decimals."""
    _, point, decimals = text.partition(".")
    return ("" if point or n_decimals == 0 else ".") + "0" * (n_decimals - len(decimals))


def _trimmed(number: Decimal) -> str:
    """Without zeros at the end, which would promise digits that the float did not have."""
    text = f"{number:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _grouped(digits: str, negative: bool) -> str:
    """Thousands of long whole parts are parted."""
    whole, dot, fraction = digits.partition(".")
    if len(whole) > 4:
        whole = f"{int(whole):,}".replace(",", NARROW_SPACE)
    return f"{MINUS if negative else ''}{whole}{dot}{fraction}"
