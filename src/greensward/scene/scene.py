"""The scene: everything that is drawn, frozen and typed, without GPU code."""

from pathlib import Path
from typing import Annotated, Any, Self, overload

from pydantic import Field, PrivateAttr, model_validator

from greensward.scene.base import Count, Many, Model, Text, default
from greensward.scene.clearing import MOST_CLEARINGS, Clearing
from greensward.scene.colour import GrassColour, GroundColour
from greensward.scene.fence import MOST_FENCES, Fence
from greensward.scene.field import Culling, Growth, Shadows, Sowing, TechniqueChoice
from greensward.scene.flowers import MOST_FLOWERS, MOST_PLANTS, Flowers
from greensward.scene.force import MOST_FORCES, Force
from greensward.scene.grass import MOST_SPECIES, Grass
from greensward.scene.ground import FlatGround, Ground
from greensward.scene.light import Camera, Fog, Phong, Post, Sky, Sun
from greensward.scene.objects import MOST_OBJECTS, Object
from greensward.scene.raster import Raster
from greensward.scene.water import Water
from greensward.scene.wind import MOST_WINDS, Gusts, Mass, Simulation, Wake, Wind

DEFAULT_KINDS = {"ground": "flat", "wind": "gusts"}
"""Kinds of tables without the key `kind`."""


class Scene(Model):
    """A scene. Load one with `greensward.load`, or build it from these parts."""

    title: Text = ""
    """A name for people."""
    seed: Count = Field(default=1, ge=0, le=2**32 - 1)
    """Seed of all randomness."""
    ground: Ground = FlatGround()
    """Ground that the grass stands on."""
    grass: Annotated[Many[Grass], Field(max_length=MOST_SPECIES)] = default((Grass(),))
    """Species, mixed by share."""
    colour: GrassColour | None = None
    """Colour of the grass by place. Without it, it is that of the species."""
    flowers: Annotated[Many[Flowers], Field(max_length=MOST_FLOWERS)] = default(())
    """Plants as billboards."""
    sowing: Sowing = Sowing()
    """Sowing of the blades."""
    clear: Annotated[Many[Clearing], Field(max_length=MOST_CLEARINGS)] = default(())
    """Areas without grass. They lie at their places in the world, also beyond the edge of the ground, once each."""
    wind: Annotated[Many[Wind], Field(max_length=MOST_WINDS)] = default((Gusts(),))
    """Winds; they add up."""
    mass: Mass | None = None
    """Winds as forces. Without it, winds move blades whatever their mass."""
    force: Annotated[Many[Force], Field(max_length=MOST_FORCES)] = default(())
    """Forces that press the grass of the ground down or push it aside; they add up. Grass on objects feels none."""
    simulation: Simulation | None = None
    """Dynamics of the blades. Without it, their motion is analytic."""
    growth: Growth | None = None
    """Growth over time. Without it, the grass is full-grown."""
    object: Annotated[Many[Object], Field(max_length=MOST_OBJECTS)] = default(())
    """Objects in the grass."""
    fence: Annotated[Many[Fence], Field(max_length=MOST_FENCES)] = default(())
    """Fences."""
    water: Water | None = None
    """A lake."""
    sun: Sun = Sun()
    """The sun."""
    sky: Sky = Sky()
    """The atmosphere."""
    fog: Fog | None = None
    """Fog. Without it, only the haze of the atmosphere lies in the distance."""
    phong: Phong | None = None
    """Phong's reflection model. Without it, leaves scatter, shine and let light through as they do in nature."""
    shadows: Shadows = Shadows()
    """Shadow maps."""
    camera: Camera = Camera()
    """The camera."""
    culling: Culling = Culling()
    """Culling of blades that do not show."""
    technique: TechniqueChoice = TechniqueChoice()
    """Technique that draws the grass."""
    post: Post = Post()
    """Post-processing."""

    _folder: Path = PrivateAttr(default=Path())

    @model_validator(mode="before")
    @classmethod
    def _kinds_may_be_left_out(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        values = dict(values)
        if isinstance(ground := values.get("ground"), dict):
            values["ground"] = {"kind": DEFAULT_KINDS["ground"], **ground}
        if isinstance(winds := values.get("wind"), list | tuple):
            values["wind"] = [{"kind": DEFAULT_KINDS["wind"], **w} if isinstance(w, dict) else w for w in winds]
        return values

    @model_validator(mode="after")
    def _has_one_wake(self) -> Self:
        wakes = [i for i, wind in enumerate(self.wind) if isinstance(wind, Wake)]
        if len(wakes) > 1:
            raise ValueError(f"wind[{wakes[1]}]: a scene has at most one wake, and wind[{wakes[0]}] is one")
        return self

    @model_validator(mode="after")
    def _has_numbers_for_its_flowers(self) -> Self:
        places = sum(table.cells**2 for table in self.flowers)
        if places > MOST_PLANTS:
            raise ValueError(
                f"flowers: must have at most {MOST_PLANTS / 1e6:.0f} million places for plants together (got "
                f"{places / 1e6:,.0f} million); lower density_per_m2 or reach_m"
            )
        return self

    @model_validator(mode="after")
    def _has_a_picture_for_its_colour(self) -> Self:
        ground = self.ground
        if isinstance(self.colour, GroundColour) and not (ground.texture or ground.terrain_map or ground.tile):
            raise ValueError(
                'colour.kind: must be "noise" on ground without a picture (got "ground"), or set ground.texture or '
                "ground.terrain_map"
            )
        return self

    @model_validator(mode="after")
    def _blurs_a_pinhole(self) -> Self:
        if self.post.blur != "off" and not self.camera.is_straight:
            raise ValueError(
                f'post.blur: must be "off" for a lens that distorts and for a fisheye (got "{self.post.blur}")'
            )
        return self

    @property
    def folder(self) -> Path:
        """Folder that the files it names are relative to."""
        return self._folder

    @overload
    def resolve(self, file: str | Path) -> Path: ...
    @overload
    def resolve(self, file: Raster) -> Raster: ...
    @overload
    def resolve(self, file: str | Raster) -> Path | Raster: ...
    def resolve(self, file: str | Path | Raster) -> Path | Raster:
        """The path of a file that the scene names, relative to the scene file's folder; an array as it is."""
        return file if isinstance(file, Raster) else self._folder / Path(file).expanduser()

    def in_folder(self, folder: str | Path) -> "Scene":
        """The same scene with its files looked for in `folder`."""
        copy = self.model_copy()
        copy._folder = Path(folder)
        return copy
