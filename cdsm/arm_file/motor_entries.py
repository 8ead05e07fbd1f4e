"""Tables of motors in ARM.toml: [motors.NAME], or [[motors]] with names."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BeforeValidator
from pydantic import ValidationInfo as Info

from cdsm.motors import Motor, MotorControl, checked_motors, require_cables
from cdsm.support import records
from cdsm.support.records import CrossFaults, record


@record
class _Motor:
    cables: dict[str, records.Number]
    stiffness: Annotated[records.Number, records.in_range("spring")] = math.inf
    control: MotorControl = "position"


def _by_name(value: object) -> object:
    """Return tables [[motors]] as [motors.NAME]."""
    if not isinstance(value, list):
        return value
    tables: dict[str, Any] = {}
    for i, table in enumerate(value, start=1):
        if not isinstance(table, dict) or not isinstance(table.get("name"), str):
            raise CrossFaults([f"[{i}].name: is missing"])
        name = table["name"]
        if name in tables:
            raise CrossFaults([f"[{i}].name: {name!r} is used twice"])
        tables[name] = {key: entry for key, entry in table.items() if key != "name"}
    return tables


MotorTables = Annotated[dict[str, _Motor] | None, BeforeValidator(_by_name)]
"""The tables by name, or none."""


def motors_of(tables: dict[str, _Motor] | None, info: Info) -> tuple[Motor, ...]:
    """Build the motors of the tables [motors.NAME], whose cables exist."""
    faults = list[str]()
    motors = []
    cables = info.data.get("cables")
    for name, table in (tables or {}).items():
        try:
            motors.append(Motor(name, **vars(table)))
            if cables:
                require_cables(motors[-1], cables)
        except ValueError as error:
            faults += records.faults_at(name, error)
    if faults:
        raise CrossFaults(faults)
    return checked_motors(motors, cables) if cables else tuple(motors)
