"""The page of a study in a real browser: by keyboard alone, on a phone and on a desk, for everybody."""

import contextlib
import functools
import http.server
import re
import shutil
import threading
from urllib.parse import urlparse

import numpy as np
import pytest
from sites import QUESTIONS, served, study_in

from greensward.study.model import load_study, shipped
from greensward.study.plan import pages
from greensward.study.static import export_static

_CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [
    pytest.mark.skipif(not _CHROMIUM, reason="no Chromium is installed"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
_PHONE, _DESK = {"width": 360, "height": 640}, {"width": 1280, "height": 800}


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=_CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


@pytest.fixture
def site(tmp_path):
    with served(study_in(tmp_path), tmp_path) as (address, store):
        yield address, store


@pytest.fixture
def visit(browser):
    """Open a page in a context of its own; an error of its console fails the test."""
    contexts, errors = [], []

    def open_page(address, viewport=_DESK, **options):
        context = browser.new_context(viewport=viewport, **options)
        context.set_default_timeout(5_000)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()
    refused_or_cut_off = re.compile("422|ERR_FAILED")
    assert [error for error in errors if not refused_or_cut_off.search(error)] == []


def _begin(page):
    page.get_by_role("checkbox").check()
    page.get_by_role("button", name="Begin").click()
    page.wait_for_url("**/page/1")


def _press(page, *keys):
    for key in keys:
        page.keyboard.press(key)


def _focus(page, selector):
    """Go by the tab key to what a selector finds, as somebody without a mouse does."""
    for _ in range(60):
        if page.evaluate("s => document.activeElement?.matches(s) ?? false", selector):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"no way to {selector} by the tab key")


def _next(page):
    before = page.url
    _focus(page, "button[value=next]")
    page.keyboard.press("Enter")
    page.wait_for_function("before => location.href !== before", arg=before)


def _by_keyboard(page):
    _focus(page, "#agree")
    page.keyboard.press("Space")
    _focus(page, "button.main")
    page.keyboard.press("Enter")
    page.wait_for_url("**/page/1")
    _focus(page, "#q-age")
    page.keyboard.type("33")
    _focus(page, "[name='a.seen.0']")
    page.keyboard.press("Space")
    _focus(page, "[name='o.seen.0']")
    page.keyboard.type("moss <b>&")
    _next(page)
    _focus(page, "[name='a.best.0']")
    page.keyboard.press("ArrowDown")
    _next(page)
    _focus(page, "[name='a.real.0']")
    page.keyboard.press("4")
    _next(page)
    page.keyboard.press("ArrowDown")
    _next(page)
    while page.locator(".pair").count():
        page.keyboard.press("ArrowLeft")
        _next(page)
    _focus(page, "textarea")
    page.keyboard.type("Fine.")
    _next(page)


@pytest.mark.parametrize("viewport", [_PHONE, _DESK])
def test_all_is_answered_by_keyboard_alone(site, visit, viewport):
    address, store = site
    page = visit(address, viewport)
    _by_keyboard(page)
    assert urlparse(page.url).path == "/end"
    answers = {f"{each.question}.{each.trial}": each for each in store.answers()}
    assert answers["age.0"].value == 33
    assert (answers["seen.0"].value, answers["seen.0"].other) == (["yes"], "moss <b>&")
    assert answers["best.0"].value == "no"
    assert answers["real.0"].value == 4
    assert answers["pair.0"].value == "="
    assert answers["more.0"].value == "Fine."
    assert all(each.value == each.shown[0] for key, each in answers.items() if key.startswith("stairs"))
    assert 0.0 < answers["real.0"].seconds < 60.0
    assert store.people()[0].finished


def _sound(page, axe):
    """Assert that axe-core finds nothing, and that nothing is wider than the window."""
    found = axe.run(
        page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]}
    )
    assert found.response["violations"] == [], found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), page.url


@pytest.mark.parametrize(("viewport", "scheme"), [(_PHONE, "light"), (_DESK, "dark")])
def test_every_page_is_for_everybody(site, visit, viewport, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = visit(site[0], viewport, color_scheme=scheme)
    _sound(page, axe)
    _begin(page)
    seen = set()
    while urlparse(page.url).path != "/end":
        kinds = tuple(page.locator("fieldset, textarea, .number").evaluate_all("e => e.map(x => x.className)"))
        if kinds not in seen:
            _sound(page, axe)
            if page.locator("[required]").count():
                page.get_by_role("button", name="Next").click()
                page.wait_for_selector(".errors")
                assert page.evaluate("document.activeElement.className") == "errors"
                _sound(page, axe)
            seen.add(kinds)
        if page.locator("#q-age").count():
            page.locator("#q-age").fill("40")
        elif page.locator("input[type=radio]").count():
            page.locator("input[type=radio]").first.check()
        page.get_by_role("button", name="Next").click()
    _sound(page, axe)
    for path in ("/pause", "/code", "/delete"):
        page.goto(site[0] + path)
        _sound(page, axe)


def test_back_reload_two_tabs_and_double_clicks_lose_and_double_nothing(site, visit):
    address, store = site
    page = visit(address)
    _begin(page)
    page.locator("#q-age").fill("20")
    page.get_by_role("button", name="Next").dblclick()
    page.wait_for_url("**/page/2")
    assert len(store.answers()) == 2
    page.go_back()
    page.locator("#q-age").fill("21")
    page.get_by_role("button", name="Next").click()
    page.wait_for_url("**/page/2")
    assert [each.value for each in store.answers() if each.question == "age"] == [21]
    page.reload()
    other = page.context.new_page()
    other.goto(f"{address}/page/2")
    for tab in (page, other):
        tab.locator("input[value=yes]").check()
        tab.get_by_role("button", name="Next").click()
        tab.wait_for_url("**/page/3")
    assert sum(each.question == "best" for each in store.answers()) == 1
    page.goto(f"{address}/page/7")  # not its turn yet
    assert urlparse(page.url).path == "/page/3"
    page.get_by_role("button", name="Back").click()
    assert page.locator("input[value=yes]").is_checked()


def test_a_pause_is_ended_on_another_device_by_the_code(site, visit):
    address, store = site
    page = visit(address)
    _begin(page)
    page.locator("#q-age").fill("20")
    page.get_by_role("button", name="Pause").click()
    code = page.locator(".code").inner_text()
    phone = visit(f"{address}/code", _PHONE)
    phone.get_by_label("Code").fill(code.lower().replace("-", " "))
    phone.get_by_role("button", name="Come back").click()
    phone.wait_for_url("**/page/1")
    assert phone.locator("#q-age").input_value() == "20"
    assert len(store.people()) == 1
    phone.goto(f"{address}/delete")
    phone.get_by_label("Code").fill(code)
    phone.get_by_role("button", name="Delete my answers").click()
    phone.get_by_text("Your answers are deleted.").wait_for()
    assert (store.people(), store.answers()) == ([], [])


def test_a_slow_network_sends_once(site, visit):
    address, store = site
    page = visit(address)
    _begin(page)
    posts = []

    def late(route):
        if route.request.method == "POST":
            posts.append(route.request.url)
            page.wait_for_timeout(400)
        route.continue_()

    page.route("**/page/*", late)
    page.locator("#q-age").fill("20")
    page.evaluate("for (let i = 0; i < 3; i++) document.querySelector('button[value=next]').click()")
    page.wait_for_url("**/page/2")
    assert len(posts) == 1
    assert len(store.answers()) == 2


def test_the_page_works_without_its_script(site, visit):
    page = visit(site[0], java_script_enabled=False)
    _begin(page)
    page.locator("#q-age").fill("20")
    page.get_by_role("button", name="Next").click()
    page.wait_for_url("**/page/2")


def _clip(folder):
    """A clip of 12 frames, as `study render` makes them."""
    video = pytest.importorskip("greensward.io.video")
    pytest.importorskip("imageio_ffmpeg")
    with video.VideoWriter(folder / "p1.webm", (160, 90), 12.0) as writer:
        for k in range(12):
            writer.add(np.full((90, 160, 3), 20 * k, np.uint8))
        writer.finish()


def test_clips_play_by_themselves_only_for_those_who_do_not_mind(visit, tmp_path):
    study = study_in(tmp_path, QUESTIONS[4])
    _clip(tmp_path)
    pictures = [p.model_copy(update={"file": "p1.webm"}) if p.name == "p1" else p for p in study.picture]
    with served(study.model_copy(update={"picture": tuple(pictures)}), tmp_path) as (address, _):
        for motion, paused in (("no-preference", False), ("reduce", True)):
            page = visit(address, reduced_motion=motion)
            _begin(page)
            clip = page.locator("video")
            assert clip.evaluate("v => v.muted && v.loop && v.controls")
            page.wait_for_function("document.querySelector('video').readyState >= 2")
            page.wait_for_timeout(100)
            assert clip.evaluate("v => v.paused") == paused
            sides = page.locator("img, video").evaluate_all("e => e.map(x => [x.clientWidth, x.clientHeight])")
            assert sides[0] == sides[1]


def test_unscaled_pictures_are_shown_pixel_by_pixel(visit, tmp_path):
    with served(study_in(tmp_path, QUESTIONS[2], scaled="never"), tmp_path) as (address, _):
        for viewport, told in ((_DESK, False), ({"width": 150, "height": 600}, True)):
            page = visit(address, viewport)
            _begin(page)
            widths = page.locator("img").evaluate_all("e => e.map(x => x.width)")
            assert widths == [160, 160, 160]
            assert page.locator(".too-small").is_visible() == told


@pytest.mark.parametrize("viewport", [_PHONE, _DESK])
def test_a_picture_stays_in_view_beside_many_questions(visit, tmp_path, viewport):
    scores = [{**QUESTIONS[3], "name": f"s{k}", "page": "grass", "show": ["p0"] if k == 0 else []} for k in range(8)]
    with served(study_in(tmp_path, *scores), tmp_path) as (address, _):
        page = visit(address, viewport)
        _begin(page)
        for name in ("s7", "s1"):
            _focus(page, f"[name='a.{name}.0']")
            seen = page.locator("img").bounding_box()
            assert 0 <= seen["y"] + 20 < seen["y"] + seen["height"] <= viewport["height"]
            chosen = page.locator(f"[name='a.{name}.0']").first.bounding_box()
            below = chosen["y"] >= seen["y"] + seen["height"]
            assert below or chosen["x"] >= seen["x"] + seen["width"]  # the picture does not hide what has the focus
            page.evaluate("document.activeElement.blur()")


def test_the_shipped_questionnaires_are_answered_in_every_language(browser, visit, tmp_path):
    for name, words in (("tillman2013-first", "de"), ("tillman2013-second", "sv")):
        folder = tmp_path / name
        folder.mkdir()
        made = study_in(folder)
        study = load_study(shipped()[name])
        bare = {"scene": "", "set": {}, "technique": "", "seconds": 0.0}
        pictures = [picture.model_copy(update={"file": "p0.png", **bare}) for picture in study.picture]
        study = study.model_copy(update={"picture": tuple(pictures), "size": made.size})
        with served(study, folder) as (address, store):
            page = visit(f"{address}/?language={words}")
            page.get_by_role("checkbox").check()
            page.locator("button.main").click()
            while urlparse(page.url).path != "/end":
                assert page.locator("html").get_attribute("lang") == words
                for group in page.locator("fieldset").all():
                    wanted = (
                        group.locator("[value='4']")
                        if group.locator("[value='4']").count()
                        else group.locator("input")
                    )
                    wanted.first.check()
                for field in page.locator("input[type=text]:not([name^='o.']), textarea").all():
                    field.fill("23")
                page.locator("button[value=next]").click()
            assert {each.question for each in store.answers()} == {question.name for question in study.question}


# Pages that stand elsewhere ---------------------------------------------------------------------------------


@contextlib.contextmanager
def _hosted(folder):
    """Files of a folder, served by another server."""
    handler = functools.partial(_Silent, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


class _Silent(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture
def elsewhere(tmp_path):
    """A page on one server, whose answers go to another: its address, and the store."""
    study = study_in(tmp_path)
    with served(study, tmp_path) as (endpoint, store):
        export_static(study, tmp_path, f"{endpoint}/answers", tmp_path / "site")
        with _hosted(tmp_path / "site") as address:
            yield address, store


def _answer_shown(page, side="0"):
    """Answer the page that is shown, by its kind."""
    form = page.locator("form.stage:visible")
    for number in form.locator("input.number").all():
        number.fill("40")
    for name in {each.get_attribute("name") for each in form.locator("input[type=radio]").all()}:
        every = form.locator(f"input[name='{name}']")
        (
            form.locator(f"input[name='{name}'][value='{side}']") if form.locator(".pair").count() else every.first
        ).check()


def _next_shown(page):
    before = page.evaluate("history.state.at")
    page.wait_for_timeout(260)
    page.locator("form.stage:visible button.main").click()
    page.wait_for_function("before => history.state.at !== before", arg=before)


def _go_through(page, look=lambda: None):
    page.locator("#agree").check()
    page.get_by_role("button", name="Begin").click()
    page.locator("form.stage:visible").wait_for()
    while page.locator("form.stage:visible").count():
        look()
        _answer_shown(page)
        _next_shown(page)
    page.get_by_text("All your answers have arrived.").wait_for()


@pytest.mark.parametrize(("viewport", "scheme"), [(_PHONE, "dark"), (_DESK, "light")])
def test_a_page_that_stands_elsewhere_sends_the_same_answers(elsewhere, visit, tmp_path, viewport, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = visit(elsewhere[0], viewport, color_scheme=scheme)
    _sound(page, axe)
    seen = {}

    def look():
        kinds = tuple(page.locator("form.stage:visible fieldset").evaluate_all("e => e.map(x => x.className)"))
        if kinds not in seen:
            _sound(page, axe)
        pictures = page.locator("form.stage:visible img")
        pictures.evaluate_all("e => Promise.all(e.map(x => x.decode()))")
        seen[kinds] = pictures.count()

    _go_through(page, look)
    _sound(page, axe)
    assert 2 in seen.values()
    (person,) = elsewhere[1].people()
    assert person.finished
    answers = elsewhere[1].answers_of(person)
    every = pages(study_in(tmp_path), person.seed, answers)
    assert {trial.key for page in every for trial in page.trials} == answers.keys()
    assert all(answers[trial.key].shown == trial.shown for page in every for trial in page.trials)
    assert answers["age.0"].value == 40
    assert all(each.value == each.shown[0] for each in answers.values() if each.question in ("pair", "stairs"))
    assert all(0.0 < each.seconds < 60.0 for each in answers.values())


def test_a_page_that_stands_elsewhere_loses_nothing_without_a_connection(elsewhere, visit):
    page = visit(elsewhere[0])
    page.route("**/answers", lambda route: route.abort())
    page.locator("#agree").check()
    page.get_by_role("button", name="Begin").click()
    page.locator("#q-age").fill("forty")
    page.wait_for_timeout(260)
    page.get_by_role("button", name="Next").click()
    page.get_by_role("link", name="How old are you?").click()
    assert page.evaluate("document.activeElement.id") == "q-age"
    _answer_shown(page)
    _next_shown(page)
    _answer_shown(page)
    _next_shown(page)
    page.route("**/orders/*", lambda route: route.abort())
    page.reload()
    page.get_by_text("There is no connection.").wait_for()
    page.unroute("**/orders/*")
    page.locator("#agree").check()
    page.get_by_role("button", name="Begin").click()  # the same answers, and not new ones
    page.locator("form.stage:visible").wait_for()
    page.reload()
    page.locator("form.stage:visible").wait_for()
    assert page.evaluate("history.state.at") == 2
    page.go_back()
    page.wait_for_function("history.state.at === 1")
    assert page.locator("form.stage:visible input:checked").count() == 1
    assert elsewhere[1].people() == []
    while page.locator("form.stage:visible").count():
        _answer_shown(page, "1")
        _next_shown(page)
    page.get_by_text("Your answers have not arrived yet.").wait_for()
    page.unroute("**/answers")
    page.evaluate("dispatchEvent(new Event('online'))")
    page.get_by_text("All your answers have arrived.").wait_for()
    (person,) = elsewhere[1].people()
    assert person.finished
    page.get_by_role("button", name="Delete my answers").click()
    page.get_by_role("button", name="Delete my answers").click()
    page.get_by_text("Your answers are deleted.").wait_for()
    assert (elsewhere[1].people(), elsewhere[1].answers()) == ([], [])
    page.reload()
    page.get_by_role("button", name="Begin").wait_for()
