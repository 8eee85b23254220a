"""Scenes by name or file, with every technique's settings known."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from greensward.scene import Scene
from greensward.scene import load as scenes
from greensward.scene.load import dump, presets
from greensward.techniques import SETTINGS

__all__ = ["dump", "load", "presets"]


def load(
    source: str | Path,
    *,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    seed: int | None = None,
    technique: str | None = None,
) -> Scene:
    """The scene of a preset's name, a TOML file, or a folder that holds `scene.toml`.

    `overrides` changes keys: `{"wind.0.speed_mps": 12.0}`, or strings as of `--set`.
    Raises `SceneError`, whose `problems` are all that is wrong, one sentence each.
    """
    return scenes.load(source, overrides=overrides, seed=seed, technique=technique, technique_settings=SETTINGS)
