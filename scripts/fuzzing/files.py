"""Files of every kind that is read, their bytes mutated."""

from __future__ import annotations

import io
import json
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from fuzzing import damage
from fuzzing.case import Case, Finding, check_sentence, quiet
from fuzzing.scenes import furnish

ROOT = Path(__file__).resolve().parents[2]
Read = Callable[[Path], object]
Mutate = Callable[[Case, bytes], bytes]
Seeds = dict[str, bytes]


def run(case: Case) -> str:
    """Read a mutant: what comes of it, or the sentence that refuses it."""
    from greensward.scene.errors import GreenswardError, SceneError

    kind = case.rng.choice([*_KINDS, "picture", "elevation", "mesh", "mesh"])  # which C libraries read too
    seeds, read = _KINDS[kind]
    name, data = case.rng.choice(sorted(seeds().items()))
    case.note(f"{kind}: {name}")
    case.limit(20)
    furnish(case.folder)
    for beside, content in _beside().items():
        (case.folder / beside).write_bytes(content)
    file = case.folder / name
    if kind == "materials":
        (case.folder / "thing.obj").write_bytes(_beside()["box.obj"])
    file.write_bytes(_mutated(case, name, data))
    begin = time.perf_counter()
    try:
        with quiet():
            read(case.folder / "thing.obj" if kind == "materials" else file)
    except SceneError as error:
        for problem in error.problems:
            check_sentence(problem, (f"{file}: ", "--camera: "))
        return f"{kind} refused"
    except GreenswardError as error:
        check_sentence(str(error), (str(case.folder),))
        return f"{kind} refused"
    finally:
        case.tell({"read_s": round(time.perf_counter() - begin, 2)})
    return f"{kind} read"


def _mutated(case: Case, name: str, data: bytes) -> bytes:
    ending = name.rpartition(".")[2]
    text = ending in ("obj", "mtl", "toml", "asc") or data[:5] == b"solid" or b"\nformat ascii" in data[:20]
    mutate: Mutate = damage.mutated_text if text else damage.mutated
    by_ending: dict[str, Mutate] = {
        "png": damage.mutated_png,
        "npy": damage.mutated_npy,
        "npz": damage.mutated_npz,
        "glb": damage.mutated_glb,
        "gltf": damage.mutated_json,
        "json": damage.mutated_json,
    }
    return by_ending.get(ending, mutate)(case, data)


# Seeds ------------------------------------------------------------------------------------------------------


def _encoded(pixels: Any, kind: str, **options: Any) -> bytes:
    stream = io.BytesIO()
    image = pixels if isinstance(pixels, Image.Image) else Image.fromarray(pixels)
    image.save(stream, kind, **options)
    return stream.getvalue()


@cache
def _pictures() -> Seeds:
    grey = (np.add.outer(np.arange(24), np.arange(20)) * 5).astype(np.uint8)
    rgb = np.stack([grey, 255 - grey, grey // 2], -1)
    rgba = np.dstack([rgb, np.where(grey > 100, 255, 0).astype(np.uint8)])
    turned = Image.Exif()
    turned[274] = 6
    return {
        "grey.png": _encoded(grey, "PNG"),
        "rgb.png": _encoded(rgb, "PNG"),
        "rgba.png": _encoded(rgba, "PNG"),
        "palette.png": _encoded(Image.fromarray(rgb).convert("P"), "PNG"),
        "bits.png": _encoded(Image.fromarray(grey).convert("1"), "PNG"),
        "sixteen.png": _encoded(grey.astype(np.uint16) * 200, "PNG"),
        "animated.png": _encoded(
            Image.fromarray(rgb), "PNG", save_all=True, append_images=[Image.fromarray(255 - rgb)]
        ),
        "rgb.jpg": _encoded(rgb, "JPEG", exif=turned),
        "progressive.jpg": _encoded(rgb, "JPEG", progressive=True),
        "cmyk.jpg": _encoded(Image.fromarray(rgb).convert("CMYK"), "JPEG"),
        "rgb.tif": _encoded(rgb, "TIFF"),
        "lzw.tif": _encoded(rgb, "TIFF", compression="tiff_lzw"),
        "deflate.tif": _encoded(grey, "TIFF", compression="tiff_adobe_deflate"),
        "jpeg.tif": _encoded(rgb, "TIFF", compression="jpeg"),
        "group4.tif": _encoded(Image.fromarray(grey).convert("1"), "TIFF", compression="group4"),
        "float.tif": _encoded(grey.astype(np.float32), "TIFF"),
        "sixteen.tif": _encoded(grey.astype(np.uint16), "TIFF"),
        "lossless.webp": _encoded(rgba, "WEBP", lossless=True),
        "lossy.webp": _encoded(rgb, "WEBP", quality=60),
        "animated.webp": _encoded(
            Image.fromarray(rgb), "WEBP", save_all=True, append_images=[Image.fromarray(255 - rgb)]
        ),
        "rgb.bmp": _encoded(rgb, "BMP"),
        "palette.bmp": _encoded(Image.fromarray(rgb).convert("P"), "BMP"),
    }


def _saved(array: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def _zipped(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


@cache
def _elevations() -> Seeds:
    heights = np.add.outer(np.arange(16), np.arange(16)).astype(np.float32)
    text = "ncols 16\nnrows 16\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -9999\n"
    found = {
        "heights.npy": _saved(heights),
        "whole.npy": _saved(heights.astype(np.uint16)),
        "double.npy": _saved(np.asfortranarray(heights.astype(">f8"))),
        "one.npz": _zipped(heights=heights),
        "grid.asc": (text + "\n".join(" ".join(f"{v:g}" for v in row) for row in heights)).encode(),
        "N46E007.hgt": heights.astype(">i2").tobytes(),
        "heights.raw": heights.astype("<u2").tobytes(),
        "sixteen.png": _pictures()["sixteen.png"],
        "grey.png": _pictures()["grey.png"],
        "float.tif": _pictures()["float.tif"],
        "sixteen.tif": _pictures()["sixteen.tif"],
        "lzw.tif": _encoded(heights.astype(np.uint8), "TIFF", compression="tiff_lzw"),
    }
    return found | _geotiffs(heights)


def _geotiffs(heights: Any) -> Seeds:
    """What GDAL writes, where rasterio is installed."""
    try:
        import rasterio
        from rasterio.io import MemoryFile
        from rasterio.transform import from_origin
    except ImportError:
        return {}
    found = {}
    for name, driver, dtype, options in (
        ("metres.tif", "GTiff", "float32", {"crs": "EPSG:32632", "compress": "deflate", "predictor": 3}),
        ("degrees.tif", "GTiff", "int16", {"crs": "EPSG:4326", "nodata": -9999}),
        ("tiled.tif", "GTiff", "uint16", {"crs": "EPSG:32632", "tiled": True, "blockxsize": 16, "blockysize": 16}),
        ("double.img", "HFA", "float64", {"crs": "EPSG:32632"}),
    ):
        with MemoryFile() as memory:
            step = 1e-4 if name == "degrees.tif" else 2.0
            with (
                rasterio.Env(),
                memory.open(
                    driver=driver,
                    dtype=dtype,
                    width=16,
                    height=16,
                    count=1,
                    transform=from_origin(7, 46, step, step),
                    **options,
                ) as sink,
            ):
                sink.write(heights.astype(dtype), 1)
            found[name] = bytes(memory.read())
    return found


@cache
def _meshes() -> Seeds:
    folder = ROOT / "tests" / "io" / "meshes"
    found = {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.is_file()}
    stone = (ROOT / "src/greensward/scene/presets/jahrmann2013/stone.ply").read_bytes()
    return found | {
        "stone.ply": stone[:200_000],
        "box.obj": _beside()["box.obj"],
        "painted.gltf": _painted(),
        "text.stl": b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        b"endloop\nendfacet\nendsolid x\n",
        "quads.ply": b"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n4 0 1 2 3\n3 0 1 4\n",
    }


@cache
def _painted() -> bytes:
    """A triangle of glTF with a texture, a skin and a morph target."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    uv = np.array([[0, 0], [1, 0], [0, 1]], np.float32)
    joints, weights = np.zeros((3, 4), np.uint8), np.tile(np.array([1, 0, 0, 0], np.float32), (3, 1))
    blob = positions.tobytes() + uv.tobytes() + joints.tobytes() + weights.tobytes()
    starts = [0, 36, 60, 72]
    kinds = [(5126, "VEC3"), (5126, "VEC2"), (5121, "VEC4"), (5126, "VEC4")]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1, 2], "translation": [0, 1, 0]}, {"mesh": 0, "skin": 0}, {"rotation": [0, 0, 0, 1]}],
        "skins": [{"joints": [2]}],
        "meshes": [
            {
                "weights": [0.5],
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "JOINTS_0": 2, "WEIGHTS_0": 3},
                        "material": 0,
                        "targets": [{"POSITION": 0}],
                    }
                ],
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {
                        "index": 0,
                        "texCoord": 0,
                        "extensions": {"KHR_texture_transform": {"offset": [0, 0], "rotation": 0.1, "scale": [1, 1]}},
                    },
                    "baseColorFactor": [1, 1, 1, 1],
                },
                "alphaMode": "MASK",
                "alphaCutoff": 0.5,
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "wrapT": 10497}],
        "images": [{"uri": "rgb.png"}],
        "accessors": [
            {"bufferView": k, "componentType": kind, "type": width, "count": 3}
            for k, (kind, width) in enumerate(kinds)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": end - start}
            for start, end in zip(starts, [*starts[1:], len(blob)], strict=True)
        ],
        "buffers": [{"uri": "blob.bin", "byteLength": len(blob)}],
    }
    _BLOBS["blob.bin"] = blob
    return json.dumps(tree).encode()


_BLOBS: Seeds = {}


@cache
def _beside() -> Seeds:
    """Files that others name."""
    _painted()
    return {
        **_BLOBS,
        "rgb.png": _pictures()["rgb.png"],
        "rgba.png": _pictures()["rgba.png"],
        "box.mtl": b"newmtl red\nKd 1 0 0\nmap_Kd -clamp on rgb.png\nmap_d rgba.png\nnewmtl green\nKd 0 1 0\n",
        "box.obj": b"mtllib box.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nv 0 0 1 0 0 1\nvt 0 0\nvt 1 0\n"
        b"vt 0 1\nvn 0 0 1\nusemtl red\nf 1/1/1 2/2/1 3/3/1\nf 1/1 2/2 4/3\nusemtl green\nf -1 -2 -3\nf 1 2 3 4\n",
    }


@cache
def _checkpoints() -> Seeds:
    clip = {"clip_start_s": 0.0, "clip_fps": 30.0, "clip_following": 4, "clip_scene": "0" * 64}
    return {
        "plain.npz": _zipped(**clip),
        "state.npz": _zipped(**clip, wake=np.zeros((8, 8, 4), np.float32), tiles=np.arange(6), time_s=0.1),
    }


@cache
def _benches() -> Seeds:
    record = json.loads((ROOT / "docs/benchmarks/llvmpipe.json").read_text(encoding="utf-8"))
    return {"bench.json": json.dumps({"machine": record["machine"], "rows": record["rows"][:3]}).encode()}


@cache
def _paths() -> Seeds:
    keys = "".join(f"[[key]]\ntime_s = {t}\n{_VIEW.replace('0.0', f'{t}.0')}" for t in range(3))
    return {"walk.toml": f'after = "repeat"\nheight_above_ground = true\n{keys}'.encode()}


_VIEW = "position_m = [0.0, 1.7, 8.0]\ntarget_m = [0.0, 1.0, -20.0]\nfov_y_deg = 50\n"


@cache
def _cameras() -> Seeds:
    return {"camera.toml": f"[camera]\n{_VIEW}near_m = 0.1\n".encode()}


@cache
def _records() -> Seeds:
    made = {"version": "0.1.0", "size": "96x54", "samples": 1, "fps": 30.0, "scene": "0" * 64, "driver": "llvmpipe"}
    return {".greensward-%04d.json": json.dumps(made).encode()}


@cache
def _states() -> Seeds:
    """What `animate --checkpoint` writes of a small scene with all that has a state."""
    from greensward.io.checkpoints import Checkpoint, write_checkpoint

    with tempfile.TemporaryDirectory() as folder, _moving() as renderer:
        renderer.render(0.0)
        renderer.render(0.1)
        path = Path(folder) / "moving.npz"
        write_checkpoint(path, Checkpoint(0.0, 30.0, 4, "0" * 64, renderer.checkpoint()))
        return {"moving.npz": path.read_bytes()}


def _moving() -> Any:
    from greensward.renderer import Renderer
    from greensward.scene import Scene

    scene = Scene.model_validate(
        {
            "sowing": {"density_per_m2": 20, "reach_m": 20},
            "shadows": {"size_px": 64, "cascades": 1},
            "simulation": {},
            "object": [{"kind": "sphere", "position_m": [0, 0, 0]}],
            "wind": [{"kind": "gusts"}, {"kind": "wake"}],
        }
    )
    return Renderer(scene, size=(32, 18), temporal=True, device="auto")


# Readers ----------------------------------------------------------------------------------------------------


def _read_picture(path: Path) -> object:
    from greensward.io.masks import read_mask
    from greensward.io.rasters import read_colours
    from greensward.motion.outlines import read_outline
    from greensward.scene.errors import InputError

    pixels = read_colours(path)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 4 or not pixels.size:
        raise Finding(f"a picture of {pixels.dtype} {pixels.shape}")
    read_mask(path)
    try:
        return read_outline(path)
    except InputError as error:
        if "would press" not in str(error):
            raise
    return None


def _read_elevation(path: Path) -> object:
    from greensward.io.elevation import extent_m, read_heights

    heights = read_heights(path, byte_order="little" if path.suffix == ".raw" else None)
    if heights.dtype != np.float32 or heights.ndim != 2 or not np.isfinite(heights).all():
        raise Finding(f"heights of {heights.dtype} {heights.shape}, not all finite or not in rows")
    extent = extent_m(path)
    if extent and not (np.isfinite(extent).all() and min(extent) > 0.0):
        raise Finding(f"an extent of {extent}")
    return None


def _read_mesh(path: Path) -> object:
    from greensward.io.meshes import read_mesh
    from greensward.scene.errors import InputError

    try:
        read_mesh(path)
    except InputError:
        painted = None
    else:
        painted = True
    mesh = read_mesh(path, painted=bool(painted))
    if not (np.isfinite(mesh.positions).all() and np.isfinite(mesh.normals).all()):
        raise Finding("a mesh that is not finite")
    if mesh.uv is not None and not np.isfinite(mesh.uv).all():
        raise Finding("texture coordinates that are not finite")
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.positions):
        raise Finding("a triangle without its corners")
    if (np.abs(np.linalg.norm(mesh.normals, axis=1) - 1.0) > 1e-3).any():
        raise Finding("a normal that is not of unit length")
    if mesh.material is not None and painted and mesh.material.max() >= max(len(mesh.materials), 1):
        raise Finding("a material that is not there")
    return mesh


def _read_checkpoint(path: Path) -> object:
    from greensward.io.checkpoints import read_checkpoint

    return read_checkpoint(path)


def _read_state(path: Path) -> object:
    """Go on from a checkpoint, and draw; what does not fit the scene is refused."""
    from greensward.io.checkpoints import read_checkpoint
    from greensward.scene.errors import InputError

    state = read_checkpoint(path).state
    with _moving() as renderer:
        try:
            renderer.resume(state)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None  # as `animate` says it
        renderer.render(0.2)
        with renderer.device.use():
            if (code := renderer.ctx.error) != "GL_NO_ERROR":
                raise Finding(f"an error of OpenGL: {code}")
    return None


def _read_bench(path: Path) -> object:
    from greensward.bench import record
    from greensward.bench.comparison import compare
    from greensward.bench.report import markdown_tables

    read = record.read(path)
    merged = record.merged({path: read})
    return markdown_tables(merged), compare(read, read, (path, path))


def _read_path(path: Path) -> object:
    from greensward.io.camera_path import CameraPath

    read = CameraPath.read(path)
    for time_s in (-1.0, 0.0, 0.5, 1.7, 1e9):
        camera = read.at(time_s)
        if not np.isfinite([*camera.position_m, *camera.target_m, camera.fov_y_deg]).all():
            raise Finding(f"at {time_s:g} s the camera is not finite")
    return None


def _read_camera(path: Path) -> object:
    from greensward.scene.load import load

    return load("meadow", camera=str(path))


def _read_record(path: Path) -> object:
    from greensward.io.video import FrameFiles

    (path.parent / "0000.png").write_bytes(b"x")
    made = json.loads(_records()[".greensward-%04d.json"])
    FrameFiles(str(path.parent / "%04d.png")).check(made)
    return None


_KINDS: dict[str, tuple[Callable[[], Seeds], Read]] = {
    "picture": (_pictures, _read_picture),
    "elevation": (_elevations, _read_elevation),
    "mesh": (_meshes, _read_mesh),
    "materials": (lambda: {"box.mtl": _beside()["box.mtl"]}, _read_mesh),
    "checkpoint": (_checkpoints, _read_checkpoint),
    "state": (_states, _read_state),
    "bench": (_benches, _read_bench),
    "camera path": (_paths, _read_path),
    "camera": (_cameras, _read_camera),
    "frames": (_records, _read_record),
}


def others() -> Seeds:
    """Sound files of the kinds that commands read."""
    return {**_beside(), **_checkpoints(), **_benches(), **_paths(), **_cameras()}
