"""What can go wrong, by name: every failure of the library is a :class:`CdsmError`.

Each error carries the data it speaks of as attributes, and its message says what was found, what is
allowed and what to do about it.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def listed(faults: Sequence[str], most: int | None = None) -> str:
    """Faults on lines of their own, at most so many of them."""
    more = "" if most is None or len(faults) <= most else f"\n  and {len(faults) - most} more"
    return "".join(f"\n  - {fault}" for fault in faults[:most]) + more


def counted(faults: Sequence[str], most: int | None = None) -> str:
    """How many faults there are, and :func:`listed` below it."""
    count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
    return f"{count}:{listed(faults, most)}"


def first_of(said: Sequence[str], most: int, what: str) -> str:
    """The first of some sentences, and how many there are beyond: ``…; and 3 joints more``."""
    more = len(said) - most
    return "; ".join(said[:most]) + (f"; and {more} {what} more" if more > 0 else "")


_NAMED = 4
"""Joints or cables that a message names; all are in the data of its error."""

LONGEST = 8000
"""Characters of a message; a file can hold a name of megabytes, and the rest helps nobody."""


class CdsmError(Exception):
    """Root of all errors raised by cdsm."""

    def __init__(self, message: str = "") -> None:
        more = len(message) - LONGEST
        super().__init__(message if more <= 0 else f"{message[:LONGEST]}… ({more} characters more)")

    def __reduce__(self) -> tuple[object, ...]:
        # the children take keyword data, which Exception's own pickling would lose
        return (_restore, (type(self), self.args, self.__dict__))


def _restore(kind: type[CdsmError], args: tuple[object, ...], data: dict[str, object]) -> CdsmError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(data)
    for value in data.values():
        if hasattr(value, "setflags"):
            value.setflags(write=False)
    return error


class InvalidInput(CdsmError, ValueError):
    """An argument has the wrong type, shape or value.

    Attributes:
        name: The offending argument.
    """

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name


class UnknownName(CdsmError, LookupError):
    """A name (of a link, solver, stiffness term, …) that does not exist here.

    Attributes:
        name: The name asked for.
        known: The names that exist.
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


_PATH = 1000
"""Characters of a path that a message shows."""


class FileError(CdsmError, OSError):
    """A file cannot be read or written.

    Attributes:
        path: The file.
    """

    def __init__(self, path: object, problem: str) -> None:
        self.path = str(path)
        shown = self.path if len(self.path) <= _PATH else f"{self.path[:_PATH]}…"
        super().__init__(f"{shown}: {problem}")


class StoreError(FileError):
    """A store of a sweep that holds another one, or that another run is writing to.

    Attributes:
        differences: What the store holds and what was asked for, one difference each.
    """

    def __init__(self, path: object, problem: str, differences: Sequence[str] = ()) -> None:
        super().__init__(path, problem)
        self.differences = tuple(differences)


class MissingExtra(CdsmError, ImportError):
    """An optional package that is not installed.

    Attributes:
        package: Its name.
        extra: The extra of ``cdsm-stiffness`` that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(
            f"{package} is not installed, which this needs; run "
            f"pip install 'cdsm-stiffness[{extra}]'."
        )
        self.package = package
        self.extra = extra


class ClusterError(CdsmError):
    """A dask cluster that does not do its work."""


class GeometryError(CdsmError, ValueError):
    """A geometry that cannot be built.

    Attributes:
        faults: Every fault found, one sentence each.
        source: The file it came from, or None.
    """

    def __init__(self, faults: Sequence[str], source: str | None = None) -> None:
        self.faults = tuple(faults)
        self.source = source
        where = f"{source}: " if source else ""
        super().__init__(f"{where}invalid geometry, {counted(self.faults)}")


class UrdfError(CdsmError, ValueError):
    """A URDF that is not a robot cdsm can work with, or that does not survive being read back."""


class CableError(CdsmError, ValueError):
    """A cable that cannot be routed as described.

    Attributes:
        cable: Name of the cable.
    """

    def __init__(self, cable: str, problem: str) -> None:
        super().__init__(f"cable {cable!r}: {problem}")
        self.cable = cable


class TensileTestError(CdsmError, ValueError):
    """A tensile test that no elasticity can be read from."""


class JointLimitError(CdsmError, ValueError):
    """A joint angle beyond its limit.

    Attributes:
        problem: Which angles are beyond which limits, the first few of them.
        joints: Names of the offending joints.
        angles: Their angles [rad]; [m] where a joint slides.
        limits: Their (lower, upper) limits [rad]; [m] where a joint slides.
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
            _beyond(*each)
            for each in zip(self.joints, self.angles, self.limits, units, strict=True)
        ]
        self.problem = first_of(said, _NAMED, "joints")
        super().__init__(
            f"{self.problem}. Stay inside the limits, widen joint_limit in the geometry (limit "
            "in a full description or a URDF), or, in Python, pass check_limits=False to compute "
            "beyond them."
        )


def _beyond(joint: str, angle: float, limits: tuple[float, float], unit: str) -> str:
    """Where a joint is and may be; in degrees too, if it turns."""
    low, high = limits
    said = f"{joint} = {angle:.6g} {unit} is outside [{low:.6g}, {high:.6g}] {unit}"
    if unit != "rad":
        return said
    degrees = [f"{math.degrees(value):.4g}°" for value in (angle, low, high)]
    return f"{said} ({degrees[0]} of {degrees[1]} to {degrees[2]})"


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined.

    Attributes:
        problem: What is wrong with it.
        tension: The offending tensions [N].
        indices: Where they stand in what was given.
        cables: Names of the cables that carry them; empty where no cable is known.
    """

    def __init__(
        self,
        problem: str,
        tension: Sequence[float],
        indices: Sequence[int] = (),
        cables: Sequence[str] = (),
    ) -> None:
        self.problem = problem
        self.tension = tuple(float(value) for value in tension)
        self.indices = tuple(int(index) for index in indices)
        self.cables = tuple(cables)
        names = f" (cable {_first(self.cables)})" if self.cables else ""
        values = _first([f"{value:.6g}" for value in self.tension])
        super().__init__(f"tension {values} N{names}: {problem}")


class InfeasibleTension(CdsmError):
    """No admissible cable tension balances the arm at this posture.

    Attributes:
        missing: Torque that no admissible tension supplies, per joint, shape (nv,) [N m] ([N] where
            it slides); the smallest in the sum of magnitudes.
        joint: Name of the joint that lacks most.
        relaxation: By how much all bounds would have to widen [N]; inf if no bounds would do.
        binding: Names of the cables that stand at a bound in the closest attempt.
        fixed: Names of the cables whose fixed tensions are in the way; empty if they are not.
    """

    def __init__(
        self,
        missing: NDArray[np.float64],
        joint: str,
        relaxation: float,
        binding: Sequence[str],
        units: tuple[str, str] = ("N m", "N m"),
        fixed: Sequence[str] = (),
    ) -> None:
        self.missing = missing
        self.joint = joint
        self.relaxation = relaxation
        self.binding = tuple(binding)
        self.fixed = tuple(fixed)
        total = float(abs(missing).sum())
        worst = float(abs(missing).max())
        message = (
            f"no tension within the bounds balances the arm: {total:.4g} {units[0]} are "
            f"missing, most of it ({worst:.4g} {units[1]}) at {joint}. "
        )
        if fixed:
            message += (
                f"Beside the fixed tensions no bounds of the other cables help: change or free "
                f"{', '.join(fixed)}."
            )
        elif relaxation == float("inf"):
            message += (
                "No bounds would help: the cables cannot exert this torque at all. Change the "
                "posture, the load, or the routing."
            )
        else:
            message += (
                f"Widening every bound by {_rounded_up(relaxation)} N would be enough "
                f"(cables at a bound: {', '.join(self.binding) or 'none'}). Lower minimum, raise "
                "maximum, or reduce the load."
            )
        super().__init__(message)


def _first(words: Sequence[str]) -> str:
    return ", ".join(words[:_NAMED]) + (", …" if len(words) > _NAMED else "")


def _rounded_up(value: float) -> str:
    """Four digits, so that what is said to be enough is."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3) if value > 0.0 else 1.0
    return f"{math.ceil(value / step) * step:.4g}"


class SolverError(CdsmError):
    """A quadratic-programming solver returned something that is not the optimum.

    Attributes:
        solver: Its name.
    """

    def __init__(self, solver: str, problem: str) -> None:
        super().__init__(f"solver {solver!r} {problem}")
        self.solver = solver


class SingularStiffness(CdsmError, ArithmeticError):
    """A stiffness or compliance matrix that does not exist at this posture.

    Attributes:
        direction: The critical direction: joint space (nv,) or Cartesian (3,), unit length.
    """

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class SingularMass(CdsmError, ArithmeticError):
    """A joint motion that moves no mass, and so has no natural frequency.

    Attributes:
        direction: The motion (nv,), unit length.
    """

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class EquilibriumError(CdsmError, ArithmeticError):
    """A loaded arm that finds no place to rest, or buckles on the way.

    Attributes:
        residual: Torque out of balance at the last iterate (nv,) [N m].
        load_factor: Part of the load [-] under which the arm still stood.
        joint: Name of the joint furthest from balance, or that gives way first.
    """

    def __init__(
        self,
        problem: str,
        residual: NDArray[np.float64],
        load_factor: float,
        joint: str,
        remedy: str = "Reduce the load, or stiffen the arm: raise the tensions, or take stiffer "
        "cables or springs.",
    ) -> None:
        super().__init__(f"{problem}. {remedy}")
        self.residual = residual
        self.load_factor = load_factor
        self.joint = joint


class UnreachableStiffness(CdsmError):
    """A stiffness that no admissible cable tensions give.

    Attributes:
        direction: u (3,), unit length, base axes.
        target: What was wanted [N/m].
        low: Smallest attainable stiffness along u [N/m].
        high: Largest attainable stiffness along u [N/m]; inf if tension raises it without end.
        nearest: What is attainable next to it [N/m]: an end of the range, or the nearest found on
            both sides.
    """

    def __init__(
        self,
        direction: NDArray[np.float64],
        target: float,
        low: float,
        high: float,
        nearest: Sequence[float],
    ) -> None:
        self.direction = direction
        self.target = target
        self.low = low
        self.high = high
        self.nearest = tuple(float(value) for value in nearest)
        along = ", ".join(f"{x:.4g}" for x in direction)
        message = (
            f"no admissible tensions give {target:.8g} N/m along ({along}): the range is "
            f"{low:.8g} to {high:.8g} N/m"
        )
        if low <= target <= high:
            sides = " and ".join(f"{value:.8g}" for value in self.nearest)
            message += (
                f", but the nearest found is {sides} N/m. Raise starts, ask for one of these, or "
                "change the bounds or the posture."
            )
        else:
            message += (
                ". Ask for a stiffness within it, or widen it: change minimum, maximum, margin, "
                "the load or the posture, or take other cables."
            )
        super().__init__(message)
