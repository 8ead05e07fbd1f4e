"""Parts of a closed loop: motor laws, what they get and return, protocol of plants.

:func:`cdsm.track` runs the loop, with :class:`cdsm.Sensors` and a plant.
"""

from cdsm.control.laws import Command as Command
from cdsm.control.laws import ControlInput as ControlInput
from cdsm.control.laws import Law as Law
from cdsm.control.laws import Reference as Reference
from cdsm.control.laws import feedforward as feedforward
from cdsm.control.laws import limited as limited
from cdsm.control.laws import mixed as mixed
from cdsm.control.laws import tension_control as tension_control
from cdsm.control.observer import with_rigidity as with_rigidity
from cdsm.control.plants import Plant as Plant
from cdsm.control.sensors import Measurement as Measurement
