"""Numerical code with loops, written once in a small part of Python: it runs as Python and as machine code.

A kernel is a function of two arrays, `given` and `found`. Its body has numbers, arrays of a fixed size, `for` over a
range, `while` and `if`, no calls but abs, sqrt, `space` and `places`; names in capitals are sizes or tables of numbers.
Graphs call it as they call a CasADi function. control/export writes it in C and in Structured Text.
"""

import ast
import ctypes
import hashlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import sqrt
from operator import add, mul
from types import FunctionType
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

import numpy as np

if TYPE_CHECKING:
    import casadi as ca

    from .object_cache import Library

_TABLES: "WeakValueDictionary[int, Kernel]" = WeakValueDictionary()  # by the address of their numbers
_OF_SIZES = {ast.Add: add, ast.Mult: mul}


def space(size: int) -> np.ndarray:
    """An array [size] of numbers, to be written before it is read."""
    return np.full(size, np.nan)


def places(size: int) -> np.ndarray:
    """An array [size] of whole numbers, to be written before it is read."""
    return np.zeros(size, int)


@dataclass(frozen=True)
class KernelShape:
    """What decides the code of a kernel: its function, its constants, the lengths of its tables in their order, and
    how many numbers it is given and finds."""

    function: Callable[[Any, Any], None]
    constants: tuple[tuple[str, int | float], ...]
    tables: tuple[tuple[str, int], ...]
    given: int
    found: int

    @property
    def tree(self) -> ast.FunctionDef:
        """The function as it is written."""
        (tree,) = ast.parse(inspect.getsource(self.function)).body
        assert isinstance(tree, ast.FunctionDef)
        return tree

    def array(self, node: Any) -> tuple[str, int] | None:
        """The kind, space or places, and size of the array that an expression makes; None for one that makes none."""
        kind = getattr(node.func, "id", "") if isinstance(node, ast.Call) else ""
        return (kind, self._size(node.args[0])) if kind in ("space", "places") else None

    def _size(self, node: Any) -> int:
        """A sum or product of sizes and whole numbers."""
        if isinstance(node, ast.Constant):
            whole: Any = node.value
        elif isinstance(node, ast.Name):
            whole = dict(self.constants)[node.id]
        else:
            whole = _OF_SIZES[type(node.op)](self._size(node.left), self._size(node.right))
        assert isinstance(whole, int), f"{ast.unparse(node)} is no whole number"
        return whole

    @cached_property
    def first(self) -> dict[str, int]:
        """The place at which each table begins."""
        ends = np.cumsum([0, *(length for _, length in self.tables)]).tolist()
        return {name: end for (name, _), end in zip(self.tables, ends, strict=False)}

    @cached_property
    def name(self) -> str:
        """Another one for every code."""
        text = f"{inspect.getsource(self.function)} {self.constants} {self.tables} {self.given} {self.found}"
        return f"{self.function.__name__}_{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    @property
    def code(self) -> "Library | None":
        """The machine code of `name(given, found)`, whose last given number is the address of the tables; None where
        this machine cannot compile."""
        return _code(self)

    @property
    def graph(self) -> "ca.Function":
        """[given, address of the tables] -> found, as a function that graphs of symbols call."""
        return _graph(self)


class Kernel:
    """A kernel with its tables `numbers` [k], one after another. Its `handle`, which graphs are given as a number, is
    good as long as the kernel lives, and in this process only. `in_graphs`: what graphs that are evaluated in Python
    call in its place."""

    def __init__(self, shape: KernelShape, numbers: np.ndarray) -> None:
        self.shape, self.numbers = shape, np.ascontiguousarray(numbers, float)
        address = self.numbers.ctypes.data
        self.handle = float(address)
        _TABLES[address] = self
        self._given, self._found = np.zeros(shape.given + 1), np.zeros(shape.found)
        self._given[-1] = self.handle
        self._library = shape.code  # code that calls it finds it as long as a kernel of its shape lives
        call = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
        self._call = call(self._library[shape.name]) if self._library else None
        self._addresses = self._given.ctypes.data, self._found.ctypes.data
        self.in_graphs: Callable[[np.ndarray], np.ndarray] = self

    def table(self, name: str) -> np.ndarray:
        """One of the tables."""
        first = self.shape.first[name]
        return self.numbers[first : first + dict(self.shape.tables)[name]]

    def __call__(self, given: np.ndarray) -> np.ndarray:
        """What it finds [found] of what it is given; the array is that of every call."""
        self._given[:-1] = given
        if self._call:
            self._call(*self._addresses)
        else:
            self.in_python(self._given, self._found)
        return self._found

    @cached_property
    def in_python(self) -> Callable[[np.ndarray, np.ndarray], None]:
        """The function with its constants and tables."""
        words: dict[str, Any] = {"abs": abs, "sqrt": sqrt, "range": range, "space": space, "places": places}
        words |= dict(self.shape.constants) | {name: self.table(name).tolist() for name, _ in self.shape.tables}
        return FunctionType(self.shape.function.__code__, words)


@lru_cache(maxsize=64)
def _code(shape: KernelShape) -> "Library | None":
    try:
        from . import object_cache
        from .kernel_code import kernel_code

        text = kernel_code(shape)
        library = object_cache.load(("kernel", text), lambda: text, (shape.name,), optimised=True)
    except (ImportError, OSError, RuntimeError):
        return None
    object_cache.provide(shape.name, library)
    return library


@lru_cache(maxsize=64)
def _graph(shape: KernelShape) -> "ca.Function":
    from .kernel_graph import KernelGraph

    _code(shape)
    return KernelGraph(shape.name, shape.given + 1, shape.found, _found)


def _found(given: np.ndarray) -> np.ndarray:
    """What the kernel whose tables are at the last of these numbers finds of the others."""
    return _TABLES[int(given[-1])].in_graphs(given[:-1])
