"""Workloads of the benchmark, named after their sources, each a list of cases."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import sqrt
from typing import Any, Literal

from greensward.bench.variants import checked, variant_of
from greensward.library import load
from greensward.scene import HeightMapGround, InputError, NoiseGround, Scene, TechniqueChoice
from greensward.scene.problems import one_of
from greensward.techniques import FAR, SETTINGS

Size = tuple[int, int]
Scale = Literal["quick", "full", "toy"]
STRIPS = "instanced-strips"
BLADED = tuple(name for name in SETTINGS if name != FAR.name)
CPU_SIZE: Size = (640, 360)
GPU_SIZE: Size = (1920, 1080)
TOY_SIZE: Size = (48, 27)
FIELD_M = 120.0


@dataclass(frozen=True)
class Case:
    """A scene at a size of the picture."""

    name: str
    build: Callable[[], Scene]
    size: Size | None = None
    """Size of the picture in the source; None for one that suits the machine."""
    quick: bool = True
    """True where a CPU draws it in seconds."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings, for the techniques that have them."""
    roots: Callable[[], Scene] | None = None
    """Scene for techniques that make extra blades of each root; None where `build` is for all."""
    only: tuple[str, ...] = ()
    """The techniques for which it differs from the other cases; empty for all."""
    published: str = ""
    """Result in the source, quoted."""
    still: bool = False
    """True if the camera stays at the start of its path, so that culling does not change."""
    flight_mps: float = 0.0
    """Speed of a straight flight that takes the place of the path; 0 for none."""
    frames: int | None = None
    """Number of frames in place of the quick protocol's, on a GPU."""

    def scene(self, technique: str) -> Scene:
        """Build the scene for a technique or a variant of one."""
        name = variant_of(technique)[0]
        if self.roots and name in SETTINGS and "extra_blades" in SETTINGS[name].model_fields:
            return self.roots()
        return self.build()

    def suits(self, technique: str) -> bool:
        """Return whether the case differs from the others for a technique or a variant of one."""
        return not self.only or variant_of(technique)[0] in self.only


@dataclass(frozen=True)
class Workload:
    """Cases that belong together, and what draws them unless a user says otherwise."""

    name: str
    source: str
    cases: tuple[Case, ...]
    techniques: tuple[str, ...]


def even_field(blades: int, **tables: Any) -> Scene:
    """So many blades on a square of 120 m, without level of detail by distance."""
    sowing = {"density_per_m2": blades / FIELD_M**2, "drift": 0, "full_density_m": 1000, "reach_m": 1000}
    return Scene.model_validate(
        {
            "ground": {"kind": "flat", "size_m": [FIELD_M, FIELD_M], "beyond": "bare"},
            "sowing": sowing,
            "camera": {"position_m": [0, 1.7, 55], "target_m": [0, 0.9, 0]},
            **tables,
        }
    )


def square(edge_m: float, **sowing: Any) -> Scene:
    """A thousand blades per square metre on a square, none of them stored; level of detail as by default."""
    return Scene.model_validate(
        {
            "ground": {"kind": "flat", "size_m": [edge_m, edge_m], "beyond": "bare"},
            "sowing": {"density_per_m2": 1000, "reach_m": 700, "stored_m": 0, **sowing},
            "camera": {"position_m": [0, 1.7, 0], "target_m": [0, 0.9, -55]},
        }
    )


def _blade_count() -> tuple[Case, ...]:
    few = {"10k": 10_000, "100k": 100_000, "1M": 1_000_000}
    many = {"10M": 10_000_000, "30M": 30_000_000}
    return (
        *(Case(name, partial(even_field, count)) for name, count in few.items()),
        *(Case(name, partial(even_field, count), quick=False) for name, count in many.items()),
    )


def _presets() -> tuple[Case, ...]:
    meadow = partial(load, "meadow")
    return Case("meadow, camera still", meadow, still=True), Case("meadow, camera moving", meadow)


FLIGHT_FRAMES = 900


def _dense() -> Scene:
    """Perennial ryegrass as dense as a lawn."""
    return Scene.model_validate({"grass": [{"species": "ryegrass"}], "sowing": {"density_per_m2": 8000}})


def _flights() -> tuple[Case, ...]:
    """Walking, driving and flying pace."""
    scenes: dict[str, Callable[[], Scene]] = {
        "meadow": partial(load, "meadow"),
        "yan2024-strong": partial(load, "yan2024-strong"),
        "ryegrass": _dense,
    }
    return tuple(
        Case(f"{name}, {speed:g} m/s", build, quick=name != "ryegrass", flight_mps=speed, frames=FLIGHT_FRAMES)
        for name, build in scenes.items()
        for speed in (1.4, 8.0, 30.0)
    )


def _responsive() -> tuple[Case, ...]:
    tables = {
        "wind": [{"kind": "strong"}],
        "shadows": {"enabled": False},
        "simulation": {"form": "yan2024", "within_m": 1000, "settle_s": 0.0},
    }
    counts = {"100k": (100_000, True), "1M": (1_000_000, False), "10M": (10_000_000, False)}
    return tuple(
        Case(f"{name} simulated", partial(even_field, count, **tables), quick=quick)
        for name, (count, quick) in counts.items()
    )


def _table1_scene(preset: str, edge_m: float, effects: bool, added: str) -> Scene:
    """A row of Table 1: post-processing is the blur of section 6.4 and the darkening with distance.

    The field ends at its edge. Maps are scaled with it, and where there are any, so is the place of the camera, which
    then stands at the same shore; land of noise keeps its hills, and as many samples to each as the driver allows.
    """
    scene = load(preset)
    post = {"blur": "average", "darkening": 0.3} if effects else {"blur": "off", "darkening": 0.0}
    assert scene.ground.size_m
    scale = edge_m / scene.ground.size_m[0]
    ground: dict[str, Any] = {"size_m": (edge_m, edge_m), "beyond": "bare"}
    changes: dict[str, Any] = {"post": scene.post.model_copy(update=post)}
    if isinstance(scene.ground, HeightMapGround):
        x, y, z = scene.camera.position_m
        to_x, to_y, to_z = scene.camera.target_m
        moved = (scale - 1.0) * x, (scale - 1.0) * z
        changes["camera"] = scene.camera.model_copy(
            update={
                "position_m": (x + moved[0], y, z + moved[1]),
                "target_m": (to_x + moved[0], to_y, to_z + moved[1]),
            }
        )
    elif isinstance(scene.ground, NoiseGround):
        ground["samples"] = min(round((scene.ground.samples - 1) * scale) + 1, 4096)
    changes["ground"] = scene.ground.model_copy(update=ground)
    if not added:
        changes |= {"flowers": (), "object": (), "fence": ()}
    return scene.model_copy(update=changes)


_TABLE_1: tuple[tuple[str, int, bool, str, int, int], ...] = (
    # scene, edge of the field in metres, post-processing, what else is drawn, frames per second, visible blades
    ("Oasis", 160, True, "", 75, 136_650),
    ("Oasis", 160, False, "", 78, 136_650),
    ("Oasis", 320, True, "", 65, 330_816),
    ("Oasis", 320, False, "", 68, 330_816),
    ("Meadow", 300, True, "", 84, 348_370),
    ("Meadow", 300, False, "", 88, 348_370),
    ("Meadow", 300, True, "objects", 83, 348_370),
    ("Meadow", 300, False, "objects", 87, 348_370),
    ("Meadow", 600, True, "objects", 81, 340_716),
    ("Meadow", 600, False, "objects", 85, 340_716),
    ("Instance", 300, True, "", 60, 660_000),
    ("Instance", 300, False, "", 62, 660_000),
    ("Instance", 600, True, "", 56, 824_000),
    ("Instance", 600, False, "", 58, 824_000),
    # for the last three pairs the paper says "enabled" twice; the quicker is taken to be without
    *(
        ("Instance", edge_m, effects, "flowers", 55 if effects else 57, 1_008_000)
        for edge_m in (2000, 4000, 8000, 90_000)
        for effects in (True, False)
    ),
)
_QUICK_ROWS = {("Oasis", 160), ("Meadow", 300), ("Instance", 2000)}


def _table1() -> tuple[Case, ...]:
    cases = []
    for name, edge_m, effects, added, fps, visible in _TABLE_1:
        label = f"{name} {edge_m}x{edge_m}{', ' + added if added else ''}, effects {'on' if effects else 'off'}"
        preset = f"jahrmann2013-{name.lower()}"
        cases.append(
            Case(
                label,
                partial(_table1_scene, preset, float(edge_m), effects, added),
                (1200, 800),
                quick=(name, edge_m) in _QUICK_ROWS and (name != "Meadow" or added == "objects"),
                published=f"{fps} frames per second, {visible:,} blades visible",
            )
        )
    return tuple(cases)


def _thesis_field(roots: int, blades: int = 1, **tables: Any) -> Scene:
    """Roots as the thesis sent them, of so many blades each: its counts fit 25 blades on each square metre."""
    edge_m = sqrt(roots * blades) / 5.0
    return Scene.model_validate(
        {
            "ground": {"kind": "flat", "size_m": [edge_m, edge_m], "beyond": "bare"},
            "sowing": {"density_per_m2": 25.0 / blades, "drift": 0, "full_density_m": 1000, "reach_m": 1000},
            "camera": {"position_m": [0, 2.5, 0], "target_m": [0, 1.0, -10]},
            **tables,
        }
    )


def _thesis_limit() -> Scene:
    """Every root in view and in full detail; seven vertices each make the 64,012,032 of the thesis."""
    scene = _thesis_field(9_144_576)
    camera = scene.camera.model_copy(update={"position_m": (0.0, 12.0, 310.0), "target_m": (0.0, 0.0, 200.0)})
    return scene.model_copy(update={"camera": camera})


_SIZES: tuple[Size, ...] = (
    (1, 1),
    (640, 480),
    (800, 600),
    (1024, 768),
    (1280, 1024),
    (1680, 1050),
    (1920, 1080),
    (1920, 1200),
    (2560, 1600),
)


def _levels_m(first: float, second: float, third: float) -> dict[str, Any]:
    """Distances of the three levels; the last blades end at once, as published."""
    return {"levels_m": [first, second, third], "fade": 0.0}


def _resolution() -> tuple[Case, ...]:
    return tuple(
        Case(
            f"{width}x{height}",
            partial(_thesis_field, 139_800),
            (width, height),
            quick=width <= 1280,
            settings=_levels_m(8.0, 16.0, 32.0),
            published="texture-array: 1,224 frames per second on average" if width == 2560 else "",
        )
        for width, height in _SIZES
    )


def _levels() -> tuple[Case, ...]:
    """Levels are distances up to which a blade has seven, five and three points; in the second set all have seven."""
    sent = {
        "low": (50_700, 16.0),
        "normal": (139_800, 32.0),
        "high": (480_000, 64.0),
        "ultra": (1_786_300, 128.0),
    }
    return tuple(
        Case(
            f"{name}, set {number}",
            partial(_thesis_field, vertices),
            (1680, 1050),
            quick=name in ("low", "normal"),
            settings=(
                _levels_m(0.25 * outer_m, 0.5 * outer_m, outer_m)
                if number == 1
                else {**_levels_m(outer_m, outer_m, outer_m), "error_px": 1e-6, "max_level": 3}
            ),
        )
        for name, (vertices, outer_m) in sent.items()
        for number in (1, 2)
    )


def _extra_blades() -> tuple[Case, ...]:
    """Roots, ever fewer, of about as many blades; techniques that make none themselves are given all of them.

    Also with every root simulated in wind, which the thesis has not.
    """
    made = {"A, 0 extra": (139_800, 0), "B, 3 extra": (36_400, 3), "C, 8 extra": (15_500, 8)}
    simulated: dict[str, Any] = {"wind": [{"kind": "gusts"}], "simulation": {"within_m": 1000, "settle_s": 0.0}}
    return tuple(
        Case(
            name + more,
            partial(_thesis_field, roots * (1 + extra), **tables),
            (1680, 1050),
            settings={**_levels_m(8.0, 16.0, 32.0), "extra_blades": extra},
            roots=partial(_thesis_field, roots, 1 + extra, **tables),
        )
        for more, tables in (("", {}), (", simulated", simulated))
        for name, (roots, extra) in made.items()
    )


def _half_screen() -> Scene:
    """Flat grass up to a level horizon: half of the picture."""
    scene = even_field(400_000)
    camera = scene.camera.model_copy(update={"target_m": (0.0, 1.7, 0.0)})
    return scene.model_copy(update={"camera": camera})


def _half_screens() -> tuple[Case, ...]:
    """Five steps, as published, through ever closer billboards."""

    def case(name: str, times: float, **more: Any) -> Case:
        return Case(name, _half_screen, (1024, 768), settings={"steps": 5, "spacing": 0.5 / times}, **more)

    return (
        case("half the screen", 1.0, published="90 to 300 frames per second"),
        *(case(f"{times} times the billboards", times, only=("billboard-grid",)) for times in (0.1, 10)),
    )


def _hills(full_density_m: float = 8.0, **culling: bool) -> Scene:
    """Dense grass on hills, sown ever thinner beyond a distance, and every test but those named."""
    return Scene.model_validate(
        {
            "ground": {
                "kind": "noise",
                "size_m": [FIELD_M, FIELD_M],
                "height_m": 8,
                "wavelength_m": 45,
                "beyond": "bare",
            },
            "sowing": {"density_per_m2": 600, "drift": 0, "full_density_m": full_density_m},
            "camera": {"position_m": [0, 1.7, 50], "target_m": [0, 0.9, 0]},
            "culling": culling,
        }
    )


def _ablation() -> tuple[Case, ...]:
    drop = {"edge_on": "drop"}  # otherwise the test of orientation finds nothing to leave out
    cut = {"error_px": 1e-6}
    leaves = "visibility-buffer", "bezier-blades"
    tests = "orientation", "frustum", "distance", "occlusion"
    return (
        Case("every test", _hills, settings=drop),
        *(Case(f"without {name}", partial(_hills, **{name: False}), settings=drop) for name in tests),
        Case("with behind_grass", partial(_hills, behind_grass=True), settings=drop, only=("visibility-buffer",)),
        Case("all segments everywhere", _hills, settings={**drop, **cut}, only=leaves),
        Case(
            "no test, all segments",
            partial(_hills, **dict.fromkeys(tests, False)),
            settings={**drop, **cut},
        ),
        Case("every blade sown", partial(_hills, 1000.0), settings=drop, quick=False),
        Case(
            "no test, no level of detail",
            partial(_hills, 1000.0, **dict.fromkeys(tests, False)),
            quick=False,
            settings={**drop, **cut},
        ),
    )


def workloads() -> dict[str, Workload]:
    """All of them by name."""
    every = (*SETTINGS, STRIPS)
    stored = tuple(f"expanded-roots[storage={storage}]" for storage in ("vertex-buffer", "texture-array"))
    thesis, tillman = "Tillman 2013, ", (*stored, "visibility-buffer", STRIPS)
    jahrmann = "tessellated-quads", "visibility-buffer"
    listed = (
        Workload("blade-count", "evenly sown squares of 120 m, every blade drawn", _blade_count(), every),
        Workload(
            "field-scale",
            "a hectare and a square kilometre of a thousand blades on each square metre, none stored",
            (
                Case("hectare", partial(square, 100.0)),
                Case("square-km", partial(square, 1000.0)),
                Case("square-km, traced from 40 m", partial(square, 1000.0, traced_m=40)),
            ),
            ("visibility-buffer",),
        ),
        Workload(
            "presets",
            "the meadow as it ships, from a camera that stands and from one that moves",
            _presets(),
            ("visibility-buffer", "bezier-blades"),
        ),
        Workload(
            "responsive-10m",
            "Yan, Wu & Wang 2024: every blade with simulation state, in strong wind",
            _responsive(),
            ("visibility-buffer", "bezier-blades"),
        ),
        Workload(
            "flight",
            "straight flights at three speeds, in which every frame brings new ground; see the slowest frames",
            _flights(),
            ("visibility-buffer",),
        ),
        Workload(
            "derstroff2024",
            "Derstroff 2024: its hills at its densities, from a camera that stands and from one that flies",
            (
                Case("standing", partial(load, "derstroff"), still=True),
                Case("8 m/s", partial(load, "derstroff"), flight_mps=8.0, frames=FLIGHT_FRAMES // 3),
            ),
            ("geometry-billboards", "visibility-buffer"),
        ),
        Workload("jahrmann2013-table1", "Jahrmann & Wimmer 2013, Table 1", _table1(), jahrmann),
        Workload("tillman2013-resolution", thesis + "3.1.1: resolutions", _resolution(), tillman),
        Workload("tillman2013-lod", thesis + "3.1.2: levels of detail", _levels(), tillman),
        Workload(
            "tillman2013-extra-blades", thesis + "3.1.3: extra blades for each vertex", _extra_blades(), tillman
        ),
        Workload(
            "tillman2013-limit",
            thesis + "3.1.4: 9,144,576 roots expanded to 64,012,032 vertices",
            (
                Case(
                    "9,144,576 roots",
                    _thesis_limit,
                    (1680, 1050),
                    quick=False,
                    settings=_levels_m(10_000.0, 10_000.0, 10_000.0),
                    published="vertex-buffer: 36.28 ms, texture-array: 58.69 ms",
                ),
            ),
            tillman,
        ),
        Workload(
            "habel2007-half-screen",
            "Habel, Wimmer & Jeschke 2007: half the screen covered",
            _half_screens(),
            ("billboard-grid", "visibility-buffer"),
        ),
        Workload("ablation", "each test of [culling] and each level of detail left out", _ablation(), BLADED),
    )
    return {each.name: each for each in listed}


QUICK = ("blade-count", "field-scale", "presets", "jahrmann2013-table1", "tillman2013-resolution", "ablation")
"""Workloads of a run that names none."""


def chosen_workloads(names: tuple[str, ...]) -> tuple[Workload, ...]:
    """The workloads of these names; `all` is every one, none the quick suite. Raises `InputError`."""
    known = workloads()
    if "all" in names:
        return tuple(known.values())
    for name in names:
        if name not in known:
            raise InputError(f"workload: {one_of(name, known)}; or all")
    return tuple(known[name] for name in dict.fromkeys(names or QUICK))


def chosen_techniques(names: tuple[str, ...]) -> tuple[str, ...]:
    """These names of techniques or variants, if each may be measured. Raises `InputError`."""
    return tuple(dict.fromkeys(checked(name, (STRIPS,)) for name in names))


def drawn_by(technique: str, scene: Scene, settings: Mapping[str, Any]) -> Scene:
    """The same scene by a technique or a variant of one, with those settings that it has."""
    if technique == STRIPS:
        return scene
    name, own = variant_of(technique)
    had = (scene.technique.model_extra or {}) if scene.technique.name == name else {}
    given = {key: value for key, value in settings.items() if key in SETTINGS[name].model_fields}
    choice = TechniqueChoice.model_validate({"name": name, **had, **given, **own})
    return scene.model_copy(update={"technique": choice})


def toy(scene: Scene) -> Scene:
    """The same with a few thousand blades and small shadow maps: everything runs, and nothing takes long."""
    sowing = scene.sowing.model_copy(
        update={
            "density_per_m2": min(scene.sowing.density_per_m2, 20.0),
            "full_density_m": min(scene.sowing.full_density_m, 5.0),
            "reach_m": min(scene.sowing.reach_m, 12.0),
            "traced_m": scene.sowing.traced_m and min(scene.sowing.traced_m, 6.0),
        }
    )
    shadows = scene.shadows.model_copy(update={"size_px": 64, "cascades": 1})
    return scene.model_copy(update={"sowing": sowing, "shadows": shadows})
