"""What several test files share and is worth computing once."""

import pytest

from cdsm import paper

Results = dict[str, paper.Result]


@pytest.fixture(scope="session")
def results() -> Results:
    """The paper's figures, recomputed."""
    return {name: compute() for name, compute in paper.FIGURES.items()}
