"""Every public model and function, as a program would use them; type checkers find nothing to say."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

import greensward as gs
from greensward import colours, forces, grounds, objects, winds

ROUND = objects.Path(times_s=[0, 4.5], positions_m=[(0, 0, 0), [3, 0, 1]], yaws_deg=[0, 90], after="repeat")
BY_A_DRONE = gs.Scene(wind=(winds.Idle(period_s=4), winds.Wake(by="both", downwash_mps2=20)))
SCENE = gs.Scene(
    title="Everything",
    seed=3,
    ground=grounds.NoiseGround(size_m=(100, 100), height_m=6, texture=Path("soil.png")),
    grass=[gs.Grass(species="fescue"), gs.Grass(species="daisy", share=0.1, height_m=[0.1, 0.2], shape="quad")],
    flowers=[gs.Flowers(height_m=(0.2, 0.4), petals=5)],
    sowing=gs.Sowing(density_per_m2=80, density_map=None, reach_m=30),
    wind=[
        winds.Gusts(),
        winds.Strong(direction_deg=10, power_mps=4),
        winds.Helicopter(centre_m=(1, 2)),
        winds.Random(),
        winds.Waves(),
        winds.Blast(centre_m=[0, 1, 0]),
        winds.Whirl(),
        winds.Ripples(),
    ],
    force=[
        forces.Footprints(path=[(0, 0), (1, 2.5)], foot_m=[0.3, 0.12]),
        forces.Tracks(path=np.array([(0, 0), (12, 5)]), tyre_m=0.5),
        forces.Stamp(outline="hoof.png", places=[(0, 0, 90)], fades_s=4),
        forces.ForceMap(file=Path("map.png"), size_m=(4, 4)),
    ],
    colour=colours.NoiseColour(noise=[colours.ChannelNoise(channel="red", wavelength_m=3)]),
    phong=gs.Phong(shininess=20),
    mass=gs.Mass(reference_kg=1e-4),
    simulation=gs.Simulation(gravity_centre_m=(0, -10, 0)),
    growth=gs.Growth(height=[(0, 0), (1, 1)]),
    object=[
        objects.Box(position_m=(0, 0, 0), size_m=[1, 2, 3], grass=objects.Fur(density_per_m2=100)),
        objects.Sphere(position_m=(2, 0, 0), path=ROUND),
        objects.Cylinder(name="post", position_m=[4, 0, 0]),
        objects.Capsule(position_m=(6, 0, 0), length_m=2),
        objects.Mesh(position_m=(8, 0, 0), file="cow.glb"),
    ],
    clear=[gs.Clearing(path=[(0, 0), (4, 5)], width_m=3), gs.Clearing(outline=((0, 0), (1, 0), (0, 1)), edge_m=0)],
    fence=[gs.Fence(path=np.array([(0, 0), (5, 0)]), rails_m=[0.5], post_m=(0.1, 1, 0.1))],
    water=gs.Water(level_m=-2),
    sun=gs.Sun(elevation_deg=20),
    sky=gs.Sky(clouds=0),
    shadows=gs.Shadows(cascades=2),
    camera=gs.Camera(position_m=np.array([0, 1, 8]), target_m=[0, 1, 0]),
    culling=gs.Culling(occlusion=False),
    technique=gs.TechniqueChoice(name="bezier-blades", max_level=4),
    post=gs.Post(tone_map="linear"),
)
HILLS = grounds.HeightMapGround(file="hills.tif", height_m=[0, 30], beyond="repeat")
PHOTOGRAPH = gs.Scene(
    ground=HILLS.model_copy(update={"texture": "lawn.png"}), colour=colours.GroundColour(neighbours=3)
)
HEIGHTS = grounds.HeightMapGround(array=np.zeros((4, 4)), terrain_map=np.zeros((4, 4, 4), np.uint8))
SOWN = gs.Sowing(density_map=np.ones((4, 4)), vegetation_map=Path("a.png"))
GROUNDS = (grounds.FlatGround(), HILLS, grounds.EndlessGround(size_m=(64, 64)), grounds.NoGround())
PAINTED = gs.Scene(ground=GROUNDS[0], wind=(winds.Texture(files=["a.png", Path("b.png")]),))
PATH = gs.CameraPath(key=[gs.CameraKey(time_s=t, position_m=(0, 2, t), target_m=(0, 0, -9)) for t in (0, 1)])


def heights(camera: gs.Camera, scene: gs.Scene) -> tuple[float, tuple[gs.Grass, ...]]:
    position_m: tuple[float, float, float] = camera.position_m
    return position_m[1], scene.grass


def draw(folder: Path) -> npt.NDArray[np.bool_]:
    try:
        scene = gs.load("meadow", overrides={"wind.0.speed_mps": 9}, seed=4, technique="bezier-blades")
    except gs.SceneError as error:
        raise gs.GreenswardError(error.problems[0]) from gs.InputError("load")
    (folder / "scene.toml").write_text(gs.dump(scene.in_folder(folder)))
    aovs: list[gs.Aov] = ["depth", "class"]
    with gs.Renderer("meadow", size=(64, 36), samples=2, device="cpu") as by_name, gs.Renderer(folder) as by_path:
        frame: gs.Frame = by_name.render(2.5, camera=PATH.at(0.5), aovs=aovs)
        counts: gs.Counts = by_path.render(aovs=("blade_id",)).counts or gs.Counts()
        print(frame.image.shape, counts.drawn, sorted(gs.presets()), gs.__version__)
    with gs.Renderer(scene, device=gs.Device("cpu")) as drawn:
        print(drawn.updates_in_place(SCENE), drawn.device.limits.picture_px)
        drawn.update("meadow")
        view_from_world, clip_from_view = drawn.camera_matrices()
        seen = gs.camera_from_matrices(view_from_world, clip_from_view, (64, 36))
        wide: gs.Camera = gs.camera_from_opencv(np.eye(3), np.eye(4), fisheye=True, size_px=(64, 36))
        target = drawn.ctx.simple_framebuffer((64, 36))
        drawn.draw_eyes([gs.Eye(target, seen), gs.Eye(target, layer=1)], encoding="hdr", sky=False)
        drawn.draw(target, view_from_world=view_from_world, clip_from_view=clip_from_view, ground=False)
        drawn.place("ball", (1, 2, 3))
        hit = drawn.hit(wide.position_m, np.array([0, -1, 0]))
        if hit and hit.blade:
            print(hit.point_m, hit.blade.species, drawn.blade(hit.blade_id), drawn.light().exposure)
    gs.show(scene, time_s=1).playing = False
    return np.equal(frame.truth["class"], gs.SurfaceClass.GRASS)
