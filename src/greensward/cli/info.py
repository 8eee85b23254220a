"""`greensward info`."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    import moderngl

EXAMPLES = """\b
Examples:
  greensward info
  greensward info --json
"""

_LIBRARIES = ("moderngl", "glcontext", "numpy", "pydantic", "pillow")
_LIMITS = {
    "texture size": 0x0D33,
    "viewport size": 0x0D3A,
    "storage block bytes": 0x90DE,
    "uniform block bytes": 0x8A30,
    "colour targets": 0x8824,
    "samples": 0x8D57,
    "patch vertices": 0x8E7D,
}
_NO_GPU = (
    "drawing is on the CPU, and slower; for a GPU install its driver, and in a container also pass the GPU "
    "in (for NVIDIA with NVIDIA_DRIVER_CAPABILITIES=graphics)"
)


def info(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """Tell what greensward runs on, what works here, and the cure for what does not."""
    told = _tell()
    print(json.dumps(told, indent=2) if as_json else _text(told))
    raise typer.Exit(0 if told["works"] else 1)


def _tell() -> dict[str, Any]:
    from greensward import __version__
    from greensward.gpu.context import devices, open_context
    from greensward.scene.errors import GreenswardError
    from greensward.techniques import TECHNIQUES

    told: dict[str, Any] = {
        "version": __version__,
        "python": platform.python_version(),
        "platform": f"{platform.platform()}, {platform.machine()}",
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "techniques": [{"name": each.name, "source": each.source} for each in TECHNIQUES],
        "works": False,
        "problem": None,
        "devices": [],
        "driver": None,
        "features": [],
        "limits": {},
    }
    try:
        told["devices"] = [vars(device) for device in devices()]
        ctx = open_context()
    except GreenswardError as error:
        return told | {"problem": str(error)}
    try:
        return told | {"works": True} | _tell_context(ctx)
    finally:
        ctx.release()


def _version(library: str) -> str | None:
    try:
        return version(library)
    except PackageNotFoundError:
        return None


def _tell_context(ctx: "moderngl.Context") -> dict[str, Any]:
    import ctypes

    from greensward.gpu.context import driver_name, gl_function, is_software

    software = is_software(ctx)
    extensions = ctx.extensions
    features = [
        ("OpenGL 4.3 or later", True, None),
        ("tessellation", True, None),
        ("compute shaders", True, None),
        ("a GPU", not software, _NO_GPU),
        (
            "draw parameters in shaders",
            ctx.version_code >= 460 or "GL_ARB_shader_draw_parameters" in extensions,
            "a newer graphics driver has them",
        ),
        (
            "64-bit atomics",
            "GL_NV_shader_atomic_int64" in extensions,
            "only NVIDIA's driver offers them; no scene needs them",
        ),
        (
            "timer queries",
            not software,
            "a CPU driver works outside of them; passes are timed by the clock instead",
        ),
    ]
    get = gl_function(ctx, "glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)
    values = (ctypes.c_int * 4)()
    limits = {}
    for name, query in _LIMITS.items():
        get(query, values)
        limits[name] = values[0]
    return {
        "driver": {
            "name": driver_name(ctx),
            "vendor": ctx.info["GL_VENDOR"],
            "opengl": f"{ctx.version_code // 100}.{ctx.version_code // 10 % 10}",
            "version": ctx.info["GL_VERSION"],
            "software": software,
        },
        "features": [
            {"name": name, "works": works, "cure": None if works else cure} for name, works, cure in features
        ],
        "limits": limits,
    }


def _text(told: dict[str, Any]) -> str:
    libraries = ", ".join(f"{name} {found or 'missing'}" for name, found in told["libraries"].items())
    lines = [
        f"greensward {told['version']}, Python {told['python']}, {told['platform']}",
        libraries,
        "",
    ]
    lines += [f"technique {each['name']}: {each['source']}" for each in told["techniques"]]
    lines += [f"device {device['index']}: {device['name']}" for device in told["devices"]]
    if not told["works"]:
        return "\n".join([*lines, f"Nothing can be drawn here: {told['problem']}"])
    driver = told["driver"]
    lines += [f"drawing on {driver['name']}, OpenGL {driver['opengl']} ({driver['version']})", ""]
    lines += [
        f"{'yes' if feature['works'] else 'no ':3}  {feature['name']}"
        + (f": {feature['cure']}" if feature["cure"] else "")
        for feature in told["features"]
    ]
    width = max(map(len, told["limits"]))
    lines += ["", *(f"{name:{width}}  {value:,}" for name, value in told["limits"].items())]
    return "\n".join(lines)
