"""Closed-loop control of position and stiffness: motor laws, sensors, plants, estimation."""

from cdsm.control.laws import (
    Command,
    Law,
    Moment,
    Reading,
    Reference,
    feedforward,
    limited,
    mixed,
    tension_control,
)
from cdsm.control.mujoco_plant import MuJoCoPlant
from cdsm.control.plant import SlowPlant
from cdsm.control.run import TrackingRun
from cdsm.control.sensors import Sensors
from cdsm.control.stiffness_loop import with_rigidity
from cdsm.control.track import track

# fmt: off
__all__ = [
    "Command", "Law", "Moment", "MuJoCoPlant", "Reading", "Reference", "Sensors", "SlowPlant",
    "TrackingRun", "feedforward", "limited", "mixed", "tension_control", "track", "with_rigidity",
]
# fmt: on
