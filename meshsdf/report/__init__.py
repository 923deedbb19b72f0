"""What was lost? Certified distances between meshes, round trips, pictures."""

from .compare import Comparison, compare
from .enclosure import Enclosure
from .roundtrip import RoundTrip, roundtrip

__all__ = ["Comparison", "Enclosure", "RoundTrip", "compare", "roundtrip"]
