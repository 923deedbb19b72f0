"""``python -m meshsdf`` is the command ``meshsdf``."""

from .cli.main import main

main()
