"""Many arms with random errors within the tolerances: their stiffnesses and balancing tensions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from cdsm._former.arm_arrays import kernel_arrays
from cdsm._former.distribution import OPTIMAL, search_tensions
from cdsm._former.draws import stiffness_of_draws
from cdsm._former.tension import NO_ARM
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array, frozen
from cdsm.uncertainties.inputs import inputs_of


class Drawn(NamedTuple):
    """Stiffness, tip and torques of N arms with random errors; see :class:`DrawnArms`."""

    joint: Array  # K_θ (N, nv, nv) [N m/rad]
    tip_rows: Array  # J_v (N, 3, nv) [m/rad]
    tip: Array  # position of the tip (N, 3) [m]
    length_jacobian: Array  # J_L (N, C, nv) [m/rad]
    torque: Array  # J_Xᵀ W − g (N, nv) [N m]


class DrawnArms:
    """N arms that differ from the arm of the stiffness ``K`` by random ``errors`` of their inputs.

    ``errors`` has an array (N, inputs) for each source of uncertainty, such as ``hole_radius``.
    """

    def __init__(self, K: Stiffness, errors: Mapping[str, Array]) -> None:
        pose, inputs = K.posture, inputs_of(K.posture.arm)
        model, springs = kernel_arrays(pose.arm), pose.arm._laws
        self._K, self._count = K, len(next(iter(errors.values())))

        def drawn(source: str, nominal: Array) -> Array:
            values = np.repeat(nominal[None], self._count, axis=0)
            return values + errors[source] if source in errors else values

        self._tension = drawn("tension", K.tension)
        self._scale = 1.0 + errors.get("rigidity", np.zeros((self._count, 1)))
        softer = np.zeros_like(self._tension)
        if "spring" in errors:  # 1/k_series of the drawn springs, less that of the nominal ones
            softer[:, springs.series > 0.0] = 1.0 / (1.0 + errors["spring"]) - 1.0
        self._softer = softer * springs.series
        q, lead = drawn("joint_angle", pose.q), np.array([cable.lead for cable in pose.arm.cables])
        mass = np.repeat(model.masses.mass[None], self._count, axis=0)
        if "link_mass" in errors:
            mass[:, inputs.link_rows] += errors["link_mass"]
        places: tuple[Any, ...] = inputs.places.moved(inputs.displaced(errors))
        self._same: tuple[Any, ...] = (
            *(model.tree, model.routing, model.masses),
            *(inputs.first, springs.series, springs.rest, K.wrench, q),
        )
        self._own: tuple[Any, ...] = (
            *(drawn("lead", lead), mass),
            *(np.ascontiguousarray(place) for place in places),
        )

    def evaluate(self) -> Drawn:
        """Compute stiffness, tip and torques of all N arms under the tensions with their errors."""
        F = self._tension
        rigidity, strain = laws_at(self._K, F)
        locked = self._K.cable_stiffness > 0.0
        stretched = np.where(locked, rigidity * (self._scale + strain), 0.0)  # ε falls as EA rises
        # in k = 1/(l_0/EA + 1/k_series), a spring softer by c equals a wire longer by c·EA
        laws, (lead, *own) = self._K.posture.arm._laws, self._own
        lead = lead + self._softer * (stretched - (F - laws.rest))
        count, (cables, nv) = self._count, self._K.posture.length_jacobian.shape
        found = Drawn(
            joint=np.empty((count, nv, nv)),
            tip_rows=np.empty((count, 3, nv)),
            tip=np.empty((count, 3)),
            length_jacobian=np.empty((count, cables, nv)),
            torque=np.empty((count, nv)),
        )
        arguments: tuple[Any, ...] = (*self._same, F, stretched, lead, *own, *found)
        stiffness_of_draws(*arguments)
        return found

    def distributed(self) -> Array:
        """Compute the least tensions (N, C) [N] that balance the N arms.

        Raises:
            InvalidInput: No tensions balance one of the arms.
        """
        arms, given = self.evaluate(), self._K.distribution
        assert given is not None
        bounds = given.minimum, given.maximum
        low, high = (frozen(np.broadcast_to(x, self._tension.shape).copy()) for x in bounds)
        none = abs(arms.length_jacobian) < NO_ARM * self._K.posture.arm.length
        J, tension = np.where(none, 0.0, arms.length_jacobian), np.empty_like(low)
        outcome = np.empty(len(low), dtype=np.intp)
        search_tensions(J, arms.torque, low, high, tension, outcome)
        if (outcome != OPTIMAL).any():
            raise InvalidInput(
                "tolerances",
                f"no tensions within the bounds balance {np.count_nonzero(outcome != OPTIMAL)} of "
                f"{len(outcome)} drawn arms. Lower the minimum, raise the maximum, or lower the "
                "tolerances.",
            )
        return tension


def margins(joint: Array) -> Array:
    """Compute the smallest eigenvalue (N,) [N m/rad] of the symmetric part of each K_θ.

    ``joint`` (N, nv, nv) are the matrices K_θ.
    """
    return np.asarray(np.linalg.eigvalsh((joint + joint.transpose(0, 2, 1)) / 2.0)[:, 0])


def laws_at(K: Stiffness, tension: Array) -> tuple[Array, Array]:
    """Return EA [N] and strain ε [-] (…, C) of each cable at ``tension`` (…, C) [N].

    The cables are those of the arm of ``K``. ε is 0 if ``original_length`` of this arm is not
    ``"unstrained"``. Raises ElasticityRangeError if a tension is outside the domain of its law.
    """
    arm = K.posture.arm
    laws = arm._laws
    rigidity, strain = np.ones_like(tension), np.zeros_like(tension)
    for law, of in laws.held:
        F = tension[..., of]
        try:
            change, rigidity[..., of] = law.strain_and_rigidity(F)
            if arm.original_length == "unstrained":
                strain[..., of] = change
        except ElasticityRangeError as error:
            low, high = float(F.min()), float(F.max())
            raise ElasticityRangeError(
                f"at tensions from {low:.4g} to {high:.4g} N, which the tolerances reach; the "
                f"elasticity is defined on {law._span}. Raise the tensions, or lower the "
                "tolerances.",
                error.tension,
            ) from None
    return rigidity, strain
