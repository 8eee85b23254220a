#!/usr/bin/env python3
"""Measure what level of detail changes: cover and mean colour of an even field by distance, heads, and flicker.

Each field is drawn with level of detail and, from the same seed, in full detail (`sowing.full_density_m` beyond its
end), by several cameras beside each other. Pixels are grouped by the distance at which their ray meets the ground.
Cover is the share of pixels that show a blade; colour is the mean of the image, decoded to linear light. Both are
ratios to full detail, means over fields of five seeds; ± gives half of their range. With the grass of the meadow
the shares of pixels that show flowers and seed heads are compared; its seed heads are blue, so that they can be told
apart, and full detail is drawn at six times the size. Flicker is the mean absolute
difference between consecutive frames, in 8-bit steps, of a camera that moves 2 mm to the side each frame.
`scripts/measure_detail.py --table FILE…` turns saved results into the tables of docs/techniques.md.
"""

import argparse
import json
import platform
import sys
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

import greensward as gs

Floats = npt.NDArray[np.float64]
EDGES_M = (5, 10, 15, 25, 40, 60, 90)
HALF_WIDTH_M, LENGTH_M = 12.0, 105.0
CAMERAS = {"1.7 m": (1.7, 0.5, 12.0), "0.6 m": (0.6, 0.3, 12.0), "6 m, down": (6.0, 0.0, 14.0)}
"""Height of the camera, height of its target, and horizontal distance between them, in metres."""
SEEDS, ASIDE_M, PLACES = (1, 2, 3, 4, 5), 0.09, 4
HEADS_SUN_DEG = 58.0
SEED_HEADS, BLUE = ("panicle", "spike"), "#0000ff"
FINER = 6
"""Times as many pixels across in full detail of a field with heads, as stems that are a pixel wide hide many."""
STEP_M, FRAMES = 0.002, 12
TRACED_M = 25.0
"""Distance from which ray-marched billboards replace blades, in the cases that use them."""
FLICKER_CASES: tuple[tuple[str, dict[str, float]], ...] = (
    ("visibility-buffer", {}),
    ("visibility-buffer", {"traced_m": TRACED_M}),
    ("bezier-blades", {}),
)


def field(
    camera: str,
    sowing: Mapping[str, float],
    seed: int = 1,
    full_detail: bool = False,
    sun_deg: float | None = None,
) -> gs.Scene:
    """Return a strip of even ground with the grass of the default scene; with a sun, that of the meadow."""
    height, target, ahead = CAMERAS[camera]
    with_heads: dict[str, object] = {}
    if sun_deg is not None:
        grass = [
            each.model_copy(update={"head_colour": BLUE}) if each.head in SEED_HEADS else each
            for each in gs.load("meadow").grass
        ]
        with_heads = {"grass": [each.model_dump() for each in grass], "sun": {"elevation_deg": sun_deg}}
    return gs.Scene.model_validate(
        {
            **with_heads,
            "seed": seed,
            "ground": {"kind": "flat", "size_m": [2 * HALF_WIDTH_M, LENGTH_M], "beyond": "bare"},
            "sowing": {"drift": 0, **sowing, **({"full_density_m": 1000, "traced_m": None} if full_detail else {})},
            "wind": [],
            "camera": {
                "position_m": [0, height, LENGTH_M / 2],
                "target_m": [0, target, LENGTH_M / 2 - ahead],
                "fov_y_deg": 40,
            },
            "technique": {"name": "visibility-buffer"},
        }
    )


def ground_distance_m(renderer: gs.Renderer) -> Floats:
    """Return the distance at which each pixel's ray meets the strip, inf where it does not: (rows, columns)."""
    view_from_world, clip_from_view = renderer.camera_matrices()
    width, height = renderer.size
    x = (2 * (np.arange(width) + 0.5) / width - 1)[None, :] / clip_from_view[0, 0]
    y = (1 - 2 * (np.arange(height) + 0.5) / height)[:, None] / clip_from_view[1, 1]
    rays = np.stack(np.broadcast_arrays(x, y, -1.0), -1) @ view_from_world[:3, :3]
    eye = np.linalg.inv(view_from_world)[:3, 3]
    along = -eye[1] / np.minimum(rays[..., 1], -1e-9)
    at = eye + along[..., None] * rays
    inside = (np.abs(at[..., 0]) < HALF_WIDTH_M - 1.5) & (np.abs(at[..., 2]) < LENGTH_M / 2)
    return np.where(inside, np.linalg.norm(at - eye, axis=-1), np.inf)


def linear(image: npt.NDArray[np.uint8]) -> Floats:
    """Decode sRGB bytes to linear light."""
    c = image / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def bands(distance: Floats) -> dict[str, npt.NDArray[np.bool_]]:
    """Return a mask of pixels for each band of distance that has at least 100 of them."""
    masks = {f"{low}-{high}": (distance >= low) & (distance < high) for low, high in pairwise(EDGES_M)}
    return {name: mask for name, mask in masks.items() if mask.sum() >= 100}


def cover_and_colour(
    scene: gs.Scene, size: tuple[int, int], samples: int, places: int = PLACES
) -> tuple[dict[str, Floats], int]:
    """Return cover, linear red, green, blue, flowers and seed heads by band; and the number of blades drawn."""
    sums: dict[str, Floats] = {}
    with gs.Renderer(scene, size=size, samples=samples) as renderer:
        masks = bands(ground_distance_m(renderer))
        _, y, z = scene.camera.position_m
        for place in range(places):
            # the same ground under each pixel to within a clump, but other blades
            aside = ASIDE_M * (place - (places - 1) / 2)
            camera = scene.camera.model_copy(
                update={"position_m": (aside, y, z), "target_m": (aside, *scene.camera.target_m[1:])}
            )
            frame = renderer.render(camera=camera, aovs=["class", "albedo"])
            seen, albedo, colour = frame.truth["class"], frame.truth["albedo"], linear(frame.image)
            shares = (
                (seen != gs.SurfaceClass.GROUND),
                seen == gs.SurfaceClass.FLOWER,
                albedo[..., 2] > 2.5 * albedo[..., :2].max(-1),
            )
            for name, mask in masks.items():
                cover, flowers, blue = (share[mask].mean() for share in shares)
                part = np.array([cover, *colour[mask].mean(axis=0), flowers, blue]) / places
                sums[name] = sums.get(name, np.zeros(6)) + part
        return sums, renderer.counts.drawn


def compare(
    camera: str, size: tuple[int, int], samples: int, sowing: Mapping[str, float], sun_deg: float | None = None
) -> list[dict[str, object]]:
    """Return a row for each band: cover in full detail, and ratios to full detail; with a sun, of heads alone."""
    ratios: list[dict[str, Floats]] = []
    columns = slice(0, 4) if sun_deg is None else slice(4, 6)
    for seed in SEEDS:
        whole = field(camera, sowing, seed, True, sun_deg)
        if sun_deg is None:
            full, _ = cover_and_colour(whole, size, samples)
        else:
            full, _ = cover_and_colour(whole, (FINER * size[0], FINER * size[1]), 1, places=1)
        less, drawn = cover_and_colour(field(camera, sowing, seed, False, sun_deg), size, samples)
        ratios.append({name: less[name][columns] / full[name][columns] for name in full})
    rows: list[dict[str, object]] = []
    for name in full:
        both = np.array([ratio[name] for ratio in ratios])
        heads = {} if sun_deg is None else {"full_heads": np.round(full[name][4:], 4).tolist()}
        rows.append(
            {
                "camera": camera,
                **sowing,
                **heads,
                "band_m": name,
                "full_cover": round(float(full[name][0]), 4),
                "ratio": [round(value, 4) for value in both.mean(axis=0).tolist()],
                "noise": [round(value, 4) for value in (0.5 * np.ptp(both, axis=0)).tolist()],
                "drawn": drawn,
            }
        )
    return rows


def flicker(
    technique: str, camera: str, size: tuple[int, int], samples: int, sowing: Mapping[str, float]
) -> dict[str, object]:
    """Return the mean difference between consecutive frames in 8-bit steps, by band."""
    scene = field(camera, sowing).model_copy(update={"technique": gs.TechniqueChoice(name=technique)})
    images = []
    with gs.Renderer(scene, size=size, samples=samples) as renderer:
        masks = bands(ground_distance_m(renderer))
        _, y, z = scene.camera.position_m
        for frame in range(FRAMES):
            x = STEP_M * frame
            camera_there = scene.camera.model_copy(
                update={"position_m": (x, y, z), "target_m": (x, *scene.camera.target_m[1:])}
            )
            images.append(renderer.render(camera=camera_there).image.astype(np.int16))
    steps = np.abs(np.diff(np.array(images), axis=0)).mean(axis=(0, 3))
    by_band = {name: round(float(steps[mask].mean()), 4) for name, mask in masks.items()}
    return {"technique": technique, "camera": camera, "samples": samples, **sowing, "steps": by_band}


def table(file: str) -> str:
    """Return a saved result as Markdown."""
    result = json.loads(Path(file).read_text(encoding="utf-8"))
    names = [f"{low}-{high}" for low, high in pairwise(EDGES_M)]
    lines = [
        f"**{result['machine']['driver']}**, {result['size']}: cover and colour as ratios to full detail",
        "",
        "| camera | drift | ray-marched from, m | distance, m | cover in full detail | cover | red | green | blue |",
        "|---" * 9 + "|",
    ]
    for row in result["rows"]:
        cells = [f"{ratio:.3f} ± {noise:.3f}" for ratio, noise in zip(row["ratio"], row["noise"], strict=True)]
        traced = f"{row['traced_m']:g}" if row.get("traced_m") else "–"
        band = row["band_m"].replace("-", "–")
        start = [row["camera"], f"{row['drift']:g}", traced, band, f"{row['full_cover']:.3f}"]
        lines.append("| " + " | ".join(start + cells) + " |")
    lines += [
        "",
        "Shares of the pixels that show flowers and seed heads:",
        "",
        "| camera | distance, m | flowers in full detail | seed heads in full detail | flowers | seed heads |",
        "|---" * 6 + "|",
    ]
    for row in result.get("heads", []):
        cells = [f"{ratio:.2f} ± {noise:.2f}" for ratio, noise in zip(row["ratio"], row["noise"], strict=True)]
        start = [row["camera"], row["band_m"].replace("-", "–")]
        start += [f"{share:.3f}" for share in row["full_heads"]]
        lines.append("| " + " | ".join([*start, *cells]) + " |")
    header = ["technique", "camera", "samples", *(name.replace("-", "–") + " m" for name in names)]
    lines += ["", "Flicker, in 8-bit steps from frame to frame:", ""]
    lines += ["| " + " | ".join(header) + " |", "|---" * len(header) + "|"]
    for row in result["flicker"]:
        cells = [f"{row['steps'][name]:.2f}" if name in row["steps"] else "" for name in names]
        traced = f", ray-marched from {row['traced_m']:g} m" if row.get("traced_m") else ""
        start = [f"`{row['technique']}`{traced}", row["camera"], str(row["samples"])]
        lines.append("| " + " | ".join([*start, *cells]) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, or turn results into tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=4, help="of each of the images that are averaged")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--cameras", nargs="+", choices=CAMERAS, default=list(CAMERAS))
    parser.add_argument("--table", nargs="+", metavar="FILE")
    arguments = parser.parse_args()
    if arguments.table:
        print("\n".join(map(table, arguments.table)), end="")
        return
    width, height = map(int, arguments.size.split("x"))
    rows: list[dict[str, object]] = []
    for camera in arguments.cameras:
        for sowing in ({"drift": 0.0}, {"drift": 0.6}, {"drift": 0.0, "traced_m": TRACED_M}):
            rows += compare(camera, (width, height), arguments.samples, sowing)
            print(*rows[-6:], sep="\n", file=sys.stderr)
    heads: list[dict[str, object]] = []
    for camera in arguments.cameras:
        with_heads = {"drift": 0.0, "density_per_m2": 900.0}
        heads += compare(camera, (width, height), arguments.samples, with_heads, HEADS_SUN_DEG)
        print(*heads[-6:], sep="\n", file=sys.stderr)
    flickers = []
    for camera in arguments.cameras[:1]:
        for samples in (1, 4):
            for technique, more in FLICKER_CASES:
                flickers.append(flicker(technique, camera, (width, height), samples, more))
                print(flickers[-1], file=sys.stderr)
    with gs.Renderer(gs.Scene(grass=()), size=(8, 8)) as renderer:
        driver = renderer.driver
    machine = {"driver": driver, "python": platform.python_version(), "greensward": gs.__version__}
    result = {"machine": machine, "size": arguments.size, "samples": arguments.samples}
    print(json.dumps({**result, "rows": rows, "heads": heads, "flicker": flickers}, indent=1))


if __name__ == "__main__":
    main()
