"""What sensors tell: loads, and tensions at the joints, from load cells and joint angles."""

from cdsm.estimation.estimate import estimate_load as estimate_load
from cdsm.estimation.estimate import estimate_tensions as estimate_tensions
from cdsm.estimation.posture import PostureEstimate as PostureEstimate
from cdsm.estimation.posture import estimate_posture as estimate_posture
from cdsm.estimation.result import LoadEstimate as LoadEstimate
from cdsm.estimation.result import TensionEstimate as TensionEstimate
