"""Strain, tension, energy and rigidity of a wire belong together."""

import numpy as np
import pytest

import cdsm

STRAND = cdsm.StrandElasticity.eq19_repaired()
TABLE = cdsm.TabulatedElasticity(
    tuple(np.linspace(5.0, 800.0, 60)), tuple(STRAND.strain(np.linspace(5.0, 800.0, 60)))
)
LAWS = {"linear": cdsm.LinearElasticity(48e3), "strand": STRAND, "table": TABLE}


@pytest.mark.parametrize("name", LAWS)
def test_tension_inverts_strain(name: str) -> None:
    law = LAWS[name]
    tension = np.array([[6.0, 31.0, 31.5], [120.0, 400.0, 799.0]])
    # strain is flat where the wire is stiff: 1e-16 of strain are some 1e-12 N there
    np.testing.assert_allclose(law.tension(law.strain(tension)), tension, rtol=1e-11)


@pytest.mark.parametrize("name", LAWS)
def test_energy_by_strain_is_tension_and_tension_by_strain_is_rigidity(name: str) -> None:
    law = LAWS[name]
    tension = np.array([12.0, 60.0, 250.0, 700.0])
    strain = np.asarray(law.strain(tension))
    errors = []
    for step in (2e-5, 1e-5):
        up, down = law.tension(strain + step), law.tension(strain - step)
        force = (law.energy(up) - law.energy(down)) / (2.0 * step)
        rigidity = (up - down) / (2.0 * step)
        errors.append([force / tension - 1.0, rigidity / law.rigidity(tension) - 1.0])
    coarse, fine = (abs(np.array(error)).max(axis=1) for error in errors)
    assert np.all(coarse < 2e-2)
    # second order (to 1e-9 if exact); a table's third derivative jumps at its points
    assert np.all(fine < np.maximum(0.3 * coarse, 1e-9))


@pytest.mark.parametrize("name", LAWS)
def test_strain_out_of_reach_is_refused(name: str) -> None:
    for strain in (-1e-3, 1e12):
        with pytest.raises(cdsm.ElasticityRangeError, match="no tension of the domain"):
            LAWS[name].tension(strain)


def test_table_passes_through_its_points() -> None:
    np.testing.assert_allclose(
        TABLE.strain(TABLE.tensions), np.subtract(TABLE.strains, TABLE.strains[0]), rtol=1e-13
    )
    assert tuple(TABLE.domain) == (5.0, 800.0)


@pytest.mark.parametrize(
    ("tensions", "strains"),
    [
        ((1.0,), (0.0,)),
        ((1.0, 1.0), (0.0, 1.0)),
        ((1.0, 2.0), (1.0, 0.0)),
        ((1.0, 2.0), (0.0, 1.0, 2.0)),
        ((-1.0, 2.0), (0.0, 1.0)),
        ((1.0, float("nan")), (0.0, 1.0)),
        ((0.0, 5e-324, 100.0), (0.0, 0.002, 0.005)),  # a slope beyond float64
    ],
)
def test_table_that_does_not_rise_is_refused(
    tensions: tuple[float, ...], strains: tuple[float, ...]
) -> None:
    with pytest.raises(cdsm.InvalidInput):
        cdsm.TabulatedElasticity(tensions, strains)
