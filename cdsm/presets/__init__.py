"""Arms with printed numbers: each says its source, what is assumed, and what was measured."""

from cdsm.presets.backbones import (
    nitinol_segment,
    rod_one_tendon,
    silicone_tentacle,
    tdcr_two_sections,
)
from cdsm.presets.linked import simplex, sjtu_snake
from cdsm.presets.prototype import (
    ELASTIC_STAGE,
    STEEL_WIRE_200GPA,
    STRAND_1X19,
    STRAND_DIAMETER,
    TEN_DEGREES,
    virtual_prototype,
    virtual_prototype_geometry,
)
from cdsm.presets.spirob import spirob

# fmt: off
__all__ = [
    "ELASTIC_STAGE", "STEEL_WIRE_200GPA", "STRAND_1X19", "STRAND_DIAMETER", "TEN_DEGREES",
    "nitinol_segment", "rod_one_tendon", "silicone_tentacle", "simplex", "sjtu_snake",
    "spirob", "tdcr_two_sections", "virtual_prototype", "virtual_prototype_geometry",
]
# fmt: on


def __dir__() -> list[str]:
    return __all__
