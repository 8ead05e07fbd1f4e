"""Batches with compiled kernels, and with the same source run by numpy."""

from __future__ import annotations

from types import ModuleType

import pytest

from cdsm.batch import solution


@pytest.fixture(params=["compiled", "numpy"])
def kernels(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Let all batches of a test use these kernels."""
    is_compiled = request.param == "compiled"
    chosen = solution.compiled_kernels() if is_compiled else solution.numpy_kernels()
    monkeypatch.setattr(solution, "choose_kernels", lambda *_: chosen)
    return chosen
