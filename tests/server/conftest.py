"""One browser for all tests of a file."""

import pytest

from tests.server.browsing import browser_of_this_machine


@pytest.fixture(scope="module")
def browser():
    with browser_of_this_machine() as found:
        yield found
