"""Check the arguments of an uncertainty budget or a Monte Carlo run."""

from __future__ import annotations

from typing import get_args

from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.directions import unit_direction
from cdsm.support.validation import instance, one_of
from cdsm.tension import Tension
from cdsm.tolerances import Tolerances
from cdsm.uncertainties.readings import Question, Reading

READINGS = get_args(Reading)
"""Names of all readings."""


def chosen_tolerances(pose: Posture, tolerances: Tolerances | None) -> Tolerances:
    """Return ``tolerances`` or, if None, the arm's own; raise InvalidInput if it has none."""
    if tolerances is not None:
        return instance("tolerances", tolerances, Tolerances)
    own = instance("pose", pose, Posture).arm.tolerances
    if not own.given:
        raise InvalidInput(
            "tolerances",
            "none given, and the arm has none; give Tolerances(rigidity=0.05, …), or a table "
            "[tolerances] in its file.",
        )
    return own


def checked_question(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: ArrayLike | None,
    of: Reading,
    cable: str | None,
    wrench: ArrayLike | None,
) -> Question:
    """Check the arguments of :func:`uncertainty`; return the reading they describe."""
    one_of("reading", of, READINGS)
    K = stiffness(pose, tension, wrench)
    for name, value, wanted in (
        ("direction", direction, of in ("along", "tip")),
        ("cable", cable, of == "tension"),
    ):
        if (value is not None) != wanted:
            raise InvalidInput(
                name, f"is needed for {of}." if wanted else f"has no meaning for {of}."
            )
    if of == "tension":
        instance("tension", tension, Tension)
    u = None if direction is None else unit_direction("direction", direction)
    names = pose.arm.cables.names
    index = None if cable is None else names.index(one_of("cable", cable, names))
    return Question(of, K, u, index)
