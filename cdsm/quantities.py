"""All quantities of an arm, of its postures and of its stiffness, each described once.

Stiffness, batches, sweeps, designs, uncertainty budgets, plots, the help of the commands and the
reference read this table. How a quantity is computed stays in its chapter, unless it follows from
others: then ``reads`` names these, and ``compute`` is the formula.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal, NamedTuple

from cdsm.errors import unknown

Needs = Literal["posture", "tension", "stiffness", "stable arm", "all postures", "arm"]
"""What must exist for a quantity to exist."""

Output = Literal["batch", "sweep", "uncertainty", "design"]
"""What gives a quantity: a batch, a sweep, an uncertainty budget, a design."""

JOINT_DIMS: Final = ("joint", "joint_column")
AXIS_DIMS: Final = ("axis", "axis_column")
MOTION_DIMS: Final = ("motion", "motion_column")

UNITS_OF_JOINTS: Final = {
    "joint": ("rad", "m"),
    "torque": ("N m", "N"),
    "joint stiffness": ("N m/rad", "N/m"),
    "lever": ("m/rad", "1"),
}
"""SI unit of what belongs to a joint: of one that turns, of one that slides."""

DISPLAY: Final = {
    "m": ("mm", 1e-3),
    "N/m": ("N/mm", 1e3),
    "m/N": ("mm/N", 1e-3),
    "m3": ("dm³", 1e-3),
    "1": ("", 1.0),
}
"""Unit in which people read a value, and its size in SI, where it is not the SI unit itself."""


class Quantity(NamedTuple):
    """Description of a quantity.

    ``compute`` takes the quantities that ``reads`` names, as arrays with any leading axes, and
    returns an array with the same leading axes and then ``dims``. If ``dims`` has "direction", it
    gets the unit directions (D, 3) too. Of a quantity that needs the arm alone, it takes the arm.
    """

    needs: Needs  # what must exist
    words: str  # its name in words
    definition: str = ""  # what it is, in words; formulas in backquotes
    unit: str = "1"  # SI, or a key of UNITS_OF_JOINTS; 1 also if the entries have different units
    dims: tuple[str, ...] = ()  # after those of the postures
    best: Literal["most", "least"] | None = None  # which end a design prefers; None: neither
    outputs: frozenset[Output] = frozenset()  # what gives it
    is_flag: bool = False  # whether entries are true or false, and false where none exists
    is_slow: bool = False  # whether it takes milliseconds at each posture
    shown: tuple[str, float] | None = None  # unit for people and its size, if not that of DISPLAY
    reads: tuple[str, ...] = ()  # quantities from which it is computed
    compute: Callable[..., Any] | None = None  # how; None: its chapter knows

    @property
    def text(self) -> str:
        """Words and definition in one line."""
        return ", ".join(filter(None, (self.words, self.definition.replace("`", ""))))

    @property
    def si_unit(self) -> str:
        """SI unit, of joints that turn."""
        return UNITS_OF_JOINTS[self.unit][0] if self.unit in UNITS_OF_JOINTS else self.unit

    @property
    def display(self) -> tuple[str, float]:
        """Unit for people, and its size in SI; of joints that turn."""
        return self.shown or display_of(self.si_unit)

    def along(self, direction: str) -> str:
        """Return the words with a direction, which is a text such as ``(0, 0, 1)``."""
        return self.words.replace("a direction", direction)


_SOFT: Final = 100.0  # [N/m]; stiffness below is read in N/m

_BATCH: Final[frozenset[Output]] = frozenset(("batch",))
_SWEEP: Final[frozenset[Output]] = frozenset(("sweep",))
_DESIGN: Final[frozenset[Output]] = frozenset(("design",))
_UNCERTAINTY: Final[frozenset[Output]] = frozenset(("uncertainty",))
_ARRAYS: Final = _BATCH | _SWEEP
_GOALS: Final = _SWEEP | _DESIGN
_ALL: Final = _ARRAYS | _GOALS | _UNCERTAINTY
_K: Final = "joint stiffness"
_BOUNDED: Final = "largest force that tensions within the bounds balance"

# fmt: off
QUANTITIES: Final[dict[str, Quantity]] = {
    "tip": Quantity(
        "posture", "pose of the tip", "position and rotation in base axes", "1", ("row", "column"),
        outputs=_BATCH),
    "tip_position": Quantity(
        "posture", "position of the tip", "in base axes", "m", ("axis",),
        outputs=_SWEEP, reads=("tip",), compute=lambda tip: tip[..., :3, 3]),
    "tip_along": Quantity(
        "posture", "tip along a direction", "its coordinate", "m", ("direction",),
        outputs=_UNCERTAINTY, reads=("tip",),
        compute=lambda tip, direction: tip[..., :3, 3] @ direction.T),
    "jacobian": Quantity(
        "posture", "tip Jacobian", "`J_X`", "1", ("motion", "joint"),
        outputs=_BATCH),
    "cable_lengths": Quantity(
        "posture", "cable lengths", "L with the leads (Eq. 8)", "m", ("cable",),
        outputs=_ARRAYS),
    "length_jacobian": Quantity(
        "posture", "Jacobian of the cable lengths", "`J_L = ∂L/∂θ`", "lever", ("cable", "joint"),
        outputs=_BATCH),
    "gravity_torque": Quantity(
        "posture", "gravity torque", "`g = ∂V/∂θ`", "torque", ("joint",),
        outputs=_ARRAYS),
    "gravity": Quantity(
        "posture", "gravity term of the joint stiffness", "`∂g/∂θ` (Eq. 16)", _K, JOINT_DIMS,
        outputs=_ARRAYS),
    "springs": Quantity(
        "posture", "spring term of the joint stiffness", "of the joint springs", _K, JOINT_DIMS,
        outputs=_ARRAYS),
    "tension_factor": Quantity(
        "posture", "tension factor",
        "largest `min F/max F` with `J_Lᵀ F = 0`; 0: no wrench closure",
        best="most", outputs=_GOALS, is_slow=True),
    "cable_clearance": Quantity(
        "posture", "clearance between cables", "", "m",
        best="most", outputs=_GOALS, is_slow=True),
    "link_clearance": Quantity(
        "posture", "clearance of cables from links", "", "m",
        best="most", outputs=_GOALS, is_slow=True),
    "disk_clearance": Quantity(
        "posture", "clearance of cables from disks", "or from the rims of their holes", "m",
        best="most", outputs=_GOALS, is_slow=True),
    "tension": Quantity(
        "tension", "tension", "least F in balance, the forces of the motors (Eq. 17)", "N",
        ("cable",), best="least", outputs=_ALL),
    "residual": Quantity(
        "tension", "residual of the balance", "`J_Lᵀ F − (J_Xᵀ W − g) + k (q − q_0)`", "torque",
        ("joint",), outputs=_BATCH),
    "active": Quantity(
        "tension", "active term of the joint stiffness", "`H_L·F` (Eq. 16)", _K, JOINT_DIMS,
        outputs=_ARRAYS),
    "load": Quantity(
        "tension", "load term of the joint stiffness", "`−∂(J_Xᵀ W)/∂θ` (Eq. 16)", _K, JOINT_DIMS,
        outputs=_ARRAYS),
    "payload": Quantity(
        "tension", "payload along a direction", _BOUNDED, "N", ("direction",),
        best="most", outputs=_GOALS, is_slow=True),
    "force_radius": Quantity(
        "tension", "payload in any direction", _BOUNDED, "N",
        best="most", outputs=_GOALS, is_slow=True),
    "cable_stiffness": Quantity(
        "stiffness", "cable stiffness", "diagonal of `K_L`", "N/m", ("cable",),
        outputs=_ARRAYS),
    "passive": Quantity(
        "stiffness", "passive term of the joint stiffness", "`J_Lᵀ K_L J_L` (Eq. 16)", _K,
        JOINT_DIMS, outputs=_ARRAYS),
    "joint": Quantity(
        "stiffness", "joint stiffness", "`K_θ` (Eq. 16)", _K, JOINT_DIMS,
        outputs=_BATCH),
    "joint_stiffness": Quantity(  # no variable of a Dataset may have the name of a dimension
        "stiffness", "joint stiffness", "`K_θ` (Eq. 16)", _K, JOINT_DIMS,
        outputs=_SWEEP, reads=("joint",), compute=lambda joint: joint),
    "margin": Quantity(
        "stiffness", "smallest joint stiffness",
        "smallest eigenvalue of the symmetric part of `K_θ`", _K, best="most", outputs=_ALL),
    "pseudoinverse": Quantity(
        "stiffness", "the paper's Cartesian stiffness", "`J⁺ᵀ K_θ J⁺`", "N/m", AXIS_DIMS,
        outputs=_ARRAYS),
    "along": Quantity(
        "stiffness", "stiffness along a direction", "`1/(uᵀ C_vv u)` (Eq. 20)", "N/m",
        ("direction",), best="most", outputs=_ALL),
    "slack": Quantity(
        "stiffness", "whether a cable is at 0 N", "along is then one-sided, all else two-sided",
        outputs=_ARRAYS, is_flag=True),
    "compliance": Quantity(
        "stiffness", "compliance", "`C = J_X K_θ⁻¹ J_Xᵀ`, tip motion per wrench", "1", MOTION_DIMS,
        outputs=_ARRAYS),
    "translational_compliance": Quantity(
        "stiffness", "translational compliance", "`C_vv`, tip motion per force", "m/N", AXIS_DIMS,
        outputs=_SWEEP, reads=("compliance",), compute=lambda compliance: compliance[..., :3, :3]),
    "cartesian": Quantity(
        "stiffness", "Cartesian stiffness", "inverse of `C_vv`", "N/m", AXIS_DIMS,
        outputs=_ARRAYS),
    "deflection": Quantity(
        "stiffness", "first-order deflection under the load", "`|C_vv f|`, motors locked", "m",
        best="least", outputs=_DESIGN, reads=("translational_compliance",)),
    "softest": Quantity(
        "stable arm", "stiffness in the softest direction", "", "N/m",
        best="most", outputs=_GOALS, reads=("compliance",)),
    "stiffest": Quantity(
        "stable arm", "stiffness in the stiffest direction", "", "N/m",
        outputs=_SWEEP, reads=("compliance",)),
    "isotropy": Quantity(
        "stable arm", "isotropy", "softest over stiffest",
        outputs=_SWEEP, reads=("compliance",)),
    "softest_direction": Quantity(
        "stable arm", "softest direction", "of unit length", "1", ("axis",),
        outputs=_SWEEP, reads=("compliance",)),
    "stiffest_direction": Quantity(
        "stable arm", "stiffest direction", "of unit length", "1", ("axis",),
        outputs=_SWEEP, reads=("compliance",)),
    "workspace": Quantity(
        "all postures", "volume around the tips held", "", "m3",
        best="most", outputs=_DESIGN, reads=("tip_position",)),
    "held": Quantity(
        "all postures", "share of postures held", "balanced, and stable",
        best="most", outputs=_DESIGN, shown=("%", 1e-2)),
    "wire_length": Quantity(
        "all postures", "wire with its leads", "", "m",
        best="least", outputs=_DESIGN, shown=("m", 1.0), reads=("cable_lengths",)),
    "mass": Quantity(
        "arm", "mass of the links", "", "kg",
        best="least", outputs=_DESIGN,
        compute=lambda arm: sum(body.mass for body in arm.geometry.chain.bodies[1:])),
    "length": Quantity(
        "arm", "length", "", "m",
        best="most", outputs=_DESIGN, compute=lambda arm: arm.geometry.length),
}
# fmt: on
"""All quantities by name: that of the attribute of Posture or Stiffness, where there is one."""


def names_of(output: Output) -> tuple[str, ...]:
    """Return the names of the quantities of a batch, a sweep, an uncertainty or a design."""
    return tuple(name for name, quantity in QUANTITIES.items() if output in quantity.outputs)


def require_name(kind: str, name: object, output: Output) -> str:
    """Return the name of a quantity of an output; InvalidInput tells a wrong name what is meant."""
    known = names_of(output)
    if isinstance(name, str) and name in known:
        return name
    texts = {quantity: f"{quantity} {QUANTITIES[quantity].text}" for quantity in known}
    raise unknown(kind, name, known, meant=_described(str(name), texts))


def _described(name: str, texts: Mapping[str, str]) -> list[str]:
    """Return the keys of those texts in which all parts of a name, such as a_b, are words.

    If there are several, those are taken of which the key has most of the parts.
    """
    parts = [part for part in re.split(r"\W+|_", name.lower()) if part]
    fits: dict[str, int] = {}
    for key, text in texts.items():
        words = re.findall(r"\w+", text.lower().replace("_", " "))
        if all(any(word.startswith(part) for word in words) for part in parts):
            fits[key] = sum(part in key.split("_") for part in parts)
    most = max(fits.values(), default=0)
    return [key for key, count in fits.items() if count == most] if parts else []


def display_of(unit: str) -> tuple[str, float]:
    """Return the unit in which people read a value, and its size in SI."""
    return DISPLAY.get(unit, (unit, 1.0))


def display_for(unit: str, largest: float) -> tuple[str, float]:
    """Return the unit, and its size in SI, in which people read values up to ``largest`` [SI].

    The stiffness of soft arms is read in N/m.
    """
    soft = unit == "N/m" and 0.0 < largest < _SOFT
    return (unit, 1.0) if soft else display_of(unit)


def si_of(units: str) -> str:
    """Return an SI unit as it is written here: ``N/m`` for ``N m-1`` of a Dataset."""
    return re.sub(r" (\w+)-1", r"/\1", units)


def udunits(unit: str) -> str:
    """Return an SI unit in the notation of UDUNITS: ``N m-1`` for ``N/m``."""
    return re.sub(r"/(\w+)", r" \1-1", unit)
