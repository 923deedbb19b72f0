"""What the tests of a report's pages share: a reader, and what holds for every page."""

import json
import re
from html.parser import HTMLParser

import pytest

from meshsdf.report.notation import read

VOID = {"meta", "link", "img", "br", "col", "hr", "input", "source", "wbr"}


class Reader(HTMLParser):
    """Elements, their nesting, the figures and the JSON of a page."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.figures: list[list[str]] = []
        self.texts: dict[str, str] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        assert len(found) == len(attributes), f"<{tag}> repeats an attribute"
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found[name] for name in ("src", "href", "action") if name in found]
        if tag == "data":
            self.figures.append([found["data-at"], found["value"], ""])
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes another element"

    def handle_data(self, text):
        for tag in self.open:
            self.texts[tag] = self.texts.get(tag, "") + text
        if "data" in self.open:
            self.figures[-1][2] += text

    @property
    def json(self) -> dict:
        return json.loads(self.texts["script"])


def parse_strictly(text: str) -> None:
    """By the rules of the HTML standard; any parse error is raised."""
    html5lib = pytest.importorskip("html5lib")
    html5lib.HTMLParser(strict=True).parse(text)


def assert_whole_in_itself(page: str) -> None:
    """It asks for nothing: no address is opened, nothing runs."""
    reader = Reader(page)
    for link in reader.links:
        assert link.startswith(("data:", "#"))
    # The name of a vocabulary is no address that anybody opens
    rest = page.replace("http://www.w3.org/1999/xlink", "").replace(
        "http://www.w3.org/2000/svg", ""
    )
    assert not re.search(r"https?:|//[a-z]+\.|@import|url\((?!#)", rest)
    assert re.findall(r"<script[^>]*>", page) == [
        '<script type="application/json" id="meshsdf-report">'
    ]


def assert_figures_are_of_the_json(reader: Reader) -> None:
    """Every figure is that at its pointer, and is rounded to the right side."""
    for at, value, text in reader.figures:
        stored = reader.json
        for step in at.split("/")[1:]:
            parent = stored
            stored = stored[int(step)] if isinstance(stored, list) else stored[step]
        assert json.loads(value) == stored, at
        if isinstance(stored, bool):
            assert text == ("yes" if stored else "no")
            continue
        shown = read(text)
        # At least three digits are shown, of places those that the farthest coordinate needs
        slack = 1e-4 * max(map(abs, parent)) if isinstance(parent, list) else 0.0
        assert shown == pytest.approx(stored, rel=0.01, abs=slack), at
        if at.endswith("/lower"):
            assert shown <= stored, at
        if at.endswith("/upper"):
            assert shown >= stored, at
