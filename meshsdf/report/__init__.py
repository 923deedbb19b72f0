"""What was lost? Certified distances between meshes, round trips, pictures."""

from .compare import Comparison, compare
from .conditioning import Conditioning, conditioning
from .enclosure import Enclosure
from .error_budget import ErrorBudget, error_budget
from .hausdorff import Hausdorff, OneSided, hausdorff, one_sided_hausdorff
from .roundtrip import RoundTrip, roundtrip
from .statistics import Statistics, one_sided_statistics
from .tolerance import Tolerance

__all__ = [
    "Comparison",
    "Conditioning",
    "Enclosure",
    "ErrorBudget",
    "Hausdorff",
    "OneSided",
    "RoundTrip",
    "Statistics",
    "Tolerance",
    "compare",
    "conditioning",
    "error_budget",
    "hausdorff",
    "one_sided_hausdorff",
    "one_sided_statistics",
    "roundtrip",
]
