"""Check messages from browsers about the 3D scene: camera, clicks, and the handle at the tip."""

from __future__ import annotations

from typing import Any, Final

HANDLE: Final = "/target"
"""Name of the scene node that clients may drag."""

_FARTHEST = 1e6  # largest coordinate [m]; farther away no arm is seen


def scene_message(message: Any) -> dict[str, Any] | None:
    """Return the allowed part of a message about the scene; None for any other message.

    Raises ValueError if a point in the message is not three numbers of magnitude up to 1e6 [m].
    """
    match message:
        case {"type": "ViewerCameraMessage"}:  # viser keeps a camera for each client
            return dict(message)
        case {
            "type": "ScenePointerMessage" as kind,
            "event_type": "click",
            "ray_origin": origin,
            "ray_direction": direction,
        } if any(_point(direction)):
            return {
                "type": kind,
                "event_type": "click",
                "ray_origin": _point(origin),
                "ray_direction": _point(direction),
                "screen_pos": [[0.0, 0.0]],
                "modifier": None,
            }
        case {"type": "TransformControlsUpdateMessage" as kind, "name": name, "position": position}:
            if name == HANDLE:
                straight = [1.0, 0.0, 0.0, 0.0]
                place = _point(position)
                return {"type": kind, "name": name, "wxyz": straight, "position": place}
        case {
            "type": "TransformControlsDragStartMessage" | "TransformControlsDragEndMessage" as kind,
            "name": name,
        }:
            if name == HANDLE:
                return {"type": kind, "name": name}
    return None


def _point(value: object) -> list[float]:
    """Return ``value`` as three floats; ValueError unless it is numbers of magnitude up to 1e6."""
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(f"{value!a:.40} is not a point")
    for number in value:
        if isinstance(number, bool) or not isinstance(number, (int, float)):
            raise ValueError(f"{number!a:.40} is not a number")
        if not abs(number) <= _FARTHEST:
            raise ValueError(f"{number!a:.40} is too far")
    return [float(number) for number in value]
