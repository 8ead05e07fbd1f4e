"""What several test files share and is worth computing once."""

import pytest

from cdsm import paper


@pytest.fixture(scope="session")
def results() -> dict[str, paper.Figure]:
    """The paper's figures, recomputed."""
    return {name: compute() for name, compute in paper.FIGURES.items()}
