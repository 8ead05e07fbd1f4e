"""What several test files share and is worth computing once."""

import os
import pickle
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from cdsm import paper
from cdsm.support.files import write_file


class Results(dict[str, paper.Figure]):
    """The paper's figures, each recomputed when it is first asked for, by one of the workers."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __missing__(self, name: str) -> paper.Figure:
        kept = self._folder / f"{name}.pickle"
        if kept.exists():
            self[name] = pickle.loads(kept.read_bytes())
        else:
            self[name] = paper.FIGURES[name]()
            write_file(kept, lambda aside: aside.write_bytes(pickle.dumps(self[name])))
        return self[name]


# a test is about numbers; how long it takes depends on what else the machine does
settings.register_profile("cdsm", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("cdsm")

# a shell that starts the tests in the background has Ctrl-C ignored, in what they start as well
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.getbasetemp()
    return Results(folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder)
