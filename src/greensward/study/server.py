"""The page of a study, and what takes its answers: an ASGI application."""

import hmac
import signal
import socket
import time
import tomllib
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Mapping
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from types import FrameType
from typing import Any, TypeAlias

import uvicorn
from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Route

from greensward.interrupts import handled
from greensward.scene.errors import GreenswardError, InputError
from greensward.study.forms import MOST_BYTES, Filled, FormError, fields_of, filled
from greensward.study.messages import MOST_MESSAGE_BYTES, Message, OtherPlanError, message_of, take
from greensward.study.model import LANGUAGES, Pairs, Picture, Staircase, Study, say
from greensward.study.pictures import is_clip, missing_pictures, picture_file
from greensward.study.plan import Answer, Page, Person, Trial, alike, pages, reached, stage_of
from greensward.study.store import Store, plain_code

PAGES = files("greensward.study") / "pages"
_COOKIE = "greensward-study"
_MOST_AGE_S = 180 * 86_400
_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; img-src 'self'; media-src 'self'; style-src 'self'; script-src 'self'; "
        "connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}
_KEPT = "private, max-age=86400, immutable"
STATIC = {
    "study.css": "text/css; charset=utf-8",
    "study.js": "text/javascript; charset=utf-8",
    "icon.svg": "image/svg+xml",
}
_KINDS = {
    ".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".webp": "image/webp", ".gif": "image/gif",
    ".avif": "image/avif", ".mp4": "video/mp4", ".webm": "video/webm",
}  # fmt: skip

Fields: TypeAlias = Mapping[str, list[str]]
"""Fields of a form by name."""


class _Stop(Exception):  # noqa: N818  # it carries an answer, which need not be an error
    """An answer to a request that goes no further."""

    def __init__(self, status: int, words: str) -> None:
        self.status, self.words = status, words


class _Limit:
    """Rates of events by who causes them: so many at once, and so many again in a second."""

    def __init__(self, most: float, per_s: float) -> None:
        self._most, self._per_s = most, per_s
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, who: str) -> None:
        """Count an event. Raises `_Stop` where there were too many."""
        now = time.monotonic()
        left, at = self._left.pop(who, (self._most, now))
        left = min(self._most, left + (now - at) * self._per_s)
        self._left[who] = max(left - 1.0, 0.0), now
        while len(self._left) > 10_000:
            self._left.popitem(last=False)
        if left < 1.0:
            raise _Stop(429, "too_often")


class _Site:
    """The pages of one study."""

    def __init__(self, study: Study, folder: Path, store: Store, behind_proxy: bool) -> None:
        self.study, self.folder, self.store = study, folder, store
        self._behind_proxy = behind_proxy
        self._words: dict[str, dict[str, str]] = {language: words_of(language) for language in study.languages}
        self._templates = templates()
        self._pictures = {picture.name: picture for picture in study.picture}
        self._by_hidden = {store.hidden(f"picture {name}"): name for name in self._pictures}
        self._static = {name: (PAGES / name).read_bytes() for name in STATIC}
        # people who begin or try codes, by their address, and answers, by their session
        self._begun, self._tried, self._sent = _Limit(300, 1.0), _Limit(10, 0.1), _Limit(120, 5.0)

    def app(self) -> Starlette:
        """The application."""
        return Starlette(
            routes=[
                Route("/", self._answered(self._start)),
                Route("/begin", self._answered(self._begin), methods=["POST"]),
                Route("/page/{number:int}", self._answered(self._page)),
                Route("/page/{number:int}", self._answered(self._take), methods=["POST"]),
                Route("/pause", self._answered(self._pause)),
                Route("/end", self._answered(self._end)),
                Route("/answers", self._take_message, methods=["POST"]),
                Route("/code", self._answered(self._code)),
                Route("/code", self._answered(self._come_back), methods=["POST"]),
                Route("/delete", self._answered(self._ask_delete)),
                Route("/delete", self._answered(self._delete), methods=["POST"]),
                Route("/picture/{name}", self._answered(self._picture)),
                Route("/seen/{question}/{trial:int}/{side:int}", self._answered(self._seen)),
                Route("/static/{name}", self._answered(self._static_file)),
                Route("/{rest:path}", self._answered(self._nothing)),
            ]
        )

    def _answered(self, handle: Callable[[Request], Response]) -> Callable[[Request], Awaitable[Response]]:
        """A handler, with its form read, and its refusals and failures as pages."""

        async def answer(request: Request) -> Response:
            try:
                if request.method == "POST":
                    request.state.fields = await _form(request)
                response = await run_in_threadpool(handle, request)
            except _Stop as stop:
                response = self._message(request, stop.status, stop.words)
            except FormError:
                response = self._message(request, 400, "bad_form")
            except GreenswardError as error:
                print(f"error: {error}", flush=True)
                response = self._message(request, 503, "failed")
            for name, value in _HEADERS.items():
                response.headers[name] = value
            response.headers.setdefault("Cache-Control", "no-store")
            return response

        return answer

    # Sessions -----------------------------------------------------------------------------------------------

    def _session(self, request: Request) -> tuple[Person, str]:
        """The person of a request, and the session's token. Raises `_Stop` where there is none."""
        token = request.cookies.get(_COOKIE, "").partition(".")[0]
        person = self.store.of_token(token) if token else None
        if not person:
            raise _Stop(403, "no_session")
        return person, token

    def _code_of(self, request: Request, person: Person) -> str:
        """The code of a person, which only the browser keeps; empty where it has another."""
        code = str(request.cookies.get(_COOKIE, "").partition(".")[2])
        return code if self.store.is_code_of(code, person) else ""

    def _key(self, token: str) -> str:
        """A word of the forms of a session, which other sites cannot know."""
        return self.store.hidden(f"form {token}")

    def _check(self, token: str, fields: Fields) -> None:
        """Raise `FormError` for a form that does not come from this session's page."""
        key = _one(fields, "key", without="")
        if not hmac.compare_digest(key.encode(), self._key(token).encode()):
            raise FormError("has another session's key")

    def _signed_in(self, request: Request, token: str, code: str, where: str) -> Response:
        response = RedirectResponse(where, 303)
        secure = request.url.scheme == "https"
        response.set_cookie(
            _COOKIE, f"{token}.{code}", _MOST_AGE_S, path="/", httponly=True, samesite="strict", secure=secure
        )
        return response

    def _from(self, request: Request) -> str:
        """The address that a request comes from; behind a proxy, the one that the proxy names last."""
        if self._behind_proxy and (named := str(request.headers.get("x-forwarded-for", ""))):
            return named.rpartition(",")[2].strip()
        return str(request.client.host) if request.client else ""

    def _language(self, request: Request) -> str:
        """The language that a person chose, or the browser asks for."""
        asked = [request.query_params.get("language", "")]
        asked += [
            part.partition(";")[0].strip()[:2] for part in request.headers.get("accept-language", "").split(",")
        ]
        return next((each for each in asked if each in self.study.languages), self.study.languages[0])

    # Pages --------------------------------------------------------------------------------------------------

    def _html(
        self, name: str, language: str, status: int = 200, headers: Mapping[str, str] | None = None, **values: Any
    ) -> HTMLResponse:
        text = self._templates.get_template(f"{name}.html.j2").render(
            study=self.study,
            language=language,
            languages={each: LANGUAGES[each] for each in self.study.languages},
            words=self._words[language],
            say=lambda words: say(words, language),
            root="/",
            **values,
        )
        return HTMLResponse(text, status, headers)

    def _message(self, request: Request, status: int, words: str) -> HTMLResponse:
        headers = {"Retry-After": "60"} if status in (429, 503) else {}
        return self._html("message", self._language(request), status, headers, what=words)

    def _closed(self) -> bool:
        return self.study.closes is not None and datetime.now(UTC).date() > self.study.closes

    def _start(self, request: Request) -> Response:
        return self._html("start", self._language(request), closed=self._closed(), problem="")

    def _begin(self, request: Request) -> Response:
        fields: Fields = request.state.fields
        _check_site(request)
        language = _one(fields, "language", self.study.languages)
        if set(fields) - {"language", "agree"}:
            raise FormError("has a field that the page does not have")
        if self._closed():
            raise _Stop(403, "closed")
        if fields.get("agree") != ["yes"]:
            return self._html("start", language, 422, closed=False, problem="agree_needed")
        self._begun.take(self._from(request))
        _, token, code = self.store.begin(language)
        return self._signed_in(request, token, code, "/page/1")

    def _page(self, request: Request) -> Response:
        person, token = self._session(request)
        answers = self.store.answers_of(person)
        every = pages(self.study, person.seed, answers)
        number, first_open = request.path_params["number"], reached(every, answers)
        if number > first_open:
            return RedirectResponse("/end" if first_open > len(every) else f"/page/{first_open}", 303)
        if not 1 <= number <= len(every):
            raise _Stop(404, "not_found")
        return self._shown(person, token, every, number, answers)

    def _shown(
        self,
        person: Person,
        token: str,
        every: list[Page],
        number: int,
        answers: Mapping[str, Answer],
        sent: Filled | None = None,
    ) -> Response:
        page = every[number - 1]
        given = {
            trial.key: sent.given[trial.key] if sent else _as_fields(trial, answers.get(trial.key))
            for trial in page.trials
        }
        # what follows a staircase's page is not known before its answer
        open_end = any(isinstance(question, Staircase) for question in self.study.question)
        at, of = stage_of(self.study, page.trials[0].question) if open_end else (number, len(every))
        return self._html(
            "page",
            person.language,
            422 if sent else 200,
            page=page,
            number=number,
            at=at,
            of=of,
            key=self._key(token),
            given=given,
            problems=sent.problems if sent else {},
            address=self._address,
            is_clip=lambda name: is_clip(self.folder, self._pictures[name]),
            pictures=self._pictures,
            size=self.study.size,
            following=self._following(every[number] if number < len(every) else None),
        )

    def _address(self, trial: Trial, side: int) -> str:
        """Address of a picture; it does not tell what it shows, nor in a staircase which is the reference."""
        if isinstance(trial.question, Staircase):
            return f"/seen/{trial.question.name}/{trial.number}/{side}"
        return f"/picture/{self.store.hidden(f'picture {trial.shown[side]}')}"

    def _following(self, page: Page | None) -> list[str]:
        """Addresses of the next page's pictures, which are loaded ahead."""
        trials = page.trials if page else ()
        return [self._address(trial, side) for trial in trials for side in range(len(trial.shown))]

    def _take(self, request: Request) -> Response:
        fields: Fields = request.state.fields
        person, token = self._session(request)
        self._check(token, fields)
        self._sent.take(str(person.number))
        if self._closed():
            raise _Stop(403, "closed")
        answers = self.store.answers_of(person)
        every = pages(self.study, person.seed, answers)
        number = request.path_params["number"]
        if not 1 <= number <= len(every):
            raise _Stop(404, "not_found")
        if number > reached(every, answers):
            raise FormError("comes before its turn")
        go, page = _one(fields, "go", ("next", "back", "pause"), "next"), every[number - 1]
        sent = filled(page, person.number, fields)
        if go == "next" and sent.problems:
            return self._shown(person, token, every, number, answers, sent)
        # what is sound is kept, whichever way a person goes on
        kept = [answer for answer in sent.answers if f"{answer.question}.{answer.trial}" not in sent.problems]
        kept = [answer for answer in kept if go == "next" or answer.value not in (None, []) or answer.other]
        changed = [each for each in kept if not alike(answers.get(f"{each.question}.{each.trial}"), each)]
        ends = {each.question: each.trial for each in changed if isinstance(page.trials[0].question, Staircase)}
        if changed:
            self.store.save(changed, ends)
        if go == "pause":
            return RedirectResponse("/pause", 303)
        if go == "back":
            return RedirectResponse(f"/page/{max(number - 1, 1)}", 303)
        answers = {**answers, **{f"{each.question}.{each.trial}": each for each in changed}}
        if ends:
            answers = self.store.answers_of(person)
        every = pages(self.study, person.seed, answers)
        if number < len(every):
            return RedirectResponse(f"/page/{number + 1}", 303)
        self.store.finish(person)
        return RedirectResponse("/end", 303)

    def _pause(self, request: Request) -> Response:
        person, _ = self._session(request)
        answers = self.store.answers_of(person)
        number = reached(pages(self.study, person.seed, answers), answers)
        return self._html("pause", person.language, code=self._code_of(request, person), number=number)

    def _end(self, request: Request) -> Response:
        person, _ = self._session(request)
        answers = self.store.answers_of(person)
        every = pages(self.study, person.seed, answers)
        if (number := reached(every, answers)) <= len(every):
            return RedirectResponse(f"/page/{number}", 303)
        return self._html("end", person.language, code=self._code_of(request, person))

    def _code(self, request: Request) -> Response:
        return self._html("code", self._language(request), what="resume", problem="")

    def _come_back(self, request: Request) -> Response:
        fields: Fields = request.state.fields
        _check_site(request)
        self._tried.take(self._from(request))
        code = plain_code(_one(fields, "code"))
        if not (found := self.store.come_back(code)):
            return self._html("code", self._language(request), 422, what="resume", problem="wrong_code")
        answers = self.store.answers_of(found[0])
        number = reached(pages(self.study, found[0].seed, answers), answers)
        return self._signed_in(request, found[1], code, f"/page/{number}")

    def _ask_delete(self, request: Request) -> Response:
        return self._html("code", self._language(request), what="delete", problem="")

    def _delete(self, request: Request) -> Response:
        fields: Fields = request.state.fields
        _check_site(request)
        self._tried.take(self._from(request))
        if not self.store.delete(_one(fields, "code")):
            return self._html("code", self._language(request), 422, what="delete", problem="wrong_code")
        response = self._message(request, 200, "deleted")
        response.delete_cookie(_COOKIE, path="/")
        return response

    async def _take_message(self, request: Request) -> Response:
        """Keep what a page that stands elsewhere sends; it may come from any site, as it carries a person's code."""
        try:
            text = await _body(request, MOST_MESSAGE_BYTES)
            status, words = await run_in_threadpool(self._keep, request, text)
        except _Stop as stop:
            status, words = stop.status, self._words[self.study.languages[0]][stop.words]
        headers = {**_HEADERS, "Access-Control-Allow-Origin": "*", "Cache-Control": "no-store"}
        return Response(words, status, headers, "text/plain; charset=utf-8")

    def _keep(self, request: Request, text: bytes) -> tuple[int, str]:
        try:
            message = message_of(text)
            known = self.store.of_code(message.code)
            self._sent.take(str(known.number)) if known else self._begun.take(self._from(request))
            if self._closed() and isinstance(message, Message):
                raise _Stop(403, "closed")
            take(self.study, self.store, message, datetime.now(UTC))
        except (FormError, OtherPlanError) as error:
            return 400 if isinstance(error, FormError) else 409, f"The message {error}."
        except GreenswardError as error:
            print(f"error: {error}", flush=True)
            return 503, self._words[self.study.languages[0]]["failed"]
        return 200, "kept"

    # Files --------------------------------------------------------------------------------------------------

    def _picture(self, request: Request) -> Response:
        name = self._by_hidden.get(request.path_params["name"])
        return self._file(self._pictures[name] if name else None)

    def _seen(self, request: Request) -> Response:
        """A picture of a trial of this session."""
        person, _ = self._session(request)
        key = f"{request.path_params['question']}.{request.path_params['trial']}"
        every = pages(self.study, person.seed, self.store.answers_of(person))
        trial = next((each for page in every for each in page.trials if each.key == key), None)
        side = request.path_params["side"]
        shown = trial.shown[side] if trial and 0 <= side < len(trial.shown) else None
        return self._file(self._pictures[shown] if shown else None)

    def _file(self, picture: Picture | None) -> Response:
        file = picture_file(self.folder, picture) if picture else None
        if not file:
            raise _Stop(404, "not_found")
        kind = _KINDS.get(file.suffix.lower(), "application/octet-stream")
        # no date and no tag of the file, which would tell pictures apart
        return Response(file.read_bytes(), media_type=kind, headers={"Cache-Control": _KEPT})

    def _static_file(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in self._static:
            raise _Stop(404, "not_found")
        kind, headers = STATIC[name], {"Cache-Control": "max-age=300"}
        return Response(self._static[name], media_type=kind, headers=headers)

    def _nothing(self, *_: object) -> Response:
        raise _Stop(404, "not_found")


def words_of(language: str) -> dict[str, str]:
    """Words of the page itself in a language."""
    return tomllib.loads((PAGES / f"{language}.toml").read_text("utf-8"))


def templates() -> Environment:
    """The page's templates."""
    loader = PackageLoader("greensward", "study/pages")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, auto_reload=False)


def make_app(study: Study, folder: Path, store: Store, *, behind_proxy: bool = False) -> Starlette:
    """The ASGI application of a study whose pictures are in a folder. Raises `InputError` for missing pictures.

    `behind_proxy` counts rates by the address that `X-Forwarded-For` names last.
    """
    if missing := missing_pictures(study, folder):
        raise InputError(f"{folder}: the picture {missing[0]} is not there; `greensward study render` draws them")
    return _Site(study, folder, store, behind_proxy).app()


def serve(
    study: Study, folder: Path, database: str | None, host: str, port: int, *, behind_proxy: bool = False
) -> None:
    """Serve a study until the process is interrupted. Raises `GreenswardError`."""
    with Store.open(folder, database) as store:
        app = make_app(study, folder, store, behind_proxy=behind_proxy)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(family, socket.SOCK_STREAM) as listening:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listening.bind((host, port))
                listening.listen(512)
            except OSError as error:
                what = f"cannot listen on {host} port {port}: {error.strerror or error}"
                raise InputError(f"--port: {what}; choose another --port or --host") from None
            at = listening.getsockname()[1]
            shown = f"[{host}]" if ":" in host else host
            print(f"http://{shown}:{at} shows the study; Ctrl+C ends it", flush=True)
            config = uvicorn.Config(
                app, access_log=False, log_level="error", server_header=False, proxy_headers=behind_proxy,
                timeout_keep_alive=30, h11_max_incomplete_event_size=16_384,
            )  # fmt: skip
            _run(uvicorn.Server(config), listening)


def _run(server: uvicorn.Server, listening: socket.socket) -> None:
    """Run until a signal comes, end open connections, and then end the program as the signal does elsewhere."""
    came: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        came.append(number)
        server.handle_exit(number, frame)

    setattr(server, "capture_signals", lambda: handled(end))  # noqa: B010  # no method may be assigned to
    server.run(sockets=[listening])
    for number in came[:1]:
        signal.raise_signal(number)


async def _form(request: Request) -> dict[str, list[str]]:
    """Fields of a request's form. Raises `FormError`, and `_Stop` for one that is too large."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip()
    if kind != "application/x-www-form-urlencoded":
        raise FormError("is no form")
    return fields_of(await _body(request, MOST_BYTES))


async def _body(request: Request, most_bytes: int) -> bytes:
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most_bytes:
            raise _Stop(413, "too_large")
    return bytes(body)


def _check_site(request: Request) -> None:
    """Raise `FormError` for a form without a session that another site sends."""
    origin = request.headers.get("origin")
    same = origin is None or origin.partition("://")[2] == request.headers.get("host")
    if not same or request.headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        raise FormError("comes from another site")


def _one(fields: Fields, name: str, known: tuple[str, ...] = (), without: str | None = None) -> str:
    """The value of a field that is there once. Raises `FormError`."""
    values = fields.get(name, [] if without is None else [without])
    if len(values) != 1 or (known and values[0] not in known):
        raise FormError(f"has no sound {name}")
    return values[0]


def _as_fields(trial: Trial, answer: Answer | None) -> tuple[list[str], str]:
    """The fields that gave an answer: values, and the answer in own words."""
    if answer is None:
        return [], ""
    value = answer.value
    if isinstance(trial.question, Pairs | Staircase) and value in answer.shown:
        value = answer.shown.index(str(value))
    given = value if isinstance(value, list) else [] if value is None else [value]
    return [str(each) for each in given], answer.other
