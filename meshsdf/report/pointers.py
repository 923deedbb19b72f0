"""Places inside a report's dict, named as JSON pointers (RFC 6901): ``/rows/2/largest``."""

from typing import Any

UNITS = (("world", "world units"), ("voxels", "voxels"), ("percent", "% of diagonal"))
MEASURES = (
    ("n_vertices", "vertices"),
    ("n_faces", "faces"),
    ("area", "area"),
    ("volume", "volume"),
    ("euler_number", "Euler number"),
    ("n_components", "components"),
    ("genus", "genus"),
    ("n_boundary_loops", "boundary loops"),
    ("is_watertight", "watertight"),
)


def look_up(data: Any, pointer: str) -> Any:
    """Return what a pointer names; None if something on the way is None.

    Raises
    ------
    KeyError, IndexError
        There is no such place.

    Examples
    --------
    >>> look_up({"rows": [{"resolution": 64}]}, "/rows/0/resolution")
    64
    """
    for step in pointer.split("/")[1:]:
        if data is None:
            return None
        data = data[int(step)] if isinstance(data, list) else data[step]
    return data


def distance_pointers(side: dict) -> list[tuple[str, str]]:
    """The rows of a direction's table: the pointer of a length in its units, and its label."""
    steps = [f"{step['percent']:g} % of the area within" for step in side["percentiles"]]
    return [
        ("/maximum", "largest"),
        ("/mean", "mean"),
        ("/rms", "root mean square"),
        *((f"/percentiles/{i}/distance", label) for i, label in enumerate(steps)),
    ]
