"""`greensward study`: ask people how grass looks."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from greensward.cli.options import Device, progress, whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from greensward.study.messages import Deletion, Message
    from greensward.study.model import Study

EXAMPLES = """\b
Examples:
  greensward study serve tillman2013-second
  greensward study new mine && greensward study serve mine
  greensward study report mine
"""

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]}
)

_Folder = Annotated[
    Path,
    typer.Argument(metavar="FOLDER", help="Folder of the study; or the name of one that comes with greensward."),
]
_Database = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Address of a PostgreSQL database for answers; answers.db in the folder if not given."
    ),
]


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder that is new or empty.")],
    like: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A study that comes along, as `study list` names them."),
    ] = None,
) -> None:
    """Make a folder with a commented study.toml to start from."""
    from importlib.resources import files

    from greensward.cli.new import write_into_new
    from greensward.study.model import shipped

    text = files("greensward.study") / "template.toml"
    if like is not None and like not in shipped():
        raise typer.BadParameter(f"must be one of {', '.join(shipped())} (got {like})", param_hint="'--like'")
    file = write_into_new(folder, "study.toml", shipped()[like].read_bytes() if like else text.read_bytes())
    print(f"Wrote {file}. Change it, then: greensward study serve {folder}")


@app.command("list")
def list_studies() -> None:
    """List the studies that come with greensward."""
    from greensward.study.model import load_study, say, shipped

    for name, file in shipped().items():
        study = load_study(file)
        print(f"{name}: {say(study.title, study.languages[0])} ({len(study.question)} questions)")


@app.command()
def render(
    folder: _Folder,
    again: Annotated[bool, typer.Option("--again", help="Draw also what is there already.")] = False,
    device: Device = "auto",
) -> None:
    """Draw the pictures of a study that are missing or have changed."""
    study, folder = _opened(folder)
    print(f"{folder}: {_draw(study, folder, device, again)}")


@app.command()
def serve(
    folder: _Folder,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on: 0.0.0.0 lets other machines in.")
    ] = "127.0.0.1",
    port: Annotated[Any, typer.Option(parser=whole(0, 65535), metavar="N", help="Port to listen on.")] = "8000",
    database: _Database = None,
    behind_proxy: Annotated[
        bool, typer.Option("--behind-proxy", help="Trust the proxy in front for addresses and https.")
    ] = False,
    export_static: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write page and pictures for another web server into a new folder, and end."
        ),
    ] = None,
    endpoint: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address to which pages of --export-static send answers."),
    ] = None,
    device: Device = "auto",
) -> None:
    """Show the page of a study to people, and keep their answers. Missing pictures are drawn first."""
    if (export_static is None) != (endpoint is None):
        missing = "--endpoint" if endpoint is None else "--export-static"
        raise typer.BadParameter("--export-static and --endpoint are given together", param_hint=f"'{missing}'")
    study, folder = _opened(folder)
    _needs_extra()
    if export_static and endpoint:
        from greensward.scene.files import check_new_folder
        from greensward.study import static

        static.check_endpoint(endpoint)
        check_new_folder(export_static)
        _draw(study, folder, device, again=False)
        count = static.export_static(study, folder, endpoint, export_static)
        print(f"{export_static / 'index.html'}: {count} files; their answers go to {endpoint}")
        return
    from greensward.study.server import serve as serve_study
    from greensward.study.store import Store

    with Store.open(folder, database):
        _draw(study, folder, device, again=False)
    serve_study(study, folder, database, host, port, behind_proxy=behind_proxy)


@app.command()
def report(
    folder: _Folder,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Where to write; the folder's report/ if not given."),
    ] = None,
    database: _Database = None,
) -> None:
    """Summarise the answers: report.html, report.md, plots, and the answers as CSV."""
    study, folder = _opened(folder)
    _needs_extra()
    from greensward.study.report import printed_tables, write_report
    from greensward.study.store import Store

    with Store.open(folder, database) as store:
        people, answers = store.people(), store.answers()
    where = output or folder / "report"
    write_report(study, people, answers, where, printed_tables().get(study.based_on))
    print(f"{where / 'report.html'}: {len(people)} people, {len(answers)} answers")


@app.command()
def export(
    folder: _Folder,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="The answers: .csv or .parquet.")],
    database: _Database = None,
) -> None:
    """Write all answers into a table, also while the study goes on."""
    from greensward.scene.files import check_writable

    check_writable(output, (".csv", ".parquet"))
    _, folder = _opened(folder)
    _needs_extra()
    from greensward.study.export import export_answers
    from greensward.study.store import Store

    with Store.open(folder, database) as store:
        people, answers = store.people(), store.answers()
    export_answers(answers, people, output)
    print(f"{output}: {len(answers)} answers of {len(people)} people")


@app.command("import")
def import_answers(
    folder: _Folder,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Messages of exported pages, one a line.")],
    database: _Database = None,
) -> None:
    """Take answers that pages of `serve --export-static` sent to another server."""
    study, folder = _opened(folder)
    _needs_extra()
    from greensward.scene.errors import InputError
    from greensward.study.forms import FormError
    from greensward.study.messages import OtherPlanError, check, read_messages, take
    from greensward.study.store import Store

    def each(do: "Callable[[Message | Deletion], int]") -> int:
        count = 0
        for number, message in read_messages(file):
            try:
                count += do(message)
            except (FormError, OtherPlanError) as error:
                raise InputError(f"{file}: line {number}: the message {error}") from None
        return count

    each(lambda message: len(check(study, message)))  # all are looked at before any is kept
    with Store.open(folder, database) as store:
        count = each(lambda message: take(study, store, message))
        people = len(store.people())
    print(f"{folder}: new answers: {count}; people in all: {people}")


def _opened(folder: Path) -> tuple["Study", Path]:
    """The study and its folder; one that comes with the program gets a folder of its name here."""
    from greensward.cli.new import write_into_new
    from greensward.scene.errors import SceneError
    from greensward.study.model import load_study, shipped

    name = str(folder)
    if not folder.exists() and name in shipped():
        print(f"Wrote {write_into_new(folder, 'study.toml', shipped()[name].read_bytes())}")
    elif not folder.exists() and re.fullmatch(r"[\w-]+", name):
        known = ", ".join(shipped())
        raise SceneError([f"{folder}: no such folder, and no study has this name; those that come along are {known}"])
    study = load_study(folder)
    return study, folder if folder.is_dir() else folder.parent


def _draw(study: "Study", folder: Path, device: str, again: bool) -> str:
    """Draw what is missing; tell how much that was."""
    from greensward.scene.errors import SceneError
    from greensward.study.pictures import draw, to_draw

    try:
        wanted = to_draw(study, folder, again)
    except SceneError as error:
        raise SceneError(f"{folder / 'study.toml'}: {problem}" for problem in error.problems) from None
    for number, each in enumerate(wanted, 1):
        print(f"Drawing {each.file} ({number} of {len(wanted)})")
        with progress() as notify:
            draw(study, folder, each, device, notify)
    return f"drew {len(wanted)} of {len(study.picture)} pictures"


def _needs_extra() -> None:
    """Raise `InputError` where the packages of studies are missing."""
    from importlib.util import find_spec

    from greensward.scene.errors import InputError

    missing = [name for name in ("starlette", "uvicorn", "jinja2", "sqlalchemy", "scipy") if not find_spec(name)]
    if missing:
        raise InputError(f'studies need {missing[0]}: pip install "greensward[study]"')
