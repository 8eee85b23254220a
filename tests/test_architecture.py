"""Imports point down only, techniques do not know each other, and names say what a thing is."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import greensward

_ROOT = Path(greensward.__file__).parent
# A module may import from its own layer and from those below. Within a layer, in the order that is written: each
# from those to its right.
_LAYERS = (
    ("__init__",),
    ("cli", "viewer", "bench"),
    ("renderer",),
    ("library", "surfaces", "truth", "viewpoint"),
    ("techniques", "passes"),
    ("world",),
    ("motion", "culling", "sowing", "objects", "ground"),
    ("gpu", "io"),
    ("scene",),
)
_ORDERED = {"cli", "viewer", "bench", "motion", "culling", "sowing", "objects", "ground"}
_APART = {("techniques", "passes"), ("passes", "techniques"), ("io", "gpu"), ("gpu", "io")}
_FORBIDDEN = {"utils", "util", "helpers", "helper", "manager", "core", "common", "misc", "base_class"}


def _part(module: str) -> str:
    """The part of the package that a module belongs to: `greensward.gpu.view` to `gpu`."""
    names = module.split(".")
    return names[1] if len(names) > 1 else "__init__"


def _sources(root: Path) -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(root.rglob("*.py")):
        names = ["greensward", *path.relative_to(root).with_suffix("").parts]
        if names[-1] in ("__init__", "__main__") and len(names) > 2:
            names.pop()
        yield ".".join(names).removesuffix(".__init__"), ast.parse(path.read_text(encoding="utf-8"))


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where a thing comes from"
            assert node.module
            for alias in node.names:
                is_module = (_ROOT / Path(*node.module.split(".")[1:]) / f"{alias.name}.py").exists()
                is_part = node.module == "greensward" and (is_module or (_ROOT / alias.name).is_dir())
                yield f"{node.module}.{alias.name}" if is_part else node.module


def _problems(sources: Iterator[tuple[str, ast.Module]]) -> list[str]:
    level = {part: number for number, layer in enumerate(_LAYERS) for part in layer}
    problems = []
    for module, tree in sources:
        here = _part(module)
        if here not in level:
            problems.append(f"{module}: belongs to no layer")
            continue
        for imported in _imports(tree):
            if imported.split(".")[0] != "greensward":
                continue
            there = _part(imported)
            if there == here == "techniques":
                mine, theirs = ([*name.split("."), ""][2] for name in (module, imported))
                shared = (_ROOT / "techniques" / f"{theirs}.py").exists()
                if mine and theirs and theirs != mine and not shared:
                    problems.append(f"{module} imports another technique: {imported}")
            elif there == "__init__" and imported == "greensward":
                pass  # the version
            elif there not in level:
                problems.append(f"{module} imports {imported}, which belongs to no layer")
            elif there != here and level[there] < level[here]:
                problems.append(f"{module} imports upwards: {imported}")
            elif there != here and level[there] == level[here]:
                order = _LAYERS[level[here]]
                if here not in _ORDERED or order.index(there) < order.index(here):
                    problems.append(f"{module} imports sideways: {imported}")
    return problems


def test_imports_point_down_only():
    assert _problems(_sources(_ROOT)) == []


@pytest.mark.parametrize(
    ("module", "text", "problem"),
    [
        ("greensward.gpu.view", "from greensward.world import World", "upwards"),
        ("greensward.scene.load", "import greensward.gpu.context", "upwards"),
        ("greensward.sowing.field", "from greensward.culling import visible", "sideways"),
        ("greensward.passes.light", "from greensward.techniques import TECHNIQUES", "sideways"),
        ("greensward.passes.light", "from greensward import techniques", "sideways"),
        ("greensward.techniques.one", "from greensward.techniques.two.parts import x", "another technique"),
        ("greensward.helpers", "", "no layer"),
    ],
)
def test_a_wrong_import_is_found(module, text, problem):
    (found,) = _problems(iter([(module, ast.parse(text))]))
    assert problem in found


def test_right_imports_are_let_through():
    text = "from greensward.techniques.technique import Technique\nfrom greensward.world import World\nimport numpy"
    assert _problems(iter([("greensward.techniques.one", ast.parse(text))])) == []


def test_the_scene_knows_no_gpu_and_no_arrays():
    for module, tree in _sources(_ROOT):
        if _part(module) == "scene":
            outside = {name.split(".")[0] for name in _imports(tree)}
            assert not outside & {"moderngl", "numpy", "ctypes", "PIL"}, module


def test_only_the_viewer_knows_windows():
    for module, tree in _sources(_ROOT):
        if _part(module) != "viewer":
            outside = {name.split(".")[0] for name in _imports(tree)}
            assert not outside & {"glfw", "imgui_bundle", "pyglet", "moderngl_window", "jupyter_rfb"}, module


def test_names_say_what_a_thing_is():
    names = {path.stem.lower() for path in _ROOT.rglob("*") if "__pycache__" not in path.parts}
    assert not names & _FORBIDDEN
