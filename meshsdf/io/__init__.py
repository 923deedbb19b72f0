"""One file format each: meshes and volumes in and out.

The four functions are imported when first asked for, so that a command which reads meshes does
not wait for what only volumes need.
"""

from importlib import import_module

_HOMES = {
    "read_mesh": "meshes",
    "write_mesh": "meshes",
    "read_volume": "volumes",
    "write_volume": "volumes",
}

__all__ = ["read_mesh", "read_volume", "write_mesh", "write_volume"]


def __getattr__(name: str):
    if name in _HOMES:
        return getattr(import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
