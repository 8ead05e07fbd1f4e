"""Proved bounds of the tip positions and tensions at which an arm with friction can rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import ElasticityRangeError, SolverError
from cdsm.friction.neighbourhood import Neighbourhood
from cdsm.friction.remainders import Bends
from cdsm.friction.rest_states import RestStates
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.instability import verdict
from cdsm.stiffness_matrix.sticking import holding
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import coordinates
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension

_ROOM = 1.1
"""First :attr:`RestBand.room`; a neighbourhood that is too small grows by this factor."""

_WIDENINGS = 8  # largest number of neighbourhoods that are tried; then the band is not proved
_INSIDE = 0.999  # a band that reaches this part of its neighbourhood needs a larger neighbourhood


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class RestBand(ReadOnlyState):
    """Range of tip positions at which an arm with locked motors may rest, after any earlier loads.

    The reference is the posture of ``stiffness``, with one tension in all segments of each cable. A
    state of rest is an equilibrium that friction allows. If ``proved`` is True, ``low`` and
    ``high`` bound all states of rest in a neighbourhood of the reference. This neighbourhood is the
    set of all states that are at rest to first order, scaled by ``room``. The bounds ``tensions``,
    ``end_tensions`` and ``loads`` also hold in this neighbourhood; reading them raises SolverError
    or ElasticityRangeError if they cannot be proved. A simulation may come near to the bounds, but
    never exceeds them.

    Attributes:
        stiffness: Frictionless K of the reference, with its posture, tensions and wrench.
        direction: Unit direction u (3,) of the displacement, base axes.
        low: Least displacement of the tip from the reference along u [m], not positive.
        high: Largest displacement of the tip from the reference along u [m], not negative.
        first_order: Largest displacement along ±u to first order [m], in closed form.
        room: Size of the neighbourhood, divided by the size of the set of all states at rest to
            first order [-]; 0 if no cable can stick at the reference, which is then the only state
            of rest.
        proved: Whether ``low`` and ``high`` are proved. False if no neighbourhood is large enough,
            because second-order terms are as large as the band. Then both hold to first order only,
            and the tip may rest a few percent beyond them. The paper's arm with a lead of 0.3 m is
            proved while friction turns no joint by more than 0.7°: with Eq. 19 from 30 to 80 N at μ
            = 0.1 and from 15 to 120 N at μ = 0.05, and with EA = 48 kN up to μ = 0.3 at 50 N.
    """

    stiffness: Stiffness
    direction: Array
    low: float
    high: float
    first_order: float
    room: float
    proved: bool = True

    def __repr__(self) -> str:
        return f"<RestBand {1e3 * self.low:.4g} to {1e3 * self.high:.4g} mm>"

    def __str__(self) -> str:
        said = (
            f"at rest from {1e3 * self.low:.4g} to {1e3 * self.high:.4g} mm along "
            f"{coordinates(self.direction)}, whatever came before"
        )
        said = said if self.proved else f"{said} (to first order, not proved)"
        return said if self.stiffness.is_stable else f"{verdict(self.stiffness)}\n{said}"

    @cached_property
    def tensions(self) -> Array:
        """Least and largest tension (S, 2) [N] of each segment over all states of rest.

        The computation takes a few milliseconds per segment.
        """
        return self._tensions(range(len(self.stiffness.posture.segments.lengths)))

    @cached_property
    def end_tensions(self) -> Array:
        """Least and largest tension (C, 2) [N] of each cable's last segment, in any state of rest.

        The last segment is the one farthest from the motor.
        """
        start = self.stiffness.posture.segments.chains.start
        return self._tensions((start[1:] - 1).tolist())

    @cached_property
    def loads(self) -> Array:
        """Least and largest force along u (2,) [N] under which the reference may stay at rest.

        These forces add to the wrench of the reference. For each force between them, tensions that
        friction allows balance the arm at exactly the angles of the reference.
        """
        if self.room == 0.0:
            return frozen(np.zeros(2))
        near = Neighbourhood(self.stiffness, self.room)
        states = RestStates(self.stiffness, near.still(self.stiffness), Bends(self.stiffness))
        return frozen(np.array([-states.load(-self.direction), states.load(self.direction)]))

    def _tensions(self, segments: Sequence[int]) -> Array:
        K = self.stiffness
        if self.room == 0.0:
            cable = K.posture.segments.chains.cable
            return frozen(np.repeat(K.tension[cable[list(segments)]][:, None], 2, axis=1))
        return RestStates(K, Neighbourhood(K, self.room), Bends(K)).tensions(segments)


def rest_band(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: ArrayLike | None = None,
) -> RestBand:
    """Compute between which points along a direction the tip may rest, whatever loads came before.

    The reference is the posture with the given tension in all segments of each cable. There the
    position-controlled motors are locked; force-controlled motors hold the tension. Any other loads
    may have acted before ``wrench``. Linear programs prove the band, unless
    :attr:`RestBand.proved` is False: they include bounds for the errors of linearising geometry and
    laws.

    Args:
        pose: The posture of the reference.
        tension: A :class:`~cdsm.Tension` or your own tensions (C,) [N], as for
            :func:`~cdsm.stiffness`. A residual torque is kept as a constant load.
        direction: u (3,) in base axes, any length, or an axis such as ``"-z"``.
        wrench: W (6,) at ``tool0`` in base axes, the load that acts now: force [N], then moment
            [N m]; only with your own tensions.

    Raises:
        InvalidInput: An argument is invalid for :func:`~cdsm.stiffness`, or ``direction`` is not a
            direction.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
        SingularStiffness: K_θ is singular.
    """
    K = stiffness(pose, tension, wrench)
    u = unit_direction("direction", direction)
    band = partial(RestBand, stiffness=K, direction=u)
    if not holding(pose).any():  # one state of rest
        return band(low=0.0, high=0.0, first_order=0.0, room=0.0)
    room, near, bends = _ROOM, Neighbourhood(K, _ROOM), Bends(K)
    half = float(near.largest(u @ pose.jacobian[:3])) / room
    for _ in range(_WIDENINGS):
        try:
            states = RestStates(K, near, bends)
            low = states.displacement(-u)
            high = states.displacement(u) if low.reach <= _INSIDE else low
        except (ElasticityRangeError, SolverError):  # too far for the law, or for the sites
            break
        if high.reach <= _INSIDE:
            return band(low=-low.bound, high=high.bound, first_order=half, room=room)
        room *= _ROOM
        near = Neighbourhood(K, room)
    return band(low=-half, high=half, first_order=half, room=_ROOM, proved=False)
