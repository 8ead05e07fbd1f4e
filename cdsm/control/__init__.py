"""Parts of a closed loop: motor laws, what they get and return, protocol of plants.

:func:`cdsm.track` runs the loop, with :class:`cdsm.Sensors` and a plant.
"""

from cdsm.control.laws import (
    Command,
    ControlInput,
    Law,
    Reference,
    feedforward,
    limited,
    mixed,
    tension_control,
)
from cdsm.control.plants import Plant, PlantState
from cdsm.control.run import TrackingRun
from cdsm.control.sensing import MotorMeasurement, with_rigidity

__all__ = [
    "Command",
    "ControlInput",
    "Law",
    "MotorMeasurement",
    "Plant",
    "PlantState",
    "Reference",
    "TrackingRun",
    "feedforward",
    "limited",
    "mixed",
    "tension_control",
    "with_rigidity",
]
