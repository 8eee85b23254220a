"""`greensward info`."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from greensward.gpu.device import Device

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
    """Report what greensward runs on, what works here, and the fix for what does not."""
    report = _report()
    print(json.dumps(report, indent=2) if as_json else _text(report))
    raise typer.Exit(0 if report["works"] else 1)


def _report() -> dict[str, Any]:
    from greensward import __version__
    from greensward.gpu.adapters import adapters
    from greensward.gpu.device import Device
    from greensward.scene.errors import GreenswardError
    from greensward.techniques import TECHNIQUES

    report: dict[str, Any] = {
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
        report["devices"] = [vars(adapter) for adapter in adapters()]
        device = Device.shared()
    except GreenswardError as error:
        return report | {"problem": str(error)}
    return report | {"works": True} | _driver(device)


def _version(library: str) -> str | None:
    try:
        return version(library)
    except PackageNotFoundError:
        return None


def _driver(device: "Device") -> dict[str, Any]:
    import ctypes

    ctx, software = device.ctx, device.software
    features = [
        ("OpenGL 4.3 or later", True, None),
        ("tessellation", True, None),
        ("compute shaders", True, None),
        ("a GPU", not software, _NO_GPU),
        (
            "draw parameters in shaders",
            ctx.version_code >= 460 or "GL_ARB_shader_draw_parameters" in ctx.extensions,
            "a newer graphics driver has them",
        ),
        (
            "64-bit atomics",
            device.features.wide_atomics,
            "only NVIDIA's driver offers them; no scene needs them",
        ),
        (
            "program binaries kept between processes",
            device.programs.keeps_binaries,
            "this driver gives none, or GREENSWARD_PROGRAM_CACHE is off; shaders are compiled in each process",
        ),
        (
            "timer queries",
            device.features.timer_queries,
            "a CPU driver works outside of them; passes are timed by the clock instead",
        ),
    ]
    get = device.function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)
    values = (ctypes.c_int * 4)()
    limits = {}
    for name, query in _LIMITS.items():
        get(query, ctypes.byref(values))
        limits[name] = values[0]
    return {
        "driver": {
            "name": device.name,
            "vendor": ctx.info["GL_VENDOR"],
            "opengl": f"{ctx.version_code // 100}.{ctx.version_code // 10 % 10}",
            "version": ctx.info["GL_VERSION"],
            "software": software,
        },
        "features": [{"name": name, "works": works, "fix": None if works else fix} for name, works, fix in features],
        "limits": limits,
    }


def _text(report: dict[str, Any]) -> str:
    libraries = ", ".join(f"{name} {found or 'missing'}" for name, found in report["libraries"].items())
    lines = [
        f"greensward {report['version']}, Python {report['python']}, {report['platform']}",
        libraries,
        "",
    ]
    lines += [f"technique {each['name']}: {each['source']}" for each in report["techniques"]]
    lines += [f"device {device['index']}: {device['name']}" for device in report["devices"]]
    if not report["works"]:
        return "\n".join([*lines, f"Nothing can be drawn here: {report['problem']}"])
    driver = report["driver"]
    lines += [f"drawing on {driver['name']}, OpenGL {driver['opengl']} ({driver['version']})", ""]
    lines += [
        f"{'yes' if feature['works'] else 'no ':3}  {feature['name']}"
        + (f": {feature['fix']}" if feature["fix"] else "")
        for feature in report["features"]
    ]
    width = max(map(len, report["limits"]))
    lines += ["", *(f"{name:{width}}  {value:,}" for name, value in report["limits"].items())]
    return "\n".join(lines)
