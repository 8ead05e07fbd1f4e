"""All errors of the library; each one is a subclass of :class:`CdsmError`.

An error stores its data as attributes; its message names the fault, the allowed values and the
remedy.
"""

from __future__ import annotations

import difflib
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cdsm.support.values import Array

    Texts = Sequence[str]
    Numbers = Sequence[float]

LINES = "\n  - "  # separator of listed that puts each text on a line of its own


def listed(texts: Texts, most: int = 4, between: str = ", ") -> str:
    """Join the first ``most`` texts, and count the others: ``a, b, and 3 more``."""
    more = f"{between}and {len(texts) - most} more" if len(texts) > most else ""
    return f"{between if between == LINES else ''}{between.join(texts[:most])}{more}"


class CdsmError(Exception):
    """Base class of all errors raised by cdsm."""

    def __reduce__(self) -> tuple[object, ...]:
        # Exception would call the constructor with the message alone
        return type(self).__new__, (type(self),), {"args": self.args, **self.__dict__}


class CdsmWarning(UserWarning):
    """Class of all warnings of cdsm: an input is possible, but probably not intended."""


class InvalidInput(CdsmError, ValueError):
    """An argument, called ``name``, with a wrong type, shape or value."""

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name


class UnknownName(CdsmError, LookupError, ValueError):
    """A ``name``, e.g. of a link, a solver or a stiffness term, that is not among ``known``."""

    def __init__(self, kind: str, name: object, known: Iterable[str], remedy: str = "") -> None:
        self.name, self.known = name, tuple(known)
        near = difflib.get_close_matches(str(name), self.known)
        hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else "."
        message = f"no {kind} is called {name!r}{hint} Known: {listed(self.known, 12)}. {remedy}"
        super().__init__(message.rstrip())


class FileError(CdsmError, OSError):
    """A file at ``path`` that cannot be read or written."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = str(path)


class MissingExtra(CdsmError, ImportError):
    """A ``package`` that is not installed; ``extra`` of ``cdsm-stiffness`` installs it."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"{package} is missing; run pip install -e '.[{extra}]' in cdsm's clone.")
        self.package, self.extra = package, extra


class MissingWire(CdsmError, LookupError):
    """A file at ``path`` without a wire for ``cables`` (names; none if no cable has a wire)."""

    def __init__(self, path: object, cables: Texts = ()) -> None:
        self.path, self.cables = str(path), tuple(cables)
        whose = f"the cables {listed(self.cables)}" if self.cables else "its cables"
        said = f"{path}: has no wire for {whose}. Give wire= (commands: --set wire=48e3), or write"
        remedy = 'at the top of it: wire = "1x19-1.2mm", or wire = 48e3 for a constant EA in N.'
        super().__init__(f"{said} {remedy}")


class GeometryError(CdsmError, ValueError):
    """A geometry with ``faults``, one sentence each, of the file ``source`` (or None)."""

    def __init__(self, faults: Texts, source: str | None = None) -> None:
        self.faults, self.source = tuple(faults), source
        said = f"invalid geometry:{listed(self.faults, 20, LINES)}"
        super().__init__(f"{source}: {said}" if source else said)


class UrdfError(CdsmError, ValueError):
    """A URDF that cdsm cannot use, or that two parsers read differently."""


class CableError(CdsmError, ValueError):
    """A ``cable`` with an invalid attribute, a name used twice, or sites where it cannot run."""

    def __init__(self, cable: str, problem: str) -> None:
        super().__init__(f"cable {cable!r}: {problem}")
        self.cable = cable


class JointLimitError(CdsmError, ValueError):
    """Angles beyond the joint limits, of which the text ``problem`` names the first few.

    ``joints`` are all their names, ``angles`` the values [rad] or [m], ``limits`` the (low, high).
    """

    def __init__(
        self, problems: Texts, joints: Texts, angles: Numbers, limits: Sequence[tuple[float, float]]
    ) -> None:
        self.problem = listed(problems, 4, "; ")
        self.joints, self.angles, self.limits = tuple(joints), tuple(angles), tuple(limits)
        stay = "Stay inside, or widen joint_limit in the geometry (limit of a joint, or in a URDF)"
        beyond = "or, in Python, pass check_limits=False to compute beyond them."
        super().__init__(f"{self.problem}. {stay}, {beyond}")


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined; ``problem`` is the fault as text.

    ``tension`` are the invalid tensions [N], none if no tension gives a strain or an elongation;
    ``indices`` those of the invalid entries of the input; ``cables`` the names, as far as known.
    """

    def __init__(
        self, problem: str, tension: Numbers = (), indices: Sequence[int] = (), cables: Texts = ()
    ) -> None:
        self.problem, self.cables = problem, tuple(cables)
        self.tension, self.indices = tuple(map(float, tension)), tuple(map(int, indices))
        where = f"cable {listed(self.cables)}" if cables else ""
        if self.tension:
            values = f"tension {listed([f'{text} N' for text in _distinct(self.tension)])}"
            where = f"{values} ({where})" if where else values
        super().__init__(": ".join(filter(None, (where, problem))))


class InfeasibleTension(CdsmError):
    """No cable tension within the bounds balances the arm at this posture.

    ``missing`` (nv,) [N m] or [N] is what the tensions within the bounds that minimise Σ|missing|
    leave, and ``joint`` the name of the joint with most of it. Of the cables without a fixed
    tension, ``binding`` names those at a bound then, and ``relaxation`` [N] is the least widening
    of all bounds that helps, or inf. ``fixed`` names the cables if their fixed tensions prevent it.
    ``hint`` becomes part of the message.
    """

    def __init__(
        self,
        missing: Array,
        joint: str,
        relaxation: float,
        binding: Texts,
        units: tuple[str, str] = ("N m", "N m"),
        fixed: Texts = (),
        hint: str = "",
    ) -> None:
        self.missing, self.joint, self.relaxation = missing, joint, relaxation
        self.binding, self.fixed = tuple(binding), tuple(fixed)
        if fixed:
            advice = f"Beside the fixed tensions no bounds help: change or free {', '.join(fixed)}."
        elif relaxation == math.inf:
            advice = f"No bounds would help: the cables cannot exert this torque at all. {hint}"
            advice += "Change the posture, the load, or the routing (in Python, "
            advice += "print(pose.moment_arms))."
        else:
            step = 10.0 ** (math.floor(math.log10(relaxation or 1.0)) - 3)
            wider, at = math.ceil(relaxation / step) * step, ", ".join(binding) or "none"
            advice = f"Widening every bound by {wider:.4g} N would be enough (cables at a bound: "
            advice += f"{at}). Reduce the load{hint and f', or {hint}'}."
        most = f"largest at {joint} ({abs(missing).max():.4g} {units[1]})"
        said = f"torque deficit {abs(missing).sum():.4g} {units[0]}, {most}. {advice}"
        super().__init__(f"no tension within the bounds balances the arm: {said}")


class SolverError(CdsmError):
    """A quadratic-programming ``solver`` returned a result that is not the optimum."""

    def __init__(self, solver: str, problem: str) -> None:
        super().__init__(f"solver {solver!r} {problem}")
        self.solver = solver


class SingularStiffness(CdsmError, ArithmeticError):
    """A stiffness or compliance matrix that does not exist at this posture.

    ``direction`` is the joint motion (nv,) with the least stiffness, or the direction (3,) in base
    axes in which the tip cannot move; of unit length.
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

    ``residual`` (nv,) [N m] or [N] is the torque left at the last iterate, ``load_factor`` [-] the
    largest fraction of the load in equilibrium, ``joint`` the one with the largest residual or that
    buckles first.
    """

    def __init__(
        self, problem: str, residual: Array, load_factor: float, joint: str, remedy: str = ""
    ) -> None:
        usual = "Reduce the load, raise the tensions, or take stiffer cables or springs."
        super().__init__(f"{problem}. {remedy or usual}")
        self.residual, self.load_factor, self.joint = residual, load_factor, joint


class UnreachableStiffness(CdsmError):
    """A stiffness ``target`` [N/m] along ``direction`` that no admissible cable tensions give.

    ``low`` and ``high`` (or inf) [N/m] are the ends of the range, ``nearest`` the end next to the
    target, or the values that were found below and above it. ``hint``, which may say how to widen
    the range, becomes part of the message.
    """

    def __init__(
        self,
        direction: Array,
        target: float,
        low: float,
        high: float,
        nearest: Numbers,
        hint: str = "",
    ) -> None:
        self.direction, self.target, self.low, self.high = direction, target, low, high
        self.nearest = tuple(map(float, nearest))
        wanted, least, most, *near = _distinct([x / 1e3 for x in (target, low, high, *nearest)])
        if low <= target <= high:
            remedy = f", but only {' and '.join(near)} N/mm found. Ask for one of these."
        else:
            remedy = f". Ask for one within it, {hint and f'{hint}, '}or change the load, posture "
            remedy += "or cables."
            if low <= 1e3 * target <= high:
                remedy += " It looks as if the target is in N/mm: give it in N/m."
        along = f"({', '.join(f'{each:.4g}' for each in direction)})"
        said = f"no admissible tensions give {wanted} N/mm along {along}: the range is "
        super().__init__(f"{said}{least} to {most} N/mm{remedy}")


class InfeasibleDesign(CdsmError):
    """No design that a search tried meets all constraints of its problem.

    ``design`` has the smallest sum of violations, one number for each variable (none if no arm was
    valid); ``constraints`` names what it violates, ``held``: it is not balanced, or unstable.
    """

    def __init__(self, message: str, constraints: Texts, design: Numbers) -> None:
        super().__init__(message)
        self.constraints, self.design = tuple(constraints), tuple(design)


def _distinct(values: Numbers) -> list[str]:
    """Return numbers as text, with more than four digits where different ones would look alike."""
    for digits in (4, 6, 8, 12):
        texts = [f"{value:.{digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts
