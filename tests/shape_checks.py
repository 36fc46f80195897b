"""Import hook that checks the array shapes of the project's signatures while tests run.

A signature gives a shape as `Annotated[Floats, "frames joints 3"]`, in the language of jaxtyping
(posefield/common/units.py). The hook wraps each function with such an annotation in the
checks of jaxtyping and beartype, and checks the fields of a dataclass after its `__init__`. Only
arrays are checked. The service has neither the hook nor the two libraries.

A check takes as long as many of the functions, so that only the first calls of each function in
each test are checked.
"""

import dataclasses
import inspect
import sys
from collections.abc import Callable
from functools import cached_property, reduce, wraps
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from operator import or_
from types import FunctionType, ModuleType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

PACKAGES = ("posefield", "posefield_train")
CHECKED_CALLS = 3
"""Calls of each function that are checked in each test."""
METHODS = (FunctionType, classmethod, staticmethod, property, cached_property)


def install() -> None:
    """Check the shapes of the project's modules that this process imports from now on."""
    sys.meta_path.insert(0, _CheckingFinder())


class _RunningTest:
    """Number of the test that runs: checks begin anew with each."""

    number = 0


def begin_test() -> None:
    """Check the first calls of each function again."""
    _RunningTest.number += 1


class _CheckingFinder(MetaPathFinder):
    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if fullname.partition(".")[0] not in PACKAGES:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _CheckingLoader(fullname, spec.loader.path)
        return spec


class _CheckingLoader(SourceFileLoader):
    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        for name, value in list(vars(module).items()):
            if getattr(value, "__module__", None) == module.__name__:
                setattr(module, name, _checked(value))


def _checked(value: Any) -> Any:
    """Return a function, a class or a descriptor with checks of its array shapes."""
    match value:
        case FunctionType():
            return _checked_function(value)
        case classmethod() | staticmethod():
            return type(value)(_checked(value.__func__))
        case property():
            return property(_checked(value.fget), value.fset, value.fdel, value.__doc__)
        case cached_property():
            value.func = _checked(value.func)
        case type():
            _check_class(value)
    return value


def _check_class(owner: type) -> None:
    for name, value in list(vars(owner).items()):
        if name != "__init__" and isinstance(value, METHODS):
            setattr(owner, name, _checked(value))
    if dataclasses.is_dataclass(owner) and (hints := _array_hints(owner)):
        owner.__init__ = _checked_init(owner.__init__, hints)


def _checked_function(function: FunctionType) -> Callable[..., Any]:
    hints = _array_hints(function)
    if not hints:
        return function
    from beartype import beartype
    from jaxtyping import jaxtyped

    function.__annotations__ = hints
    return _first_calls(jaxtyped(beartype(function), typechecker=None), function)


def _checked_init(init: Callable[..., None], hints: dict[str, Any]) -> Callable[..., None]:
    from beartype.door import die_if_unbearable
    from jaxtyping import jaxtyped

    @wraps(init)
    def checked(self: Any, *args: Any, **options: Any) -> None:
        init(self, *args, **options)
        with jaxtyped("context"):
            for name, hint in hints.items():
                said = f"{type(self).__name__}.{name} "
                die_if_unbearable(getattr(self, name), hint, exception_prefix=said)

    return _first_calls(checked, init)


def _first_calls(checked: Callable[..., Any], plain: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that is checked in the first calls of each test only."""
    number, left = -1, 0

    @wraps(plain)
    def called(*args: Any, **options: Any) -> Any:
        nonlocal number, left
        if number != _RunningTest.number:
            number, left = _RunningTest.number, CHECKED_CALLS
        if not left:
            return plain(*args, **options)
        left -= 1
        return checked(*args, **options)

    return called


def _array_hints(owner: Any) -> dict[str, Any]:
    """Return the annotations that name the shape of an array, as types of jaxtyping."""
    if not any("Annotated" in str(hint) for hint in inspect.get_annotations(owner).values()):
        return {}
    hints = get_type_hints(owner, include_extras=True)
    found = {name: _with_shapes(hint) for name, hint in hints.items()}
    return {name: found[name] for name, hint in hints.items() if found[name] is not hint}


def _with_shapes(hint: Any) -> Any:
    """Return a hint with the types of jaxtyping in it; the same object if it has no shape."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        base, dimensions = args[:2]
        return _jaxtyping_type(base, dimensions) if _is_array(base, dimensions) else hint
    own = tuple(map(_with_shapes, args))
    if all(a is b for a, b in zip(own, args, strict=True)):
        return hint
    if origin in (Union, UnionType):
        return reduce(or_, own)
    # Only arrays are checked: what stands beside them in a tuple may be anything.
    return origin[
        tuple(Any if a is b and a is not ... else a for a, b in zip(own, args, strict=True))
    ]


def _is_array(base: Any, dimensions: Any) -> bool:
    import numpy as np

    return get_origin(base) is np.ndarray and isinstance(dimensions, str)


def _jaxtyping_type(base: Any, dimensions: str) -> Any:
    import jaxtyping
    import numpy as np

    kinds = {
        np.float64: jaxtyping.Float,
        np.float32: jaxtyping.Float32,
        np.int64: jaxtyping.Int,
        np.bool_: jaxtyping.Bool,
        np.complex128: jaxtyping.Complex,
    }
    # Any object with a shape: a sum over the last axis of a single row is a number, not an array.
    kind = get_args(get_args(base)[1])[0]
    return kinds.get(kind, jaxtyping.Shaped)[Any, dimensions]
