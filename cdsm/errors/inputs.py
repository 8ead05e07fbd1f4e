"""Errors of invalid input: arguments, files, geometries, URDFs, cables, joint angles."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

from cdsm.errors.base import NAMED, CdsmError, counted, first_of, named
from cdsm.support.format import beyond


class InvalidInput(CdsmError, ValueError):
    """An argument with a wrong type, shape or value.

    Attributes:
        name: Name of the argument.
    """

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name


class UnknownName(CdsmError, LookupError):
    """An unknown name, e.g. of a link, a solver or a stiffness term.

    Attributes:
        name: The unknown name.
        known: The known names.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str], remedy: str = "") -> None:
        self.name = name
        self.known = tuple(known)
        near = difflib.get_close_matches(str(name)[:100], self.known[:1000], n=3)
        listed = self.known if len(self.known) <= 12 else (*self.known[:12], "…")
        message = f"no {kind} is called {name!r}"
        message += f"; did you mean {' or '.join(map(repr, near))}?" if near else "."
        message += f" Known: {', '.join(listed)}."
        super().__init__(f"{message} {remedy}".rstrip())


_PATH = 1000  # number of characters of a path that a message shows


class FileError(CdsmError, OSError):
    """A file that cannot be read or written.

    Attributes:
        path: Path of the file.
    """

    def __init__(self, path: object, problem: str) -> None:
        self.path = str(path)
        shown = self.path if len(self.path) <= _PATH else f"{self.path[:_PATH]}…"
        super().__init__(f"{shown}: {problem}")


class StoreError(FileError):
    """A store that contains another sweep, or that another run is writing to.

    Attributes:
        differences: Differences between the stored and the requested sweep, one text each; may be
            empty.
    """

    def __init__(self, path: object, problem: str, differences: Sequence[str] = ()) -> None:
        super().__init__(path, problem)
        self.differences = tuple(differences)


class MissingExtra(CdsmError, ImportError):
    """An optional package that is not installed.

    Attributes:
        package: Name of the package.
        extra: The extra of ``cdsm-stiffness`` that installs it.
    """

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(
            f"{package} is not installed, which this needs; run pip install -e '.[{extra}]' in "
            "the folder of cdsm, its clone."
        )
        self.package = package
        self.extra = extra


class ClusterError(CdsmError):
    """A dask cluster that cannot compute, e.g. because its client is closed or a worker failed."""


class MissingWire(CdsmError, LookupError):
    """Cables whose file names no wire, so that their stiffness is unknown.

    Attributes:
        path: Path of the file.
        cables: Names of the cables without a wire; empty if no cable has a wire.
    """

    def __init__(self, path: object, cables: Sequence[str] = ()) -> None:
        self.path = str(path)
        self.cables = tuple(cables)
        whose = f"the cables {named(self.cables)}" if self.cables else "its cables"
        super().__init__(
            f"{self.path}: has no wire for {whose}, and the stiffness depends on it. Give wire= "
            "(--wire on the command line), or write it at the top of an ARM.toml, such as "
            'wire = "1x19-1.2mm", or wire = 48e3 for a constant EA in N.'
        )


class GeometryError(CdsmError, ValueError):
    """A geometry that cannot be built.

    Attributes:
        faults: All faults, one sentence each.
        source: Path of the file with the geometry, or None.
    """

    def __init__(self, faults: Sequence[str], source: str | None = None) -> None:
        self.faults = tuple(faults)
        self.source = source
        where = f"{source}: " if source else ""
        super().__init__(f"{where}invalid geometry, {counted(self.faults)}")


class UrdfError(CdsmError, ValueError):
    """A URDF that cdsm cannot use, or that two parsers read differently."""


class CableError(CdsmError, ValueError):
    """A cable with an invalid attribute, a name used twice, or sites where it cannot run.

    Attributes:
        cable: Name of the cable.
    """

    def __init__(self, cable: str, problem: str) -> None:
        super().__init__(f"cable {cable!r}: {problem}")
        self.cable = cable


class TensileTestError(CdsmError, ValueError):
    """A tensile test from which no elasticity can be computed."""


class JointLimitError(CdsmError, ValueError):
    """A joint angle beyond its limit.

    Attributes:
        problem: Text that names the first few angles beyond their limits.
        joints: Names of the joints beyond their limits.
        angles: Angles of these joints [rad]; [m] for prismatic joints.
        limits: Limits (lower, upper) of these joints [rad]; [m] for prismatic joints.
    """

    def __init__(
        self,
        joints: Sequence[str],
        angles: Sequence[float],
        limits: Sequence[tuple[float, float]],
        units: Sequence[str] = (),
    ) -> None:
        self.joints = tuple(joints)
        self.angles = tuple(float(angle) for angle in angles)
        self.limits = tuple((float(low), float(high)) for low, high in limits)
        units = units or ["rad"] * len(joints)
        said = [
            beyond(joint, angle, *limit, unit)
            for joint, angle, limit, unit in zip(
                self.joints, self.angles, self.limits, units, strict=True
            )
        ]
        self.problem = first_of(said, NAMED, "joints")
        super().__init__(
            f"{self.problem}. Stay inside the limits, or widen joint_limit in the geometry (limit "
            "in a full description or a URDF), or, in Python, pass check_limits=False to compute "
            "beyond them."
        )
