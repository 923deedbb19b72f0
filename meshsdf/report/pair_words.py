"""What a report calls two surfaces: a mesh and its round trip, or two files by their names."""

from dataclasses import dataclass

MARKED = " (A)", " (B)"  # behind names that are the same


@dataclass(frozen=True)
class PairWords:
    """The names of two surfaces, as sentences and heads of tables need them.

    Attributes
    ----------
    first, second : str
        In tables and plots.
    a, b : str
        In sentences.
    b_of_a : str
        The second, in a sentence about the first.
    b_found : str
        The second, as what is looked at by itself.
    less : str
        What the second does where its mean signed distance is negative.
    lost, added : str
        What is told behind each direction.
    """

    first: str
    second: str
    a: str
    b: str
    b_of_a: str
    b_found: str
    less: str
    lost: str = ""
    added: str = ""

    @classmethod
    def of_files(cls, a: str, b: str) -> "PairWords":
        """Each surface by the name of its file; equal names are told apart.

        >>> PairWords.of_files("part.obj", "part.obj").b
        'part.obj (B)'
        """
        if a == b:
            a, b = a + MARKED[0], b + MARKED[1]
        return cls(a, b, a, b, b, b, "lies inside")

    @property
    def forward(self) -> str:
        """The way from the first to the second."""
        return f"{self.first} → {self.second}"

    @property
    def backward(self) -> str:
        """The way back."""
        return f"{self.second} → {self.first}"

    @property
    def starts(self) -> tuple[str, str]:
        """Both names as a sentence begins with them."""
        return started(self.a, self.first), started(self.b_found, self.second)


ROUND_TRIP = PairWords(
    first="mesh",
    second="round trip",
    a="the mesh",
    b="the round trip",
    b_of_a="its round trip",
    b_found="what came back",
    less="shrinks",
    lost=": what was lost",
    added=": what was added",
)


def started(words: str, name: str) -> str:
    """Words as a sentence begins with them; the name of a file stays as it is."""
    return words if words == name else words[0].upper() + words[1:]
