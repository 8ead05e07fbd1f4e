"""Compute the experiments of Section V on a prototype with given parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm import presets
from cdsm.errors import SingularStiffness
from cdsm.manipulator import Manipulator
from cdsm.paper.claims import floats
from cdsm.paper.section_v import CHECK, DROPS, HYBRID, POSTURE, RISES, TENSIONS
from cdsm.posture import Posture
from cdsm.statics.weight_test import weight_test
from cdsm.stiffness_matrix import stiffness
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

_RIGID = LinearElasticity(1e9).scaled(
    1e3
)  # the series stiffness is the whole stiffness of a hybrid cable


@final
@dataclass(frozen=True, kw_only=True)
class Prototype:
    """Parameters of the prototype of Section V that the paper does not state.

    The first cable of each pair is position-controlled, the second one force-controlled.

    Attributes:
        link_length: Length of the links between the joints [m].
        tool_length: Distance from the last joint to the weights [m].
        hole_radius: R: distance of the holes from the arm's axis [m].
        lead: Lead (the straight cable between its actuator and the base disk) of all cables [m].
        link_mass: Mass of every link [kg].
        drive_stiffness: Stiffness of the drive in series with every strand [N/m].
        tension_offset: Actual minus reported tension of the force-controlled cables [N].
        angle_1: Joint angle 1 of the second configuration of Figs. 12 and 13 [rad]. The first
            configuration is assumed to be the posture of Table II.
        angle_2: Joint angle 2 of the second configuration [rad].
        angle_3: Joint angle 3 of the second configuration [rad].
        spring_ratio: Stiffest divided by softest stiffness of the hybrid cables (strand and spring)
            [-]; Fig. 11 gives no numbers.
        hybrid_tension: Tension in Fig. 13 and in the accuracy check [N]. We assume that the
            check uses the hybrid cables of 1.89 N/mm.
        highest_hybrid_tension: Highest tension in Fig. 12 [N]; the lowest is 3 N, as in Table II.
        disk_ratio: Disk offset divided by hole radius [-]. If it is tan 15°, disks touch at ±30°,
            the stated joint limit.
        level_2: Tension of row 2 of Table II [N]. Row 1 is at 3 N, row 5 at 86 N.
        level_3: Tension of row 3 of Table II [N].
        level_4: Tension of row 4 of Table II [N].
        weight_x: Force of the weight in tests along x of Table II [N]; 0: an infinitesimal weight.
        weight_y: Force of the weight in tests along y [N].
        weight_z: Force of the weight in tests along z, which acts along −z [N].
    """

    link_length: float
    tool_length: float
    hole_radius: float
    lead: float
    link_mass: float
    drive_stiffness: float
    tension_offset: float
    angle_1: float
    angle_2: float
    angle_3: float
    spring_ratio: float
    hybrid_tension: float
    highest_hybrid_tension: float
    disk_ratio: float
    level_2: float
    level_3: float
    level_4: float
    weight_x: float
    weight_y: float
    weight_z: float

    @property
    def levels(self) -> Array:
        """Reported tensions of the rows of Table II (5,) [N]."""
        return np.array([TENSIONS[0], self.level_2, self.level_3, self.level_4, TENSIONS[-1]])

    @property
    def weights(self) -> Array:
        """Forces of the weights in the tests of Table II (3, 3) [N]: rows for tests in x, y, z."""
        return np.diag([self.weight_x, self.weight_y, -self.weight_z])

    @property
    def configurations(self) -> tuple[Array, Array]:
        """Joint angles (3,) of the two configurations of Figs. 12 and 13 [rad]."""
        return POSTURE, np.array([self.angle_1, self.angle_2, self.angle_3])

    def arm(self, cable_stiffness: float | None = None) -> Manipulator:
        """Build the arm with the strand, or with hybrid cables of ``cable_stiffness`` [N/m].

        Raises GeometryError if the dimensions are invalid.
        """
        if cable_stiffness is None:
            return arm_of(self, presets.STRAND_1X19, self.drive_stiffness)
        return arm_of(self, _RIGID, cable_stiffness)

    def measure(self, pose: Posture, tensions: ArrayLike) -> Array:
        """Compute the stiffness for a small weight along x, y, z (N, 3) [N/m].

        ``tensions`` are N reported tensions of the force-controlled cables [N].

        Raises:
            CdsmError: No tensions of the position-controlled cables balance the arm, a tension
                leaves the domain of its law, or the arm is unstable.
        """
        return self._measured(pose, tensions, np.zeros((3, 3)))

    def weigh(self, pose: Posture, tensions: ArrayLike) -> Array:
        """Compute weight/displacement along x, y, z (N, 3) [N/m] under the :attr:`weights`.

        Argument and errors are those of :meth:`measure`.
        """
        return self._measured(pose, tensions, self.weights)

    def _measured(self, pose: Posture, tensions: ArrayLike, weights: Array) -> Array:
        """Compute stiffness (N, 3) [N/m] in x, y, z at N reported tensions [N].

        Row 0, 1, 2 of ``weights`` (3, 3) [N] is the force of the test in x, y, z. The stiffness is
        force/displacement under this force; if the force is zero, the limit for small forces.
        """
        forced = [cable.name for cable in pose.arm.cables if cable.control == "force"]
        rows = []
        for tension in np.atleast_1d(np.asarray(tensions, dtype=np.float64)).tolist():
            fixed = dict.fromkeys(forced, tension + self.tension_offset)
            K = stiffness(pose, distribute_tension(pose, fixed=fixed))
            if not K.is_stable:
                raise SingularStiffness(
                    f"the arm buckles at {tension:g} N: its smallest stiffness is "
                    f"{K.margin:.3g} N m/rad. Lower the tension, or take stiffer cables.",
                    K.critical_direction,
                )
            rows.append(
                [
                    weight_test(pose, K.tension, force).stiffness if force.any() else K.along(axis)
                    for axis, force in zip(np.eye(3), weights, strict=True)
                ]
            )
        return np.array(rows)

    def predict(self, table_alone: bool = False) -> Predicted:
        """Predict the numbers of Section V, or those of Table II alone.

        Raises the errors of :meth:`measure`.
        """
        table = self.weigh(self.arm().at(POSTURE), self.levels)
        if table_alone:
            return Predicted(table=frozen(table))
        soft, stiff = self.arm(HYBRID), self.arm(HYBRID * self.spring_ratio)
        tensions = [TENSIONS[0], self.hybrid_tension, self.highest_hybrid_tension]
        measured = np.array(
            [
                [*self.measure(soft.at(q), tensions), *self.measure(stiff.at(q), tensions[1])]
                for q in self.configurations
            ]
        )
        low, middle, high, stiffest = measured[:, :, 1].T
        return Predicted(
            table=frozen(table),
            drops=floats(1.0 - high / low),
            rises=floats(stiffest / middle - 1.0),
            check=float(measured[0, 1, 2]),
        )


def arm_of(
    one: Prototype, law: Elasticity, series_stiffness: float, friction: float = 0.0
) -> Manipulator:
    """Build the arm of a prototype; each cable has the ``law`` and a spring [N/m] in series."""
    return presets.experimental_prototype(
        law,
        series_stiffness=series_stiffness,
        link_length=one.link_length,
        tool_length=one.tool_length,
        hole_radius=one.hole_radius,
        disk_offset=one.hole_radius * one.disk_ratio,
        lead=one.lead,
        link_mass=one.link_mass,
        friction=friction,
    )


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Predicted:
    """Predictions of the 20 numbers that Section V prints, or only of the 15 of Table II."""

    table: Array  # Table II (5, 3) [N/m]
    drops: tuple[float, ...] = ()  # reductions of Fig. 12 (2,) [-], or empty
    rises: tuple[float, ...] = ()  # increments of Fig. 13 (2,) [-], or empty
    check: float | None = None  # stiffness in z of Section V-B [N/m], or None

    def residuals(self, table: Array) -> Array:
        """Compute the residuals of the predictions (20,) [-], or (15,) for Table II alone.

        They are ln(model/paper) for a stiffness, (model − paper)/paper for a drop or a rise.
        ``table`` (5, 3) [N/m] is the paper's Table II, perhaps with x and y exchanged.
        """
        of_table = np.log(self.table / table).ravel()
        if self.check is None:
            return np.asarray(of_table)
        return np.concatenate(
            [
                of_table,
                np.divide(self.drops, DROPS) - 1.0,
                np.divide(self.rises, RISES) - 1.0,
                [math.log(self.check / CHECK)],
            ]
        )
