"""Pages of a study that any web server can hold: they keep answers in the browser, and send them to one address."""

import json
import re
import secrets
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from greensward.scene.errors import InputError
from greensward.scene.files import check_new_folder, open_file, written_aside
from greensward.study.messages import plan_of
from greensward.study.model import LANGUAGES, Staircase, Study, say, shown_in
from greensward.study.pictures import is_clip, missing_pictures, picture_file
from greensward.study.plan import Trial, order_of, stages
from greensward.study.server import PAGES, STATIC, templates, words_of
from greensward.study.store import LETTERS

_BLIND = ("pairs", "staircase")
_ORDERS = 256
"""Orders that are made beforehand; each visitor gets one of them at random."""
_WORDS = (
    *("progress", "required", "not_offered", "arrived", "not_arrived", "refused", "sending"),
    *("not_deleted", "no_connection"),
)


def check_endpoint(address: str) -> str:
    """An address that answers are sent to. Raises `InputError`."""
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https") or not re.fullmatch(r"[\w.:\[\]-]+", parts.netloc) or parts.fragment:
        raise InputError(f"--endpoint: must be an address such as https://example.org/answers (got {address})")
    return address


def export_static(study: Study, folder: Path, endpoint: str, output: Path) -> int:
    """Write pages and pictures into a folder that is new or empty; returns the number of files.

    Raises `GreenswardError`.
    """
    check_endpoint(endpoint)
    if missing := missing_pictures(study, folder):
        raise InputError(f"{folder}: the picture {missing[0]} is not there; `greensward study render` draws them")
    check_new_folder(output)
    _make(output)
    hidden = _hidden_names(study, folder)
    files: dict[str, bytes] = {f"static/{name}": (PAGES / name).read_bytes() for name in (*STATIC, "static.js")}
    is_random = any(question.kind in _BLIND for question in study.question)
    orders = _ORDERS if is_random else 1
    for seed in range(1, orders + 1):
        files[f"orders/{seed}.json"] = json.dumps(_order(study, seed, hidden), separators=(",", ":")).encode()
    pictures = {picture.name: picture for picture in study.picture}
    for name, where in hidden.items():
        _copy(picture_file(folder, pictures[name]), output / where)
    # the pages come last: nobody is shown a study that is not whole
    for language in study.languages[::-1]:
        files[_file_of(study, language)] = _page(study, folder, endpoint, language, hidden, orders).encode()
    for name, content in files.items():
        _write(output / name, content)
    return len(files) + len(hidden)


def _hidden_names(study: Study, folder: Path) -> dict[str, str]:
    """Files of the pictures on the site, by the picture's name, from which nobody learns it."""
    used = {name for question in study.question for name in shown_in(question)}
    found = {}
    for picture in study.picture:
        if picture.name in used:
            file = picture_file(folder, picture)
            found[picture.name] = f"pictures/{secrets.token_hex(8)}{file.suffix.lower() if file else ''}"
    return found


def _order(study: Study, seed: int, hidden: dict[str, str]) -> dict[str, Any]:
    return {
        name: [[hidden[each] for each in one] if isinstance(one, tuple) else one for one in order]
        for name, order in order_of(study, seed).items()
    }


def _page(study: Study, folder: Path, endpoint: str, language: str, hidden: dict[str, str], orders: int) -> str:
    pictures = {picture.name: picture for picture in study.picture}
    words = words_of(language)
    parts = urlsplit(endpoint)
    data = {
        "plan": plan_of(study),
        "endpoint": endpoint,
        "orders": orders,
        "letters": LETTERS,
        "size": study.size,
        "closes": study.closes and study.closes.isoformat(),
        "required": [question.name for question in study.question if question.required],
        "pictures": {
            where: {
                "file": where,
                "clip": is_clip(folder, pictures[name]),
                "alt": say(pictures[name].alt, language),
            }
            for name, where in hidden.items()
        },
        "stairs": {
            question.name: {
                "levels": [hidden[name] for name in question.levels],
                "reference": hidden[question.reference],
                **question.model_dump(include={"down", "reversals", "most"}),
            }
            for question in study.question
            if isinstance(question, Staircase)
        },
        "words": {word: words[word] for word in _WORDS},
    }
    shown = []
    for questions in stages(study):
        kind = questions[0].kind if questions[0].kind in _BLIND else "plain"
        trials = [Trial(each, shown=shown_in(each)[:2] if kind != "plain" else shown_in(each)) for each in questions]
        shown.append({"kind": kind, "trials": trials})
    template = templates().get_template("static.html.j2")
    html: str = template.render(
        study=study,
        language=language,
        languages={each: LANGUAGES[each] for each in study.languages},
        file_of=lambda other: _file_of(study, other),
        words=words,
        say=lambda texts: say(texts, language),
        root="",
        origin=f"{parts.scheme}://{parts.netloc}",
        data=data,
        stages=shown,
        pictures=pictures,
        size=study.size,
        is_clip=lambda name: is_clip(folder, pictures[name]),
        address=lambda trial, side: "" if trial.question.kind in _BLIND else hidden[trial.shown[side]],
    )
    return html


def _file_of(study: Study, language: str) -> str:
    return "index.html" if language == study.languages[0] else f"{language}.html"


def _make(folder: Path) -> None:
    try:
        for part in ("static", "orders", "pictures"):
            (folder / part).mkdir(parents=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: cannot be made: {getattr(error, 'strerror', None) or error}") from None


def _copy(source: Path | None, target: Path) -> None:
    assert source
    with open_file(source) as stream, written_aside(target) as written:
        while block := stream.read(1 << 20):
            written.write(block)


def _write(target: Path, content: bytes) -> None:
    with written_aside(target) as stream:
        stream.write(content)
