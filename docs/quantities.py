"""Write the page of the reference that lists all quantities, from their table."""

from cdsm.quantities import QUANTITIES, UNITS_OF_JOINTS, Quantity
from docs.formulas import typeset

_HEAD = """# Quantities

Names, units and dimensions of all quantities, and what gives them: {py:func}`cdsm.evaluate`
(batch), {py:func}`cdsm.sweep` and `cdsm sweep --outputs` (sweep), {py:func}`cdsm.uncertainty`
(uncertainty), {py:class}`cdsm.Objective` and {py:class}`cdsm.Constraint` (design). Attributes of
{py:class}`cdsm.Posture` and {py:class}`cdsm.Stiffness` have the same names. No variable of a
Dataset may have the name of a dimension, so $K_θ$ is `joint_stiffness` there. The dimensions follow
those of the postures. Of two units, the second is that of joints that slide. A design prefers the
most or the least.

| name | what it is | unit | dimensions | exists with | given by | best |
|---|---|---|---|---|---|---|
"""


def page() -> str:
    """Return the page as Markdown."""
    return _HEAD + "".join(_line(name, quantity) for name, quantity in QUANTITIES.items())


def _line(name: str, quantity: Quantity) -> str:
    units = UNITS_OF_JOINTS.get(quantity.unit, (quantity.unit,))
    cells = [
        f"`{name}`",
        ", ".join(filter(None, (quantity.words, typeset(quantity.definition)))),
        " or ".join(units),
        ", ".join(quantity.dims),
        quantity.needs,
        ", ".join(sorted(quantity.outputs)),
        quantity.best or "",
    ]
    return f"| {' | '.join(cells)} |\n"
