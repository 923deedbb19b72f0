"""Every example in a docstring runs and prints what it says."""

import doctest
import importlib
import pkgutil

import numpy as np
import pytest

import meshsdf

MODULES = ["meshsdf"] + [
    module.name
    for module in pkgutil.walk_packages(meshsdf.__path__, "meshsdf.")
    if module.name != "meshsdf.__main__"
]


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples_are_true(name):
    module = importlib.import_module(name)
    outcome = doctest.testmod(module, extraglobs={"np": np})
    assert outcome.failed == 0
