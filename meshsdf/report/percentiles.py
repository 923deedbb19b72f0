"""How the area of a surface is distributed over the distances, between proven bounds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Number, Values
from ..errors import ReportError
from .area_search import AreaSearch
from .distance_pieces import Areas, Thresholds
from .enclosure import Enclosure

PER_WINDOW = 31  # thresholds that cut a window in 32
MAX_ROUNDS = 2
WORTH_IT = 0.5  # a round that leaves more of every window is the last


@dataclass(frozen=True, eq=False)
class Shares:
    """The share of the area that is within each of some distances.

    Attributes
    ----------
    thresholds : (k,) float64
        Ascending distances, world units.
    lower, upper : (k,) float64
        Between them lies the share of the source's area at a distance of at most each; in [0, 1].
    """

    thresholds: Values
    lower: Values
    upper: Values


def first_shares(search: AreaSearch) -> Shares:
    """Shares at the thresholds of the search, up to a distance that nothing is beyond."""
    found = _shares(search, search.thresholds, search.first_areas())
    most = found.thresholds[-1]
    thresholds = found.thresholds if search.largest <= most else [*found.thresholds, search.largest]
    thresholds = np.array(thresholds)
    bounds = np.ones((2, len(thresholds)))
    below = thresholds < search.largest
    bounds[:, below] = np.stack([found.lower, found.upper])[:, : below.sum()]
    return Shares(thresholds, *bounds)


def find_percentiles(
    search: AreaSearch, shares: Shares, percents: Sequence[Number]
) -> dict[float, Enclosure]:
    """Enclose each percentile: the least t such that so much of the area is within t.

    Notes
    -----
    Method: the shares at a few thresholds tell between which two of them it lies; that window is
    cut in 32, and once more if that helps. Only pieces with distances inside a
    window need a second look.
    """
    check_percents(percents)
    windows = {float(p): _window(shares, 0.01 * p, (0.0, search.largest)) for p in percents}
    for _ in range(MAX_ROUNDS):
        wide = {p: w for p, w in windows.items() if w[1] - w[0] > search.tolerance.width(w[0])}
        if not wide:
            break
        cuts = [np.linspace(*window, PER_WINDOW + 2)[1:-1] for window in wide.values()]
        thresholds = np.unique(np.concatenate(cuts))
        areas = search.areas_within(thresholds, np.array(list(wide.values())))
        found = _shares(search, thresholds, areas)
        gain = 1.0
        for p, window in wide.items():
            windows[p] = _window(found, 0.01 * p, window)
            before, after = window[1] - window[0], windows[p][1] - windows[p][0]
            gain = min(gain, after / before)
        if gain > WORTH_IT:
            break
    return {p: Enclosure(*window) for p, window in windows.items()}


def check_percents(percents: Sequence[Number]) -> None:
    """Refuse what is no percentage above zero."""
    for p in percents:
        if not 0 < p <= 100:
            what = f"{p:g} is no percentage of an area"
            fix = "pass numbers above 0, up to 100"
            raise ReportError(what, "one_sided_statistics(percentiles=...)", fix)


def _window(shares: Shares, share: float, window: tuple[float, float]) -> tuple[float, float]:
    """The part of a window that holds the percentile, as far as the shares tell."""
    too_small = shares.thresholds[shares.upper < share]
    enough = shares.thresholds[shares.lower >= share]
    low = max(window[0], float(too_small[-1])) if len(too_small) else window[0]
    high = min(window[1], float(enough[0])) if len(enough) else window[1]
    return low, max(low, high)


def _shares(search: AreaSearch, thresholds: Thresholds, areas: Areas) -> Shares:
    """Areas as shares of the whole, moved out by their rounding."""
    lower, upper = areas / search.area
    slack = search.area_rounding
    return Shares(thresholds, np.maximum(lower - slack, 0.0), np.minimum(upper + slack, 1.0))
