"""Bars: on terminals only, after a second, the outermost alone."""

import pytest

from cdsm.support import progress
from cdsm.support.progress import progress_bar, track


@pytest.mark.parametrize("terminal", [True, False])
def test_the_outermost_bar_is_shown_on_a_terminal(
    terminal: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "DELAY", 0.0)
    with progress_bar("sweep", 1000, 400, rate=True) as advance:
        assert list(track([1, 2, 3], "inside")) == [1, 2, 3]
        advance(600)
    shown = capsys.readouterr().err
    assert ("sweep" in shown) == ("1000/1000" in shown) == terminal
    assert "inside" not in shown
