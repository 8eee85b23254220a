"""Scenes that are mutated by what the models allow, and as text."""

from __future__ import annotations

import copy
import json
import math
import os
import time
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from PIL import Image
from pydantic import ValidationError

from fuzzing import schemas
from fuzzing.case import Case, Finding, check_sentence, cut, heard, quiet
from fuzzing.damage import mutated_text

DRAWN = 0.7
"""Share of the accepted scenes that are drawn."""
SIZE = (48, 27)
_NEEDS_A_DEVICE = ("this device can give", "GiB are free", "million blades", "pictures must have the shape of")


def run(case: Case) -> str:
    """Check a mutant, and draw some of those that are accepted."""
    furnish(case.folder)
    text = _text(case)
    file = case.folder / "scene.toml"
    file.write_bytes(text)
    case.note(f"{len(text):,} bytes of TOML")
    case.limit(60)  # noise of a large ground takes all processors, which cases share
    problems = checked(file)
    if problems:
        return "refused"
    if not case.chance(DRAWN):
        return "accepted"
    file.write_text(tomli_w.dumps(_cheap(tomllib.loads(text.decode("utf-8-sig")))), encoding="utf-8")
    if checked(file):
        return "accepted"
    case.limit(120)
    return _drawn(case, file)


# Making -----------------------------------------------------------------------------------------------------


@cache
def _presets() -> dict[str, dict[str, Any]]:
    """The presets' tables, their files named by absolute paths."""
    from greensward.scene.load import preset_file, presets

    found = {}
    for name in presets():
        file = preset_file(name)
        table = tomllib.loads(file.read_text(encoding="utf-8"))
        for holder, key, _ in list(schemas.places(table, None)):
            if isinstance(value := holder[key], str) and value and (file.parent / value).is_file():
                holder[key] = str(file.parent / value)
        found[name] = table
    return found


def _text(case: Case) -> bytes:
    rng = case.rng
    if case.chance(0.02):
        return _swollen(case)
    if case.chance(0.5):
        case.note("a scene at random")
        table = schemas.valid(schemas.scene_schema(), rng)
        if case.chance(0.8):
            _mend(table)
    else:
        name = rng.choice(sorted(_presets()))
        case.note(f"preset {name}")
        table = copy.deepcopy(_presets()[name])
    for _ in range(rng.choice([0, 1, 1, 1, 2, 3])):
        _mutate(case, table)
    text = _dumped(table)
    return mutated_text(case, text) if case.chance(0.1) else text


def _mend(table: dict[str, Any]) -> None:
    """Take out what rules of several keys refuse."""
    from greensward.scene import Scene

    for _ in range(20):
        try:
            Scene.model_validate(table)
        except ValidationError as error:
            for name, *rest in {each["loc"][:2] or ("camera",) for each in error.errors()}:
                part = table.get(str(name))
                if isinstance(part, dict) and len(rest) == 1 and rest[0] in part:
                    del part[rest[0]]
                else:
                    table.pop(str(name), None)
        else:
            return


def _dumped(table: dict[str, Any]) -> bytes:
    try:
        return tomli_w.dumps(table).encode("utf-8", "replace")
    except (RecursionError, ValueError, TypeError):
        return b""


def _mutate(case: Case, table: dict[str, Any]) -> None:
    rng, schema = case.rng, schemas.scene_schema()
    found = list(schemas.places(table, schema))
    action = rng.choices(
        ["set", "edge", "delete", "duplicate", "hostile", "kind", "unknown", "swap"], [8, 6, 1, 1, 1, 1, 0.5, 0.5]
    )[0]
    if action == "set":
        node, own = rng.choice(list(schemas.tables(table, schema)))
        key = rng.choice(sorted(own["properties"]))
        below = own["properties"][key]
        node[key] = schemas.edge(below, rng) if case.chance(0.6) else schemas.valid(below, rng)
        case.note(f"{_name(own)}.{key} = {cut(repr(node[key]), 160)}")
        return
    if action == "unknown":
        node, own = rng.choice(list(schemas.tables(table, schema)))
        key = rng.choice([*schemas.TEXTS, "heigth_m", "height", "Density", "__class__", "model_config", "_folder"])
        node[key] = schemas.hostile(rng)
        case.note(f"{_name(own)}: unknown key {cut(key, 60)!r}")
        return
    if not found:
        return
    holder, key, below = rng.choice(found)
    place = f"{_path(table, holder)}{key}"
    if action == "edge":
        holder[key] = schemas.edge(below, rng)
    elif action == "hostile":
        holder[key] = schemas.hostile(rng)
    elif action == "delete":
        del holder[key]
        case.note(f"without {place}")
        return
    elif action == "duplicate" and isinstance(holder, list):
        holder += [copy.deepcopy(holder[key])] * rng.choice([1, 2, 10, 100, 1000])
        case.note(f"item {place} to {len(holder)} items")
        return
    elif action == "kind":
        node, own = rng.choice(list(schemas.tables(table, schema)))
        node["kind"] = rng.choice(["flat", "noise", "heightmap", "endless", "none", "mesh", "box", "sphere", "gusts"])
        case.note(f"{_name(own)}.kind = {node['kind']}")
        return
    else:
        other, at, _ = rng.choice(found)
        holder[key], other[at] = copy.deepcopy(other[at]), copy.deepcopy(holder[key])
    case.note(f"{place} = {cut(repr(holder[key]) if key in holder or isinstance(key, int) else '', 160)}")


def _path(node: Any, holder: Any, before: str = "") -> str | None:
    """The place of a table or list within another, as a person writes it."""
    if node is holder:
        return before
    for key in node if isinstance(node, dict) else range(len(node)):
        if isinstance(node[key], dict | list):
            found = _path(node[key], holder, f"{before}{key}.")
            if found is not None:
                return found
    return None


def _name(schema: schemas.Schema) -> str:
    return str(schema.get("title", "technique"))


def _swollen(case: Case) -> bytes:
    """Text of a size or depth that no scene has."""
    name, text = case.rng.choice(
        [
            ("a dotted key of 400 kB", "a." * 200_000 + "a = 1"),
            ("a dotted key in a table", "[ground]\n" + "size." * 100_000 + "x = 1"),
            ("a dotted table", "[" + "a." * 50_000 + "a]"),
            ("200,000 tables", "[[object]]\nkind = 'box'\nposition_m = [0, 0, 0]\n" * 200_000),
            ("200,000 empty tables", "[[grass]]\n" * 200_000),
            ("200,000 tables of their own", "".join(f"[t{i}]\n" for i in range(200_000))),
            ("200,000 unknown keys", "".join(f"k{i} = {i}\n" for i in range(200_000))),
            ("200,000 unknown keys of a table", "[sowing]\n" + "".join(f"k{i} = {i}\n" for i in range(200_000))),
            ("a list 900 deep", "x = " + "[" * 900 + "]" * 900),
            ("a list 100,000 deep", "x = " + "[" * 100_000 + "]" * 100_000),
            ("a table 100,000 deep", "x = " + "{a=" * 100_000),
            (
                "a path of a million points",
                "[[object]]\nkind='box'\nposition_m=[0,0,0]\npath.times_s=["
                + ",".join(map(str, range(1_000_000)))
                + "]\n",
            ),
            ("a number of 5,000 digits", "seed = " + "9" * 5000),
            ("a number of 1,000,000 hexadecimal digits", "seed = 0x" + "f" * 1_000_000),
            ("a text of 15 MB", 'title = "' + "x" * 15_000_000 + '"'),
            ("a million numbers", "[ground]\nsize_m = [" + "1," * 1_000_000 + "]"),
            ("a million texts", "[grass]\nsize_m = [" + '"x",' * 1_000_000 + "]"),
            ("1,000 objects", "[[object]]\nkind = 'box'\nposition_m = [0, 0, 0]\n" * 1000),
            ("17 MB", "#" * (17 << 20)),
            ("a million comments", "#\n" * 1_000_000),
            ("a million lines", "\n" * 1_000_000 + "x"),
        ]
    )
    case.note(name)
    return text.encode()


@cache
def _pictures() -> dict[str, bytes]:
    """Files that scenes may name, by their names."""
    import io

    grey = np.add.outer(np.arange(16), np.arange(16)).astype(np.uint8) * 8
    found = {}
    for name, pixels in (
        ("picture.png", np.stack([grey, grey.T, 255 - grey, grey | 128], -1)),
        ("deep.png", grey.astype(np.uint16) * 257),
    ):
        stream = io.BytesIO()
        Image.fromarray(pixels).save(stream, "PNG")
        found[name] = stream.getvalue()
    stream = io.BytesIO()
    np.save(stream, grey.astype(np.float32))
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    return found | {
        "heights.npy": stream.getvalue(),
        "mesh.obj": (corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n").encode(),
        "text.png": b"no picture",
        "empty.png": b"",
    }


def furnish(folder: Path) -> None:
    """Put into a folder what scenes may name, sound and otherwise."""
    for name, content in _pictures().items():
        (folder / name).write_bytes(content)
    os.mkfifo(folder / "fifo")
    (folder / "folder").mkdir()
    (folder / "loop.png").symlink_to("loop.png")


# Judging ----------------------------------------------------------------------------------------------------


def checked(file: Path) -> list[str]:
    """The problems that `greensward check` has with a scene. Raises `Finding`."""
    from greensward.cli import main

    with heard() as said:
        try:
            main(["check", str(file), "--json"])
        except SystemExit as left:
            code = left.code
    try:
        answer = json.loads(said.out)
        problems, ok = list(answer["errors"]), bool(answer["ok"])
    except (ValueError, KeyError, TypeError):
        raise Finding(f"check: code {code}: {cut(said.out + said.err)}") from None
    if said.err:
        raise Finding(f"check: written to the terminal: {cut(said.err)}")
    if (code, ok) not in ((0, True), (2, False)) or ok == bool(problems):
        raise Finding(f"check: code {code} with {len(problems)} problems, ok is {ok}")
    if len(said.out) > 1_000_000:
        raise Finding(f"check: {len(problems):,} problems in {len(said.out):,} characters")
    for problem in problems:
        check_sentence(problem, (f"{file}: ",))
    for doubt in answer["warnings"]:
        if len(doubt) > 2000 or ": " not in doubt or "\n" in doubt:
            raise Finding(f"check: a warning that is no sentence: {cut(doubt)}")
    return problems


def _cheap(table: dict[str, Any]) -> dict[str, Any]:
    """The same scene with few blades and small maps."""
    sowing = table.setdefault("sowing", {})
    sowing["density_per_m2"] = min(sowing.get("density_per_m2", 20), 20)
    sowing["reach_m"] = min(sowing.get("reach_m", 30), 30)
    if sowing.get("traced_m", 0) >= sowing["reach_m"]:
        del sowing["traced_m"]
    if "settle_s" in table.get("simulation", {}):
        table["simulation"]["settle_s"] = min(table["simulation"]["settle_s"], 1.0)
    shadows = table.setdefault("shadows", {})
    shadows["size_px"] = min(shadows.get("size_px", 256), 256)
    table.get("ground", {}).update(
        {key: min(value, 257) for key, value in table.get("ground", {}).items() if key == "samples"}
    )
    technique = table.get("technique", {})
    technique.update({key: min(value, 64) for key, value in technique.items() if key == "texture_px"})
    technique.update({key: min(value, 8) for key, value in technique.items() if key == "layers"})
    for plants in table.get("flowers", []):
        plants.update({key: min(value, 60.0) for key, value in plants.items() if key == "reach_m"})
    for force in table.get("force", []):
        force.update({key: min(value, 4.0) for key, value in force.items() if key == "impact_m"})
    for thing in table.get("object", []):
        if "density_per_m2" in thing.get("grass", {}):
            thing["grass"]["density_per_m2"] = min(thing["grass"]["density_per_m2"], 20)
    return table


def _drawn(case: Case, file: Path) -> str:
    from greensward.aovs import AOVS
    from greensward.gpu.device import Device
    from greensward.renderer import Renderer
    from greensward.scene.errors import GreenswardError
    from greensward.scene.load import load
    from greensward.techniques import SETTINGS

    time_s = case.rng.choice([0.0, 0.0, 1.5, -3.0, 1e6])
    case.note(f"drawn at {time_s:g} s")
    begin = time.perf_counter()
    pictures = []
    with quiet():
        scene = load(file, technique_settings=SETTINGS)
        for _ in range(2):
            try:
                with Renderer(scene, size=SIZE, samples=1, device="auto") as renderer:
                    pictures.append(renderer.render(time_s, aovs=AOVS))
            except GreenswardError as error:
                if any(word in str(error) for word in _NEEDS_A_DEVICE):
                    return "refused by the device"
                raise Finding(f"check accepts and render refuses: {cut(str(error), 400)}") from None
        if (code := Device.shared("auto").ctx.error) != "GL_NO_ERROR":
            raise Finding(f"an error of OpenGL: {code}")
    first, second = pictures
    _check_truth(first)
    for name in first.truth:
        if np.asarray(first.truth[name]).tobytes() != np.asarray(second.truth[name]).tobytes():
            raise Finding(f"drawn twice, the {name} differs")
    if first.image.tobytes() != second.image.tobytes():
        raise Finding("drawn twice, the picture differs")
    if (spent := time.perf_counter() - begin) > 40:
        raise Finding(f"two pictures took {spent:.0f} s")
    return "drawn"


def _check_truth(frame: Any) -> None:
    from greensward.scene.classes import SurfaceClass

    truth = frame.truth
    if frame.image.shape != (SIZE[1], SIZE[0], 3):
        raise Finding(f"a picture of shape {frame.image.shape}")
    sky = truth["class"] == SurfaceClass.SKY
    depth = truth["depth"]
    if np.isnan(depth).any() or (depth[~sky] == math.inf).any() or (depth[sky] != math.inf).any():
        raise Finding(
            f"depth is not finite on {int((~np.isfinite(depth[~sky])).sum())} pixels of surfaces, "
            f"finite on {int(np.isfinite(depth[sky]).sum())} of sky, NaN on {int(np.isnan(depth).sum())}"
        )
    for name in ("normal", "motion", "albedo"):
        if bad := int((~np.isfinite(truth[name])).sum()):
            raise Finding(f"{name} is not finite in {bad} values of {truth[name].size}")
    length = np.linalg.norm(truth["normal"], axis=-1)
    if (np.abs(length[~sky] - 1.0) > 0.01).any():
        raise Finding("a normal is not of unit length")
    json.loads(str(truth["camera"]), parse_constant=_refuse)
    known = {int(kind) for kind in SurfaceClass}
    if not set(np.unique(truth["class"]).tolist()) <= known:
        raise Finding("a class that is none")


def _refuse(constant: str) -> None:
    raise Finding(f"the camera's record holds {constant}")
