"""Events while a load grows: what changes how an arm carries it, and the words for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final, Literal, final

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

Kind = Literal[
    "slip", "slack", "stop", "maximum", "law", "lift-off", "groove", "contact", "buckling"
]

PathPart = Literal["pull", "load"]
"""Part of the way of :func:`~cdsm.forward_statics` with friction: motors pull, then it bears."""

_WORDS: Final[dict[Kind, str]] = {
    "slip": "{} begins to slide",
    "slack": "{} goes slack",
    "stop": "{} reaches its stop",
    "maximum": "{} passes its maximum tension",
    "law": "{} leaves the domain of its law",
    "lift-off": "{} lifts off",
    "groove": "{} leaves the groove beside its plane, where its length has a step,",
    "contact": "{} touches",
    "buckling": "the arm buckles, {} most",
}
LIMIT_POINT: Final = "limit point"
"""Cause of a snap: an eigenvalue of K_θ is 0, and the load has its largest value."""

_AT_PULLEYS: Final[dict[Kind, str]] = {
    "lift-off": "lifts off",
    "groove": "leaves its groove",
    "contact": "touches",
}
_SHOWN = 8  # most events in a text


@final
@dataclass(frozen=True)
class Event:
    """What changes how an arm carries a growing load, and the load at which it does.

    Attributes:
        kind: ``"slip"``: a cable begins to slide in a hole with friction; ``"slack"``: a cable
            loses its tension; ``"stop"``: a joint reaches its limit; ``"maximum"``: a tension
            passes the largest one of its cable; ``"law"``: a tension leaves the domain of the law
            of its wire; ``"lift-off"`` and ``"contact"``: a cable leaves or touches a pulley, and
            `K_θ` has a step; ``"groove"``: it leaves a groove beside its plane, and its length has
            a step; ``"buckling"``: `K_θ` is no longer positive definite.
        place: Name of the cable, hole or joint; for buckling, of the joint that moves most; for a
            pulley, of its cable and its link.
        share: Share of the load (and pull) [-]; in a load cycle, of the step to a load; with a
            ``part``, of that part alone.
        load: Magnitude of the growing force [N]; 0 if no force grows. In a load cycle, of the sum
            of all forces.
        step: In a load cycle, the number of the load at which the step ends.
        part: Where the arm of forward statics has friction: whether the event lies on the
            ``"pull"`` of the motors, or on the ``"load"`` after it. None elsewhere.
        cause: Of buckling in a load cycle: ``"limit point"``, where an eigenvalue of `K_θ` is 0; or
            what takes so much stiffness that the arm snaps, such as a cable that begins to slide.
    """

    kind: Kind
    place: str
    share: float
    load: float
    step: int | None = None
    part: PathPart | None = None
    cause: str = ""

    def __str__(self) -> str:
        if self.cause == LIMIT_POINT:
            return f"{self.label} at a limit point {self.where}"
        if self.cause:
            return f"the arm snaps as {self.cause}, {self.place} most, {self.where}"
        return f"{event_words(self.kind, self.place)} {self.where}"

    @property
    def where(self) -> str:
        """The load in words, such as ``at 4.5 N``; in a load cycle with the step."""
        amount = f"at {self.load:.4g} N" if self.load else f"at {100.0 * self.share:.4g} %"
        if self.part is not None:
            return f"{amount} of the {self.part}" if self.share else f"as the {self.part} begins"
        where = amount if self.load else f"{amount} of it"
        where = where if self.share else "at once"
        return where + ("" if self.step is None else f" in the step to load {self.step}")

    @property
    def label(self) -> str:
        """What happens, without the load, in the few words that a picture has room for."""
        if self.kind in _AT_PULLEYS:
            cable, _, pulley = self.place.partition(" on the ")
            return f"{cable} {_AT_PULLEYS[self.kind]} ({pulley.partition(' (')[0]})"
        return event_words(self.kind, self.place)

    def to_dict(self) -> dict[str, object]:
        """Return it for JSON: the load in N."""
        entries = asdict(self)
        entries["load_N"] = entries.pop("load")
        for name in ("step", "part"):
            if entries[name] is None:
                del entries[name]
        if not self.cause:
            del entries["cause"]
        return entries


def event_words(kind: Kind, place: str) -> str:
    """Return what happens, and where, in words without the load."""
    return _WORDS[kind].format(place)


def first_slips(events: Sequence[Event]) -> list[Event]:
    """Return the events without the slips after the first one of each step."""
    steps = set[int | None]()
    told = list[Event]()
    for event in events:
        if event.kind == "slip" and event.step in steps:
            continue
        if event.kind == "slip":
            steps.add(event.step)
        told.append(event)
    return told


def events_text(events: Sequence[Event], about: str = "on the way") -> list[str]:
    """Return a line that names the events, or nothing if there are none.

    Of many holes in which cables begin to slide, it names the first.
    """
    slips = [event for event in events if event.kind == "slip"]
    told = [event for event in events if event.kind != "slip" or event is slips[0]]
    words = [str(event) for event in told[:_SHOWN]]
    if slips and slips[0] in told[:_SHOWN] and len(slips) > 1:
        words[told.index(slips[0])] += f", the first of {len(slips)} slips"
    if len(told) > _SHOWN:
        words.append(f"and {len(told) - _SHOWN} more events")
    return [f"{about}: {'; '.join(words)}"] if words else []


def buckling_joint(K: Array, out: NDArray[np.bool_], names: Sequence[str]) -> str:
    """Return the joint that moves most in the softest motion of the joints that are not ``out``."""
    free = np.flatnonzero(~out)
    if not free.size:
        free = np.arange(len(K))
    motion = np.linalg.eigh((K + K.T)[np.ix_(free, free)])[1][:, 0]
    return names[int(free[abs(motion).argmax()])]
