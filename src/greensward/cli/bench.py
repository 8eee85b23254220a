"""`greensward bench`."""

import contextlib
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from greensward.cli.options import CameraFile, Device, size_of, whole

if TYPE_CHECKING:
    from greensward.bench.suite import Wanted

EXAMPLES = """\b
Examples:
  greensward bench --list
  greensward bench blade-count --techniques visibility-buffer,instanced-strips
  greensward bench presets --techniques "expanded-roots[storage=texture-array,extra_blades=3]"
  greensward bench --json today.json --report today
  greensward bench tillman2013-limit --scale full --protocol thesis --json limit.json
  greensward bench field-scale --camera-path walk.toml --protocol thesis
  greensward bench --compare before.json after.json
"""


def _one(allowed: tuple[str, ...]) -> Any:
    def parse(text: str) -> str:
        if text not in allowed:
            raise typer.BadParameter(f"must be one of {', '.join(allowed)} (got {text})")
        return text

    return parse


def _names(texts: Iterable[str] | None) -> tuple[str, ...]:
    names = (name.strip() for text in texts or () for name in text.split(","))
    return tuple(name for name in names if name)


def _sizes(texts: Iterable[str] | None) -> list[tuple[int, int]]:
    try:
        return [size_of(name) for name in _names(texts)]
    except typer.BadParameter as error:
        error.param_hint = "'--sizes'"
        raise


def bench(
    workloads: Annotated[
        list[str] | None, typer.Argument(metavar="[WORKLOAD]...", help="Workloads, as listed by --list; or all.")
    ] = None,
    techniques: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help="Techniques, or variants as name[key=value], with commas; if not given, those of each workload.",
        ),
    ] = None,
    sizes: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SIZES", help="Pixels, with commas, such as 640x360,1920x1080; if not given, the source's."
        ),
    ] = None,
    frames: Annotated[
        Any,
        typer.Option(
            parser=whole(1, 10_000_000), metavar="N", help="Frames of each measurement.", show_default=False
        ),
    ] = None,
    protocol: Annotated[
        Any,
        typer.Option(
            parser=_one(("quick", "thesis")),
            metavar="quick|thesis",
            help="thesis: at least 10,000 frames over at least 40 s (Tillman 2013).",
        ),
    ] = "quick",
    scale: Annotated[
        Any,
        typer.Option(
            parser=_one(("quick", "full", "toy")),
            metavar="quick|full|toy",
            help="quick leaves out what takes long on a CPU; toy makes everything tiny, as a smoke test.",
        ),
    ] = "quick",
    camera_path: CameraFile = None,
    quality: Annotated[
        bool, typer.Option(help="Compare the techniques' pictures of one scene as well, by their FLIP distance.")
    ] = True,
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Where to write the rows, after each of them."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where to write report.html and report.md.")
    ] = None,
    compare: Annotated[
        tuple[Path, Path] | None,
        typer.Option(metavar="FILE FILE", help="Compare two JSON files, and measure nothing."),
    ] = None,
    source: Annotated[
        list[Path] | None,
        typer.Option("--from", metavar="FILE", help="Print or report what JSON files hold; may be repeated."),
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List the workloads.")] = False,
    device: Device = "auto",
) -> None:
    """Benchmark techniques: every frame counted, beside the machine's floor, at equal quality."""
    if listing:
        _list()
        return
    from greensward.bench.variants import split_names
    from greensward.scene.errors import InputError

    named = _names(workloads), split_names(techniques or ()), _sizes(sizes)
    if compare and (source or json_file or report):
        raise InputError("--compare: must stand alone, as it prints; leave out the other files")
    if (compare or source) and (any(named) or camera_path):
        raise InputError("--compare and --from: must stand alone, as they measure nothing; leave out what to measure")
    if compare:
        _compare(*compare)
        return
    if source:
        _show(source, json_file, report)
        return
    from greensward.bench.suite import Wanted
    from greensward.bench.workloads import chosen_techniques, chosen_workloads
    from greensward.io.camera_path import CameraPath

    wanted = Wanted(
        chosen_workloads(named[0]),
        chosen_techniques(named[1]),
        named[2],
        frames=frames,
        protocol=protocol,
        scale=scale,
        quality=quality,
        device=device,
        path=CameraPath.read(camera_path) if camera_path else None,
    )
    _measure(wanted, json_file, report)


def _compare(first: Path, second: Path) -> None:
    from greensward.bench.comparison import compare
    from greensward.bench.record import read

    print(compare(read(first), read(second), (first, second)), end="")


def _show(sources: list[Path], json_file: Path | None, report: Path | None) -> None:
    from greensward.bench import record
    from greensward.bench.report import markdown_tables, write_report

    merged = record.merged({path: record.read(path) for path in sources})
    _check(json_file, report)
    if json_file:
        record.write(json_file, merged)
    if report:
        _say(report, write_report(report, merged, None))
    if not report and not json_file:
        print(markdown_tables(merged), end="")


def _measure(wanted: "Wanted", json_file: Path | None, report: Path | None) -> None:
    from greensward.bench import record
    from greensward.bench.report import markdown_tables, write_report
    from greensward.bench.suite import Result, run
    from greensward.bench.tables import skipped

    _check(json_file, report)

    def keep(result: Result) -> None:
        if json_file:
            record.write(json_file, result.json)

    result = run(wanted, notify=_notify, keep=keep)
    keep(result)
    if report:
        _say(report, write_report(report, result.json, result.pictures))
    if not report and not json_file:
        print(markdown_tables(result.json), end="")
    for workload, by, cases, why in skipped(result.json).rows:
        named = ", ".join(filter(None, (workload, by, "" if cases == "all" else cases)))
        print(f"Not measured: {named}: {why}", file=sys.stderr)
    if result.machine["incomplete"]:
        print(f"Incomplete: {result.machine['incomplete']}", file=sys.stderr)
        raise typer.Exit(1)


def _check(json_file: Path | None, report: Path | None) -> None:
    """Refuse what cannot be written, which is best known before hours of work."""
    from greensward.bench.record import check_folder
    from greensward.scene.files import check_writable

    if json_file:
        check_writable(json_file, (".json",))
    if report:
        check_folder(report)


def _notify(line: str) -> None:
    """Print progress on a terminal, and nothing into a pipe."""
    if sys.stderr.isatty():
        print(line, file=sys.stderr)


def _say(folder: Path, files: list[Path]) -> None:
    print(f"{folder}: {', '.join(sorted(file.name for file in files))}")


def _list() -> None:
    from greensward.bench.workloads import QUICK, workloads

    for each in workloads().values():
        with contextlib.suppress(BrokenPipeError):
            print(f"{each.name}{' (quick)' if each.name in QUICK else ''}: {each.source}")
            print(f"    cases: {'; '.join(case.name for case in each.cases)}")
            print(f"    techniques: {', '.join(each.techniques)}")
