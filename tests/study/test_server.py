"""The server of a study: what it refuses, what it keeps, and what nobody can learn or forge."""

import asyncio
import contextlib
import json
import os
import re
import signal
import sqlite3
import statistics
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest
import sqlalchemy
from sites import study_in
from starlette.testclient import TestClient

from greensward.scene import GreenswardError, InputError
from greensward.study.messages import MOST_MESSAGE_BYTES, message_of, plan_of
from greensward.study.plan import order_of
from greensward.study.server import make_app
from greensward.study.store import Store

_CHOICE = {"name": "best", "kind": "choice", "text": "Which?", "options": [{"value": v, "text": v} for v in "ab"]}
_TEXT = {"name": "more", "kind": "text", "text": "What?", "required": False}


@pytest.fixture
def site(tmp_path):
    """A study of two questions: a maker of clients, its store, and its folder."""
    with _Site(tmp_path, _CHOICE, _TEXT) as made:
        yield made


class _Site:
    def __init__(self, folder, *questions, **keys):
        self._folder, self.study = folder, study_in(folder, *questions, **keys)

    def __enter__(self):
        self._opened = Store.open(self._folder)
        self.store = self._opened.__enter__()
        return self

    def __exit__(self, *error):
        self._opened.__exit__(*error)

    def client(self, **options):
        return TestClient(make_app(self.study, self._folder, self.store, **options), follow_redirects=False)

    def visitor(self):
        client = self.client()
        assert client.post("/begin", data={"language": "en", "agree": "yes"}).headers["location"] == "/page/1"
        return client


def _key(client, page=1):
    return re.search(r'name="key" value="(\w+)"', client.get(f"/page/{page}").text)[1]


def _send(client, page=1, **fields):
    return client.post(f"/page/{page}", data={"key": _key(client, page), "go": "next", **fields})


# Pages that stand elsewhere ---------------------------------------------------------------------------------

_STAIRS = {
    "name": "stairs", "kind": "staircase", "text": "?", "reference": "p0", "levels": ["p1", "p2"], "reversals": 2,
    "most": 4,
}  # fmt: skip


def _message(study, *answers, **keys):
    now = datetime.now(UTC).isoformat()
    given = {key: {"values": values, "other": "", "seconds": 2.0, "at": now} for key, *values in answers}
    message = {"plan": plan_of(study), "code": "ABCD-EFGH-JKMN-PQRS", "seed": 7, "language": "en", "begun": now}
    return json.dumps({**message, "sent": now, "answers": given, **keys})


def test_a_page_elsewhere_sends_all_answers_each_time(tmp_path):
    with _Site(tmp_path, _CHOICE, _STAIRS, _TEXT) as site:
        client, study = site.client(), site.study
        sides = order_of(study, 7)["stairs"]
        right = [("best.0", "a"), *((f"stairs.{k}", str(sides[k])) for k in range(2))]
        for answers in (right[:1], right, right, [right[0], ("stairs.0", str(1 - sides[0]))], right):
            reply = client.post("/answers", content=_message(study, *answers))
            assert (reply.status_code, reply.text) == (200, "kept")
            assert reply.headers["access-control-allow-origin"] == "*"
            assert len(site.store.answers()) == len(answers)
        (person,) = site.store.people()
        assert (person.seed, person.finished) == (7, None)
        told = [("stairs.2", str(1 - sides[2])), ("stairs.3", str(sides[3])), ("more.0", "Moss")]
        client.post("/answers", content=_message(study, *right, *told))
        assert site.store.people()[0].finished
        kept = site.store.answers_of(person)
        assert [kept[f"stairs.{k}"].value == "p0" for k in range(4)] == [False, False, True, False]
        assert kept["more.0"].value == "Moss"


def test_clocks_of_devices_are_corrected_by_the_arrival(tmp_path):
    with _Site(tmp_path, _CHOICE) as site:
        wrong = datetime.now(UTC) - timedelta(hours=5)
        given = {"best.0": {"values": ["a"], "seconds": 1.0, "at": (wrong - timedelta(minutes=3)).isoformat()}}
        site.client().post("/answers", content=_message(site.study, sent=wrong.isoformat(), answers=given))
        (answer,) = site.store.answers()
        since = (datetime.now(UTC) - datetime.fromisoformat(answer.at)).total_seconds()
        assert 170 < since < 200


@pytest.mark.parametrize(
    ("answers", "keys", "status", "said"),
    [
        ([("best.0", "c")], {}, 400, "has an answer that is not offered: best.0"),
        ([("best.1", "a")], {}, 400, "has an answer that belongs to no page: best.1"),
        ([("best.0", "a"), ("stairs.1", "0")], {}, 400, "belongs to no page: stairs.1"),
        ([("best.0", "a", "b")], {}, 400, "has a field twice"),
        ([], {"plan": "0" * 16}, 409, "is from a page of another version of this study; export its pages again"),
        ([], {"code": "abcd"}, 400, "is not one of a page (code: "),
        ([], {"seed": 0}, 400, "(seed: "),
        ([], {"person": 1}, 400, "(person: "),
        ([], {"delete": False}, 400, "(delete: "),
    ],
)
def test_only_what_a_page_elsewhere_can_send_is_kept(tmp_path, answers, keys, status, said):
    with _Site(tmp_path, _CHOICE, _STAIRS) as site:
        reply = site.client().post("/answers", content=_message(site.study, *answers, **keys))
        assert reply.status_code == status
        assert said in reply.text
        assert site.store.people() == []


def test_the_documented_message_is_one():
    page = (Path(__file__).parents[2] / "docs" / "study.md").read_text(encoding="utf-8")
    message = message_of(page.partition("```json\n")[2].partition("```")[0].encode())
    assert message.answers["realistic.0"].values == ["4"]


@pytest.mark.parametrize("text", [b"", b"[]", b"null", b"{}", b"\xff", b"[" * 100_000, b'{"delete": 1}'])
def test_what_is_no_message_is_refused(site, text):
    assert site.client().post("/answers", content=text).status_code == 400


def test_a_message_that_is_too_large_is_refused(site):
    assert site.client().post("/answers", content=b" " * (MOST_MESSAGE_BYTES + 1)).status_code == 413


def test_a_page_elsewhere_changes_and_deletes_only_its_own_answers(tmp_path):
    with _Site(tmp_path, _CHOICE) as site:
        client, study = site.client(), site.study
        client.post("/answers", content=_message(study, ("best.0", "a")))
        assert client.post("/answers", content=_message(study, ("best.0", "b"), seed=8)).status_code == 400
        other = "ZZZZ-EFGH-JKMN-PQRS"
        client.post("/answers", content=_message(study, ("best.0", "b"), code=other))
        assert [each.value for each in site.store.answers()] == ["a", "b"]
        gone = json.dumps({"plan": plan_of(study), "delete": True, "code": other})
        assert client.post("/answers", content=gone).status_code == 200
        assert [each.value for each in site.store.answers()] == ["a"]
        assert site.store.delete("abcd efgh jkmn pqrs")


def test_a_database_of_an_older_version_gets_what_it_lacks(tmp_path):
    with Store.open(tmp_path) as store:
        store.begin("en")
    with contextlib.closing(sqlite3.connect(tmp_path / "answers.db")) as old:
        old.execute("ALTER TABLE people DROP COLUMN own_seed")
    with Store.open(tmp_path) as store:
        assert [person.seed for person in store.people()] == [1]
        assert store.begin_elsewhere("en", "ABCD-EFGH-JKMN-PQRS", "2026-01-01T00:00:00Z", 9).seed == 9


# Going through it -------------------------------------------------------------------------------------------


def test_nobody_begins_without_agreeing(site):
    client = site.client()
    assert client.post("/begin", data={"language": "en"}).status_code == 422
    assert client.get("/page/1").status_code == 403
    assert site.store.people() == []


def test_an_answer_is_kept_before_the_next_page(site):
    client = site.visitor()
    assert _send(client, **{"a.best.0": "a", "seconds": "2.5"}).headers["location"] == "/page/2"
    (answer,) = site.store.answers()
    assert (answer.question, answer.value, answer.seconds) == ("best", "a", 2.5)
    assert _send(client, 2, **{"a.more.0": "x"}).headers["location"] == "/end"
    assert site.store.people()[0].finished
    assert client.get("/end").status_code == 200


def test_a_closed_study_takes_nothing(tmp_path):
    with _Site(tmp_path, _CHOICE) as open_site:
        client = open_site.visitor()
    yesterday = datetime.now(UTC).date() - timedelta(days=1)
    with _Site(tmp_path, _CHOICE, closes=yesterday) as site:
        assert "closed" in site.client().get("/").text
        assert site.client().post("/begin", data={"language": "en", "agree": "yes"}).status_code == 403
        late = site.client()
        late.cookies = client.cookies
        assert _send(late, **{"a.best.0": "a"}).status_code == 403
        assert site.store.answers() == []


# What is refused --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        ({}, 422),
        ({"a.best.0": "c"}, 422),
        ({"a.best.0": ["a", "b"]}, 400),
        ({"a.best.1": "a"}, 400),
        ({"a.more.0": "a"}, 400),
        ({"a.best.0": "a", "person": "1"}, 400),
        ({"a.best.0": "a", "go": "on"}, 400),
        ({"a.best.0": "a", "key": "0" * 24}, 400),
        ({"a.best.0": "a", "key": ""}, 400),
        ({"a.best.0": "a", "o.best.0": "mine"}, 422),
        ({"a.best.0": "a", "seconds": "nan"}, 303),
        ({"a.best.0": "a", "seconds": "-5"}, 303),
        ({"a.best.0": "x" * 70_000}, 413),
    ],
)
def test_only_what_the_page_offers_is_kept(site, fields, status):
    client = site.visitor()
    assert _send(client, **fields).status_code == status
    kept = site.store.answers()
    assert len(kept) == (status == 303)
    assert all(answer.seconds == 0.0 for answer in kept)


def test_what_is_no_form_is_refused(site):
    client, form = site.visitor(), "application/x-www-form-urlencoded"
    for body, kind in ((b"{}", "application/json"), (b"\xff=\xff", form), (b"x", form), (b"&" * 60_000, form)):
        assert client.post("/page/1", content=body, headers={"content-type": kind}).status_code == 400
    assert client.put("/page/1").status_code == 405
    assert client.get("/static/../study.toml").status_code == 404
    assert client.get("/static/server.py").status_code == 404
    assert client.get("/picture/p0").status_code == 404
    assert client.get("/page/99999999999999999999").status_code in (303, 404)
    assert site.store.answers() == []


def test_a_key_of_another_session_is_refused(site):
    mine, other = site.visitor(), site.visitor()
    answer = {"key": _key(other), "go": "next", "a.best.0": "a"}
    assert mine.post("/page/1", data=answer).status_code == 400
    assert site.store.answers() == []


def test_other_sites_begin_and_delete_nothing(site):
    client = site.client()
    for headers in ({"origin": "https://evil.example"}, {"origin": "null"}, {"sec-fetch-site": "cross-site"}):
        for path in ("/begin", "/delete", "/code"):
            data = {"language": "en", "agree": "yes"} if path == "/begin" else {"code": "AAAA"}
            assert client.post(path, data=data, headers=headers).status_code == 400
    assert site.store.people() == []


def test_answers_of_one_are_seen_by_no_other(site):
    mine, other = site.visitor(), site.visitor()
    _send(mine, **{"a.best.0": "a"})
    _send(mine, 2, **{"a.more.0": "my secret"})
    assert "my secret" in mine.get("/page/2").text
    assert other.get("/page/2").headers["location"] == "/page/1"
    _send(other, **{"a.best.0": "b"})
    assert "my secret" not in other.get("/page/2").text
    cookie = mine.cookies["greensward-study"].strip('"')
    forged = site.client()
    forged.cookies.set("greensward-study", cookie[:-30] + "A" * 30)
    assert forged.get("/page/1").status_code == 403


def test_codes_are_tried_a_few_times_only(site):
    site.visitor()
    client = site.client()
    seen = [client.post("/delete", data={"code": f"AAAA-{k:04}"}).status_code for k in range(15)]
    assert seen == [422] * 10 + [429] * 5
    assert len(site.store.people()) == 1
    proxied = site.client(behind_proxy=True)
    for k in range(15):  # each from an address of its own, as the proxy says
        headers = {"x-forwarded-for": f"1.1.1.1, 10.0.0.{k}"}
        assert proxied.post("/delete", data={"code": "AAAA"}, headers=headers).status_code == 422


def test_answers_come_at_a_bounded_rate(site):
    client = site.visitor()
    key = _key(client)
    data = {"key": key, "go": "next", "a.best.0": "a"}
    assert 429 in {client.post("/page/1", data=data).status_code for _ in range(140)}


# What is shown ----------------------------------------------------------------------------------------------


def test_text_of_strangers_and_of_the_study_is_escaped(tmp_path):
    bad = '"><script>alert(1)</script>'
    question = {
        **_CHOICE,
        "text": bad,
        "note": bad,
        "options": [{"value": v, "text": bad} for v in "ab"],
        "other": True,
    }
    with _Site(tmp_path, question, title=bad, introduction=bad, consent=bad, contact=bad) as site:
        client = site.visitor()
        texts = [client.get("/").text, client.get("/page/1").text]
        texts.append(_send(client, **{"a.best.0": bad, "o.best.0": bad}).text)
        for text in texts:
            assert "<script>alert" not in text
            assert "&lt;script&gt;alert" in text


def test_every_answer_forbids_what_the_page_does_not_need(site):
    client = site.visitor()
    for path in ("/", "/page/1", "/pause", "/nothing", "/static/study.js", "/picture/x"):
        headers = client.get(path).headers
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
    assert client.get("/page/1").headers["cache-control"] == "no-store"
    set_cookie = site.client().post("/begin", data={"language": "en", "agree": "yes"}).headers["set-cookie"].lower()
    assert all(word in set_cookie for word in ("httponly", "samesite=strict", "path=/"))


def test_the_page_does_not_tell_which_picture_is_which(tmp_path):
    stairs = {"name": "s", "kind": "staircase", "text": "?", "reference": "p0", "levels": ["p1", "p2"]}
    pairs = {"name": "p", "kind": "pairs", "text": "?", "pictures": ["p2", "p3"]}
    with _Site(tmp_path, pairs, stairs) as site:
        client = site.visitor()
        text = client.get("/page/1").text
        _send(client, **{"a.p.0": "0"})
        text += client.get("/page/2").text
        assert not re.search(r"p[0-3]\b", text)
        shown = [client.get(f"/seen/s/0/{side}") for side in (0, 1)]
        files = [(tmp_path / f"{name}.png").read_bytes() for name in ("p0", "p2")]
        assert sorted(each.content for each in shown) == sorted(files)
        assert {name.lower() for each in shown for name in each.headers} & {"etag", "last-modified"} == set()
        assert client.get("/seen/s/1/0").status_code == 404  # not its turn
        assert site.client().get("/seen/s/0/0").status_code == 403


def test_a_missing_picture_is_told_before_anybody_comes(tmp_path):
    study = study_in(tmp_path)
    (tmp_path / "p1.png").unlink()
    with (
        Store.open(tmp_path) as store,
        pytest.raises(InputError, match="the picture p1 is not there; `green"),
    ):
        make_app(study, tmp_path, store)


# The database -----------------------------------------------------------------------------------------------


def test_a_database_that_fails_acknowledges_nothing(tmp_path, monkeypatch):
    with _Site(tmp_path, _CHOICE, _TEXT) as site:
        client = site.visitor()
        key = _key(client)
        with site.store._engine.begin() as connection:
            connection.exec_driver_sql("ALTER TABLE answers RENAME TO gone")
        response = client.post("/page/1", data={"key": key, "go": "next", "a.best.0": "a"})
        assert response.status_code == 503
        assert "database does not work" in response.text


def test_a_full_disk_is_told_and_nothing_acknowledged(site):
    client = site.visitor()
    _send(client, **{"a.best.0": "a"})
    key = _key(client, 2)
    engine = site.store._engine
    sqlalchemy.event.listen(engine, "connect", lambda file, _: file.execute("PRAGMA max_page_count = 1"))
    engine.dispose()
    for size in (2000, 1):  # until the pages that there are hold no more
        said = ""
        while not said:
            try:
                site.store.begin("e" * size)
            except GreenswardError as error:
                said = str(error)
        assert said.endswith("answers.db: the database failed: database or disk is full")
    refused = client.post("/page/2", data={"key": key, "go": "next", "a.more.0": "x" * 3900})
    assert refused.status_code == 503
    assert "could not be kept" in refused.text


@pytest.mark.parametrize(
    ("address", "kind", "problem"),
    [
        (None, GreenswardError, r"answers\.db: the database failed: file is not a database; take a copy"),
        ("mysql://x", InputError, "--database: must be an address such as postgresql"),
        ("postgresql://me:secret@127.0.0.1:9/x", GreenswardError, r"//me:…@127\.0\.0\.1:9/x: the database failed: "),
    ],
)
def test_a_database_that_is_none_is_refused_in_a_sentence(tmp_path, address, kind, problem):
    (tmp_path / "answers.db").write_bytes(b"no database" * 1000)
    with pytest.raises(kind, match=problem), Store.open(tmp_path, address):
        pass


def test_deleted_people_are_gone_and_their_numbers_are_not_given_again(site):
    store = site.store
    first, _, code = store.begin("en")
    _send(site.visitor(), **{"a.best.0": "a"})
    assert store.delete(code.lower().replace("-", ""))
    assert not store.delete(code)
    assert first.number not in {store.begin("en")[0].number, *(person.number for person in store.people())}
    raw = b"".join(path.read_bytes() for path in Path(site._folder).glob("answers.db*"))
    assert code.encode() not in raw


@contextlib.contextmanager
def _process(folder, questions):
    """A process that serves a study of so many questions; gives it and its address."""
    script = (
        "import sys; sys.path.insert(0, sys.argv[2]); from pathlib import Path; from sites import study_in\n"
        "from greensward.study.server import serve\nfolder = Path(sys.argv[1])\n"
        "texts = [dict(name=f'q{k}', kind='text', text='?') for k in range(int(sys.argv[3]))]\n"
        "serve(study_in(folder, *texts), folder, None, '127.0.0.1', 0)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", script, str(folder), str(Path(__file__).parent), str(questions)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as server:
        try:
            yield server, server.stdout.readline().split()[0]
        finally:
            server.kill()


def test_a_killed_server_loses_no_answer_that_it_acknowledged(tmp_path):
    acknowledged = []
    with _process(tmp_path, 60) as (server, address):

        def answer():
            with httpx.Client(base_url=address) as client:
                client.post("/begin", data={"language": "en", "agree": "yes"})
                try:
                    for page in range(1, 60):
                        data = {"key": _key(client, page), "go": "next", f"a.q{page - 1}.0": f"answer {page}"}
                        if client.post(f"/page/{page}", data=data).status_code == 303:
                            acknowledged.append(f"answer {page}")
                except httpx.HTTPError:
                    pass

        people = [threading.Thread(target=answer) for _ in range(4)]
        for each in people:
            each.start()
        while len(acknowledged) < 40:
            time.sleep(0.01)
        server.send_signal(signal.SIGKILL)
        for each in people:
            each.join()
    with Store.open(tmp_path) as store:
        kept = sorted(each.value for each in store.answers())
    assert len(acknowledged) <= len(kept) <= len(acknowledged) + 4
    for each in sorted(acknowledged):
        kept.remove(each)


def test_two_hundred_at_once_lose_and_double_nothing(tmp_path, capsys):
    times = []

    async def visit(address, number):
        async with httpx.AsyncClient(base_url=address, timeout=60.0) as client:
            await asyncio.sleep(0.01 * number)
            await client.post("/begin", data={"language": "en", "agree": "yes"})
            for page in range(1, 4):
                shown = await client.get(f"/page/{page}")
                data = {"key": re.search(r'name="key" value="(\w+)"', shown.text)[1], f"a.q{page - 1}.0": f"{number}"}
                await asyncio.sleep(0.8 + 0.01 * (number % 100))  # a person looks before answering
                begun = time.perf_counter()
                assert (await client.post(f"/page/{page}", data=data)).status_code == 303
                times.append(time.perf_counter() - begun)

    async def visits(address):
        await asyncio.gather(*(visit(address, number) for number in range(200)))

    with _process(tmp_path, 3) as (_, address):
        asyncio.run(visits(address))
    with Store.open(tmp_path) as store:
        people, answers = store.people(), store.answers()
    assert len(people) == 200
    assert all(person.finished for person in people)
    assert len(answers) == len({(each.person, each.question) for each in answers}) == 600
    assert sorted(each.value for each in answers) == sorted(str(number) for number in range(200) for _ in range(3))
    with capsys.disabled():
        p95 = statistics.quantiles(times, n=20)[-1]
        print(f"\n200 people, 600 answers: median {1e3 * statistics.median(times):.0f} ms, 95 % {1e3 * p95:.0f} ms")


# PostgreSQL -------------------------------------------------------------------------------------------------


@pytest.fixture
def postgresql(tmp_path_factory):
    """The address of a PostgreSQL server of this test's own."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not programs or os.name != "posix":
        pytest.skip("no PostgreSQL server is installed")
    folder = tmp_path_factory.mktemp("postgresql")
    prefix = []
    if os.geteuid() == 0:  # the server does not run as root
        subprocess.run(["chown", "nobody", folder], check=True)
        for above in (folder, *folder.parents[:3]):
            above.chmod(above.stat().st_mode | 0o055)
        prefix = ["setpriv", "--reuid=nobody", "--clear-groups"]
    data = folder / "data"
    options = f"-k {folder} -c listen_addresses= -c fsync=off"
    run = {"check": True, "capture_output": True, "cwd": folder}
    subprocess.run([*prefix, programs[-1] / "initdb", "-D", data, "-U", "me", "-A", "trust"], **run)
    begin = [*prefix, programs[-1] / "pg_ctl", "-D", data, "-w", "-l", folder / "log", "-o", options, "start"]
    subprocess.run(begin, check=True, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    yield f"postgresql://me@/postgres?host={folder}"
    subprocess.run([*prefix, programs[-1] / "pg_ctl", "-D", data, "-m", "immediate", "stop"], **run)


def test_postgresql_keeps_what_sqlite_keeps(tmp_path, postgresql):
    pytest.importorskip("psycopg")
    study = study_in(tmp_path, _CHOICE, _TEXT)
    kept = []
    for address in (None, postgresql):
        with Store.open(tmp_path, address) as store:
            client = TestClient(make_app(study, tmp_path, store), follow_redirects=False)
            client.post("/begin", data={"language": "en", "agree": "yes"})
            for value in ("a", "b", "b"):
                _send(client, **{"a.best.0": value})
            _send(client, 2, **{"a.more.0": "täg\n„x“"})
            code = client.cookies["greensward-study"].strip('"').partition(".")[2]
        with Store.open(tmp_path, address) as store:
            kept.append([(each.question, each.trial, each.value) for each in store.answers()])
            assert store.people()[0].finished
            assert store.delete(code)
            assert (store.people(), store.answers()) == ([], [])
    assert kept[0] == kept[1] == [("best", 0, "b"), ("more", 0, "täg\n„x“")]
