"""What all tests share: the examples of Hypothesis are the same in every run."""

from hypothesis import settings

# No deadline: the first example of a test may compile kernels
settings.register_profile("meshsdf", deadline=None, derandomize=True, database=None)
settings.load_profile("meshsdf")
