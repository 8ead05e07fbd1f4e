"""Formulas of docstrings as LaTeX. In single backquotes they read well in a terminal, too.

A docstring has ```K_θ = H_L·F + J_Lᵀ K_L J_L```, which ``help`` shows as it is, and the site as a
formula. Greek letters and most signs stay, since MathJax knows them. What is translated:

- ``F_c``, ``C_vv``, ``r₁``, ``T_{j+1}``: an index is letters and digits, or what is in braces;
- ``J_Lᵀ``, ``K_θ⁻¹``, ``x^p``, ``e^{−μφ}``, ``(1 + u)^((p−1)/2)``: powers;
- ``√x``, ``√(a² + b²)``, ``½``;
- words such as ``cos``, ``min`` and ``exp``, which are upright. Capitals such as ``EA`` are one
  name, and ``dF`` is a differential.
"""

import re
from typing import Final
from unicodedata import normalize

_MARKED: Final = re.compile(r"(:\w+:`[^`]*`|``[^`]*``)|`([^`]+)`")
"""What stands in backquotes: a role such as ``:meth:`at``` or code, or a formula."""

_SIGNS: Final = {
    "·": r"\cdot ",
    "×": r"\times ",
    "‖": r"\|",
    "|": r"\vert ",  # a bar of its own would end a cell of a table
    "°": r"^\circ ",
    "Σ": r"\sum ",
    "∫": r"\int ",
    "…": r"\dots ",
    "−": "-",
    "′": "'",
    "″": "''",
    "½": r"\frac{1}{2}",
    "¼": r"\frac{1}{4}",
    "%": r"\%",
}
_TOKEN: Final = re.compile(
    r"(?P<raised>[⁰¹²³⁴-⁹⁺⁻ᵀ]+)|(?P<lowered>[₀-₉]+)|(?P<mark>[_√]|\^[-−]?)|(?P<word>atan2|[A-Za-z]+)|.",
    re.DOTALL,
)
_NAME: Final = re.compile(r"[A-Za-zΑ-ω0-9]+|.")


def typeset(text: str) -> str:
    """Return a text of a docstring with its formulas as Markdown has them, ``$…$``."""
    return _MARKED.sub(lambda found: found[1] or f"${latex(found[2])}$", text)


def latex(formula: str) -> str:
    """Return a formula of a docstring as LaTeX."""
    done, rest = "", formula
    while rest:
        found = _TOKEN.match(rest)
        assert found is not None
        piece, rest = found[0], rest[found.end() :]
        match found.lastgroup:
            case "raised":
                power = normalize("NFKC", piece).replace("−", "-").replace("T", r"\mathsf{T}")
                done += f"^{{{power}}}"
            case "lowered":
                done += f"_{{{normalize('NFKC', piece)}}}"
            case "mark":
                argument, rest = _argument(rest)
                done += {"_": f"_{{{_index(argument)}}}", "√": rf"\sqrt{{{latex(argument)}}}"}.get(
                    piece, f"^{{{'-' * (len(piece) - 1)}{latex(argument)}}}"
                )
            case "word":
                done += _word(piece)
            case _:
                done += _SIGNS.get(piece, piece)
    return done


def _argument(text: str) -> tuple[str, str]:
    """Return what a mark acts on, without its brackets, and the text behind it."""
    if text[:1] not in ("(", "{"):
        found = _NAME.match(text)
        assert found is not None, f"a formula ends in a mark that acts on nothing: {text!r}"
        return found[0], text[found.end() :]
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign in "({") - (sign in ")}")
        if depth == 0:
            return text[1:place], text[place + 1 :]
    raise ValueError(f"a bracket is not closed: {text!r}")


def _index(text: str) -> str:
    """Return an index: up to two letters are indices of their own, more are a word."""
    if text.isalnum():
        return text if len(text) < 3 else rf"\mathrm{{{text}}}"
    return latex(text)


def _word(text: str) -> str:
    if len(text) == 1 or (len(text) == 2 and text[0] == "d"):  # a differential
        return text
    if text[0] == "d" and text[1:].isupper():
        return "d" + _word(text[1:])
    return rf"\mathit{{{text}}}" if text.isupper() else rf"\operatorname{{{text}}}"
