"""All errors of the library, each one a subclass of :class:`CdsmError`, and its warnings.

An error stores its data as attributes; its message names the fault, the allowed values and the
remedy.
"""

from __future__ import annotations

import difflib
import importlib
import math
import sys
import warnings
from typing import TYPE_CHECKING

from cdsm.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Texts = Sequence[str]
    Numbers = Sequence[float]

LINES = "\n  - "  # separator of listed that puts each text on a line of its own


def listed(texts: Texts, most: int = 4, between: str = ", ") -> str:
    """Join the first ``most`` texts, and count the others: ``a, b, and 3 more``."""
    more = f"{between}and {len(texts) - most} more" if len(texts) > most else ""
    return f"{between if between == LINES else ''}{between.join(texts[:most])}{more}"


class CdsmError(Exception):
    """Base class of all errors raised by cdsm.

    ``status`` is the member of :class:`~cdsm.Status` for its cause, which a batch has in its place.

    Example:
        >>> import cdsm
        >>> try:
        ...     cdsm.presets.virtual_prototype().at([0.1] * 9)
        ... except cdsm.CdsmError as error:
        ...     print(type(error).__name__)
        InvalidInput
    """

    status: Status = Status.FAILED

    def __init__(self, message: str = "", status: Status | None = None) -> None:
        super().__init__(message)
        if status is not None:
            self.status = status

    def __reduce__(self) -> tuple[object, ...]:
        # Exception would call the constructor with the message alone
        return type(self).__new__, (type(self),), {"args": self.args, **self.__dict__}


def solver_failed(solver: str, problem: str) -> CdsmError:
    """Return the error for a ``solver`` whose result is not the optimum."""
    return CdsmError(f"solver {solver!r} {problem}", Status.SOLVER_FAILED)


class CdsmWarning(UserWarning):
    """Class of all warnings of cdsm: an input is possible, but probably not intended."""


class InvalidInput(CdsmError, ValueError):
    """An argument, a cable or a thing called ``name`` with a wrong type, shape or value."""

    status = Status.INVALID_INPUT

    def __init__(self, name: str, problem: str, status: Status | None = None) -> None:
        super().__init__(f"{name}: {problem}", status)
        self.name = name


def did_you_mean(name: str, known: Iterable[str], most: int = 1, least: float = 0.6) -> str:
    """Return ``; did you mean 'a' or 'b'?`` with up to ``most`` known names similar to ``name``.

    The text is empty if no similarity, from 0 to 1, reaches ``least``.
    """
    near = difflib.get_close_matches(name, [other for other in known if other != name], most, least)
    return f"; did you mean {' or '.join(map(repr, near))}?" if near else ""


def unknown(
    kind: str, name: object, known: Iterable[str], remedy: str = "", meant: Sequence[str] = ()
) -> InvalidInput:
    """Return the error for a ``kind``, e.g. a link, called ``name`` that is not among ``known``.

    ``meant`` are known names that fit it better than those that are spelled alike.
    """
    known = tuple(known)
    fitting = f"; did you mean {' or '.join(map(repr, meant[:3]))}?" if meant else ""
    hint = fitting or did_you_mean(str(name), known, 3) or "."
    error = InvalidInput(kind, "unknown")
    message = f"no {kind} is called {name!r}{hint} Known: {listed(known, 12)}. {remedy}"
    error.args = (message.rstrip(),)
    return error


class FileError(CdsmError, OSError):
    """A file at ``path`` that cannot be read or written."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = str(path)


class GeometryError(CdsmError, ValueError):
    """The faults of a record (geometry, tolerances, wire, design problem), or of a URDF as a text.

    ``faults`` has a sentence for each; ``source`` is the file of the record, or None.
    """

    status = Status.INVALID_INPUT

    def __init__(self, faults: Texts | str, source: str | None = None) -> None:
        self.faults = (faults,) if isinstance(faults, str) else tuple(faults)
        self.source = source
        message = f"invalid geometry:{listed(self.faults, 20, LINES)}"
        message = faults if isinstance(faults, str) else message
        super().__init__(f"{source}: {message}" if source else message)


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined; ``problem`` is the fault as text.

    ``tension`` are the invalid tensions [N], none if no tension gives a strain or an elongation;
    ``indices`` those of the invalid entries of the input; ``cables`` the names, as far as known.
    """

    status = Status.OUTSIDE_ELASTICITY

    def __init__(
        self, problem: str, tension: Numbers = (), indices: Sequence[int] = (), cables: Texts = ()
    ) -> None:
        self.problem = problem
        self.cables = tuple(cables)
        self.tension = tuple(map(float, tension))
        self.indices = tuple(map(int, indices))
        where = f"cable {listed(self.cables)}" if cables else ""
        if self.tension:
            values = f"tension {listed([f'{text} N' for text in _distinct(self.tension)])}"
            where = f"{values} ({where})" if where else values
        super().__init__(": ".join(filter(None, (where, problem))))


class InfeasibleTension(CdsmError):
    """No cable tension within the bounds balances the arm at this posture.

    ``missing`` (nv,) [N m] or [N] is what the tensions within the bounds that minimise `Σ|missing|`
    leave, and ``joint`` the name of the joint with most of it. Of the cables without a fixed
    tension, ``binding`` names those at a bound then, and ``relaxation`` [N] is the least widening
    of all bounds that helps, or inf. ``fixed`` names the cables if their fixed tensions prevent it.
    ``hint`` and ``cause`` become part of the message.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.3] * 10)
        >>> try:
        ...     cdsm.distribute_tension(pose, minimum=5.0, maximum=20.0)
        ... except cdsm.InfeasibleTension as error:
        ...     print(error.joint)
        joint1_2
    """

    status = Status.INFEASIBLE

    def __init__(
        self,
        missing: NDArray[np.float64],
        joint: str,
        relaxation: float,
        binding: Texts,
        units: Texts = (),
        names: Texts = (),
        fixed: Texts = (),
        hint: str = "",
        cause: str = "",
    ) -> None:
        self.missing = missing
        self.joint = joint
        self.relaxation = relaxation
        self.binding = tuple(binding)
        self.fixed = tuple(fixed)
        if fixed:
            advice = f"Beside the fixed tensions no bounds help: change or free {', '.join(fixed)}."
        elif relaxation == math.inf:
            advice = f"No bounds would help: the cables cannot exert this torque at all. {hint}"
            advice += "Change the posture, the load, or the routing, or, in Python, look at "
            advice += "pose.moment_arms."
        else:
            step = 10.0 ** (math.floor(math.log10(relaxation or 1.0)) - 3)
            wider = math.ceil(relaxation / step) * step
            at = ", ".join(binding) or "none"
            advice = f"{cause}Widening every bound by {wider:.4g} N would be enough (cables at a "
            advice += f"bound: {at}). Reduce the load{hint and f', or {hint}'}."
        if len({*units}) > 1:  # torques and forces have no sum
            order = sorted(range(len(units)), key=lambda j: (names[j] != joint, -abs(missing[j])))
            lacks = [j for j in order if abs(missing[j]) > 1e-9 * abs(missing).max()]
            parts = [f"{abs(missing[j]):.4g} {units[j]} at {names[j]}" for j in lacks]
            message = f"missing are {listed(parts)}. {advice}"
        else:
            unit = units[0] if units else "N m"
            most = f"largest at {joint} ({abs(missing).max():.4g} {unit})"
            message = f"torque deficit {abs(missing).sum():.4g} {unit}, {most}. {advice}"
        super().__init__(f"no tension within the bounds balances the arm: {message}")


class SingularStiffness(CdsmError, ArithmeticError):
    """A stiffness, compliance or mass matrix that is singular at this posture.

    ``direction`` is the joint motion (nv,) with the least stiffness or without mass,
    or the direction (3,) in base axes in which the tip cannot move; of unit length.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> try:
        ...     cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0)).spatial()
        ... except cdsm.SingularStiffness as error:
        ...     print(str(error)[:30])
        the tip has 5 of 6 motions, so
    """

    status = Status.SINGULAR

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class EquilibriumError(CdsmError, ArithmeticError):
    """A loaded arm that has no equilibrium, or that buckles before the full load.

    ``residual`` (nv,) [N m] or [N] is the torque left at the last iterate, ``load_factor`` [-] the
    largest fraction of the load in equilibrium, ``joint`` the one with the largest residual or that
    buckles first; ``problem`` is the message without the remedy.
    """

    status = Status.NO_EQUILIBRIUM

    def __init__(
        self,
        problem: str,
        residual: NDArray[np.float64],
        load_factor: float,
        joint: str,
        remedy: str = "",
    ) -> None:
        usual = "Reduce the load, raise the tensions, or take stiffer cables or springs."
        super().__init__(f"{problem}. {remedy or usual}")
        self.problem = problem
        self.residual = residual
        self.load_factor = load_factor
        self.joint = joint


class UnreachableStiffness(CdsmError):
    """A stiffness ``target`` [N/m] along ``direction`` that no admissible cable tensions give.

    ``low`` and ``high`` (or inf) [N/m] are the ends of the range, ``nearest`` the end next to the
    target, or the values that were found below and above it. ``hint``, which may say how to widen
    the range, becomes part of the message.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> try:
        ...     cdsm.plan_stiffness(pose, "z", 1e6, minimum=5.0, maximum=100.0)
        ... except cdsm.UnreachableStiffness as error:
        ...     print(f"{1e-3 * error.low:.2f} to {1e-3 * error.high:.1f} N/mm")
        2.10 to 61.2 N/mm
    """

    status = Status.UNREACHABLE_STIFFNESS

    def __init__(
        self,
        direction: NDArray[np.float64],
        target: float,
        low: float,
        high: float,
        nearest: Numbers,
        hint: str = "",
    ) -> None:
        self.direction = direction
        self.target = target
        self.low = low
        self.high = high
        self.nearest = tuple(map(float, nearest))
        wanted, least, most, *near = _distinct([x / 1e3 for x in (target, low, high, *nearest)])
        if low <= target <= high:
            remedy = f", but only {' and '.join(near)} N/mm found. Ask for one of these."
        else:
            remedy = f". Ask for one within it, {hint and f'{hint}, '}or change the load, posture "
            remedy += "or cables."
            if low <= 1e3 * target <= high:
                remedy += " It looks as if the target is in N/mm: give it in N/m."
        along = f"({', '.join(f'{component:.4g}' for component in direction)})"
        message = f"no admissible tensions give {wanted} N/mm along {along}: the range is "
        super().__init__(f"{message}{least} to {most} N/mm{remedy}")


def _distinct(values: Numbers) -> list[str]:
    """Return numbers as text, with more than four digits where different ones would look alike."""
    for digits in (4, 6, 8, 12):
        texts = [f"{value:.{digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts


_OURS = {"cdsm", "pydantic", "dataclasses", "contextlib"}


def warn(message: str) -> None:
    """Issue a :class:`CdsmWarning` that names the line of the first caller outside cdsm."""
    level = 1
    frame = sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _OURS:
        level = level + 1
        frame = frame.f_back
    warnings.warn(message, CdsmWarning, stacklevel=level + 1)


def need(extra: str, *packages: str) -> None:
    """Raise :class:`~cdsm.CdsmError` if one of the ``packages`` of ``extra`` is missing."""
    for package in packages:
        try:
            importlib.import_module(package)
        except ImportError:
            install = f"{sys.executable} -m pip install -e '.[{extra}]'"
            raise CdsmError(f"{package} is missing; run {install} in cdsm's clone.") from None
