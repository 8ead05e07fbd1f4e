"""What cables do whose motors are locked, as their elasticities tell it, and where that ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cdsm.arm_model import kinks
from cdsm.cable import Cable
from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.validation import Array
from cdsm.wires.laws import TabulatedElasticity

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

ONE_SIDED = 1e-4
"""A tension this part of itself from an end or a kink of its law has a law on one side alone."""

_BESIDE = 1e-6
"""A point of a table this part of a tension beside it is at that tension."""


class LockedLaws:
    """The position-controlled cables of a stiffness, from strain and energy of their laws alone.

    Args:
        K: The stiffness. Its posture, tensions and free lengths are taken from it, and of its
            ``cable_stiffness`` no more than steps.

    Attributes:
        held: Number and cable. One that hangs slack beside its law, as at some equilibria, gives
            nothing when moved and is left out.
        stiffness: K_L (C,) [N/m] as the stiffness has it, to choose steps by; zero for the others.
    """

    def __init__(self, K: Stiffness) -> None:
        self._tension, self._free_length = K.tension, K.free_lengths
        self.held = [
            (c, cable)
            for c, cable in enumerate(K.posture.arm.cables)
            if cable.control == "position" and (K.tension[c] > 0.0 or K.cable_stiffness[c] > 0.0)
        ]
        which = [c for c, _ in self.held]
        self.stiffness = np.zeros(K.tension.size)
        self.stiffness[which] = abs(K.cable_stiffness[which])

    def pulls(self, c: int, cable: Cable, longer: Array) -> Array:
        """Tensions of a cable (P,) [N] that is longer by so much (P,) [m].

        Raises:
            ElasticityRangeError: Its law does not reach that far.
            InvalidInput: Its law fails.
        """
        start, F = self._free_length[c], self._tension[c]
        return asked(
            cable, lambda: cable.tension(float(cable.elongation(F, start)) + longer, start)
        )

    def stored(self, c: int, cable: Cable, longer: Array) -> Array:
        """Energy of such a cable (P,) [J] beyond that of a constant tension.

        Raises:
            ElasticityRangeError: Its law does not reach that far.
            InvalidInput: Its law fails.
        """
        start, F = self._free_length[c], self._tension[c]
        pulls = self.pulls(c, cable, longer)
        more = asked(cable, lambda: cable.energy(pulls, start) - cable.energy(F, start))
        return np.asarray(more - F * longer)

    def room(self, c: int, cable: Cable) -> float:
        """How far its tension may go [N] until its law ends or bends sharply."""
        F, law = float(self._tension[c]), cable.elasticity
        edges = [law.domain.low, law.domain.high, *kinks(law)]
        if isinstance(law, TabulatedElasticity):
            # at its points the rigidity bends; so near to one that no step would be left, the
            # bend stays in the middle, and the differences settle all the same
            edges += [point for point in law.tensions if abs(F - point) > _BESIDE * F]
        return min(abs(F - edge) for edge in edges)

    def one_sided(self) -> list[str]:
        """Why there is no law on both sides of the tensions, cable by cable; mostly nothing."""
        return [reason for c, cable in self.held for reason in self._edges(c, cable)]

    def _edges(self, c: int, cable: Cable) -> list[str]:
        """The ends and kinks of its law that a cable stands at, in words."""
        F, law = float(self._tension[c]), cable.elasticity
        if F == 0.0:
            return [f"{cable.name} is slack (0 N), and K_θ counts it as if it were taut"]
        where, close = f"{cable.name} at {F:.6g} N stands at", ONE_SIDED * F
        ends = {"low": F - law.domain.low, "high": law.domain.high - F}
        said = [
            f"{where} the {end} end of its law {law.domain}" for end in ends if ends[end] <= close
        ]
        said += [
            f"{where} a sharp bend of its tangent rigidity, at {bend:g} N"
            for bend in kinks(law)
            if abs(F - bend) <= close
        ]
        return said


def asked(cable: Cable, answer: Callable[[], Array]) -> Array:
    """What an elasticity answers, which need not be the library's own.

    Raises:
        CdsmError: What it raises, or that it fails or gives no finite numbers.
    """
    try:
        values = np.asarray(answer(), dtype=np.float64)
    except CdsmError:
        raise
    except Exception as error:  # whatever a law of the user's own raises
        raise InvalidInput(
            "elasticity", f"{cable.elasticity!r} of {cable.name} fails: {error!r}."
        ) from error
    if not np.isfinite(values).all():
        raise InvalidInput(
            "elasticity", f"{cable.elasticity!r} of {cable.name} gives numbers that are not finite."
        )
    return values
