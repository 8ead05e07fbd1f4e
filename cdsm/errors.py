"""All errors of the library; each one is a subclass of :class:`CdsmError`.

An error stores its data as attributes. Its message names the fault, the allowed values and the
remedy.
"""

from __future__ import annotations

import difflib
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LINES = "\n  - "
"""Separator of :func:`listed` that puts each text on a line of its own."""


def listed(texts: Sequence[str], most: int = 4, between: str = ", ") -> str:
    """Join the first ``most`` texts, and count the others: ``a, b, and 3 more``."""
    more = f"{between}and {len(texts) - most} more" if len(texts) > most else ""
    return f"{between if between == LINES else ''}{between.join(texts[:most])}{more}"


class CdsmError(Exception):
    """Base class of all errors raised by cdsm."""

    def __reduce__(self) -> tuple[object, ...]:
        # subclasses have attributes, which Exception's own pickling would lose
        return _restore, (type(self), self.args, self.__dict__)


def _restore(kind: type[CdsmError], args: tuple[object, ...], data: dict[str, object]) -> CdsmError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(data)
    for value in data.values():
        if hasattr(value, "setflags"):
            value.setflags(write=False)
    return error


class CdsmWarning(UserWarning):
    """Class of all warnings of cdsm: an input is possible, but probably not intended."""


# --- input ----------------------------------------------------------------------------------


class InvalidInput(CdsmError, ValueError):
    """An argument, called ``name``, with a wrong type, shape or value."""

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name


class UnknownName(CdsmError, LookupError):
    """A ``name``, e.g. of a link, a solver or a stiffness term, that is not among ``known``."""

    def __init__(self, kind: str, name: object, known: Iterable[str], remedy: str = "") -> None:
        self.name = name
        self.known = tuple(known)
        near = difflib.get_close_matches(str(name), self.known)
        hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else "."
        message = f"no {kind} is called {name!r}{hint} Known: {listed(self.known, 12)}. {remedy}"
        super().__init__(message.rstrip())


class FileError(CdsmError, OSError):
    """A file at ``path`` that cannot be read or written."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = str(path)


class StoreError(FileError):
    """A store that holds something else than asked for, or that another run is writing to.

    Attributes:
        differences: Differences between the stored and the requested sweep, one text each; may be
            empty.
    """

    def __init__(self, path: object, problem: str, differences: Sequence[str] = ()) -> None:
        super().__init__(path, problem)
        self.differences = tuple(differences)


class MissingExtra(CdsmError, ImportError):
    """A ``package`` that is not installed; ``extra`` of ``cdsm-stiffness`` installs it."""

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
    """A file at ``path`` without a wire for ``cables`` (names; none if no cable has a wire)."""

    def __init__(self, path: object, cables: Sequence[str] = ()) -> None:
        self.path = str(path)
        self.cables = tuple(cables)
        whose = f"the cables {listed(self.cables)}" if self.cables else "its cables"
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
        super().__init__(f"{where}invalid geometry:{listed(self.faults, 20, LINES)}")


class UrdfError(CdsmError, ValueError):
    """A URDF that cdsm cannot use, or that two parsers read differently."""


class CableError(CdsmError, ValueError):
    """A ``cable`` with an invalid attribute, a name used twice, or sites where it cannot run."""

    def __init__(self, cable: str, problem: str) -> None:
        super().__init__(f"cable {cable!r}: {problem}")
        self.cable = cable


class JointLimitError(CdsmError, ValueError):
    """Joint angles beyond their limits.

    Attributes:
        problem: Text that names the first few of these angles.
        joints: Names of their joints.
        angles: Their values [rad]; [m] for prismatic joints.
        limits: Limits (lower, upper) of these joints [rad]; [m] for prismatic joints.
    """

    def __init__(
        self,
        problems: Sequence[str],
        joints: Sequence[str],
        angles: Sequence[float],
        limits: Sequence[tuple[float, float]],
    ) -> None:
        self.problem = listed(problems, 4, "; ")
        self.joints = tuple(joints)
        self.angles = tuple(angles)
        self.limits = tuple(limits)
        super().__init__(
            f"{self.problem}. Stay inside the limits, or widen joint_limit in the geometry (limit "
            "in a full description or a URDF), or, in Python, pass check_limits=False to compute "
            "beyond them."
        )


# --- mechanics ------------------------------------------------------------------------------


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined.

    Attributes:
        problem: The fault, as text.
        tension: The invalid tensions [N]; empty if the error is about a strain or an elongation
            that no tension gives.
        indices: Indices of these tensions, strains or elongations in the input array.
        cables: Names of the cables with these tensions; empty if no cable is known.
    """

    def __init__(
        self,
        problem: str,
        tension: Sequence[float] = (),
        indices: Sequence[int] = (),
        cables: Sequence[str] = (),
    ) -> None:
        self.problem = problem
        self.tension = tuple(map(float, tension))
        self.indices = tuple(map(int, indices))
        self.cables = tuple(cables)
        where = f"cable {listed(self.cables)}" if self.cables else ""
        if self.tension:
            values = f"tension {listed([f'{text} N' for text in _distinct(self.tension)])}"
            where = f"{values} ({where})" if where else values
        super().__init__(f"{where}: {problem}" if where else problem)


class InfeasibleTension(CdsmError):
    """No cable tension within the bounds balances the arm at this posture.

    Attributes:
        missing: Torque that the cables cannot balance, (nv,) [N m] ([N] for prismatic joints), at
            the tensions within the bounds that minimise Σ|missing|.
        joint: Name of the joint with the largest missing torque.
        relaxation: Least amount by which the bounds of all cables without a fixed tension must be
            widened to make the problem feasible [N]; inf if this is not possible.
        binding: Names of the cables without a fixed tension that are at a bound at these tensions.
        fixed: Names of the cables with fixed tensions, if these make the problem infeasible; else
            empty.
    """

    def __init__(
        self,
        missing: Array,
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
        if fixed:
            remedy = (
                "Beside the fixed tensions no bounds of the other cables help: change or free "
                f"{', '.join(fixed)}."
            )
        elif relaxation == math.inf:
            remedy = (
                "No bounds would help: the cables cannot exert this torque at all. Change the "
                "posture, the load, or the routing (in Python, print(pose.moment_arms))."
            )
        else:
            step = 10.0 ** (math.floor(math.log10(relaxation)) - 3) if relaxation > 0.0 else 1.0
            remedy = (
                f"Widening every bound by {math.ceil(relaxation / step) * step:.4g} N would be "
                f"enough (cables at a bound: {', '.join(self.binding) or 'none'}). Lower minimum=, "
                "raise maximum=, or reduce the load."
            )
        super().__init__(
            f"no tension within the bounds balances the arm: {abs(missing).sum():.4g} {units[0]} "
            f"are missing, most of it ({abs(missing).max():.4g} {units[1]}) at {joint}. {remedy}"
        )


class SolverError(CdsmError):
    """A quadratic-programming ``solver`` returned a result that is not the optimum."""

    def __init__(self, solver: str, problem: str) -> None:
        super().__init__(f"solver {solver!r} {problem}")
        self.solver = solver


class SingularStiffness(CdsmError, ArithmeticError):
    """A stiffness or compliance matrix that does not exist at this posture.

    Attributes:
        direction: Unit vector: the joint motion (nv,) with the least stiffness, or the direction
            (3,) in base axes in which the tip cannot move.
    """

    def __init__(self, problem: str, direction: Array) -> None:
        super().__init__(problem)
        self.direction = direction


class SingularMass(CdsmError, ArithmeticError):
    """A joint motion, the unit vector ``direction`` (nv,), that moves no mass."""

    def __init__(self, problem: str, direction: Array) -> None:
        super().__init__(problem)
        self.direction = direction


class EquilibriumError(CdsmError, ArithmeticError):
    """A loaded arm that has no equilibrium, or that buckles before the full load.

    Attributes:
        residual: Torque residual at the last iterate (nv,) [N m]; [N] for prismatic joints.
        load_factor: Largest fraction of the load [-] at which the arm was in equilibrium.
        joint: Name of the joint with the largest residual, or of the joint that buckles first.
    """

    def __init__(
        self,
        problem: str,
        residual: Array,
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
        nearest: Attainable stiffness nearest to the target [N/m]: ``low`` or ``high``, or the
            nearest values found below and above the target.
    """

    def __init__(
        self, direction: Array, target: float, low: float, high: float, nearest: Sequence[float]
    ) -> None:
        self.direction = direction
        self.target = target
        self.low = low
        self.high = high
        self.nearest = tuple(map(float, nearest))
        wanted, least, most, *near = _distinct(
            [value / 1e3 for value in (target, low, high, *self.nearest)]
        )
        if low <= target <= high:
            remedy = (
                f", but the nearest found is {' and '.join(near)} N/mm. Raise starts=, ask for one "
                "of these, or change the bounds or the posture."
            )
        else:
            remedy = (
                ". Ask for a stiffness within it, or widen it: change minimum=, maximum=, "
                "the load or the posture, or take other cables."
            )
            if low <= 1e3 * target <= high:
                remedy += " It looks as if the target is in N/mm: give it in N/m."
        super().__init__(
            f"no admissible tensions give {wanted} N/mm along "
            f"({', '.join(format(each, '.4g') for each in direction)}): the range is {least} to "
            f"{most} N/mm{remedy}"
        )


class InfeasibleDesign(CdsmError):
    """No design that a search tried meets all constraints of its problem.

    Attributes:
        constraints: Names of the constraints that the nearest design violates; the name ``held``
            means that at some postures the arm cannot be balanced or is unstable.
        design: The nearest design, the one with the smallest sum of violations, as one number for
            each variable; empty if no design gives a valid arm.
    """

    def __init__(self, message: str, constraints: Sequence[str], design: Sequence[float]) -> None:
        super().__init__(message)
        self.constraints = tuple(constraints)
        self.design = tuple(design)


def _distinct(values: Sequence[float]) -> list[str]:
    """Return numbers as text, with more than four digits where different ones would look alike."""
    for digits in (4, 6, 8, 12):
        texts = [f"{value:.{digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts
