"""All errors of the library; each one is a subclass of :class:`CdsmError`.

An error stores its data as attributes. Its message names the fault, the allowed values and the
remedy.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from cdsm.support.format import beyond, coordinates, enough, told_apart

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def listed(faults: Sequence[str], most: int | None = None) -> str:
    """Return the faults as one line each; ``most`` limits their number."""
    more = "" if most is None or len(faults) <= most else f"\n  and {len(faults) - most} more"
    return "".join(f"\n  - {fault}" for fault in faults[:most]) + more


def counted(faults: Sequence[str], most: int | None = None) -> str:
    """Return the number of faults, with :func:`listed` below it."""
    count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
    return f"{count}:{listed(faults, most)}"


def first_of(said: Sequence[str], most: int, what: str) -> str:
    """Return the first ``most`` sentences and the number of others: ``…; and 3 joints more``."""
    more = len(said) - most
    return "; ".join(said[:most]) + (f"; and {more} {what} more" if more > 0 else "")


_NAMED = 4
"""Number of joints or cables that a message names; the attributes of the error hold all of them."""

LONGEST = 8000
"""Largest number of characters of a message, since a name in a file can be very long."""


class CdsmError(Exception):
    """Base class of all errors raised by cdsm."""

    def __init__(self, message: str = "") -> None:
        more = len(message) - LONGEST
        super().__init__(message if more <= 0 else f"{message[:LONGEST]}… ({more} characters more)")

    def __reduce__(self) -> tuple[object, ...]:
        # subclasses have attributes, which Exception's own pickling would lose
        return (_restore, (type(self), self.args, self.__dict__))


def _restore(kind: type[CdsmError], args: tuple[object, ...], data: dict[str, object]) -> CdsmError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(data)
    for value in data.values():
        if hasattr(value, "setflags"):
            value.setflags(write=False)
    return error


class CdsmWarning(UserWarning):
    """Base class of all warnings of cdsm: an input that is possible, but rarely meant."""


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


_PATH = 1000
"""Number of characters of a path that a message shows."""


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
    """A sweep store that holds another sweep, or that another run is writing to.

    Attributes:
        differences: Differences between the stored sweep and the requested sweep, one each.
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
    """A dask cluster that does not work."""


class MissingWire(CdsmError, LookupError):
    """Cables whose file names no wire, so that their stiffness is unknown.

    Attributes:
        path: Path of the file.
        cables: Names of the cables without a wire; empty: all.
    """

    def __init__(self, path: object, cables: Sequence[str] = ()) -> None:
        self.path = str(path)
        self.cables = tuple(cables)
        whose = f"the cables {_first(self.cables)}" if self.cables else "its cables"
        super().__init__(
            f"{self.path}: has no wire for {whose}, and the stiffness depends on it. Give wire= "
            "(--wire on the command line), or write it at the top of an ARM.toml, such as "
            'wire = "1x19-1.2mm", or wire = 48e3 for a constant EA in N.'
        )


class GeometryError(CdsmError, ValueError):
    """A geometry that cannot be built.

    Attributes:
        faults: All faults, one sentence each.
        source: The file of the geometry, or None.
    """

    def __init__(self, faults: Sequence[str], source: str | None = None) -> None:
        self.faults = tuple(faults)
        self.source = source
        where = f"{source}: " if source else ""
        super().__init__(f"{where}invalid geometry, {counted(self.faults)}")


class UrdfError(CdsmError, ValueError):
    """A URDF that cdsm cannot use, or that two parsers read differently."""


class CableError(CdsmError, ValueError):
    """A cable that cannot be routed as described.

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
        problem: The first few angles that are beyond their limits, as text.
        joints: Names of the joints beyond their limits.
        angles: Angles of these joints [rad]; [m] where a joint slides.
        limits: Limits (lower, upper) of these joints [rad]; [m] where a joint slides.
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
        self.problem = first_of(said, _NAMED, "joints")
        super().__init__(
            f"{self.problem}. Stay inside the limits, widen joint_limit in the geometry (limit "
            "in a full description or a URDF), or, in Python, pass check_limits=False to compute "
            "beyond them."
        )


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined.

    Attributes:
        problem: The fault, as text.
        tension: The invalid tensions [N].
        indices: Indices of these tensions in the input array.
        cables: Names of the cables with these tensions; empty if no cable is known.
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
        values = _first(told_apart(self.tension))
        super().__init__(f"tension {values} N{names}: {problem}")


class InfeasibleTension(CdsmError):
    """No cable tension within the bounds balances the arm at this posture.

    Attributes:
        missing: Missing torque per joint, shape (nv,) [N m] ([N] where it slides). It has the
            smallest possible sum of magnitudes.
        joint: Name of the joint with the largest missing torque.
        relaxation: Widening of all bounds that makes the problem feasible [N]; inf if none does.
        binding: Names of the cables at a bound in the closest attempt.
        fixed: Names of the cables with fixed tensions, if these make the problem infeasible; else
            empty.
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
                "posture, the load, or the routing (in Python, print(pose.moment_arms))."
            )
        else:
            message += (
                f"Widening every bound by {enough(relaxation, up=True)} N would be enough "
                f"(cables at a bound: {', '.join(self.binding) or 'none'}). Lower minimum=, raise "
                "maximum=, or reduce the load."
            )
        super().__init__(message)


def _first(words: Sequence[str]) -> str:
    return ", ".join(words[:_NAMED]) + (", …" if len(words) > _NAMED else "")


class SolverError(CdsmError):
    """A quadratic-programming solver returned a result that is not the optimum.

    Attributes:
        solver: Name of the solver.
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
    """A joint motion that moves no mass and therefore has no natural frequency.

    Attributes:
        direction: The joint motion (nv,), unit length.
    """

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class EquilibriumError(CdsmError, ArithmeticError):
    """A loaded arm that has no equilibrium, or that buckles before the full load.

    Attributes:
        residual: Torque residual at the last iterate (nv,) [N m].
        load_factor: Largest fraction of the load [-] at which the arm was in equilibrium.
        joint: Name of the joint with the largest residual, or of the joint that buckles first.
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
        target: Wanted stiffness [N/m].
        low: Smallest attainable stiffness along u [N/m].
        high: Largest attainable stiffness along u [N/m]; inf if it has no upper bound.
        nearest: Attainable stiffness nearest to the target [N/m]: an end of the range, or the
            nearest values found on both sides.
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
        wanted, least, most, *near = told_apart(
            [value / 1e3 for value in (target, low, high, *self.nearest)]
        )
        message = (
            f"no admissible tensions give {wanted} N/mm along {coordinates(direction)}: the range "
            f"is {least} to {most} N/mm"
        )
        if low <= target <= high:
            message += (
                f", but the nearest found is {' and '.join(near)} N/mm. Raise starts=, ask for one "
                "of these, or change the bounds or the posture."
            )
        else:
            message += (
                ". Ask for a stiffness within it, or widen it: change minimum=, maximum=, "
                "the load or the posture, or take other cables."
            )
        super().__init__(message)
