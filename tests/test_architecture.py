"""Imports and includes point down only, techniques do not know each other, and names say what a thing is."""

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

import greensward
from greensward.gpu.layouts import LAYOUTS
from greensward.gpu.shader_source import INCLUDE

_ROOT = Path(greensward.__file__).parent
# A module may import from its own layer and from those below. Within a layer, in the order that is written: each
# from those to its right.
_LAYERS = (
    ("__init__",),
    ("cli", "viewer", "bench", "study"),
    ("renderer",),
    ("eyes",),
    ("lens", "queries"),
    ("truth",),
    ("library", "frame", "viewpoint", "winds", "grounds", "forces", "colours"),
    ("techniques", "passes"),
    ("world",),
    ("motion", "culling", "sowing", "objects", "ground"),
    ("gpu", "io"),
    ("scene",),
    ("aovs", "interrupts"),
)
_ORDERED = {"cli", "viewer", "bench", "study", "motion", "culling", "sowing", "objects", "ground"}
_FORBIDDEN = {"utils", "util", "helpers", "helper", "manager", "core", "common", "misc", "base_class"}
_NEITHER_VERB_NOR_NOUN = """
    what where whether how which who whom whose when why while than because if as of in on at to from for by with
    within without into onto over under above below between among along across through around about against
    after before during until since behind beside beyond near off
"""
_BOTTOM = {"shaders", "layout"}
"""Rooms of GLSL that every shader may include from; those of `shaders/` include nothing else."""
_GLSL = {".glsl", ".vert", ".tesc", ".tese", ".geom", ".frag", ".comp"}


def _part(module: str) -> str:
    """The part of the package that a module belongs to: `greensward.gpu.view` to `gpu`."""
    names = module.split(".")
    return names[1] if len(names) > 1 else "__init__"


def _sources(root: Path) -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(root.rglob("*.py")):
        names = ["greensward", *path.relative_to(root).with_suffix("").parts]
        if names[-1] == "__init__" and len(names) > 2:
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


def _wrong_way(here: str, there: str) -> str:
    """Direction of a dependency, if it does not point down."""
    level = {part: number for number, layer in enumerate(_LAYERS) for part in layer}
    if there == here or level[there] > level[here]:
        return ""
    if level[there] < level[here]:
        return "upwards"
    order = _LAYERS[level[here]]
    return "" if here in _ORDERED and order.index(there) > order.index(here) else "sideways"


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
                shared = theirs == "blades" or (_ROOT / "techniques" / f"{theirs}.py").exists()
                if mine and theirs and theirs != mine and not shared:
                    problems.append(f"{module} imports another technique: {imported}")
            elif there == "__init__" and imported == "greensward":
                pass  # the version
            elif there not in level:
                problems.append(f"{module} imports {imported}, which belongs to no layer")
            elif way := _wrong_way(here, there):
                problems.append(f"{module} imports {way}: {imported}")
    return problems


def test_imports_point_down_only():
    assert _problems(_sources(_ROOT)) == []


@pytest.mark.parametrize(
    ("module", "text", "problem"),
    [
        ("greensward.gpu.view", "from greensward.world import World", "upwards"),
        ("greensward.scene.load", "import greensward.gpu.device", "upwards"),
        ("greensward.sowing.field", "from greensward.culling import in_view", "sideways"),
        ("greensward.culling.visible", "from greensward.motion.poses import Poses", "sideways"),
        ("greensward.frame", "from greensward.renderer import Renderer", "upwards"),
        ("greensward.techniques.blades.leaf", "import greensward.techniques.bezier_blades", "another technique"),
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
    text = """
from greensward.techniques.technique import Technique
from greensward.techniques.blades.leaf import LeafSettings
from greensward.world import World
import numpy
"""
    assert _problems(iter([("greensward.techniques.one", ast.parse(text))])) == []


# GLSL -------------------------------------------------------------------------------------------------------


def _shaders(root: Path) -> dict[str, str]:
    """Text of every shader file, by its path in the package."""
    paths = (path for path in root.rglob("*") if path.suffix in _GLSL)
    return {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8") for path in sorted(paths)}


def _include_problems(shaders: dict[str, str], generated: set[str]) -> list[str]:
    problems = []
    for file, text in shaders.items():
        for line in text.splitlines():
            if not (include := INCLUDE.match(line)):
                continue
            path = include[1]
            here, there = file.split("/")[0], path.split("/")[0]
            if there == "layout":
                known = path.removeprefix("layout/") in LAYOUTS
            else:
                known = path in shaders or path in generated
            if not known:
                problems.append(f"{file} includes {path}, which is not there")
            elif there == here == "techniques":
                mine, theirs = file.split("/")[1], path.split("/")[1]
                if theirs not in (mine, "blades"):
                    problems.append(f"{file} includes another technique: {path}")
            elif here == "shaders" and there not in _BOTTOM:
                problems.append(f"{file} includes upwards: {path}")
            elif there not in _BOTTOM and (way := _wrong_way(here, there)):
                problems.append(f"{file} includes {way}: {path}")
    return problems


_GENERATED = {"culling/width", "culling/base_depth", "passes/heads/tables"}
"""Includes that Python writes: what a technique, or a picture, fills in."""


def test_includes_point_down_only():
    import greensward.renderer  # noqa: F401  declares the layouts

    shaders = _shaders(_ROOT)
    assert len(shaders) > 100
    assert _include_problems(shaders, _GENERATED) == []
    included = "".join(shaders.values())
    assert all(f'"{path}"' in included for path in _GENERATED)


@pytest.mark.parametrize(
    ("file", "include", "problem"),
    [
        ("culling/blades.glsl", "motion/pose.glsl", "sideways"),
        ("sowing/sward.glsl", "culling/tests.glsl", "sideways"),
        ("motion/pose.glsl", "techniques/blades/leaf.glsl", "upwards"),
        ("passes/sky/sky.glsl", "techniques/blades/leaf.glsl", "sideways"),
        ("shaders/blade.glsl", "sowing/sward.glsl", "upwards"),
        ("techniques/one/blade.frag", "techniques/two/blade.glsl", "another technique"),
        ("techniques/blades/leaf.glsl", "techniques/two/blade.glsl", "another technique"),
        ("ground/ground.glsl", "layout/NoSuch", "not there"),
        ("ground/ground.glsl", "ground/none.glsl", "not there"),
    ],
)
def test_a_wrong_include_is_found(file, include, problem):
    there = {} if problem == "not there" else {include: ""}
    (found,) = _include_problems({**there, file: f'// why\n  #  include "{include}"'}, set())
    assert problem in found


@pytest.mark.parametrize(
    ("file", "include"),
    [
        ("motion/unstored_blades.glsl", "culling/tests.glsl"),
        ("culling/bounds.glsl", "sowing/sward.glsl"),
        ("techniques/one/blade.frag", "techniques/blades/leaf.glsl"),
        ("techniques/one/blade.frag", "techniques/one/blade.glsl"),
        ("ground/ground.glsl", "shaders/hash.glsl"),
        ("shaders/blade.glsl", "layout/Blade"),
    ],
)
def test_right_includes_are_let_through(file, include):
    assert _include_problems({include: "", file: f'#include "{include}"'}, set()) == []


# Bindings ---------------------------------------------------------------------------------------------------

_NUMBERED = re.compile(r"\bbinding\s*=|\bbind_to_\w+\(|\.use\((?:location\s*=\s*)?\d")


def _numbered(texts: dict[str, str]) -> list[str]:
    return [
        f"{file}:{number}: {line.strip()}"
        for file, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        if _NUMBERED.search(line)
    ]


def test_nothing_is_bound_by_number_outside_the_gpu_room():
    python = {
        path.relative_to(_ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(_ROOT.rglob("*.py"))
        if path.relative_to(_ROOT).parts[0] != "gpu"
    }
    assert _numbered(_shaders(_ROOT) | python) == []


@pytest.mark.parametrize(
    "line",
    [
        "layout(std430, binding = 3) buffer Blades { Blade blades[]; };",
        "buffer.bind_to_storage_buffer(slot)",
        "self._block.bind_to_uniform_block(2)",
        "texture.bind_to_image(0, read=True)",
        "texture.use(4)",
        "texture.use(location=4)",
    ],
)
def test_a_number_is_found(line):
    assert _numbered({"a": f"\n{line}"}) == [f"a:2: {line}"]


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


def _modules_imported(tree: ast.Module, modules: set[str]) -> set[str]:
    """Return the modules that a module imports: at any level, and for type checking too."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.module
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            found |= {name if name in modules else node.module for name in names}
    return found & modules


def _circles(sources: Iterable[tuple[str, ast.Module]]) -> list[list[str]]:
    """Return the import circles among modules: their strongly connected components (Tarjan 1972)."""
    trees = dict(sources)
    imports = {module: _modules_imported(tree, set(trees)) for module, tree in trees.items()}
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    circles = []

    def visit(module: str) -> None:
        order[module] = lowest[module] = len(order)
        stack.append(module)
        for imported in imports[module]:
            if imported not in order:
                visit(imported)
            if imported in stack:
                lowest[module] = min(lowest[module], lowest[imported])
        if lowest[module] == order[module]:
            circle = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(circle) > 1 or module in imports[module]:
                circles.append(sorted(circle))

    for module in imports:
        if module not in order:
            visit(module)
    return circles


def test_no_modules_import_each_other():
    assert _circles(_sources(_ROOT)) == []


@pytest.mark.parametrize(
    "second",
    [
        "import greensward.one",
        "def later():\n    from greensward.one import x",
        "if TYPE_CHECKING:\n    from greensward import one",
    ],
)
def test_a_circle_of_imports_is_found(second):
    texts = {"greensward.one": "from greensward import two", "greensward.two": second, "greensward.three": ""}
    sources = ((module, ast.parse(text)) for module, text in texts.items())
    assert _circles(sources) == [["greensward.one", "greensward.two"]]


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """The line and the text of every docstring, those below attributes included."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) or not body:
            continue
        for i, part in enumerate(body):
            documents = i == 0 or isinstance(body[i - 1], ast.Assign | ast.AnnAssign)
            match part:
                case ast.Expr(value=ast.Constant(value=str(text))) if documents:
                    yield part.lineno, text


def _wrong_docstrings(sources: Iterator[tuple[str, ast.Module]]) -> list[str]:
    return [
        f"{module}:{line}: {text.splitlines()[0]}"
        for module, tree in sources
        for line, text in _docstrings(tree)
        if re.match(r"\W*(\w*)", text)[1].lower() in _NEITHER_VERB_NOR_NOUN.split()
    ]


def test_docstrings_begin_with_a_verb_or_a_noun():
    assert _wrong_docstrings(_sources(_ROOT)) == []


def test_a_docstring_without_a_verb_or_a_noun_is_found():
    text = '''
class Blade:
    """A blade."""
    height_m: float
    """How tall it is."""
    def bend(self):
        """Bend it."""
    def stands(self):
        """Whether it stands."""
'''
    found = _wrong_docstrings(iter([("greensward.scene.blade", ast.parse(text))]))
    assert found == ["greensward.scene.blade:5: How tall it is.", "greensward.scene.blade:9: Whether it stands."]


def test_names_say_what_a_thing_is():
    names = {path.stem.lower() for path in _ROOT.rglob("*") if "__pycache__" not in path.parts}
    assert not names & _FORBIDDEN
