"""A report as one HTML file: no network, no script, the JSON inside.

Every number on the page is looked up in the report's dict by its JSON pointer (RFC 6901), which the
page carries beside it: ``<data value="…" data-at="/rows/2/largest/voxels/upper">0.8713</data>``.
"""

import json
from base64 import b64encode
from importlib.resources import files

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from . import notation
from .color_words import COLOR_KINDS, COLOR_MEASURES, COLOR_WORDS
from .compare_report import main_unit, units_of, words_of
from .heat_maps import HeatMaps
from .pair_words import ROUND_TRIP
from .plots import distribution_svg, errors_svg, shares_svg
from .pointers import MEASURES, UNITS, distance_pointers, look_up
from .verdict import METHOD_WORDS

BUDGET_WORDS = {
    "sample_error": ("samples", "stored distances against exact ones"),
    "mesh_to_zero_set": ("interpolation, mesh → zero set", "of the field between the samples"),
    "zero_set_to_mesh": ("interpolation, zero set → mesh", ""),
    "zero_set_to_surface": ("extraction, zero set → triangles", "flat triangles for a curved set"),
    "surface_to_zero_set": ("extraction, triangles → zero set", ""),
}


def page(data: dict, maps: dict[int, HeatMaps] | None = None) -> str:
    """Write the page of a round trip.

    Parameters
    ----------
    data : dict
        From `report_data`.
    maps : dict, optional
        Pictures of the rows of those indices.

    Returns
    -------
    html : str
        Valid HTML 5 that asks for nothing but itself.
    """
    environment = _environment(data)
    environment.globals |= {
        "timed": list(dict.fromkeys(name for row in data["rows"] for name in row["seconds"] or ())),
        "words": METHOD_WORDS,
        "units": UNITS,
        "unit": ("voxels", "voxels"),
        "budget_words": BUDGET_WORDS,
        "color_kinds": COLOR_KINDS,
        "color_measures": COLOR_MEASURES,
        "color_words": COLOR_WORDS,
    }
    return environment.get_template("page.html.j2").render(
        says=ROUND_TRIP,
        normals=_have_sides(data["two_set"]),
        maps=maps or {},
        errors=Markup(errors_svg(data)),
        distributions={index: Markup(distribution_svg(data, index)) for index in data["last_rows"]},
    )


def compare_page(data: dict, maps: HeatMaps | None = None) -> str:
    """Write the page of two meshes compared.

    Parameters
    ----------
    data : dict
        From `compare_data`.
    maps : HeatMaps, optional
        Pictures of both.

    Returns
    -------
    html : str
        As for `page`.
    """
    ways = "A → B", "B → A"
    plot = shares_svg(data["comparison"], "shares", ways, data["voxel_size"])
    environment = _environment(data)
    environment.globals |= {"units": units_of(data), "unit": main_unit(data)}
    return environment.get_template("compare.html.j2").render(
        says=words_of(data),
        normals=all(_have_sides(found) for found in data["two_set"].values()),
        heat=maps,
        distribution=Markup(plot),
    )


def _environment(data: dict) -> Environment:
    """What all pages use; their templates also need units."""
    looked_up = _Pointers(data)
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=FunctionLoader(_file),
    )
    environment.globals |= {
        "data": data,
        "style": Markup(_file("page.css")),
        "embedded": Markup(embedded_json(data)),
        "figure": looked_up.figure,
        "interval": looked_up.interval,
        "place": looked_up.place,
        "change": looked_up.change,
        "measure_names": MEASURES,
        "distance_pointers": distance_pointers,
        "count": notation.count,
    }
    environment.filters["uri"] = data_uri
    return environment


def _have_sides(two_set: dict) -> bool:
    """Whether all faces show the same side, so that normals can be compared."""
    turned = any(part["inside_out"] for part in two_set["components"])
    return two_set["n_orientation_conflicts"] == 0 and not turned


def _file(name: str) -> str:
    return (files(__package__) / name).read_text("utf-8")


def embedded_json(data: dict) -> str:
    """The dict as JSON that no reader of HTML takes for an end of its element."""
    text = json.dumps(data, indent=1, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def data_uri(picture: bytes) -> str:
    """A picture as part of the page."""
    kind = "png" if picture.startswith(b"\x89PNG") else "webp"
    return f"data:image/{kind};base64,{b64encode(picture).decode()}"


class _Pointers:
    """Writes what pointers name, and says beside it what it wrote."""

    def __init__(self, data: dict) -> None:
        self.data = data

    def figure(self, at: str, rounding: str = "nearest", digits: int = notation.DIGITS) -> Markup:
        """One number, or a dash where there is none."""
        value = look_up(self.data, at)
        text = notation.written(value, rounding, digits)
        if value is None:
            return Markup('<span class="none">{}</span>').format(text)
        return self._number(at, text)

    def _number(self, at: str, text: str) -> Markup:
        stored = json.dumps(look_up(self.data, at))
        return Markup('<data value="{}" data-at="{}">{}</data>').format(stored, at, text)

    def change(self, at: str) -> Markup:
        """A number with its sign."""
        value = look_up(self.data, at)
        sign = "+" if value is not None and value > 0 else ""
        return Markup("{}{}").format(sign, self.figure(at, digits=3))

    def interval(self, at: str, digits: int = notation.DIGITS) -> Markup:
        """[lower, upper], rounded outwards; ≈ before what is not proved."""
        span = look_up(self.data, at)
        if span is None:
            return Markup('<span class="none">{}</span>').format(notation.DASH)
        if "estimate" in span:
            return Markup("≈ {}").format(self.figure(f"{at}/estimate", digits=digits))
        texts = notation.ends(span, digits)
        both = [
            self._number(f"{at}/{end}", text)
            for end, text in zip(("lower", "upper"), texts, strict=True)
        ]
        if span["lower"] == span["upper"] == notation.read(texts[0]):
            return both[0]
        return Markup('<span class="span">[{}, {}]</span>').format(*both)

    def place(self, at: str) -> Markup:
        """A point."""
        point = look_up(self.data, at)
        if point is None:
            return Markup('<span class="none">{}</span>').format(notation.DASH)
        texts = enumerate(notation.coordinates(point))
        parts = [self._number(f"{at}/{axis}", text) for axis, text in texts]
        return Markup('<span class="span">({})</span>').format(Markup(", ").join(parts))
