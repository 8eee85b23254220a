"""Living grass for Python and OpenGL: millions of blades, each swaying on its own."""

from __future__ import annotations

from functools import cache
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:  # the import of typing itself takes longer than all else here, and interrupts wait for it
    from typing import Any

__version__ = "0.1.0"


@cache
def _homes() -> dict[str, str]:
    """Modules of the public names; the stub lists them, where editors and type checkers look for them."""
    import ast
    from pkgutil import get_data

    return {
        alias.name: node.module or ""
        for node in ast.parse(get_data(__name__, "__init__.pyi") or "").body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def __getattr__(name: str) -> Any:
    # the command line answers --help without waiting for NumPy and OpenGL to load
    if name == "__all__":
        return sorted(_homes())
    if name.startswith("__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    homes = _homes()
    groups = [group for group, home in homes.items() if home == __name__]
    if name in groups:
        return import_module(f"{__name__}.{name}")
    if name in homes:
        return getattr(import_module(homes[name]), name)
    if name[:1].isupper():
        for group in groups:
            if name in __getattr__(group).__all__:
                raise AttributeError(f"{__name__}.{name} is now {__name__}.{group}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*sorted(_homes()), "__version__"]
