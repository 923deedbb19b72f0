"""The colours of the heat maps and the distances they stand for."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Values
from ..ray import color_map
from ..srgb import srgb_from_linear
from .notation import written

LEAST_TOP = 1e-2
"""In voxels: the scale never ends lower, so that rounding errors do not shine."""

MAP, DARKEST = "magma_r", 0.82  # of the map: beyond, shadows could not be told from colours
WIDTH, HEIGHT, MARGIN, BAR = 420, 38, 42, 12  # of the drawing, pixels
N_STOPS = 25
ROOM = 0.11  # of the bar, between two labels


@dataclass(frozen=True)
class Scale:
    """Distances to colours: by their square roots, so that small ones differ too."""

    top: float
    unit: str = "voxels"
    goes_on: bool = False  # there are larger distances, of the last colour

    def place(self, distances: Values) -> Values:
        """Where on the scale, from 0 to 1."""
        return np.sqrt(np.minimum(distances / self.top, 1.0))

    def colors(self, distances: Values) -> np.ndarray:
        """(n, 3) linear RGB of (n,) distances in the scale's unit."""
        return _colors(self.place(distances))

    @property
    def ticks(self) -> list[float]:
        """Round numbers that have room below the top."""
        decade = 10.0 ** np.floor(np.log10(self.top))
        found = [0.0]
        for step in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0):
            places = self.place(np.array([found[-1], step * decade]))
            if places[1] - places[0] >= ROOM and places[1] <= 1.0 - 1.5 * ROOM:
                found.append(float(f"{step * decade:.1g}"))
        return found

    def bar(self, name: str | int) -> str:
        """Return the scale as SVG, with its ticks; ``name`` is unique on the page."""
        places = np.linspace(0.0, 1.0, N_STOPS)
        encoded = np.rint(255 * srgb_from_linear(_colors(places))).astype(int)
        stops = "".join(
            f'<stop offset="{place:.4f}" stop-color="#{r:02x}{g:02x}{b:02x}"/>'
            for place, (r, g, b) in zip(places, encoded.tolist(), strict=True)
        )
        gradient = f'<linearGradient id="colors-{name}">{stops}</linearGradient>'
        length = WIDTH - 2 * MARGIN
        place = f'x="{MARGIN}" y="2" width="{length}" height="{BAR}" rx="2"'
        bar = f'<rect {place} fill="url(#colors-{name})"/>'
        labels = [written(tick) for tick in self.ticks]
        values = np.array([*self.ticks, self.top])
        sign = "≥ " if self.goes_on else ""
        labels.append(f"{sign}{written(self.top, 'up', 3)} {self.unit}")
        marks = "".join(
            f'<line x1="{x:.1f}" y1="{BAR + 2}" x2="{x:.1f}" y2="{BAR + 7}"/>'
            f'<text x="{x:.1f}" y="{BAR + 19}">{label}</text>'
            for x, label in zip(MARGIN + length * self.place(values), labels, strict=True)
        )
        words = f"Colours from 0, light, to {labels[-1]}, dark, by square roots"
        return (
            f'<svg class="bar" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{words}">'
            f"<defs>{gradient}</defs>{bar}{marks}</svg>"
        )


def _colors(places: Values) -> np.ndarray:
    return color_map(MAP)(DARKEST * places)
