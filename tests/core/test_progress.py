"""Bars: on terminals only, after a second, the outermost alone."""

import pytest

from cdsm.support import progress
from cdsm.support.progress import progress_bar, track

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # which rich takes for a terminal
    monkeypatch.setattr(progress, "DELAY", 0.0)


def test_a_pipe_shows_nothing(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(progress, "DELAY", 0.0)
    assert list(track([1, 2, 3], "counting")) == [1, 2, 3]
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("terminal")
def test_a_terminal_shows_what_is_done_and_how_much_is_left(capsys: Capture) -> None:
    with progress_bar("sweep", 1000, 400, rate=True) as advance:
        advance(600)
    shown = capsys.readouterr().err
    assert "sweep" in shown
    assert "1000/1000" in shown
    with progress_bar("fitting"):
        pass
    assert "fitting" in capsys.readouterr().err
