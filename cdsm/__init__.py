"""Stiffness of cable-driven serpentine manipulators.

    geometry = cdsm.Geometry.universal(...)            # or read from TOML
    arm = cdsm.Manipulator(geometry, elasticity=...)   # URDF, rigid-body model, cables
    pose = arm.at(q)                                   # kinematics, cable lengths, gravity torque
    tension = cdsm.distribute_tension(pose, minimum=50.0)  # tensions that balance the load
    K = cdsm.stiffness(pose, tension)                  # joint and Cartesian stiffness

All units are SI. The x-axis of the base frame lies along the straight arm.
"""

from importlib import import_module

with open(f"{__path__[0]}/__init__.pyi", encoding="utf-8") as _stub:
    # the module of each public name: lines of the stub are "from MODULE import NAME as NAME"
    _HOME = {words[3]: words[1] for words in map(str.split, _stub) if words[:1] == ["from"]}

_MODULES = [name for name, module in _HOME.items() if module == "cdsm"]

__all__ = sorted(name for name in _HOME if name == "presets" or name not in _MODULES)


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return import_module(f"cdsm.{name}")
    if name in _HOME:
        found = getattr(import_module(_HOME[name]), name)
    elif name == "__version__":
        from importlib.metadata import version

        found = version("cdsm-stiffness")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found  # the next time it is found without this function
    return found


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES})
