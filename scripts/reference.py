#!/usr/bin/env python3
"""Write docs/scene-reference.md from the models: `.venv/bin/python scripts/reference.py`."""

from pathlib import Path

from greensward.scene.reference import reference
from greensward.techniques import SETTINGS

page = Path(__file__).resolve().parents[1] / "docs" / "scene-reference.md"
page.write_text(reference(SETTINGS), encoding="utf-8")
print(page)
