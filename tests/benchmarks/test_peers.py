"""The batch on one core, against other packages on the same core; each compares the numbers first.

pip install -e '.[bench]'     the other packages: who is absent is skipped by name
pytest -m speed -s                      prints what was measured
"""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.benchmarks.naive import NaiveArm
from tests.benchmarks.peers import with_casadi, with_jax
from tests.benchmarks.test_batch_speed import per_posture, problem
from tests.benchmarks.test_speed import GRAVITY, RIGIDITY, SIZES
from tests.benchmarks.timing import Clock


@pytest.fixture(autouse=True)
def _one_core() -> Iterator[None]:
    """Threads that a package starts inherit it: as many cores for all."""
    if not hasattr(os, "sched_setaffinity"):  # macOS
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def forces(joints: int, rows: int) -> tuple[cdsm.Manipulator, Array, Array, Array]:
    """A problem without moments: those have no potential."""
    one, q, tension, wrench = problem(joints, rows)
    wrench[:, 3:] = 0.0
    return one, q, tension, wrench


def told(peer: str, joints: int, theirs: float, ours: float) -> str:
    return f"n = {joints}: {peer} {theirs:.2f} us, {theirs / ours:.2f} times the {ours:.2f} us here"


@pytest.mark.parametrize(
    ("joints", "rows", "chunk", "needed"),
    [(5, 4000, 256, 4.0), (10, 400, 64, 8.0), (20, 64, 16, 8.0)],
)
def test_batch_is_several_times_faster_than_jax(
    joints: int, rows: int, chunk: int, needed: float, clock: Clock | None
) -> None:
    """In chunks that fit the cache, where JAX is fastest: with 5 joints it takes 7 times as long.

    In one call for 4000 postures it is 12 to 18 times; this is printed.
    """
    pytest.importorskip("jax", reason="JAX is not installed")
    one, q, tension, wrench = forces(joints, rows)
    stiffness = with_jax(NaiveArm(joints, gravity=GRAVITY, **SIZES), RIGIDITY)

    def batch() -> Array:
        return cdsm.evaluate(one, q, tension, wrench, ("joint",), threads=1)["joint"]

    def jax(count: int) -> Any:
        return stiffness(q[:count], tension[:count], wrench[:count, :3]).block_until_ready()

    # float64 in both: a mode of JAX that is off by default
    np.testing.assert_allclose(batch(), jax(rows), rtol=0.0, atol=1e-12 * abs(batch()).max())
    if clock:
        ours, whole = per_posture(batch, rows), per_posture(lambda: jax(rows), rows)
        print("\n" + told(f"JAX, {rows} postures at once,", joints, whole, ours))
        what = f"batch, n = {joints}: faster than JAX, {chunk} postures at once"
        clock.race(what, lambda: jax(chunk), batch, least=needed, rows=rows / chunk, fast_repeat=1)


@pytest.mark.parametrize(("joints", "rows"), [(5, 1000), (10, 100), (20, 20)])
def test_batch_computes_what_casadi_does(
    joints: int, rows: int, tmp_path: Path, clock: Clock | None
) -> None:
    casadi = pytest.importorskip("casadi", reason="CasADi is not installed")
    one, q, tension, wrench = forces(joints, rows)
    function = with_casadi(NaiveArm(joints, gravity=GRAVITY, **SIZES), RIGIDITY)

    def batch() -> Array:
        return cdsm.evaluate(one, q, tension, wrench, ("joint",), threads=1)["joint"]

    ways = {"CasADi, its virtual machine,": function}
    compiler = shutil.which("cc")
    if joints == 5 and compiler is not None:  # 10 joints take a compiler more than two minutes
        source, library = tmp_path / "joint_stiffness.c", tmp_path / "joint_stiffness.so"
        writer = casadi.CodeGenerator(source.name)
        writer.add(function)
        writer.generate(f"{tmp_path}/")
        flags = ["-O3", "-march=native", "-shared", "-fPIC"]
        subprocess.run([compiler, str(source), *flags, "-o", str(library)], check=True)
        ways["CasADi, as C,"] = casadi.external("joint_stiffness", str(library))
    # its buffers point to these arrays without owning them
    given = q, tension, np.ascontiguousarray(wrench[:, :3])
    out = np.empty((rows, one.nv, one.nv))
    for way, each in ways.items():
        buffer, run = each.map(rows, "serial").buffer()
        for place, array in enumerate(given):
            buffer.set_arg(place, array.data)
        buffer.set_res(0, out.data)
        out[:] = np.nan
        run()
        np.testing.assert_allclose(batch(), out, rtol=0.0, atol=1e-12 * abs(out).max())
        if clock:
            print("\n" + told(way, joints, per_posture(run, rows), per_posture(batch, rows)))


@pytest.mark.parametrize(("joints", "rows"), [(5, 400), (10, 400), (20, 100)])
def test_batch_measures_the_cables_as_mujoco_does(
    joints: int, rows: int, clock: Clock | None
) -> None:
    """Kinematics and tendons alone: the lengths and their Jacobian are all that MuJoCo computes."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    from tests.support.mujoco_arms import in_mujoco, tendon_jacobian

    one, q, _, _ = problem(joints, rows)
    model, data = in_mujoco(one.at(q[0]))

    def tendons(angles: Array) -> None:
        data.qpos[:] = angles
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)

    def each() -> None:
        for angles in q:
            tendons(angles)

    def batch() -> cdsm.Batch:
        return cdsm.evaluate(one, q, outputs=("cable_lengths", "length_jacobian"), threads=1)

    found = batch()
    for row in range(0, rows, rows // 10):
        tendons(q[row])
        lengths, jacobian = found["cable_lengths"][row], found["length_jacobian"][row]
        np.testing.assert_allclose(lengths, data.ten_length, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(jacobian, tendon_jacobian(model, data), rtol=0.0, atol=1e-14)
    if clock:
        cost = per_posture(each, rows), per_posture(batch, rows)
        print("\n" + told("MuJoCo, lengths and Jacobian alone,", joints, *cost))
