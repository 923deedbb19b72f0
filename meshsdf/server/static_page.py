"""Whether the painting page is there, and what is shown in its place where it is not."""

from pathlib import Path

from .bundle import COMMAND, STATIC

INDEX = STATIC / "index.html"

MISSING_PAGE = f"""<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>meshsdf paint</title></head>
<body>
<h1>The painting page is not here</h1>
<p>The server runs, but this copy of meshsdf was put together without its page,
as the packages it is made of could not be fetched then.</p>
<p>This command adds it; then reload:</p>
<pre>{COMMAND}</pre>
</body>
</html>
"""


def has_page(index: Path = INDEX) -> bool:
    """Whether the page was bundled."""
    return index.is_file()
