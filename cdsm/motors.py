"""Motors that move several cables: a spool of a pair, a drum of twins, coupled spools.

:mod:`cdsm.yielding` has the formulas of those that yield.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, final, get_args

import numpy as np

from cdsm.cable import Cable, Cables
from cdsm.errors import CdsmError, InvalidInput, listed, warn
from cdsm.support.format import aligned, plural
from cdsm.support.validation import (
    WIDEST,
    check_numbers,
    doubts_about_units,
    number,
    one_of,
    scalar,
    sequence_of,
    text,
    within,
)
from cdsm.support.values import Array, Printed, frozen
from cdsm.yielding import Yielding

MotorControl = Literal["position", "torque"]

_RANK = 1e-9  # motors are dependent below this singular value of B with columns of unit length


@final
@dataclass(frozen=True)
class Motor:
    """A motor that moves one cable or several, which then share its torque and its compliance.

    Attributes:
        name: Unique name, not that of a cable.
        cables: Radius [m] of the drum of each cable by the cable's name: wire taken in per turn.
            A negative one lets wire out: ``{"left": 0.012, "right": -0.012}`` is a spool with two
            cables against each other. A cable may hang on several motors.
        stiffness: `k_m` [N m/rad] of gears and servo loop; inf: it holds its angle exactly.
        control: What it keeps constant: ``"position"``: its angle; ``"torque"``: its torque `Bᵀ F`,
            by which it yields to every change of length that leaves its torque.

    Raises InvalidInput, which names the motor and the fault.

    Example:
        >>> import cdsm
        >>> pair = cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": -0.012}, stiffness=20.0)
        >>> arm = cdsm.presets.virtual_prototype().with_motors([pair])
        >>> arm.motors.count, arm.motors.matrix[:3, 0].tolist()
        ('14 motors for 15 cables', [0.012, -0.012, 0.0])
    """

    name: str
    cables: Mapping[str, float]
    stiffness: float = number("spring", math.inf, infinite=True)
    control: MotorControl = "position"

    def __post_init__(self) -> None:
        text("name", self.name)
        try:
            one_of("control", self.control, get_args(MotorControl))
            k: object = self.stiffness
            if self.control == "position" and isinstance(k, (int, float)) and k == 0.0:
                raise CdsmError("stiffness: 0 N m/rad holds no angle; give control='torque'.")
            check_numbers(self)
            if self.control == "torque" and math.isfinite(self.stiffness):
                raise CdsmError(
                    "stiffness: a motor with control='torque' has none; leave one of them out."
                )
            self.__dict__["cables"] = _checked_radii(self.cables)
        except CdsmError as error:
            raise InvalidInput(f"motor {self.name!r}", str(error)) from None
        drums = [
            (f"the drum of {cable} on motor {self.name!r}", abs(radius), WIDEST)
            for cable, radius in self.cables.items()
        ]
        for doubt in doubts_about_units(0.0, drums):
            warn(doubt)

    def __hash__(self) -> int:
        return hash((self.name, self.stiffness, self.control, *self.cables.items()))

    @property
    def yields(self) -> bool:
        """Whether it turns as its torque changes: it is compliant, or holds a torque."""
        return self.control == "torque" or math.isfinite(self.stiffness)

    def can_give(self, torque: float) -> bool:
        """Whether cables that only pull have the torque `Bᵀ F` [N m] under any tensions."""
        return any(torque * radius >= 0.0 for radius in self.cables.values())

    def __str__(self) -> str:
        return f"{self.name} ({_radii(self)}): {self.holds}"

    @property
    def holds(self) -> str:
        """What it holds, in words: its angle, with which stiffness, or its torque."""
        if self.control == "torque":
            return "holds its torque"
        if math.isinf(self.stiffness):
            return "holds its angle"
        return f"holds its angle by {self.stiffness:.4g} N m/rad"


def _radii(motor: Motor) -> str:
    """Return its cables with their radii, in words."""
    return ", ".join(f"{cable} {1e3 * r:+.4g} mm" for cable, r in motor.cables.items())


def _checked_radii(cables: object) -> dict[str, float]:
    if not isinstance(cables, Mapping):
        raise CdsmError(f"cables: {cables!r} given; give a dict of radii [m] by cable.")
    if not cables:
        raise CdsmError("cables: none given; a motor moves one cable or more.")
    radii: dict[str, float] = {}
    for cable, value in cables.items():
        name = f"radius of {text('cable', cable)}"
        radius = scalar(name, value)
        if radius == 0.0:
            raise CdsmError(f"{name}: 0 m takes in no wire; leave the cable out.")
        if problem := within("length", abs(radius)):
            raise CdsmError(f"{name}: {problem}.")
        radii[cable] = radius
    return radii


def checked_motors(motors: Motor | Sequence[Motor], cables: Cables) -> tuple[Motor, ...]:
    """Return motors of these cables; InvalidInput if one does not fit them, or repeats others."""
    several = sequence_of("motors", [motors] if isinstance(motors, Motor) else motors, Motor)
    names = Counter([motor.name for motor in several])
    for motor in several:
        if names[motor.name] > 1:
            where = f"motor {motor.name!r}"
            raise InvalidInput(where, "the name is used twice; every motor needs its own.")
        require_cables(motor, cables)
    Motors(several, cables).require_independent()
    return several


def require_cables(motor: Motor, cables: Cables) -> None:
    """Raise InvalidInput if a motor moves a cable that does not exist, or controls force."""
    where = f"motor {motor.name!r}"
    if motor.name in cables.names:
        raise InvalidInput(where, "is the name of a cable; give the motor another one.")
    for name in motor.cables:
        one_of(f"cable of {where}", name, cables.names)
        _require_plain(where, cables[name])


def _require_plain(where: str, cable: Cable) -> None:
    """Refuse what belongs to the motor, but is set at one of its cables."""
    if cable.control == "force":
        problem = f"{cable.name} has control='force', which belongs to its motor: "
        raise InvalidInput(where, f"{problem}give the motor control='torque'.")
    if cable.gain != 1.0:
        problem = f"{cable.name} has gain = {cable.gain:g}, which belongs to its motor: "
        raise InvalidInput(where, f"{problem}change the radius of this cable.")


class Motors(Printed):
    """All motors of an arm: those that were given, then one for each cable that none of them moves.

    The motor of a single cable has the cable's name, and takes in 1 m of wire per 1 m.

    Attributes:
        given: The motors that were given.
        names: Names of all M motors.
        matrix: B (C, M) [m/rad]: wire of each cable taken in per turn of each motor.
    """

    def __init__(self, given: tuple[Motor, ...], cables: Cables) -> None:
        moved = {name for motor in given for name in motor.cables}
        own = [name for name in cables.names if name not in moved]
        radii: list[Mapping[str, float]] = [motor.cables for motor in given]
        radii += [{name: 1.0} for name in own]
        columns = [[row.get(name, 0.0) for name in cables.names] for row in radii]
        self.given = given
        self.names = (*(motor.name for motor in given), *own)
        self.matrix = frozen(np.array(columns).T)
        self._force = [cables[name].control == "force" for name in own]

    def __len__(self) -> int:
        return len(self.names)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Motors):
            return NotImplemented
        return self.given == other.given and self.names == other.names

    def __hash__(self) -> int:
        return hash(self.names)

    @property
    def are_free(self) -> bool:
        """Whether there are as many motors as cables, so that they can give any tensions."""
        return len(self) == len(self.matrix)

    @cached_property
    def yielding(self) -> Yielding | None:
        """Those of the given motors that yield; None if all are rigid."""
        soft = [i for i, motor in enumerate(self.given) if motor.yields]
        if not soft:
            return None
        stiffness = [0.0 if self.holds_torque[i] else self.given[i].stiffness for i in soft]
        names = tuple(self.names[i] for i in soft)
        return Yielding(names, frozen(self.matrix[:, soft].copy()), frozen(np.array(stiffness)))

    @cached_property
    def holds_torque(self) -> tuple[bool, ...]:
        """Whether each motor holds a torque (M,), or a cable's own one a tension."""
        return (*(motor.control == "torque" for motor in self.given), *self._force)

    @cached_property
    def compliance(self) -> Array:
        """`B k_m⁻¹ Bᵀ` (C, C) [m/N], which the motors add to the compliance of the cables.

        It is ±inf between cables of a motor that holds its torque.
        """
        soft = self.yielding
        if soft is None:
            return frozen(np.zeros((len(self.matrix),) * 2))
        held = soft.stiffness == 0.0
        B = soft.matrix[:, ~held]
        added = (B / soft.stiffness[~held]) @ B.T
        for column in soft.matrix[:, held].T:
            together = np.outer(column, column)
            added = np.where(together == 0.0, added, np.copysign(np.inf, together))
        return frozen(added)

    @cached_property
    def fixed(self) -> Array:
        """N (C, C − M), orthonormal: `Nᵀ B = 0`. No motor changes `Nᵀ l_0`; assembly has set it."""
        return frozen(np.linalg.svd(self.matrix)[0][:, len(self) :].copy())

    def require_independent(self) -> None:
        """Raise InvalidInput if turns of some motors undo each other in all cables."""
        unit = self.matrix / np.linalg.norm(self.matrix, axis=0)
        _, size, turns = np.linalg.svd(unit)
        if len(self) <= len(self.matrix) and size.min() > _RANK:
            return
        together = np.flatnonzero(abs(turns[-1]) > 1e-6)
        names = listed([self.names[i] for i in together])
        raise InvalidInput(
            "motors",
            f"{names} do the same: turned together they move no cable. Leave one of them out, or "
            "change its radii.",
        )

    @property
    def count(self) -> str:
        """How many there are for how many cables, in words."""
        return f"{plural(len(self), 'motor')} for {plural(len(self.matrix), 'cable')}"

    @property
    def line(self) -> str:
        """What prints say of the motors; empty if each cable has its own, which is rigid."""
        if not self.given:
            return ""
        shown = [str(motor) for motor in self.given[:_SHOWN]]
        more = len(self.given) - _SHOWN
        shown += [f"and {more} more"] * (more > 0)
        return f"{self.count}: {'; '.join(shown)}"

    def described(self, commands: Array) -> dict[str, object]:
        """Return commands (M,) of motors for JSON: turns, torques, wire and tensions by name."""
        numbers: dict[str, dict[str, float]] = {}
        for m, (name, held) in enumerate(zip(self.names, self.holds_torque, strict=True)):
            is_given = m < len(self.given)
            kind = ("torque_Nm" if is_given else "tension_N") if held else "turn_rad"
            kind = kind if held or is_given else "wire_m"
            numbers.setdefault(f"motor_{kind}", {})[name] = float(commands[m])
        return dict(numbers)

    def commanded(self, commands: Array) -> str:
        """Return commands (M,) of motors as text for people."""
        words = []
        for m, (name, held) in enumerate(zip(self.names, self.holds_torque, strict=True)):
            is_given = m < len(self.given)
            turn = (
                f"{math.degrees(commands[m]):z.4g}°" if is_given else f"{1e3 * commands[m]:z.4g} mm"
            )
            load = f"{commands[m]:.4g} {'N m' if is_given else 'N'}"
            words.append(f"{name} {load if held else turn}")
        return "motors: " + ", ".join(words)

    def to_dict(self) -> dict[str, object]:
        """Return the given motors for JSON by name: radii [m], stiffness [N m/rad], control."""
        return {
            motor.name: {
                "cables_m_per_rad": dict(motor.cables),
                "stiffness_Nm_per_rad": motor.stiffness,
                "control": motor.control,
            }
            for motor in self.given
        }

    def __str__(self) -> str:
        rows = [("motor", "cables", "holds")]
        for motor in self.given:
            rows.append((motor.name, _radii(motor), motor.holds))
        own = self.names[len(self.given) :]
        for name, force in zip(own, self._force, strict=True):
            rows.append((name, "its own", "holds its tension" if force else "holds its length"))
        return "\n".join([*aligned(rows), self.count])


_SHOWN = 4  # most motors in a line


def needs_assembly(motors: Motors) -> str:
    """Return what a result says whose tensions the motors cannot reach from another posture."""
    return (
        f"needs its own assembly at this posture: {motors.count} cannot set each tension; "
        "distribute_tension(pose, assembly=) keeps an assembly"
    )


YIELDING_REMEDY = (
    "Leave stiffness and control of the motor out, or give the cable a series_stiffness instead."
)


def refuse_shared(motors: Motors, what: str, remedy: str = "", values: str = "tensions") -> None:
    """Raise InvalidInput if motors move several cables, so that tensions are not free.

    ``what`` cannot work then; ``remedy`` is what works, where the user stands; ``values`` is what
    is not free of each cable.
    """
    if not motors.are_free:
        free = f"{values} of {len(motors.matrix)} cables are not free: "
        works = remedy or (
            "Use distribute_tension(pose, assembly=) or forward_statics(motors=, assembly=), "
            "or, in Python, with_motors([]) for an arm with a motor for each cable."
        )
        raise InvalidInput(what, f"{free}{plural(len(motors), 'motor')} move them. {works}")


def refuse_yielding(motors: Motors, what: str, why: str, remedy: str) -> None:
    """Raise InvalidInput if a motor yields: ``why`` comes after its name."""
    if motors.yielding is not None:
        names = listed(motors.yielding.names)
        raise InvalidInput(what, f"{names} {why}. {remedy}")


def refuse_rough(motors: Motors, has_friction: bool, what: str) -> None:
    """Raise InvalidInput if cables have friction in their holes, and a motor yields."""
    if has_friction:
        why = "yields: friction in the holes would couple all cables that it moves"
        remedy = "Take friction 0, as by with_friction(0) or friction=False, or rigid motors: "
        refuse_yielding(motors, what, why, f"{remedy}leave their stiffness and control out.")
