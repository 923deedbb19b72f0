"""Bundle the painting page while a wheel is built (a hook of hatchling).

Where npm's registry cannot be reached the wheel is made without the page, with a warning.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SECONDS = 120  # for npm; whoever installs does not wait longer for a page


def _load_bundle() -> ModuleType:
    """The module beside, by its path: the package cannot be imported while it is built."""
    path = Path(__file__).resolve().parent.parent / "bundle.py"
    spec = importlib.util.spec_from_file_location("meshsdf_bundle", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class PageHook(BuildHookInterface):
    """Makes ``meshsdf/server/static`` before the wheel's files are gathered."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Bundle if the page changed; warn if that fails."""
        module = _load_bundle()
        try:
            module.bundle(seconds=SECONDS)
        except module.BundleError as error:
            self.app.display_warning(
                f"meshsdf is built without its painting page: {error}\n"
                f"Everything else works. To add the page later: {module.COMMAND}"
            )
