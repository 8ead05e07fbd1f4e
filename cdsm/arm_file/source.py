"""Where an arm comes from, as lines that read it again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, final

from cdsm.support.records import set_texts

_FILE: Final = "ARM.toml"


@final
@dataclass(frozen=True)
class ArmSource:
    """Where an arm comes from, for the lines that compute the same: its file, if it has one."""

    file: str = ""
    changes: Mapping[str, Any] = field(default_factory=dict)  # laid over the keys of the file

    @property
    def arguments(self) -> str:
        """The file and the changes, as arguments of a command."""
        changed = (f" --set {shlex.quote(text)}" for text in set_texts(self.changes))
        return shlex.quote(self.file or _FILE) + "".join(changed)

    @property
    def python(self) -> str:
        """Python that reads the arm."""
        changed = f", changes={dict(self.changes)!r}" if self.changes else ""
        return f"cdsm.Manipulator.read({self.file or _FILE!r}{changed})"

    @property
    def remark(self) -> str:
        """What the reader of the lines has to do."""
        if self.file:
            return "run it where it was started"
        return f"put the name of your file for {_FILE}"
