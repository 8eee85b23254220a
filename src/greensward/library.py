"""Scenes by name or file, checked with every technique's settings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from greensward.scene import Scene, TechniqueChoice
from greensward.scene import load as scenes
from greensward.scene.load import dump, presets
from greensward.techniques import SETTINGS

__all__ = ["as_scene", "dump", "load", "presets"]


def load(
    source: str | Path,
    *,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    seed: int | None = None,
    technique: str | None = None,
) -> Scene:
    """Load the scene of a preset's name, a TOML file, or a folder that holds `scene.toml`.

    `overrides` changes keys: `{"wind.0.speed_mps": 12.0}`, or strings as of `--set`.
    Raises `SceneError`, whose `problems` holds every error found, one sentence each.
    """
    return scenes.load(source, overrides=overrides, seed=seed, technique=technique, technique_settings=SETTINGS)


def as_scene(scene: Scene | str | Path, technique: str | None = None) -> Scene:
    """Return a scene as it is, or load it by a preset's name or a path; with `technique`, drawn by that one."""
    if not isinstance(scene, Scene):
        return load(scene, technique=technique)
    if technique is None or technique == scene.technique.name:
        return scene
    return scene.model_copy(update={"technique": TechniqueChoice(name=technique)})
