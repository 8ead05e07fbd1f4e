"""Evaluation of the postures of a batch, slice by slice, with checked arguments."""

from __future__ import annotations

import numpy as np

from cdsm.batch import layout
from cdsm.batch.distribution import Distributor
from cdsm.batch.fused_kernel import evaluate_rows
from cdsm.batch.inputs import kernel_arm, of_rows
from cdsm.batch.layout import QUANTITIES, Codes, Flags
from cdsm.cable_laws import CableLaws
from cdsm.elasticity import Elasticity
from cdsm.errors import ElasticityRangeError
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array, frozen


class Evaluator:
    """Evaluation of slices of the postures; arguments as in :func:`cdsm.batch.evaluate`.

    ``tension`` is F (C,) or (B, C) [N], or None if tensions are distributed or not needed. The
    ``distributor`` finds tensions that are not given.

    Attributes:
        values: The outputs in the order of ``names``, filled slice by slice.
        width: Floats of temporary memory per posture.
    """

    def __init__(
        self,
        arm: Manipulator,
        q: Array,
        tension: Array | None,
        wrench: Array,
        direction: Array | None,
        names: tuple[str, ...],
        distributor: Distributor | None,
        check_limits: bool,
    ) -> None:
        self._arm, self._q, self._wrench, self._names = arm, q, wrench, names
        self._tension, self._distributor = tension, distributor
        nv, cables = arm.nv, len(arm.cables)
        self._directions = frozen(
            np.zeros((0, 3)) if direction is None else direction.reshape(-1, 3)
        )
        self._arrays = kernel_arm(arm, check_limits)
        count = len(self._directions)
        self._start = layout.starts(nv, cables, count)
        wanted = sorted(QUANTITIES.index(name) for name in names if name != "tension")
        self._wanted = np.array(wanted, dtype=np.intp)
        ends = np.cumsum(self._start[self._wanted + 1] - self._start[self._wanted])
        self._size = int(ends[-1]) if wanted else 0
        self._place = {
            QUANTITIES[number]: slice(end - (self._start[number + 1] - self._start[number]), end)
            for number, end in zip(wanted, ends.tolist(), strict=True)
        }
        self.width = self._size + nv + 2 * cables
        if distributor is not None:
            self.width += distributor.width

        shapes = dict(zip(QUANTITIES, layout.shapes(nv, cables, count), strict=True))
        shapes["tension"] = (cables,)
        if direction is not None and direction.ndim == 1:
            shapes["along"] = ()
        self.values = [np.empty((len(q), *shapes[name])) for name in names]

    def fill(self, part: slice, status: Codes) -> None:
        """Fill the values and the status (B,) of a slice of the postures."""
        rows, q, found = len(self._q), self._q[part], status[part]
        wrench = of_rows(self._wrench, part, rows)
        if self._distributor is not None:
            tension, found[:] = self._distributor.at(part)
            frozen(tension)
        elif self._tension is not None:
            tension = of_rows(self._tension, part, rows)
        else:
            tension = frozen(np.zeros((len(q), len(self._arm.cables))))
        springs = self._wanted.size and self._wanted[-1] > layout.LOAD
        rigidity = _rigidities(self._arm, tension, found == layout.OK) if springs else tension
        out = np.empty((len(q), self._size))
        evaluate_rows(
            self._arrays,
            q,
            tension,
            rigidity,
            wrench,
            self._directions,
            self._start,
            self._wanted,
            out,
            found,
        )
        for name, value in zip(self._names, self.values, strict=True):
            source = tension if name == "tension" else out[:, self._place[name]]
            value[part] = source.reshape(value[part].shape)


def _rigidities(arm: Manipulator, tension: Array, usable: Flags) -> Array:
    """Return EA (1 + ε) (b, C) [N] at tensions F (b, C) [N] of usable postures (b,).

    It is 0 under force control and in postures that are not usable, and −1 outside the domain.
    """
    if not usable.any():  # a user-defined law may fail on empty arrays
        return frozen(np.zeros_like(tension))
    given = tension if usable.all() else tension[usable]
    rigidity = np.zeros_like(given)
    for law, held in arm._model.laws.held:
        rigidity[:, held] = _where_defined(arm._model.laws, law, given[:, held])
    if given is tension:
        return frozen(rigidity)
    result = np.zeros_like(tension)
    result[usable] = rigidity
    return frozen(result)


def _where_defined(laws: CableLaws, law: Elasticity, tension: Array) -> Array:
    """Return EA (1 + ε) [N] at tensions of any shape; −1 outside the domain of the law."""
    try:
        return laws.stretched_rigidity(law, tension)
    except ElasticityRangeError:
        pass
    result, values = np.full(tension.size, -1.0), tension.ravel()
    left = np.arange(tension.size)
    while left.size:
        try:
            result[left] = laws.stretched_rigidity(law, values[left])
            break
        except ElasticityRangeError as error:
            if not error.indices:  # a user-defined law may not say which tensions are outside
                result[left] = [_one(laws, law, value) for value in values[left]]
                break
            left = np.delete(left, error.indices)
    return result.reshape(tension.shape)


def _one(laws: CableLaws, law: Elasticity, tension: float) -> float:
    try:
        return float(laws.stretched_rigidity(law, np.array([tension]))[0])
    except ElasticityRangeError:
        return -1.0
