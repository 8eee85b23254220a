"""Scenes from TOML and back. An invalid scene is refused with every error at once."""

import contextlib
import re
import tomllib
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import BaseModel, ValidationError

from greensward.scene.base import names_a_file
from greensward.scene.errors import InputError, SceneError
from greensward.scene.files import is_there, read_file
from greensward.scene.kinds import kind_of, models_in
from greensward.scene.light import INTRINSICS, Camera
from greensward.scene.plain import defaults_of, plain
from greensward.scene.problems import MOST_TOLD, Loc, Models, did_you_mean, one_of, place_of, sentences, short
from greensward.scene.save import saved_text
from greensward.scene.scene import Scene

_PRESETS = Path(str(files("greensward.scene") / "presets"))
_LARGEST = 16 * 2**20
_MOST_PARTS, _MOST_ITEMS = 200, 5000
_NUMBER = r"[^\s,:]+"
_VIEW = re.compile(rf"({_NUMBER},{_NUMBER},{_NUMBER}):({_NUMBER},{_NUMBER},{_NUMBER})(?::({_NUMBER}))?")

Settings: TypeAlias = Mapping[str, type[BaseModel]]
ReadFile: TypeAlias = Callable[[str, Path, Mapping[str, Any]], None]


def load(
    source: str | Path,
    *,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    seed: int | None = None,
    technique: str | None = None,
    camera: str | None = None,
    technique_settings: Settings | None = None,
    read_file: ReadFile | None = None,
) -> Scene:
    """Load the scene of a preset's name, a TOML file, or a folder that holds `scene.toml`.

    A preset's name wins over a file of that name: write `./meadow` for the file. `overrides` are
    `key=value` strings as of `--set` (`wind.0.speed_mps=12`), or a mapping of such keys, whose values that
    are not strings are taken as they are. `camera` is `x,y,z:tx,ty,tz[:fov]` or a TOML file with a `[camera]`
    table. `technique_settings` maps each technique's name to the model of its settings; without it, the
    technique and its settings are not checked. `read_file(key, path, table)` is called for every file that is
    there, with the table that names it; the `InputError` that it raises is a problem of the scene.

    Raises `SceneError`, which holds all problems, one sentence each.
    """
    table, folder, label = _read(source)
    if crowded := next(
        (key for key, value in table.items() if isinstance(value, list) and len(value) > _MOST_ITEMS), None
    ):
        # to check each would take minutes
        rule = f"must hold at most {_MOST_ITEMS:,} tables (got {len(table[crowded]):,})"
        raise SceneError([f"{label}: {place_of((crowded,))}: {rule}"])
    changes = _Changes(table, label)
    if seed is not None:
        changes.set(("seed",), seed, "--seed")
    if technique is not None:
        changes.choose_technique(technique)
    if camera is not None:
        changes.look_from(camera)
    for key, value in _pairs(overrides, changes):
        changes.set(key, value, "--set")
    found = changes.problems + _file_problems(
        [*_files(table, (Scene,), ()), *_files_of_technique(table.get("technique"), technique_settings)],
        folder,
        changes.origin,
        read_file,
    )
    scene: Scene | None = None
    untold = 0
    try:
        scene = Scene.model_validate(table)
    except ValidationError as error:
        found += sentences(error, Scene, changes.origin)
        untold = max(error.error_count() - MOST_TOLD, 0)
    found += _technique_problems(table.get("technique", {}), technique_settings, changes)
    if found or scene is None:
        raise SceneError(dict.fromkeys(found), untold)
    _warn_of_idle_keys(table.get("camera", {}), scene.camera)
    return scene.in_folder(folder)


def _warn_of_idle_keys(written: Mapping[str, Any], camera: Camera) -> None:
    """Warn of keys that say how wide a lens sees and do not count, since another stands for them."""
    counts = "view_height_m" if camera.projection == "orthographic" else "fov_y_deg"
    if camera.fx_px is not None:
        counts = "fx_px"
    for key in ("fov_y_deg", "view_height_m"):
        if key in written and key != counts:
            what = f'{counts} with projection = "{camera.projection}"'
            warnings.warn(f"camera.{key}: does not count, but {what}; leave it out", stacklevel=3)


def dump(scene: Scene) -> str:
    """TOML that loads to an equal scene: every kind and species, and each key that is not its default.

    The files it names stay relative to the scene's own folder.
    """
    return saved_text(None, scene)


def presets() -> dict[str, tuple[str, str]]:
    """The title and the summary of every preset by name; the summary is the comment that opens its file."""
    found = {}
    for path in sorted(_PRESETS.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        opening = re.match(r"(?:#.*\n)*", text)
        summary = " ".join(line.lstrip("# ").rstrip() for line in (opening[0] if opening else "").splitlines())
        found[path.stem] = (str(tomllib.loads(text).get("title", path.stem)), summary)
    return found


def preset_file(name: str) -> Path:
    """The file of a preset."""
    return _PRESETS / f"{name}.toml"


def named_files(scene: Scene, technique_settings: Settings) -> list[tuple[str, Path]]:
    """The key, such as `sowing.density_map`, and the path of every file that the scene and its technique name."""
    found = [*_files(scene.model_dump(), (Scene,), ())]
    if settings := technique_settings.get(scene.technique.name):
        found += _files(scene.technique.model_extra or {}, (settings,), ("technique",))
    return [(place_of(loc), scene.resolve(table[loc[-1]])) for loc, table in found]


# Reading ----------------------------------------------------------------------------------------------------


def _read(source: str | Path) -> tuple[dict[str, Any], Path, str]:
    """The table of a scene, the folder that its files are relative to, and what to call it."""
    path = Path(source)
    if source in presets():
        path, label = preset_file(str(source)), str(source)
    else:
        with contextlib.suppress(OSError, ValueError):
            path = path / "scene.toml" if path.is_dir() else path
        label = str(path)
        if not is_there(path):
            raise SceneError([_no_such_scene(source, path)])
    return read_table(path, label), path.parent, label


def _no_such_scene(source: str | Path, path: Path) -> str:
    if path != Path(source):
        return f"{source}: the folder holds no scene.toml; `greensward new` writes one to start from"
    if path.suffix or {"/", "\\"} & set(str(source)):
        return f"{short(str(source), False)}: no such file or folder"
    names = presets()
    fix = did_you_mean(str(source), names) or f"; presets are {', '.join(names)}"
    return f"{short(str(source), False)}: no preset has this name and no file is there{fix}"


def read_table(path: Path, label: str, what: str = "a scene") -> dict[str, Any]:
    """The tables of a TOML file, which is called `label` and holds `what`. Raises `SceneError`."""
    try:
        text = read_file(path, _LARGEST, what, may_be_empty=True).decode("utf-8-sig")
        _refuse_long_keys(text)
        return tomllib.loads(text)
    except InputError as error:
        raise SceneError([str(error).replace(str(path), label, 1)]) from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise SceneError([f"{label}: line {line}: is not UTF-8 text; {what} is a TOML file"]) from None
    except RecursionError:
        raise SceneError([f"{label}: is nested too deeply"]) from None
    except ValueError as error:
        place = re.fullmatch(r"(.*) \(at (line \d+, column \d+|end of document)\)", str(error), re.DOTALL)
        what, where = (place[1], place[2]) if place else ("a number has too many digits", "TOML")
        raise SceneError([f"{label}: {where}: {what[:1].lower()}{what[1:]}"]) from None


def _refuse_long_keys(text: str) -> None:
    """Raise `ValueError` for a key of more parts than any has: tomllib takes the square of their number in time."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.count(".") > _MOST_PARTS and line.partition("=")[0].count(".") > _MOST_PARTS:
            raise ValueError(f"a key must have at most {_MOST_PARTS} parts (at line {number}, column 1)")


# Changes from outside the file ------------------------------------------------------------------------------


class _Changes:
    """Changes to a scene's table by the caller, and the origin of each key."""

    def __init__(self, table: dict[str, Any], label: str) -> None:
        self.table = table
        self.problems: list[str] = []
        self._origins: list[tuple[Loc, str]] = [((), label)]

    def origin(self, loc: Loc) -> str:
        """Origin of the value at `loc`: the scene file or an option."""
        return next(
            name for at, name in reversed(self._origins) if not at or at[: len(loc)] == loc or loc[: len(at)] == at
        )

    def set(self, loc: Loc, value: Any, origin: str) -> None:
        """Set the value at `loc`; tables on its path that the file lacks start as their defaults."""
        node: Any = self.table
        models: Models = (Scene,)
        for depth in range(len(loc)):
            key: Any = loc[depth]
            if isinstance(node, list) and (not str(key).isdecimal() or int(key) >= len(node)):
                return self._refuse(origin, loc[:depth], _no_item(node, loc, depth))
            if not isinstance(node, dict | list):
                return self._refuse(origin, loc[:depth], f"holds a single value, so it has no key {key}")
            key = int(key) if isinstance(node, list) else key
            loc = (*loc[:depth], key, *loc[depth + 1 :])
            if depth == len(loc) - 1:
                node[key] = value
                break
            if isinstance(node, dict):
                model = _chosen(models, node)
                start = plain(defaults_of(model, node).get(str(key), {}) if model else {})
                node.setdefault(key, {} if start is None else start)
                field = model.model_fields.get(str(key)) if model else None
                models = models_in(field.annotation) if field else ()
            node = node[key]
        # A new kind brings its own rules: what breaks them is due to the change.
        self._origins.append((loc[:-1] if loc[-1] == "kind" else loc, origin))
        return None

    def choose_technique(self, name: str) -> None:
        """Draw with this technique; the settings of another one do not apply to it."""
        written = self.table.get("technique")
        if not isinstance(written, dict) or written.get("name", _technique_name()) != name:
            self.table["technique"] = {}
        self.set(("technique", "name"), name, "--technique")

    def look_from(self, camera: str) -> None:
        """Use the camera given as numbers or as a TOML file."""
        if view := _VIEW.fullmatch(camera.strip()):
            self.set(("camera", "position_m"), [toml_value(part) for part in view[1].split(",")], "--camera")
            self.set(("camera", "target_m"), [toml_value(part) for part in view[2].split(",")], "--camera")
            if view[3]:
                self.set(("camera", "fov_y_deg"), toml_value(view[3]), "--camera")
                for name in INTRINSICS:  # which it replaces
                    self.table["camera"].pop(name, None)
            return
        if not is_there(Path(camera)):
            self.problems.append(
                "--camera: must be x,y,z:tx,ty,tz, optionally :fov, or a TOML file with a [camera] table"
                f" (got {short(camera)})"
            )
            return
        try:
            table = read_table(Path(camera), camera)
        except SceneError as error:
            self.problems += error.problems
            return
        if "camera" in table:
            self.set(("camera",), table["camera"], camera)
        else:
            self.problems.append(f"{camera}: has no [camera] table")

    def _refuse(self, origin: str, loc: Loc, rule: str) -> None:
        self.problems.append(f"{origin}: {place_of(loc)}: {rule}")


def _pairs(overrides: Mapping[str, Any] | Sequence[str], changes: _Changes) -> Iterator[tuple[Loc, Any]]:
    """Keys and values of overrides; `grass[1].share` and `grass.1.share` mean the same."""
    pairs: Iterable[tuple[str, Any]]
    if isinstance(overrides, Mapping):
        pairs = overrides.items()
    else:
        pairs = ((key, value if equals else None) for key, equals, value in (o.partition("=") for o in overrides))
    for key, value in pairs:
        loc = tuple(re.sub(r"\[(\d+)\]", r".\1", key.strip()).split("."))
        if value is None or "" in loc:
            changes.problems.append(f"--set: must be key=value, such as wind.0.speed_mps=12 (got {short(key)})")
        else:
            yield loc, toml_value(value) if isinstance(value, str) else value


def _no_item(items: list[Any], loc: Loc, depth: int) -> str:
    """The rule that the key at this depth breaks, which is not the number of one of these items."""
    count = f"{len(items)} in all, counted from 0" if items else "it is empty"
    if not items or str(loc[depth]).isdecimal():
        return f"has no item {short(str(loc[depth]), False)} ({count})"
    names_a_key = isinstance(items[0], dict) and depth == len(loc) - 1
    meant = (*loc[:depth], "0", *loc[depth + (not names_a_key) :])
    return f"is a list, so the number of an item must follow, as in {'.'.join(map(str, meant))} ({count})"


def toml_value(text: str) -> Any:
    """A value as TOML writes it; anything else is the text itself."""
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text


def _chosen(models: Models, node: Mapping[str, Any]) -> type[BaseModel] | None:
    """The model of a table: the one that its `kind` names, or the first where it names none."""
    if len(models) < 2:
        return models[0] if models else None
    return next((model for model in models if node.get("kind", kind_of(models[0])) == kind_of(model)), None)


def _technique_name() -> str:
    return Scene().technique.name


# Files ------------------------------------------------------------------------------------------------------


@cache
def _places_of_files(model: type[BaseModel]) -> list[tuple[str, bool, Models]]:
    """Keys of a model that name files, or whose models may: the key, which of both, and the models."""
    found = [(key, names_a_file(field), models_in(field.annotation)) for key, field in model.model_fields.items()]
    return [each for each in found if each[1] or each[2]]


def _files(node: Any, models: Models, loc: Loc) -> Iterator[tuple[Loc, Any]]:
    """Every key under `node` that names a file, and the table or list that holds it; `node` need not be valid."""
    if isinstance(node, list | tuple):
        for index, item in enumerate(node):
            yield from _files(item, models, (*loc, index))
    elif isinstance(node, dict) and (model := _chosen(models, node)):
        for key, is_file, inner in _places_of_files(model):
            if not is_file:
                yield from _files(node.get(key), inner, (*loc, key))
            elif isinstance(named := node.get(key), str) and named:
                yield (*loc, key), node
            elif isinstance(named, list | tuple):
                yield from (((*loc, key, i), named) for i, name in enumerate(named) if isinstance(name, str) and name)


def _files_of_technique(choice: Any, technique_settings: Settings | None) -> Iterator[tuple[Loc, Any]]:
    """Those of the settings of a technique."""
    name = choice.get("name", _technique_name()) if isinstance(choice, dict) else None
    if isinstance(name, str) and (settings := (technique_settings or {}).get(name)):
        yield from _files(choice, (settings,), ("technique",))


def _file_problems(
    named: Iterable[tuple[Loc, Any]], folder: Path, origin: Callable[[Loc], str], read_file: ReadFile | None
) -> list[str]:
    """One sentence for each file that is named and not there, or that cannot be read."""
    found = []
    for loc, table in named:
        name = table[loc[-1]]
        try:
            path = folder / Path(name).expanduser()
            if not path.exists():
                raise InputError(f"no such file: {short(str(path), False)}")
            if not path.is_file():
                raise InputError(f"is not a file: {short(str(path), False)}")
            if read_file:
                read_file(place_of(loc), path, table)
        except InputError as error:
            found.append(f"{origin(loc)}: {place_of(loc)}: {error}")
        except (OSError, ValueError, RuntimeError):
            found.append(f"{origin(loc)}: {place_of(loc)}: cannot be a file's name (got {short(name)})")
    return found


# The technique's settings -----------------------------------------------------------------------------------


def _technique_problems(choice: Any, settings: Settings | None, changes: _Changes) -> list[str]:
    """Errors in the technique's name or settings; a table of another type is reported elsewhere."""
    if settings is None or not isinstance(choice, dict):
        return []
    name = choice.get("name", _technique_name())
    if not isinstance(name, str):
        return []
    if name not in settings:
        return [f"{changes.origin(('technique', 'name'))}: technique.name: {one_of(name, settings)}"]
    try:
        settings[name].model_validate({key: value for key, value in choice.items() if key != "name"})
    except ValidationError as error:
        return sentences(error, settings[name], changes.origin, ("technique",))
    return []
