"""What defines an arm."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

from cdsm.errors import InvalidInput, listed
from cdsm.support.values import Array

TERMS_OF_K = ("active", "passive", "gravity", "load", "springs")
"""Names of the terms of K_θ that every arm has, in the order of Eq. 16."""

RESERVED = ("joint", "batch")
"""Names of rows of a report that are no terms."""


class Term(Protocol):
    """A term of the energy U(θ) of an arm; :mod:`cdsm.terms` has those of this library.

    A class of your own needs no base class. ``pose`` is the :class:`~cdsm.Posture`, which this
    module is below.
    """

    @property
    def name(self) -> str:
        """Its name in tables, exports and reports."""

    def energy(self, pose: Any) -> float:
        """Compute U [J], up to a constant."""

    def torque(self, pose: Any) -> Array:
        """Compute ∂U/∂θ (nv,) [N m]."""

    def stiffness(self, pose: Any) -> Array:
        """Compute ∂²U/∂θ² (nv, nv) [N m/rad]."""


def checked_terms(terms: object) -> tuple[Term, ...]:
    """Return further terms of an arm; InvalidInput if one is no term, or its name is in use."""
    if not isinstance(terms, (list, tuple)):
        raise InvalidInput("terms", f"{terms!r} given; give a list of terms.")
    names = [*TERMS_OF_K, *RESERVED]
    for term in terms:
        methods = ("energy", "torque", "stiffness")
        lacking = [name for name in methods if not callable(getattr(term, name, None))]
        name = getattr(term, "name", None)
        if lacking or not isinstance(name, str) or not name:
            raise InvalidInput(
                "terms",
                f"{term!r} is no term: it needs the methods energy, torque and stiffness, and a "
                "name; see cdsm.terms.",
            )
        if name in names:
            raise InvalidInput("terms", f"the name {name!r} is in use; give the term another one.")
        names.append(name)
    return tuple(terms)


def refuse_terms(terms: Iterable[Term], why: str, argument: str = "arm") -> None:
    """Raise InvalidInput if there are any terms; ``why`` comes before their names."""
    if names := [term.name for term in terms]:
        raise InvalidInput(argument, f"{why} {listed(names)}.")
