"""The scene: everything that is drawn, frozen and typed, with no GPU in sight."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, model_validator

from greensward.scene.base import Count, Model, Text
from greensward.scene.field import Culling, Growth, Shadows, Sowing, TechniqueChoice
from greensward.scene.flowers import MOST_FLOWERS, Flowers
from greensward.scene.force import Force
from greensward.scene.grass import Grass
from greensward.scene.ground import FlatGround, Ground
from greensward.scene.light import Camera, Post, Sky, Sun
from greensward.scene.objects import Object
from greensward.scene.water import Water
from greensward.scene.wind import Gusts, Simulation, Wind


class Scene(Model):
    """What is drawn. Load one with `greensward.load`, or build it from these parts."""

    title: Text = ""
    """A name for people."""
    seed: Count = Field(1, ge=0, le=2**32 - 1)
    """All randomness follows from it."""
    ground: Ground = FlatGround()
    """What the grass stands on."""
    grass: tuple[Grass, ...] = Field((Grass(),), max_length=16)
    """Species, mixed by share."""
    flowers: Annotated[tuple[Flowers, ...], Field(max_length=MOST_FLOWERS)] = ()
    """Plants that are pictures."""
    sowing: Sowing = Sowing()
    """Where blades grow."""
    wind: tuple[Wind, ...] = Field((Gusts(),), max_length=8)
    """Winds; they add up."""
    force: Annotated[tuple[Force, ...], Field(max_length=8)] = ()
    """What presses the grass of the ground down or pushes it aside; they add up. Grass on objects feels none."""
    simulation: Simulation | None = None
    """How blades remember. Without it, none does."""
    growth: Growth | None = None
    """How the grass grows. Without it, it is full-grown."""
    object: Annotated[tuple[Object, ...], Field(max_length=1000)] = ()
    """Objects in the grass."""
    water: Water | None = None
    """A lake. Without it, there is none."""
    sun: Sun = Sun()
    """Where the sun stands."""
    sky: Sky = Sky()
    """The air."""
    shadows: Shadows = Shadows()
    """Shadow maps."""
    camera: Camera = Camera()
    """Where it is seen from."""
    culling: Culling = Culling()
    """Which blades are left out."""
    technique: TechniqueChoice = TechniqueChoice()
    """How the grass is drawn."""
    post: Post = Post()
    """From light to picture."""

    _folder: Path = PrivateAttr(default=Path())

    @model_validator(mode="before")
    @classmethod
    def _kinds_may_be_left_out(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        values = dict(values)
        if isinstance(ground := values.get("ground"), dict):
            values["ground"] = {"kind": "flat", **ground}
        if isinstance(winds := values.get("wind"), list | tuple):
            values["wind"] = [{"kind": "gusts", **wind} if isinstance(wind, dict) else wind for wind in winds]
        return values

    def resolve(self, file: str) -> Path:
        """The path of a file that the scene names, relative to the scene file's folder."""
        return self._folder / Path(file).expanduser()

    def in_folder(self, folder: Path) -> "Scene":
        """The same scene with its files looked for in `folder`."""
        copy = self.model_copy()
        copy._folder = folder
        return copy
