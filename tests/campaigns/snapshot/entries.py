"""Values taken apart into named texts and arrays."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import inspect
import os
import re
import types
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.environment import TREE

PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic)
BRIEF = {"Site", "Joint", "Link", "CableRoute"}
"""Kinds whose repr says all."""


def clean(text: str) -> str:
    """The text without what depends on where the code and the folders are."""
    text = text.replace(os.getcwd(), "<folder>").replace(TREE, "<tree>")
    text = re.sub(r"\bcdsm(?:\.\w+)*\.(?=[A-Z])", "", text)
    text = re.sub(r"\b(?:__main__|tests\.campaigns\.snapshot\.\w+)\.", "", text)
    text = re.sub(r" at 0x[0-9a-f]+", " at <address>", text)
    return re.sub(r"\b\d+:\d\d:\d\d\b", "<time>", text)


def attempt(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """What the call returns, or the error it raises."""
    try:
        return function(*arguments, **keywords)
    except Exception as error:
        return error


def attributes(value: Any) -> list[str]:
    """Names of the public data of a value: fields, properties, and what an error carries."""
    kind = type(value)
    computed = (property, cached_property)
    names = {name for name in dir(kind) if isinstance(inspect.getattr_static(kind, name), computed)}
    if dataclasses.is_dataclass(value):
        names |= {field.name for field in dataclasses.fields(value)}
    if isinstance(value, BaseException):
        names |= set(vars(value))
    return sorted(name for name in names if not name.startswith("_"))


class Entries:
    """The answers of a job, taken apart into texts and arrays."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}
        self.arrays: dict[str, Any] = {}
        self._seen: dict[int, tuple[Any, str]] = {}

    def add(self, name: str, value: Any, depth: int = 8) -> None:
        """Record a value and, so many levels deep, all that it consists of."""
        if isinstance(value, np.ndarray) and value.dtype != object:
            self._put(self.arrays, name, value)
        elif isinstance(value, str):
            self._put(self.texts, name, clean(value))
        elif isinstance(value, (*PLAIN, Enum)) or depth <= 0:
            self._put(self.texts, name, clean(repr(value)))
        elif isinstance(value, Path):
            self._put(self.texts, name, f"Path {clean(str(value))}")
        elif isinstance(value, Mapping):
            self._put(self.texts, name, f"{type(value).__name__}: {', '.join(map(str, value))}")
            for key, part in value.items():
                self.add(f"{name}[{key}]", part, depth - 1)
        elif isinstance(value, (list, tuple)):
            if all(isinstance(part, PLAIN) for part in value):
                self._put(self.texts, name, clean(repr(value)))
                return
            self._put(self.texts, name, f"{type(value).__name__} of {len(value)}")
            for i, part in enumerate(value):
                self.add(f"{name}[{i}]", part, depth - 1)
        elif hasattr(value, "savefig"):
            self._figure(name, value)
        elif hasattr(value, "data_vars"):
            self._dataset(name, value)
        elif isinstance(value, BaseException) or type(value).__module__.startswith("cdsm"):
            self._object(name, value, depth)
        elif callable(value) or isinstance(value, types.ModuleType):
            self._put(self.texts, name, type(value).__name__)
        else:
            self._put(self.texts, name, clean(repr(value)))

    def _put(self, into: dict[str, Any], name: str, value: Any) -> None:
        assert name not in self.texts, name
        assert name not in self.arrays, name
        into[name] = value

    def _object(self, name: str, value: Any, depth: int) -> None:
        shown = clean(repr(value))
        if type(value).__name__ in BRIEF:
            self._put(self.texts, name, shown)
            return
        if id(value) in self._seen:
            self._put(self.texts, name, f"same as {self._seen[id(value)][1]}")
            return
        self._seen[id(value)] = (value, name)  # kept, so that no other gets its id
        self._put(self.texts, name, type(value).__name__)
        if not isinstance(value, BaseException):
            self._put(self.texts, f"{name} repr", shown)
        printed = attempt(str, value)
        if clean(str(printed)) != shown:
            self.add(f"{name} str", printed, 1)
        if hasattr(value, "_repr_html_"):
            page = attempt(value._repr_html_)
            if page != f"<pre>{html.escape(str(printed))}</pre>":
                self.add(f"{name} html", page, 1)
        for each in attributes(value):
            self.add(f"{name}.{each}", attempt(getattr, value, each), depth - 1)

    def _figure(self, name: str, figure: Any) -> None:
        """The pixels as a digest, and what was drawn, to see where another digest comes from."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        digest = hashlib.sha256(bytes(canvas.buffer_rgba())).hexdigest()
        self._put(self.texts, name, f"figure {canvas.get_width_height()} {digest}")
        for i, axes in enumerate(figure.axes):
            words = [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()]
            words += [text.get_text() for text in axes.texts]
            self._put(self.texts, f"{name} words {i}", clean(" | ".join(words)))
            for j, line in enumerate(axes.lines):
                drawn = line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_xydata()
                self._put(self.arrays, f"{name} line {i}.{j}", np.array(drawn, dtype=float))

    def _dataset(self, name: str, dataset: Any) -> None:
        self._put(self.texts, name, clean(f"{dict(dataset.sizes)} {list(dataset.variables)}"))
        self.add(f"{name} attributes", dict(dataset.attrs), 2)
        for each, variable in dataset.variables.items():
            values = np.asarray(variable.values)
            self.add(f"{name}.{each}", values if values.dtype != object else values.tolist())
            self.add(f"{name}.{each} attributes", [variable.dims, dict(variable.attrs)], 3)
