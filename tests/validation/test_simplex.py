"""A tensegrity that was built and measured: its tensions and its lowest mode, nothing fitted."""

import numpy as np
import simplex

import cdsm


def test_tensions_follow_from_the_lengthened_struts() -> None:
    """Feron et al. 2023: −1.5 kN in the struts; an independent program: −1501, 593 and 970 N."""
    rest = simplex.at_rest()
    expected = np.repeat([593.0, 970.0, 1501.0], [6, 3, 3])
    np.testing.assert_allclose(rest.tension, expected, atol=0.5)
    assert rest.stable


def test_lowest_mode() -> None:
    """Feron et al. 2023: a twist that sinks, of a frequency in the table; the next one at 34 Hz.

    Theirs: the heads move by (3.3, 0, −1), (−1.7, −2.9, −1) and (−1.7, 2.9, −1).
    """
    rest = simplex.at_rest()
    modes = cdsm.modes(rest.stiffness)
    np.testing.assert_allclose(modes.frequencies[1], 34.4, rtol=5e-3)
    ends = [rest.pose.arm.at(rest.pose.q + s * 1e-6 * modes.shapes[:, 0]) for s in (1.0, -1.0)]
    heads = ("head3", "head4", "head5")
    there, back = ([at.link_pose(head)[:3, 3] for head in heads] for at in ends)
    moved = np.subtract(there, back)
    moved /= -moved[:, 2].mean()
    np.testing.assert_allclose(moved[:, 2], -1.0, atol=0.02)
    np.testing.assert_allclose(np.linalg.norm(moved[:, :2], axis=1), 3.3, atol=0.1)
