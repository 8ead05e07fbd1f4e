"""What a variable or coordinate of a Dataset says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from cdsm.support.validation import Array


@final
@dataclass(frozen=True, eq=False)
class Label:
    """A coordinate: what stands along a dimension, or the one value there is.

    Attributes:
        dims: Its dimensions; none for a single value.
        values: Numbers or names, of that shape.
        long_name: In words.
        units: As UDUNITS writes them, SI; empty for names, which have none.
    """

    dims: tuple[str, ...]
    values: Array | NDArray[np.int64] | NDArray[np.str_] | float
    long_name: str
    units: str

    @property
    def attributes(self) -> dict[str, str]:
        """As a Dataset holds them."""
        return {"long_name": self.long_name} | ({"units": self.units} if self.units else {})
