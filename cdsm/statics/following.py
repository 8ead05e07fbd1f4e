"""Follow the stable equilibria of an arm with locked motors while its load changes."""

from __future__ import annotations

import math

import numpy as np

from cdsm.errors import CableError, EquilibriumError
from cdsm.statics.equilibrium import Equilibrium, eigenvalues
from cdsm.statics.locked_motors import Iterate, LoadedArm
from cdsm.statics.rest_search import settled
from cdsm.statics.trust_region import RestSearch, find_rest
from cdsm.support.values import Array, frozen

_FAR = 0.1  # largest joint motion [rad] from one equilibrium to the next in :func:`follow`

_DENSE = 0.02
"""Distance [rad] between two postures of a path at which stability is checked.

An unstable part of the path that is shorter may be missed.
"""

_FINEST = 2.0**-12  # relative precision of a buckling load
_SLIGHT = 1e-9  # below this part of the load the precision is absolute: this part times _FINEST


def follow_load(
    before: Equilibrium, wrench: Array, added: Array, reached: float, goal: float
) -> Equilibrium:
    """Follow the equilibrium of an arm while its load wrench + λ · added grows; return the last.

    λ grows from ``reached``, where the equilibrium is ``before``, to ``goal``. ``wrench`` and
    ``added`` are (6,): force [N], then moment [N m]. Raises EquilibriumError if the arm buckles.
    """
    step = goal - reached
    while reached < goal:
        part = min(goal, reached + step)
        after = follow(before, frozen(wrench + part * added))
        if after is not None:
            before, reached, step = after, part, 2.0 * step
        elif step > _FINEST * max(reached, _SLIGHT):
            step /= 2.0
        else:
            mode = before.stiffness.critical_direction
            joint = before.pose.arm.joint_names[int(abs(mode).argmax())]
            raise EquilibriumError(
                f"the arm buckles at {100.0 * reached:.4g} % of the load, under "
                f"{reached * float(np.linalg.norm(added)):.4g} N: {joint} buckles",
                residual=before.residual,
                load_factor=reached,
                joint=joint,
            )
    return before


def follow(before: Equilibrium, wrench: Array, start: Array | None = None) -> Equilibrium | None:
    """Find the equilibrium that the arm reaches from ``before`` if the load becomes ``wrench``.

    ``wrench`` is (6,): force [N], then moment [N m]. The search starts at the joint angles
    ``start`` (nv,) [rad], by default at those of ``before``. Returns None if it finds no path of
    stable postures to an equilibrium; with a smaller change of the wrench it may find one. Raises
    the errors of :func:`~cdsm.equilibrium`.
    """
    loaded = LoadedArm(before.reference, before.reference_tension, wrench)
    iterate = loaded.at(before.pose, before.tension)
    if start is not None:
        try:
            iterate = loaded.moved(start, iterate)
        except CableError:
            return None
    search = find_rest(loaded, iterate)
    if not (search.converged and search.convex and _is_stable_between(loaded, iterate, search)):
        return None
    return settled(loaded, search)


def _is_stable_between(loaded: LoadedArm, start: Iterate, search: RestSearch[Iterate]) -> bool:
    """Return whether the motion from ``start`` to the result of ``search`` is short and stable.

    Short: no joint moves by more than 0.1 rad. Stable: K_θ of the joints off their stops is
    positive definite at points along the straight path of joint angles. If it is not, the arm snaps
    through there, though the search may have stepped over the unstable postures.
    """
    path = search.state.pose.q - start.pose.q
    length = float(abs(path).max())
    if length > _FAR:
        return False
    free = np.flatnonzero(~search.at_stop)
    for part in np.arange(_DENSE, length, _DENSE) / max(length, _DENSE):
        try:
            K = loaded.moved(start.pose.q + part * path, start).stiffness
        except CableError:
            return False
        if eigenvalues(K, free).min(initial=math.inf) <= 0.0:
            return False
    return True
