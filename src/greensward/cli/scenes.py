"""`greensward scenes`."""

import json
from typing import Annotated

import typer

EXAMPLES = """\b
Examples:
  greensward scenes
  greensward scenes --json
"""


def scenes(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the scenes that come with greensward."""
    from greensward.scene.load import presets

    found = presets()
    if as_json:
        print(json.dumps([{"name": n, "title": t, "summary": s} for n, (t, s) in found.items()], indent=2))
        return
    width = max(map(len, found), default=0)
    for name, (title, summary) in found.items():
        print(f"{name:{width}}  {title}{'. ' if summary else ''}{summary}")
