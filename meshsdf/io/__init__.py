"""One file format each: meshes and volumes in and out.

Its functions are imported when first asked for, so that a command which reads meshes does not
wait for what only volumes need.
"""

from importlib import import_module

_HOMES = {
    "atomic_write": "atomic",
    "check_input": "registry",
    "check_output": "atomic",
    "kind_of": "registry",
    "make_folder": "atomic",
    "probe_volume": "volumes",
    "read_mesh": "meshes",
    "VdbGrid": "vdb_grid",
    "probe_vdb": "vdb",
    "read_vdb": "vdb",
    "read_vdb_grids": "vdb",
    "read_volume": "volumes",
    "suffixes": "registry",
    "write_mesh": "meshes",
    "write_text": "atomic",
    "write_vdb": "vdb",
    "write_vdb_grids": "vdb",
    "write_volume": "volumes",
}

__all__ = [
    "VdbGrid",
    "atomic_write",
    "check_input",
    "check_output",
    "kind_of",
    "make_folder",
    "probe_vdb",
    "probe_volume",
    "read_mesh",
    "read_vdb",
    "read_vdb_grids",
    "read_volume",
    "suffixes",
    "write_mesh",
    "write_text",
    "write_vdb",
    "write_vdb_grids",
    "write_volume",
]


def __getattr__(name: str):
    if name in _HOMES:
        return getattr(import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
