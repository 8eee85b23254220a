"""The report: one HTML page that needs nothing else, and Markdown with its pictures beside it."""

import base64
import io
import re
from collections.abc import Mapping
from html import escape
from pathlib import Path

from PIL import Image

from greensward.bench import tables
from greensward.bench.plots import plots
from greensward.bench.quality import Picture
from greensward.bench.record import Record
from greensward.scene import GreenswardError
from greensward.scene.files import written_aside

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #1d241a; }
table { border-collapse: collapse; font-size: 13px; margin: 1rem 0; display: block; overflow-x: auto; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid #d8ddd2; text-align: right; white-space: nowrap; }
th:first-child, td:first-child, th:nth-child(2), td:nth-child(2) { text-align: left; }
img { max-width: 100%; height: auto; } figure { margin: 0; } figcaption { font-size: 13px; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(20rem, 1fr)); gap: 1rem; }
.missing { background: #fbe6d4; padding: .6rem 1rem; } .text td { text-align: left; white-space: normal; }
"""
READING = (
    "Milliseconds. The floor is what the same run needs for as many bare primitives, or as many strips as blades "
    "were drawn, and for filling the picture once; a technique that fills blades by compute shaders may stay below "
    "it. Vertices are those submitted or made by tessellation, primitives those handed to the rasteriser: blades "
    "that compute shaders fill are neither. Python is the time until the last call of a frame returns. First is what "
    "passes, in seconds, from building the renderer to its first finished frame. Outliers lie more than three "
    "interquartile ranges above the third quartile; they are in every figure."
)
_SAME = "Equal blades, light and camera. The reference is drawn in the finest detail with 64 samples for each pixel."


def write_report(folder: Path, record: Record, pictures: Mapping[str, Picture] | None) -> list[Path]:
    """Write `report.html` and `report.md` with its pictures into a folder. Raises `GreenswardError`.

    With None for pictures, those of an earlier report in the folder are shown.
    """
    record = {**record, "machine": {**record["machine"], "skipped": list(record["machine"].get("skipped", []))}}
    try:
        drawn = plots(record)
    except GreenswardError as error:
        drawn = {}
        record["machine"]["skipped"].append({"workload": "report", "reason": str(error)})
    if pictures is None:
        shown = _shown_before(folder, record)
    else:
        shown = {f"{_file(name)}.jpg": (name, _jpeg(picture)) for name, picture in _worth_showing(pictures).items()}
    files = {
        "report.html": _html(record, drawn, shown).encode(),
        "report.md": _markdown(record, drawn, shown).encode(),
        **drawn,
        **{file: data for file, (_, data) in shown.items()},
    }
    for name, data in files.items():
        with written_aside(folder / name) as stream:
            stream.write(data)
    return [folder / name for name in files]


def _shown_before(folder: Path, record: Record) -> dict[str, tuple[str, bytes]]:
    """Pictures that a report of the same techniques left in the folder."""
    compared = {row["technique"]: row["case"] for row in record["rows"] if "flip" in row}
    captions = {"reference": "reference", **{name: f"{name}, {case}" for name, case in compared.items()}}
    files = {f"{_file(name)}.jpg": text for name, text in captions.items() if compared}
    return {file: (text, (folder / file).read_bytes()) for file, text in files.items() if (folder / file).is_file()}


def markdown_tables(record: Record) -> str:
    """The tables alone."""
    return _markdown(record, {}, {})


def _worth_showing(pictures: Mapping[str, Picture]) -> dict[str, Picture]:
    """The reference, and the last, best picture of each technique."""
    best = {_technique_of(name): name for name in pictures}
    return {name: pictures[name] for name in best.values()}


def _technique_of(caption: str) -> str:
    """Technique, or variant with its settings in brackets, that a caption begins with."""
    return re.split(r",(?![^\[]*\])", caption)[0]


def _file(caption: str) -> str:
    return re.sub(r"[^\w.-]+", "-", _technique_of(caption)).strip("-")


def _jpeg(picture: Picture) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=85)
    return file.getvalue()


def _title(record: Record) -> str:
    machine = record["machine"]
    return f"greensward {machine.get('greensward')} on {machine.get('driver')}"


def _markdown(record: Record, drawn: Mapping[str, bytes], shown: Mapping[str, tuple[str, bytes]]) -> str:
    parts = [f"# {_title(record)}", tables.origin(record).markdown()]
    if record["machine"].get("incomplete"):
        parts.append(f"**Incomplete: {record['machine']['incomplete']}.**\n")
    parts.append(READING + "\n")
    for name, rows in tables.by_workload(record).items():
        parts.append(f"## {name}")
        if "flip" in rows[0]:
            parts.append(_SAME + "\n")
        parts += [f"![{plot}]({plot})\n" for plot in _plots_of(name, drawn)]
        if "flip" in rows[0]:
            parts += [f"![{caption}]({file})\n\n*{caption}*\n" for file, (caption, _) in shown.items()]
        parts += [tables.times(rows).markdown(), tables.work(rows).markdown(), tables.passes(rows).markdown()]
    left_out = tables.skipped(record)
    if left_out.rows:
        parts += ["## Not measured", left_out.markdown()]
    return "\n".join(parts)


def _plots_of(workload: str, drawn: Mapping[str, bytes]) -> list[str]:
    return [name for name in drawn if name == (f"{workload}.webp" if workload != "quality" else "cost-quality.webp")]


def _html(record: Record, drawn: Mapping[str, bytes], shown: Mapping[str, tuple[str, bytes]]) -> str:
    def image(data: bytes, kind: str, caption: str) -> str:
        text = base64.b64encode(data).decode()
        return f'<img src="data:image/{kind};base64,{text}" alt="{escape(caption)}">'

    parts = [f"<h1>{escape(_title(record))}</h1>", f'<div class="text">{tables.origin(record).html()}</div>']
    if record["machine"].get("incomplete"):
        parts.append(f'<p class="missing"><b>Incomplete: {escape(record["machine"]["incomplete"])}.</b></p>')
    parts.append(f"<p>{escape(READING)}</p>")
    for name, rows in tables.by_workload(record).items():
        parts.append(f"<h2>{escape(name)}</h2>")
        if "flip" in rows[0]:
            parts.append(f"<p>{_SAME}</p>")
        parts += [image(drawn[plot], "webp", f"{name}, plotted") for plot in _plots_of(name, drawn)]
        if "flip" in rows[0]:
            figures = [
                f"<figure>{image(data, 'jpeg', caption)}<figcaption>{escape(caption)}</figcaption></figure>"
                for caption, data in shown.values()
            ]
            parts.append(f'<div class="pictures">{"".join(figures)}</div>')
        parts.append(tables.times(rows).html())
        more = tables.work(rows).html() + tables.passes(rows).html()
        parts.append(f"<details><summary>What a frame draws, and its passes</summary>{more}</details>")
    left_out = tables.skipped(record)
    if left_out.rows:
        parts.append(f'<h2>Not measured</h2><div class="text">{left_out.html()}</div>')
    body = "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(_title(record))}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
    )
