"""One file format each: meshes and volumes in and out.

Its functions are imported when first asked for, so that a command which reads meshes does not
wait for what only volumes need.
"""

from importlib import import_module

_HOMES = {
    "atomic_write": "atomic",
    "check_exr_output": "exr",
    "check_input": "registry",
    "check_output": "atomic",
    "check_volume_output": "volumes",
    "kind_of": "registry",
    "make_folder": "atomic",
    "probe_exr": "exr",
    "probe_samples": "sample_headers",
    "probe_volume": "volumes",
    "probe_zarr": "zarr_volume",
    "read_exr": "exr",
    "read_zarr": "zarr_volume",
    "read_mesh": "meshes",
    "VdbGrid": "vdb_grid",
    "VdbMetadata": "vdb_foreign",
    "probe_vdb": "vdb",
    "read_vdb": "vdb",
    "read_vdb_grids": "vdb",
    "read_vdb_metadata": "vdb",
    "read_volume": "volumes",
    "stored_bytes": "registry",
    "suffixes": "registry",
    "write_exr": "exr",
    "write_mesh": "meshes",
    "write_samples": "samples",
    "write_text": "atomic",
    "write_vdb": "vdb",
    "write_vdb_grids": "vdb",
    "write_volume": "volumes",
    "write_zarr": "zarr_volume",
}

__all__ = [
    "VdbGrid",
    "VdbMetadata",
    "atomic_write",
    "check_exr_output",
    "check_input",
    "check_output",
    "check_volume_output",
    "kind_of",
    "make_folder",
    "probe_exr",
    "probe_samples",
    "probe_vdb",
    "probe_volume",
    "probe_zarr",
    "read_exr",
    "read_mesh",
    "read_vdb",
    "read_vdb_grids",
    "read_vdb_metadata",
    "read_volume",
    "read_zarr",
    "stored_bytes",
    "suffixes",
    "write_exr",
    "write_mesh",
    "write_samples",
    "write_text",
    "write_vdb",
    "write_vdb_grids",
    "write_volume",
    "write_zarr",
]


def __getattr__(name: str):
    if name in _HOMES:
        return getattr(import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
