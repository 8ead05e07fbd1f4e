"""Turn kernels into Python functions, which run the calls that are not worth compiling.

For one posture, Python runs a kernel as it is written. For a block of postures, it runs a loop over
them as operations of numpy on the last axis of its arrays:

    for w in lanes(width):                             w = slice(None)
        c[i, w] = a[w] if b[w] > 0.0 else 0.0          c[i, w] = select(b[w] > 0.0, a[w], 0.0)

Both ways give the same bits as the compiled kernel: numpy rounds each operation as the loop does.
"""

from __future__ import annotations

import ast
import inspect
import math
import sys
from collections.abc import Callable
from copy import deepcopy
from functools import cache, reduce
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher


def python_kernel(function: FunctionType, wide: bool) -> Callable[..., Any]:
    """Return a kernel as a Python function: for a block of postures if ``wide``, else for one.

    The kernels that it calls become Python functions too.
    """
    kernel: Callable[..., Any] = _names(function.__module__, wide)[function.__name__]
    return kernel


@cache
def _names(module: str, wide: bool) -> dict[str, Any]:
    """Return the global names of ``module``, its kernels replaced by Python functions.

    If ``wide``, the functions compute a block of postures, else one posture.
    """
    home = sys.modules[module]
    names: dict[str, Any] = {**vars(home), **_OPERATIONS}
    own = set()
    for name, each in vars(home).items():
        if isinstance(each, Dispatcher) and each.py_func.__module__ == module:
            own.add(name)
            names[name] = FunctionType(each.py_func.__code__, names, name)
        elif isinstance(each, Dispatcher):
            names[name] = python_kernel(each.py_func, wide)
    if wide:
        tree = ast.parse(inspect.getsource(home))
        tree.body = [each for each in tree.body if getattr(each, "name", None) in own]
        changed = ast.fix_missing_locations(_Loops().visit(tree))
        exec(compile(changed, inspect.getfile(home), "exec"), names)
    return names


def _atan2(y: Any, x: Any) -> Any:
    """Compute atan2(y, x) with the bits of the C library; numpy may compute other bits."""
    return np.asarray(np.frompyfunc(math.atan2, 2, 1)(y, x), dtype=np.float64)[()]


def _max(*values: Any) -> Any:
    """Return the elementwise maximum, with Python's rules for NaN and for signed zeros."""
    return reduce(lambda a, b: np.where(b > a, b, a), values)


def _min(*values: Any) -> Any:
    return reduce(lambda a, b: np.where(b < a, b, a), values)


def _highest(start: float, values: Any) -> float:
    return max(start, float(np.fmax.reduce(values)))


_OPERATIONS = {
    "math": SimpleNamespace(
        **vars(math)
        | {"sqrt": np.sqrt, "isnan": np.isnan, "copysign": np.copysign}
        | {"atan2": _atan2}
    ),
    "_max": _max,
    "_min": _min,
    "_highest": _highest,
    "_select": np.where,
    "_sum": np.sum,
    "_not": np.logical_not,
    "_where": np.flatnonzero,
    "_numbers": np.arange,
}
"""Names that the rewritten kernels use, with the functions behind them."""


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _found(node: ast.AST) -> set[str]:
    return {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}


class _Loops(ast.NodeTransformer):
    """Replace each loop over postures by operations on arrays.

    A loop that cannot be rewritten stays: for example, if a posture depends on the one before.
    """

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.decorator_list = []
        whole = any(each.arg == "w" for each in node.args.args)
        return _Operations(None).generic_visit(node) if whole else self.generic_visit(node)

    def visit_For(self, node: ast.For) -> Any:
        if not (isinstance(node.iter, ast.Call) and ast.unparse(node.iter.func) == "lanes"):
            return self.generic_visit(node)
        numbered = "np.intp(w)" in ast.unparse(node)
        every = (
            _call("_numbers", *node.iter.args) if numbered else _call("slice", ast.Constant(None))
        )
        lines: list[ast.stmt] = []
        change = _Operations({"w"})
        for each in deepcopy(node.body):
            line = change.line(each)
            if line is None:
                return node
            lines += [ast.Assign([ast.Name("w", ast.Store())], every), line]
        return lines


class _Operations(ast.NodeTransformer):
    """Replace Python's operations on numbers by numpy's operations on arrays.

    ``arrays`` has the names of the variables that have one value per posture; None means all names.
    """

    def __init__(self, arrays: set[str] | None) -> None:
        self.arrays = arrays

    def line(self, node: ast.stmt) -> ast.stmt | None:
        """Rewrite ``node``, a line of a loop over postures, as one operation on all postures.

        Returns None if the loop must run posture by posture.
        """
        arrays = self.arrays or set()
        match node:
            case ast.AugAssign(target=ast.Subscript()):
                self.generic_visit(node)
            case ast.AugAssign(target=ast.Name(id=name), op=ast.Add()) if name not in arrays:
                node.value = _call("_sum", self.visit(node.value))
            case ast.Assign(
                targets=[ast.Name(id=name)],
                value=ast.Call(func=ast.Name(id="max"), args=[ast.Name(id=same) as start, value]),
            ) if name == same and name not in arrays:
                node.value = _call("_highest", start, self.visit(value))
            case ast.Assign():
                targets = [each for target in node.targets for each in _parts(target)]
                assigned = {each.id for each in targets if isinstance(each, ast.Name)}
                if (assigned & _found(node.value)) - arrays:
                    return None
                self.visit(node)
                arrays |= assigned
            case ast.If(orelse=[]) if _found(node) & arrays == {"w"}:
                some = _call("_where", self.visit(node.test))
                return ast.For(ast.Name("w", ast.Store()), some, node.body, [])
            case _:
                return None
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        """Make ``node`` assign a copy where it would assign a view of an array.

        A view would change later, when the array is overwritten.
        """
        self.generic_visit(node)
        if not isinstance(node.targets[0], ast.Subscript):
            copies = [
                ast.UnaryOp(ast.UAdd(), each) if isinstance(each, ast.Subscript) else each
                for each in _parts(node.value)
            ]
            several = isinstance(node.value, ast.Tuple)
            node.value = ast.Tuple(copies, ast.Load()) if several else copies[0]
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        array = self._is_array(node.test)
        self.generic_visit(node)
        return _call("_select", node.test, node.body, node.orelse) if array else node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        array = self._is_array(node)
        way = ast.BitOr() if isinstance(node.op, ast.Or) else ast.BitAnd()
        self.generic_visit(node)
        return reduce(lambda a, b: ast.BinOp(a, way, b), node.values) if array else node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        array = isinstance(node.op, ast.Not) and self._is_array(node)
        self.generic_visit(node)
        return _call("_not", node.operand) if array else node

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        self.generic_visit(node)
        if len(node.ops) == 1:
            return node
        ends = [node.left, *node.comparators]
        pairs: list[ast.expr] = [
            ast.Compare(a, [way], [b]) for a, way, b in zip(ends, node.ops, ends[1:], strict=False)
        ]
        return reduce(lambda a, b: ast.BinOp(a, ast.BitAnd(), b), pairs)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if ast.unparse(node.func) in ("max", "min") and self._is_array(node):
            node.func = ast.Name(f"_{ast.unparse(node.func)}", ast.Load())
        return self.generic_visit(node)

    def _is_array(self, node: ast.AST) -> bool:
        return self.arrays is None or not self.arrays.isdisjoint(_found(node))


def _parts(node: ast.expr) -> list[ast.expr]:
    return node.elts if isinstance(node, ast.Tuple) else [node]
