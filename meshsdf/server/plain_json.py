"""JSON from strangers: finite numbers, little nesting, text that can be kept."""

import json
from typing import Any

from ..errors import ServerError

MOST_DEPTH = 16
LARGEST_INTEGER = 2**53  # what JavaScript's numbers count exactly
WHERE = "a message of the painting page"


def json_bytes(value: dict[str, Any]) -> bytes:
    """An object as JSON in UTF-8, without spaces.

    Examples
    --------
    >>> json_bytes({"a": [1, 0.5]})
    b'{"a":[1,0.5]}'
    """
    return json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()


def json_object(data: bytes) -> dict[str, Any]:
    """The object that JSON in UTF-8 says.

    Raises
    ------
    ServerError
        It is no JSON, or no object; it is nested too deeply; a number is not finite, or is a whole
        one beyond 2^53; a text cannot be written in UTF-8.
    """
    try:
        value = json.loads(data.decode(), parse_constant=_refuse)
    except RecursionError:
        raise _wrong(f"JSON nested more than {MOST_DEPTH} deep") from None
    except ValueError as error:
        raise _wrong(f"no JSON: {error}") from None
    if not isinstance(value, dict):
        raise _wrong(f"a JSON {type(value).__name__}", "send an object")
    _check(value)
    return value


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _check(whole: dict[str, Any]) -> None:
    """Look at every value without recursion."""
    depth, values = 0, [whole]
    while values:
        depth += 1
        if depth > MOST_DEPTH:
            raise _wrong(f"JSON nested more than {MOST_DEPTH} deep")
        inner: list[Any] = []
        for value in values:
            if isinstance(value, dict):
                inner.extend(value)
                inner.extend(value.values())
            elif isinstance(value, list):
                inner.extend(value)
            else:
                _check_scalar(value)
        values = inner


def _check_scalar(value: Any) -> None:
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            raise _wrong("half a character in a text") from None
    elif isinstance(value, float) and not abs(value) < float("inf"):
        raise _wrong(f"the number {value}", "send finite numbers")
    elif isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise _wrong("a whole number beyond 2^53", "send smaller ones")


def _wrong(what: str, fix: str = "send JSON as the protocol's page says") -> ServerError:
    return ServerError(what, WHERE, fix)
