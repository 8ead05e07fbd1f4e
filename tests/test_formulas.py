"""Formulas of public docstrings: marked, and translated to LaTeX that a typesetter can read."""

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
from matplotlib.mathtext import MathTextParser

from docs.formulas import latex, typeset

DOCS = Path(__file__).parents[1] / "docs"
LISTED = (DOCS / "reference/api.rst").read_text(encoding="utf-8")
CODE = re.compile(r"``.*?``|:\w+:`.*?`", re.DOTALL)
UNIT = re.compile(r"(?<![\w)])\[.*?\]", re.DOTALL)
FORMULA = re.compile("`(.*?)`", re.DOTALL)
IS_FORMULA = re.compile(r"[ᵀ∂√Σ∫‖⁺⁻^]|\b[^\W\d_]′?_[^\W_]|[₀-₉]")


def documented() -> Iterator[tuple[str, Any]]:
    """What the reference of the site shows: listed names, and the members of classes."""
    for name in re.findall(r"^   cdsm\.(\S+)$", LISTED, re.MULTILINE):
        value = resolve_name(f"cdsm.{name}")
        yield name, value
        for member, of_class in vars(value).items() if inspect.isclass(value) else ():
            if not member.startswith("_") and (callable(of_class) or hasattr(of_class, "__get__")):
                yield f"{name}.{member}", getattr(value, member)


TEXTS = {
    name: CODE.sub("", text.partition("\nExample:\n")[0])
    for name, value in documented()
    if not isinstance(value, (int, float, str, tuple, dict))
    if (text := inspect.getdoc(value))
}
FORMULAS = sorted({found for text in TEXTS.values() for found in FORMULA.findall(text)})


def test_formulas_of_public_docstrings_stand_in_backquotes() -> None:
    assert len(TEXTS) > 500
    plain = {name: UNIT.sub("", FORMULA.sub("", text)) for name, text in TEXTS.items()}
    found = {name: IS_FORMULA.findall(text) for name, text in plain.items()}
    assert {name: signs for name, signs in found.items() if signs} == {}


@pytest.mark.parametrize("page", sorted(DOCS.rglob("[a-z]*.md")), ids=lambda page: page.stem)
def test_formulas_of_pages_are_typeset(page: Path) -> None:
    if page.stem in {"changelog", "commands", "contributing", "paper"}:  # made of other texts
        return
    text = page.read_text(encoding="utf-8")
    for typeset_or_code in (r"```.*?```", r"\$\$.*?\$\$", r"\$[^$]*\$", r"`[^`]*`", r"\[.*?\]"):
        text = re.sub(typeset_or_code, "", text, flags=re.DOTALL)
    assert IS_FORMULA.findall(text) == []


def test_each_formula_can_be_typeset() -> None:
    assert len(FORMULAS) > 200
    parse = MathTextParser("agg").parse
    for formula in FORMULAS:
        written = latex(" ".join(formula.split()))
        assert not re.search(r"[ᵀ√⁺⁻½]", written), formula
        parse(f"${written}$")


@pytest.mark.parametrize(
    ("formula", "written"),
    [
        ("K_θ = H_L·F + J_Lᵀ K_L J_L", r"K_{θ} = H_{L}\cdot F + J_{L}^{\mathsf{T}} K_{L} J_{L}"),
        ("J⁺ᵀ K J⁺", r"J^{+\mathsf{T}} K J^{+}"),
        ("D^-½ P", r"D^{-\frac{1}{2}} P"),
        ("k x (1 + u)^((p−1)/2)", "k x (1 + u)^{(p-1)/2}"),
        (
            "|ln T_{j+1} − ln T_j|",
            r"\vert \operatorname{ln} T_{j+1} - \operatorname{ln} T_{j}\vert ",
        ),
        ("e^{−μφ}", "e^{-μφ}"),
        ("√(Σ u_i²)", r"\sqrt{\sum  u_{i}^{2}}"),
        ("√F x", r"\sqrt{F} x"),
        ("1/k_series", r"1/k_{\mathrm{series}}"),
        ("(C_vv)⁻¹", "(C_{vv})^{-1}"),
        ("atan2(y, x)", r"\operatorname{atan2}(y, x)"),
        ("dEA/dF", r"d\mathit{EA}/dF"),
        ("r₁/r₂", "r_{1}/r_{2}"),
        ("k′_c", "k'_{c}"),
    ],
)
def test_structure_becomes_latex(formula: str, written: str) -> None:
    assert latex(formula) == written


@pytest.mark.parametrize("formula", ["x_", "√(a + b", "e^"])
def test_a_mark_that_acts_on_nothing_is_refused(formula: str) -> None:
    with pytest.raises((AssertionError, ValueError), match=r"nothing|not closed"):
        latex(formula)


def test_code_and_roles_are_no_formulas() -> None:
    text = "`K_θ` of :attr:`Stiffness.joint`, ``K_θ``; `q_0` [rad]"
    assert typeset(text) == "$K_{θ}$ of :attr:`Stiffness.joint`, ``K_θ``; $q_{0}$ [rad]"
