"""Living grass for Python and OpenGL: millions of blades, each swaying on its own."""

import ast
from importlib import import_module
from pkgutil import get_data
from typing import Any

__version__ = "0.1.0"

# public names are listed once, in the stub, where editors and type checkers look for them
_HOMES = {
    alias.name: node.module or ""
    for node in ast.parse(get_data(__name__, "__init__.pyi") or "").body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
_GROUPS = [name for name, home in _HOMES.items() if home == __name__]

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    # the command line answers --help without waiting for NumPy and OpenGL to load
    if name in _GROUPS:
        return import_module(f"{__name__}.{name}")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name[:1].isupper():
        for group in _GROUPS:
            if name in __getattr__(group).__all__:
                raise AttributeError(f"{__name__}.{name} is now {__name__}.{group}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
