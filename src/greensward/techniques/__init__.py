"""Techniques, HOW grass is drawn: one folder each, Python and GLSL together."""

from typing import Any

from pydantic import BaseModel, ValidationError

from greensward.gpu.device import Device
from greensward.scene import Scene, SceneError
from greensward.scene.problems import one_of, sentences
from greensward.techniques.bezier_blades import BezierBlades
from greensward.techniques.billboard_grid import BillboardGrid
from greensward.techniques.billboard_grid.settings import GridSettings
from greensward.techniques.expanded_roots import ExpandedRoots
from greensward.techniques.geometry_billboards import GeometryBillboards
from greensward.techniques.technique import Needs, Technique
from greensward.techniques.tessellated_quads import TessellatedQuads
from greensward.techniques.visibility_buffer import VisibilityBuffer
from greensward.world import World

AnyTechnique = Technique[Any]
TECHNIQUES: tuple[type[AnyTechnique], ...] = (
    BezierBlades,
    BillboardGrid,
    ExpandedRoots,
    GeometryBillboards,
    TessellatedQuads,
    VisibilityBuffer,
)
FAR = BillboardGrid
"""Technique that stands for blades beyond `sowing.traced_m`."""
# there a texel holds several blades, and few are met before they close
_FAR = GridSettings.model_validate({"spacing": 0.5, "steps": 14})

SETTINGS: dict[str, type[BaseModel]] = {technique.name: technique.Settings for technique in TECHNIQUES}


def chosen(scene: Scene) -> tuple[type[AnyTechnique], BaseModel]:
    """Find the technique that a scene names, and its settings. Raises `InputError` where they do not fit it."""
    choice = scene.technique
    for technique in TECHNIQUES:
        if technique.name == choice.name:
            try:
                settings = technique.Settings.model_validate(choice.model_extra or {})
            except ValidationError as error:
                raise SceneError(sentences(error, technique.Settings, lambda _: "scene", ("technique",))) from None
            if scene.sowing.stored_m is not None and (why := _must_be_stored(scene, technique, settings)):
                raise SceneError([f"scene: sowing.stored_m: {why}; leave stored_m out"])
            if scene.sowing.traced_m is not None and (why := _must_be_blades(scene, technique)):
                raise SceneError([f"scene: sowing.traced_m: {why}; leave traced_m out"])
            technique.check(scene, settings)
            if scene.sowing.traced_m is not None:
                FAR.check(scene, _FAR)
            return technique, settings
    raise SceneError([f"scene: technique.name: {one_of(choice.name, SETTINGS)}"])


def _must_be_stored(scene: Scene, technique: type[AnyTechnique], settings: BaseModel) -> str:
    if not technique.needs(settings).unstored:
        able = ", ".join(each.name for each in TECHNIQUES if each.needs(each.Settings()).unstored)
        return f"is for {able} only, as {technique.name} draws stored blades"
    return "blades that are not stored cannot grow older as [growth] says" if scene.growth else ""


def _must_be_blades(scene: Scene, technique: type[AnyTechnique]) -> str:
    if technique is FAR:
        return f"is for techniques that draw blades, and {technique.name} draws none"
    return "pictures of grass cannot grow older as [growth] says" if scene.growth else ""


def far_level(device: Device, world: World) -> AnyTechnique | None:
    """Build what draws the grass beyond `sowing.traced_m`; None where the scene has blades everywhere."""
    if world.scene.sowing.traced_m is None:
        return None
    return FAR(device, world, _FAR, far=True)


__all__ = ["SETTINGS", "TECHNIQUES", "AnyTechnique", "Needs", "Technique", "chosen", "far_level"]
