"""Batches with compiled kernels, and with the same source run by numpy."""

from __future__ import annotations

from types import ModuleType

import pytest

from cdsm.batch import solution


@pytest.fixture(params=["compiled", "numpy"])
def kernels(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Let all batches of a test use these kernels."""
    chosen = solution.compiled() if request.param == "compiled" else solution.plain()
    monkeypatch.setattr(solution, "kernels_for", lambda *_: chosen)
    return chosen
