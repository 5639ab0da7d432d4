"""Types and shapes of the package, checked at each call while its tests run.

Of each function beartype checks arguments and result; names of axes mean the same size throughout a call. What
jaxtyping has for this binds arguments by name at each call, which takes longer than many a call: here only functions
with named axes get a scope for them, and nothing is bound.
"""

import ast
import dataclasses
import functools
import hashlib
import inspect
import itertools
import re
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder, SourceFileLoader
from importlib.util import cache_from_source, decode_source
from pathlib import Path
from typing import Any, get_args
from unittest.mock import patch

from beartype import BeartypeConf, beartype
from jaxtyping import AbstractArray, jaxtyped

PACKAGE = "jaxmotor"
VERSION = hashlib.md5(Path(__file__).read_bytes()).hexdigest()
"""Of the byte code that is kept of checked modules."""
CHECKS = BeartypeConf(violation_type=TypeError)
"""Python itself raises this where a value is not of the type that is needed, and the package expects it of strangers'
files."""


def pytest_load_initial_conftests():
    """Before anything imports the package."""
    assert PACKAGE not in sys.modules
    sys.meta_path.insert(0, _Finder())


def checked(definition: Any) -> Any:
    """The function with its checks, or the dataclass with those of its fields."""
    if inspect.isclass(definition):
        made = definition.__init__
        if dataclasses.is_dataclass(definition) and not hasattr(made, "is_checked"):
            definition.__init__ = checked(made)
        return definition
    definition.__annotations__ = {name: _unquoted(one, definition) for name, one in definition.__annotations__.items()}
    judged = beartype(definition, conf=CHECKS)
    if not any(map(_names_axes, definition.__annotations__.values())):
        return judged

    @functools.wraps(definition)
    def call(*arguments: Any, **named: Any) -> Any:
        with jaxtyped("context"):
            return judged(*arguments, **named)

    call.is_checked = True  # pyright: ignore[reportFunctionMemberAccess]
    return call


def _unquoted(annotation: Any, definition: Any) -> Any:
    """Names that stand for types not before later, or for type checkers alone, may be anything."""
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, definition.__globals__)
    except (NameError, TypeError):
        return Any


def _names_axes(annotation: Any) -> bool:
    if inspect.isclass(annotation) and issubclass(annotation, AbstractArray):
        return re.search("[A-Za-z]", annotation.dim_str) is not None
    return any(map(_names_axes, get_args(annotation)))


class _Marks(ast.NodeTransformer):
    """`checked` as the first decorator of all functions and the last of all classes."""

    def visit_Module(self, node: ast.Module) -> ast.Module:
        self.generic_visit(node)
        begins = len(list(itertools.takewhile(_comes_first, node.body)))
        node.body.insert(begins, ast.Import([ast.alias(__name__)]))
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.generic_visit(node)
        node.decorator_list.append(_mark(node))
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        self.generic_visit(node)
        node.decorator_list.insert(0, _mark(node))
        return node


def _comes_first(node: ast.stmt) -> bool:
    is_future = isinstance(node, ast.ImportFrom) and node.module == "__future__"
    return is_future or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))


def _mark(node: ast.AST) -> ast.expr:
    mark = ast.Attribute(ast.Name(__name__, ast.Load()), "checked", ast.Load())
    for part in ast.walk(mark):
        ast.copy_location(part, node)
    return mark


class _Loader(SourceFileLoader):
    def source_to_code(self, data: Any, path: Any, *, _optimize: int = -1) -> Any:
        tree = _Marks().visit(ast.parse(decode_source(data), path))
        return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True, optimize=_optimize)

    def exec_module(self, module: Any) -> None:
        kept = functools.partial(cache_from_source, optimization=f"checked{VERSION}")
        with patch("importlib._bootstrap_external.cache_from_source", kept):
            super().exec_module(module)


class _Finder(MetaPathFinder):
    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> Any:
        if fullname.partition(".")[0] != PACKAGE:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec
