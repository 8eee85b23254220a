#!/usr/bin/env python3
"""Draw the pictures of the documentation: `.venv/bin/python scripts/pictures.py`.

scripts/pictures.py --draft            half the size and fewer samples, in a minute or two
scripts/pictures.py meadow shapes      only these

Each is a JPEG or WebP of at most 300 kB: the quality is lowered until it fits.
"""

import argparse
import contextlib
import io
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from bisect import bisect_left
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args
from urllib.parse import urlunsplit

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

import greensward as gs
from greensward.aovs import AOVS
from greensward.gpu.adapters import open_context
from greensward.ground.noise import octaves
from greensward.scene import InputError
from greensward.scene.files import written_aside
from greensward.viewer.application import Application
from greensward.viewer.brushes import Brush, Tool
from greensward.viewer.contexts import Contexts
from greensward.viewer.input import MouseMove
from greensward.viewer.session import Session
from greensward.viewer.viewer import PANEL_PX

ROOT = Path(__file__).resolve().parents[1]
Picture = npt.NDArray[np.uint8]
Size = tuple[int, int]
MAX_BYTES = 300_000
"""Largest file of a picture: a redraw adds each of them to the repository's history."""
SAVE_OPTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    ".jpg": ("JPEG", {"optimize": True, "progressive": True}),
    ".webp": ("WEBP", {"method": 6}),
}
QUALITIES = range(86, 50, -1)


def draw(scene: gs.Scene, size: Size, samples: int, time_s: float = 0.0, **more: Any) -> gs.Frame:
    with gs.Renderer(scene, size=size, samples=samples) as renderer:
        return renderer.render(time_s, **more)


def ahead_of(scene: gs.Scene, right_m: float, up_m: float, ahead_m: float) -> tuple[float, float, float]:
    """A point beside and ahead of a scene's camera, `up_m` above the ground."""
    position, target = np.array(scene.camera.position_m), np.array(scene.camera.target_m)
    ahead = (target - position) * (1.0, 0.0, 1.0)
    ahead /= np.linalg.norm(ahead)
    x, _, z = position + ahead_m * ahead + right_m * np.array([-ahead[2], 0.0, ahead[0]])
    return float(x), up_m, float(z)


def labelled(picture: Picture, text: str) -> Picture:
    """Return a picture with a caption in its corner."""
    image = Image.fromarray(picture)
    edge = max(11, image.height // 20)
    font = ImageFont.load_default(edge)
    brush = ImageDraw.Draw(image)
    box = brush.textbbox((edge // 2, edge // 3), text, font=font)
    brush.rectangle((0, 0, box[2] + edge // 2, box[3] + edge // 3), fill=(24, 26, 22))
    brush.text((edge // 2, edge // 3), text, font=font, fill=(240, 240, 232))
    return np.array(image)


def sheet(pictures: list[Picture], columns: int, gap: int = 6) -> Picture:
    """Arrange pictures of one size in rows."""
    height, width, _ = pictures[0].shape
    rows = -(-len(pictures) // columns)
    page = np.full((rows * (height + gap) - gap, columns * (width + gap) - gap, 3), 255, np.uint8)
    for i, picture in enumerate(pictures):
        y, x = i // columns * (height + gap), i % columns * (width + gap)
        page[y : y + height, x : x + width] = picture
    return page


def encoded(picture: Image.Image, suffix: str) -> bytes:
    """Return a picture's file, of the highest quality that takes at most `MAX_BYTES`."""
    kind, options = SAVE_OPTIONS[suffix]

    def of_quality(quality: int) -> bytes:
        stream = io.BytesIO()
        picture.save(stream, kind, quality=quality, **options)
        return stream.getvalue()

    fitting = bisect_left(QUALITIES, True, key=lambda quality: len(of_quality(quality)) <= MAX_BYTES)
    if fitting < len(QUALITIES):
        return of_quality(QUALITIES[fitting])
    raise InputError(
        f"{picture.width}×{picture.height} pixels: do not fit into {MAX_BYTES:,} bytes; draw them smaller"
    )


# The pictures -----------------------------------------------------------------------------------------------


def meadow(size: Size, samples: int) -> Picture:
    return draw(gs.load("meadow"), size, samples).image


def close_up(size: Size, samples: int) -> Picture:
    scene = gs.load("meadow")
    camera = gs.Camera(
        position_m=ahead_of(scene, 0.6, 0.42, 3.0), target_m=ahead_of(scene, 0.7, 0.36, 5.0), fov_y_deg=38
    )
    return draw(scene, size, samples, camera=camera).image


def blades(size: Size, samples: int) -> Picture:  # noqa: ARG001
    """Draw blade ids in colours, shaded by the image."""
    scene = gs.load("meadow")
    camera = gs.Camera(
        position_m=ahead_of(scene, 0.6, 0.8, 2.0), target_m=ahead_of(scene, 0.7, 0.4, 5.0), fov_y_deg=45
    )
    double = size[0] * 2, size[1] * 2
    frame = draw(scene, double, 1, camera=camera, aovs=["blade_id"])
    ids = frame.truth["blade_id"]
    hues = np.stack(
        [
            (ids * np.uint64(factor) >> np.uint64(32)) % np.uint64(200) + 40
            for factor in (2654435761, 2246822519, 3266489917)
        ],
        -1,
    )
    grey = frame.image.mean(-1, keepdims=True)
    painted = np.where(ids[..., None] > 0, np.clip(hues * (0.35 + grey / 160.0), 0, 255), 0.5 * grey)
    height, width = size[1], size[0]
    return np.asarray(painted.reshape(height, 2, width, 2, 3).mean((1, 3)), np.uint8)


def without_end(size: Size, samples: int) -> Picture:
    scene = gs.load("meadow")
    sowing = scene.sowing.model_copy(
        update={"density_per_m2": 1000.0, "full_density_m": 25.0, "reach_m": 900.0, "stored_m": 20.0}
    )
    camera = gs.Camera(
        position_m=ahead_of(scene, -2.0, 7.0, -6.0), target_m=ahead_of(scene, 6.0, 2.0, 40.0), fov_y_deg=45
    )
    return draw(scene.model_copy(update={"sowing": sowing}), size, samples, camera=camera).image


def wind(size: Size, samples: int) -> Picture:
    pictures = []
    for title, speed_mps in (("calm", 0.0), ("wind of 14 m/s", 14.0)):
        scene = gs.load("meadow", overrides={"wind.0.speed_mps": speed_mps})
        camera = gs.Camera(
            position_m=ahead_of(scene, 0.0, 0.9, 0.0), target_m=ahead_of(scene, 0.5, 0.2, 4.0), fov_y_deg=42
        )
        pictures.append(labelled(draw(scene, size, samples, 1.0, camera=camera).image, title))
    return sheet(pictures, 2)


def gusts(size: Size, samples: int) -> Picture:
    scene = gs.Scene(
        grass=(gs.Grass(species="wheat", stiffness=(0.0, 0.2)),),
        sowing=gs.Sowing(density_per_m2=400, drift=0.15, clumping=0.2, reach_m=150),
        wind=(gs.winds.Gusts(direction_deg=270, speed_mps=6.0, gustiness=1.0, gust_m=12.0),),
        sun=gs.Sun(azimuth_deg=90, elevation_deg=15),
        camera=gs.Camera(position_m=(0, 7, 0), target_m=(0, 0, -24), fov_y_deg=32),
    )
    times_s = (0.0, 0.7, 1.4, 2.1)
    with gs.Renderer(scene, size=size, samples=samples) as renderer:
        return sheet([labelled(renderer.render(t).image, f"{t:.1f} s") for t in times_s], len(times_s))


def shapes(size: Size, samples: int) -> Picture:
    pictures = []
    for shape in get_args(gs.Grass.model_fields["shape"].annotation):
        grass = gs.Grass(
            species="ryegrass",
            shape=shape,
            height_m=(0.28, 0.36),
            width_m=(0.022, 0.034),
            tilt_deg=(4, 24),
        )
        scene = gs.Scene(
            seed=3,
            grass=(grass,),
            sowing=gs.Sowing(density_per_m2=24, drift=0.0, clumping=0.0, reach_m=5),
            wind=(),
            sun=gs.Sun(azimuth_deg=215, elevation_deg=38),
            camera=gs.Camera(position_m=(0, 0.75, 2.4), target_m=(0, 0.15, 0), fov_y_deg=14, near_m=1.7),
        )
        pictures.append(labelled(draw(scene, size, samples).image, shape))
    return sheet(pictures, 4)


def truth(size: Size, samples: int) -> Picture:  # noqa: ARG001
    arrays = draw(gs.load("meadow"), size, 1, 1.0, aovs=AOVS).truth
    near, far = np.log(1.0), np.log(400.0)
    depth = 1.0 - np.clip((np.log(arrays["depth"]) - near) / (far - near), 0.0, 1.0)
    classes = np.array(
        [[150, 190, 230], [120, 88, 60], [96, 150, 56], [222, 80, 60], [110, 110, 120], [60, 90, 200]], np.uint8
    )
    ids = arrays["blade_id"]
    mixed = ids[..., None] * np.array([2654435761, 2246822519, 3266489917], np.uint64) >> np.uint64(24) & np.uint64(
        255
    )
    motion = np.clip(0.5 + arrays["motion"] / 3.0, 0.0, 1.0)
    colours = {
        "depth": np.repeat(depth[..., None], 3, axis=2),
        "normal": 0.5 + 0.5 * arrays["normal"],
        "class": classes[arrays["class"]] / 255.0,
        "blade_id": np.where(ids[..., None] > 0, mixed / 255.0, 0.0),
        "motion": np.dstack([motion, np.full(motion.shape[:2], 0.5)]),
        "albedo": arrays["albedo"] ** (1 / 2.2),
    }
    return sheet([labelled((255.0 * np.clip(colours[name], 0, 1)).astype(np.uint8), name) for name in AOVS], 3)


def strip(name: str, times_s: tuple[float, ...], size: Size, samples: int, **overrides: Any) -> Picture:
    """Draw a preset at several times, simulating between them."""
    with gs.Renderer(gs.load(name, overrides=overrides), size=size, samples=samples) as renderer:
        pictures = []
        for i in range(round(times_s[0]), round(times_s[-1]) + 1):
            renderer.advance(float(i))
            for t in (t for t in times_s if i <= t < i + 1):
                pictures.append(labelled(renderer.render(t).image, f"{t:.1f} s"))
        return sheet(pictures, 2)


def balls(size: Size, samples: int) -> Picture:
    return strip("jahrmann2017-balls", (0.0, 1.0, 2.0, 4.0), size, samples)


def helicopter(size: Size, samples: int) -> Picture:
    return strip("yan2024-helicopter", (0.0, 0.4, 0.8, 3.0), size, samples)


def tracks(size: Size, samples: int) -> Picture:
    """Draw wheel tracks through the meadow, and footprints beside them."""
    scene = gs.load("meadow")

    def path(*points: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        on_ground = (ahead_of(scene, right_m, 0.0, ahead_m) for right_m, ahead_m in points)
        return tuple((x, z) for x, _, z in on_ground)

    drive = path((1.5, 1), (1.6, 4.5), (1.9, 8), (3, 12), (4, 17), (3, 24), (0, 33), (-5, 44))
    walk = path((-0.25, 1.5), (-0.45, 4), (-1.2, 7), (-2.3, 10), (-2.6, 14), (-1.2, 18), (1, 21))
    changes = {
        "force": (
            gs.forces.Tracks(path=drive, gauge_m=1.5, tyre_m=0.34, impact_m=0.3),
            gs.forces.Footprints(path=walk, step_m=0.85, gauge_m=0.44, foot_m=(0.48, 0.32), impact_m=0.3),
        ),
        "grass": tuple(
            grass.model_copy(update={"height_m": tuple(0.75 * m for m in grass.height_m)}) for grass in scene.grass
        ),
        "object": (),
        "fence": (),
        "wind": (gs.winds.Gusts(direction_deg=285, speed_mps=1.6, gustiness=0.75, gust_m=10),),
        "sun": gs.Sun(azimuth_deg=332, elevation_deg=10),
    }
    camera = gs.Camera(position_m=ahead_of(scene, 0, 3.0, 0), target_m=ahead_of(scene, 0.4, 0.4, 8), fov_y_deg=50)
    return draw(scene.model_copy(update=changes), size, samples, camera=camera).image


def planet(size: Size, samples: int) -> Picture:
    return draw(gs.load("planet"), size, samples, 1.0).image


def cow(size: Size, samples: int) -> Picture:
    """Draw the scene of docs/surfaces.md; its mesh is outside the repository, where the tests look for it too."""
    page = (ROOT / "docs" / "surfaces.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```\n(\[ground\].*?)```", page, re.DOTALL)
    scene = gs.Scene.model_validate(tomllib.loads(text)).in_folder(ROOT.parent / "shared" / "data")
    return draw(scene, size, samples, 1.0).image


def growth(size: Size, samples: int) -> Picture:
    scene = gs.load("meadow").model_copy(
        update={"growth": gs.Growth(time_s=40.0, spread=0.4, height=((0.0, 0.0), (0.3, 0.5), (1.0, 1.0)))}
    )
    camera = gs.Camera(
        position_m=ahead_of(scene, 0.6, 0.6, 3.0), target_m=ahead_of(scene, 0.7, 0.25, 6.0), fov_y_deg=40
    )
    with gs.Renderer(scene, size=size, samples=samples) as renderer:
        times_s = (6.0, 14.0, 26.0, 56.0)
        return sheet([labelled(renderer.render(t, camera=camera).image, f"{t:.0f} s") for t in times_s], 4)


def path_through_grass(edge_px: int) -> Picture:
    """Paint a ground from above: lush and dry grass, and a path."""
    x, z = np.meshgrid(*2 * [np.linspace(-30.0, 30.0, edge_px)])
    broad, fine = octaves(x / 9.0, z / 9.0, 3, 5, 0.5, 2.1), octaves(x * 2.0, z * 2.0, 11, 3, 0.6, 2.1)
    dry = np.clip(0.5 + broad + 0.2 * fine, 0.0, 1.0)[..., None]
    painted = np.array([70.0, 104.0, 34.0]) * (1.0 - dry) + np.array([150.0, 150.0, 74.0]) * dry
    painted[np.abs(x - 3.0 * np.sin(z / 7.0) - 1.0) < 0.9 + 0.25 * fine] = 124.0, 98.0, 70.0
    return np.clip(painted * (1.0 + 0.2 * fine[..., None]), 0.0, 255.0).astype(np.uint8)


def colours(size: Size, samples: int) -> Picture:
    camera = gs.Camera(position_m=(0.0, 3.2, 9.0), target_m=(0.5, 0.4, -3.0), fov_y_deg=46.0)
    sun = gs.Sun(azimuth_deg=140.0, elevation_deg=35.0)
    noise = gs.Scene(colour=gs.colours.NoiseColour(), camera=camera, sun=sun)
    with tempfile.TemporaryDirectory() as folder:
        Image.fromarray(path_through_grass(1024)).save(Path(folder) / "land.png")
        ground = gs.Scene(
            ground=gs.grounds.FlatGround(size_m=(60.0, 60.0), terrain_map="land.png"),
            grass=(gs.Grass(height_m=(0.12, 0.3)),),
            sowing=gs.Sowing(density_per_m2=900.0),
            colour=gs.colours.GroundColour(),
            camera=camera,
            sun=sun,
        ).in_folder(folder)
        panels = [draw(scene, size, samples).image for scene in (noise, ground)]
    captions = "noise", "the ground's picture"
    return sheet([labelled(*each) for each in zip(panels, captions, strict=True)], 2)


def example(name: str, file: str, size: Size, samples: int) -> Picture:
    """Run a program of examples/ and return the picture that it writes."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / (file if name == "embed" else name)
        program = ROOT / "examples" / f"{name}.py"
        options = ["--size", f"{size[0]}x{size[1]}", "--samples", str(samples), "-o", str(out)]
        subprocess.run([sys.executable, str(program), *options], check=True, stdout=subprocess.DEVNULL)
        return np.array(Image.open(out if out.is_file() else out / file).convert("RGB"))


def hillside_near(size: Size, samples: int) -> Picture:
    return example("hillside", "near.png", size, samples)


def hillside_far(size: Size, samples: int) -> Picture:
    return example("hillside", "far.png", size, samples)


def embed(size: Size, samples: int) -> Picture:
    return example("embed", "embed.png", size, samples)


def hosts(size: Size, samples: int) -> Picture:  # noqa: ARG001
    """Windows of other libraries, on an X server without a screen."""
    names = "moderngl_window", "pyside6", "pyvista", "panda3d"
    with tempfile.TemporaryDirectory() as folder:
        panels = []
        for name in names:
            out, program = Path(folder) / f"{name}.png", ROOT / "examples" / "hosts" / f"in_{name}.py"
            options = ["--size", f"{size[0]}x{size[1]}", "--frames", "3", "-o", str(out)]
            command = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", sys.executable, str(program), *options]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            panels.append(labelled(np.array(Image.open(out).convert("RGB")), name.replace("_", "-")))
    return sheet(panels, 2)


def study_page(size: Size, samples: int) -> Picture:
    """The page of a shipped study in Chromium, on a desk and on a phone, and its report."""
    from playwright.sync_api import sync_playwright

    from greensward.study.model import load_study, shipped
    from greensward.study.pictures import draw as draw_picture
    from greensward.study.pictures import to_draw

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    study = load_study(shipped()["tillman2013-second"])
    study = study.model_copy(
        update={
            "size": size,
            "picture": tuple(each.model_copy(update={"samples": samples}) for each in study.picture),
        }
    )
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        for each in to_draw(study, folder):
            draw_picture(study, folder, each)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        shots = []
        with served(study, folder) as address:
            schemes: tuple[tuple[int, int, Any], ...] = ((1120, 760, "light"), (390, 760, "dark"))
            for width, high, scheme in schemes:
                page = browser.new_page(viewport={"width": width, "height": high}, color_scheme=scheme)
                page.goto(f"{address}/?language=en")
                page.get_by_role("checkbox").check()
                page.locator("button.main").click()
                page.locator("#q-age").fill("30")
                page.get_by_label("Female").check()
                page.locator("button.main").click()
                page.get_by_label("4", exact=True).check()
                page.wait_for_load_state("networkidle")
                page.mouse.move(0, 0)
                shots.append(np.array(Image.open(io.BytesIO(page.screenshot())).convert("RGB")))
        browser.close()
    gap = np.full((760, 24, 3), 255, np.uint8)
    both = Image.fromarray(np.concatenate([shots[0], gap, shots[1]], axis=1))
    return np.asarray(both.resize((864, 428), Image.Resampling.LANCZOS))


@contextlib.contextmanager
def served(study: Any, folder: Path) -> Iterator[str]:
    """Serve a study from a thread; gives its address."""
    import uvicorn

    from greensward.study.server import make_app
    from greensward.study.store import Store

    with Store.open(folder) as store:
        server = uvicorn.Server(uvicorn.Config(make_app(study, folder, store), port=0, log_level="error"))
        thread = threading.Thread(target=server.run)
        thread.start()
        while not server.started:
            time.sleep(0.01)
        try:
            port = server.servers[0].sockets[0].getsockname()[1]
            yield urlunsplit(("http", f"127.0.0.1:{port}", "", "", ""))
        finally:
            server.should_exit = True
            thread.join()


def lenses(size: Size, samples: int) -> Picture:
    scene = gs.load("meadow")
    camera, (x, _, z) = scene.camera, scene.camera.position_m
    above: dict[str, Any] = {"position_m": (x, 6.0, z - 5.0), "target_m": (x, 0.0, z - 5.01), "view_height_m": 9.0}
    cameras: dict[str, dict[str, Any]] = {
        "fisheye, 180°": {"projection": "fisheye", "fov_y_deg": 180.0},
        "distortion": {"fov_y_deg": 65.0, "distortion": (-0.25, 0.06)},
        "orthographic": {"projection": "orthographic", **above},
        "roll": {"roll_deg": 20.0},
    }
    return sheet(
        [
            labelled(draw(scene, size, samples, camera=camera.model_copy(update=lens)).image, name)
            for name, lens in cameras.items()
        ],
        2,
    )


def weather(size: Size, samples: int) -> Picture:
    """The meadow in four weathers."""
    shots = []
    for name in ("clear", "fair", "broken", "overcast"):
        scene = gs.load(
            "meadow", overrides={"sky": {"weather": name}, "sun.elevation_deg": 32, "post.exposure_ev": 0.2}
        )
        shots.append(labelled(draw(scene, size, samples, time_s=12.0).image, name))
    return sheet(shots, 2)


def fog(size: Size, samples: int) -> Picture:
    """The meadow at a low sun, with fog in its valleys."""
    return draw(gs.load("meadow", overrides={"fog": {"scale_m": 6.0}}), size, samples).image


def bloom(size: Size, samples: int) -> Picture:
    """The meadow towards a low sun, without bloom and with it."""
    shots = []
    for strength in (0.0, 0.3):
        scene = gs.load("meadow", overrides={"sun.elevation_deg": 11, "post.bloom": strength})
        to_sun = gs.Renderer(scene, size=(16, 9)).light().to_sun
        camera = scene.camera.model_copy(update={"target_m": ahead_of_sun(scene, to_sun)})
        shots.append(labelled(draw(scene, size, samples, camera=camera).image, f"bloom = {strength:g}"))
    return sheet(shots, 2)


def ahead_of_sun(scene: gs.Scene, to_sun: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    """A point before a scene's camera, somewhat below the sun."""
    x, y, z = scene.camera.position_m
    return x + 20.0 * float(to_sun[0]), y + 1.6, z + 20.0 * float(to_sun[2])


def clearing(size: Size, samples: int) -> Picture:
    """A road, a fence beside it, and a house that keeps its feet clear."""
    road = ((-5.0, 30.0), (-1.0, 8.0), (2.5, -4.0), (1.0, -18.0), (-8.0, -40.0))
    scene = gs.Scene(
        ground=gs.grounds.NoiseGround(size_m=(300.0, 300.0), height_m=3.0, wavelength_m=90.0, octaves=3),
        grass=(
            gs.Grass(species="meadow-grass", share=0.6),
            gs.Grass(species="fescue", share=0.3),
            gs.Grass(species="daisy", share=0.1),
        ),
        sowing=gs.Sowing(density_per_m2=900.0),
        clear=(gs.Clearing(path=road, width_m=2.6, edge_m=0.7, smooth=True),),
        fence=(gs.Fence(path=((5.5, 4.0), (5.0, -6.0), (4.5, -18.0), (0.0, -32.0)), weathered=0.8),),
        object=(
            gs.objects.Box(position_m=(-6.0, -0.2, -9.0), size_m=(5.0, 2.9, 4.0), yaw_deg=20.0, colour="#b9ab92"),
            gs.objects.Box(position_m=(-6.0, 2.5, -9.0), size_m=(5.6, 0.25, 4.6), yaw_deg=20.0, colour="#6d4a3a"),
        ),
        sun=gs.Sun(azimuth_deg=130.0, elevation_deg=28.0),
        camera=gs.Camera(position_m=(0.5, 2.1, 9.0), target_m=(-0.6, 0.9, -6.0), fov_y_deg=48.0),
    )
    return draw(scene, size, samples, 1.0).image


def oasis(size: Size, samples: int) -> Picture:
    return draw(gs.load("jahrmann2013-oasis"), size, samples, 1.0).image


def wheat(size: Size, samples: int) -> Picture:
    return draw(gs.load("jahrmann2013-wheat"), size, samples, 1.0).image


def boulders(size: Size, samples: int) -> Picture:
    return draw(gs.load("jahrmann2013-meadow"), size, samples, 1.0).image


def one_patch(size: Size, samples: int) -> Picture:
    return draw(gs.load("jahrmann2013-instance"), size, samples, 1.0).image


def expanded_roots(size: Size, samples: int) -> Picture:
    scene = gs.load("tillman2013-texture-array")
    camera = scene.camera.model_copy(update={"position_m": (2.0, 0.55, 14.0), "target_m": (0.9, 0.3, 11.0)})
    return draw(scene.model_copy(update={"camera": camera}), size, samples, 1.0).image


def billboards(size: Size, samples: int) -> Picture:
    return draw(gs.load("meadow", overrides={"technique.name": "geometry-billboards"}), size, samples, 2.0).image


def derstroff(size: Size, samples: int) -> Picture:
    return draw(gs.load("derstroff"), size, samples, 1.0).image


def football(size: Size, samples: int) -> Picture:
    return draw(gs.load("football"), size, samples, 1.0).image


def instant_grass(size: Size, samples: int) -> Picture:
    return draw(gs.load("habel2007"), size, samples, 2.0).image


def instant_grass_published(size: Size, samples: int) -> Picture:
    return draw(gs.load("habel2007-published"), size, samples, 2.0).image


def far_level(size: Size, samples: int) -> Picture:
    """Draw the middle of the meadow with blades at all distances, and with ray-marched billboards from 40 m on."""
    pictures = []
    for caption, overrides in (("blades", {}), ("ray-marched from 40 m on", {"sowing.traced_m": 40})):
        whole = draw(gs.load("meadow", overrides=overrides), (size[0], 2 * size[1]), samples, 2.0).image
        pictures.append(labelled(whole[size[1] // 3 :][: size[1]], caption))
    return sheet(pictures, 1)


def viewed(
    name: str,
    size: Size,
    draft: bool,
    *steps: Callable[[Application], None],
    page: str = "Quick",
    mouse: Size | None = None,
) -> Picture:
    """Return the viewer's window with a preset after some steps, at full quality and resolution, anti-aliased."""
    ctx = open_context()
    application = Application(Contexts(ctx, lambda: None), Session(name))
    viewer = application.viewer
    viewer.resolution.automatic, viewer.resolution.scale = False, 0.25 if draft else 1.0
    viewer.quality = 0.125 if draft else 1.0
    target = ctx.simple_framebuffer(size)
    for step in (lambda application: application.ui.go_to(page), *steps):
        application.frame(0.1, [], size, target)
        step(application)
    viewer.session.clock.paused = True
    viewer.session.messages.clear()
    for i in range(4 if draft else 29):
        application.frame(0.0, [MouseMove(*mouse)] if mouse and not i else [], size, target)
    picture = np.frombuffer(target.read(), np.uint8).reshape(*size[::-1], 3)[::-1].copy()
    application.release()
    ctx.release()
    return picture


def stroke(tool: Tool, radius_m: float, *points: tuple[float, float]) -> Callable[[Application], None]:
    """Return a step that draws a brush stroke through points to the right of and ahead of the scene's camera."""

    def draw_stroke(application: Application) -> None:
        session = application.viewer.session
        session.tool, session.brush = tool, Brush(radius_m)
        for right_m, ahead_m in points:
            x, _, z = ahead_of(session.scene, right_m, 0.0, ahead_m)
            session.extend_stroke((x, z))
        session.end_stroke()

    return draw_stroke


def fly_to(
    right_m: float, up_m: float, ahead_m: float, pitch_deg: float, turn_deg: float = 0.0
) -> Callable[[Application], None]:
    """Return a step that flies to a point beside and ahead of the scene's camera."""

    def go(application: Application) -> None:
        session = application.viewer.session
        controller, scene = session.controller, session.scene
        x, y, z = ahead_of(scene, right_m, up_m, ahead_m)
        controller.choose("fly")
        controller.position_ws[:] = x, y + float(session.heights.height(x, z)), z
        controller.pitch = np.radians(pitch_deg)
        controller.yaw += np.radians(turn_deg)

    return go


def viewer_window(size: Size, samples: int) -> Picture:
    return viewed("meadow", size, samples < 4)


def viewer_mow(size: Size, samples: int) -> Picture:
    path = tuple((0.5 + 2.2 * np.sin(0.2 * i), 1.0 + 1.1 * i) for i in range(32))
    lair = ((-4.6, 9.0), (-3.8, 11.0), (-4.8, 13.0))

    def take_mower(application: Application) -> None:
        application.viewer.session.tool = "mow"

    steps = (stroke("mow", 1.2, *path), stroke("press", 0.8, *lair), fly_to(0.0, 5.0, -2.0, -24.0), take_mower)
    return viewed("meadow", size, samples < 4, *steps, mouse=(560, 470))


def viewer_split(size: Size, samples: int) -> Picture:
    def morning(application: Application) -> None:
        session = application.viewer.session
        session.split()
        session.set_hour(9.5)
        session.use_technique("bezier-blades")
        session.change(("wind", 0, "speed_mps"), 11.0)

    return viewed("meadow", size, samples < 4, morning)


def viewer_pages(size: Size, samples: int) -> Picture:
    """Draw the pages of the panel beside each other."""

    def winds(application: Application) -> None:
        application.ui.scene_page.search = "wind"

    shots = [
        viewed("yan2024-helicopter", size, samples < 4, page="Scene"),
        viewed("yan2024-helicopter", size, samples < 4, winds, page="Scene"),
        viewed("meadow", size, samples < 4, page="Frame"),
    ]
    return sheet([shot[:, -PANEL_PX:] for shot in shots], 3)


# function, size of one picture, samples
PICTURES: dict[str, tuple[Callable[[Size, int], Picture], Size, int]] = {
    "meadow.webp": (meadow, (1600, 900), 16),
    "close-up.jpg": (close_up, (1280, 720), 16),
    "wind.jpg": (wind, (800, 500), 16),
    "gusts.jpg": (gusts, (400, 300), 16),
    "blades.jpg": (blades, (640, 360), 1),
    "without-end.jpg": (without_end, (1120, 630), 12),
    "shapes.jpg": (shapes, (400, 300), 16),
    "ground-truth.jpg": (truth, (530, 298), 1),
    "hillside-near.jpg": (hillside_near, (1600, 900), 16),
    "hillside-far.jpg": (hillside_far, (1600, 900), 16),
    "balls.jpg": (balls, (560, 315), 8),
    "helicopter.jpg": (helicopter, (640, 360), 8),
    "tracks.webp": (tracks, (960, 540), 16),
    "planet.jpg": (planet, (1280, 720), 16),
    "cow.jpg": (cow, (1280, 720), 16),
    "oasis.jpg": (oasis, (1280, 720), 16),
    "wheat.jpg": (wheat, (1280, 720), 16),
    "boulders.jpg": (boulders, (1280, 720), 16),
    "one-patch.jpg": (one_patch, (1280, 720), 16),
    "expanded-roots.webp": (expanded_roots, (640, 300), 16),
    "billboards.jpg": (billboards, (960, 540), 16),
    "derstroff.webp": (derstroff, (960, 540), 8),
    "football.jpg": (football, (1280, 720), 16),
    "instant-grass.jpg": (instant_grass, (1280, 720), 16),
    "instant-grass-published.webp": (instant_grass_published, (640, 360), 8),
    "far-level.jpg": (far_level, (1120, 315), 16),
    "growth.jpg": (growth, (400, 300), 16),
    "colours.webp": (colours, (336, 210), 16),
    "clearing.webp": (clearing, (800, 450), 16),
    "embed.jpg": (embed, (960, 540), 16),
    "lenses.webp": (lenses, (400, 240), 16),
    "bloom.webp": (bloom, (560, 315), 8),
    "fog.webp": (fog, (1120, 630), 16),
    "weather.webp": (weather, (560, 315), 16),
    "hosts.webp": (hosts, (400, 225), 1),
    "study.webp": (study_page, (1280, 720), 8),
    "viewer.webp": (viewer_window, (1280, 800), 16),
    "viewer-mow.webp": (viewer_mow, (1280, 800), 16),
    "viewer-split.webp": (viewer_split, (1280, 800), 16),
    "viewer-pages.jpg": (viewer_pages, (1280, 760), 16),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(Path(n).stem for n in PICTURES))
    parser.add_argument("--draft", action="store_true", help="half the size, two samples")
    parser.add_argument("-o", "--out", type=Path, default=ROOT / "docs" / "pictures", metavar="DIR")
    options = parser.parse_args()
    known = {Path(name).stem for name in PICTURES}
    if unknown := set(options.names) - known:
        parser.error(f"unknown picture {', '.join(sorted(unknown))}; the names are {', '.join(sorted(known))}")
    options.out.mkdir(parents=True, exist_ok=True)
    for name, (function, size, samples) in PICTURES.items():
        if options.names and Path(name).stem not in options.names:
            continue
        if options.draft:
            size, samples = (size[0] // 2, size[1] // 2), min(samples, 2)
        picture = Image.fromarray(function(size, samples))
        data = encoded(picture, Path(name).suffix)
        with written_aside(options.out / name) as stream:
            stream.write(data)
        print(f"{options.out / name}: {picture.width}×{picture.height}, {len(data):,} bytes")


if __name__ == "__main__":
    main()
