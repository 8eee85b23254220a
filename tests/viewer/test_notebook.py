"""A scene in a notebook, without a browser: what the widget draws, and what mouse, keys and the page do to it."""

import builtins
import threading
import time

import numpy as np
import pytest

import greensward as gs
from greensward.ground import HeightField
from greensward.viewer.camera_controller import Intent
from small_scenes import NOISE
from small_scenes import small_scene as denser_scene

jupyter_rfb = pytest.importorskip("jupyter_rfb")
SIZE = (96, 54)


def small_scene(**tables):
    """A scene of which forty frames are drawn in a second."""
    thin = {"sowing": {"density_per_m2": 20.0, "reach_m": 9.0}, "shadows": {"size_px": 64}}
    return denser_scene(**{**thin, **tables})


@pytest.fixture
def show():
    """Shows scenes, and closes them afterwards."""
    views = []

    def make(scene, **options):
        views.append(gs.show(scene, **{"size": SIZE, "device": "cpu", "playing": False, **options}))
        return views[-1]

    yield make
    for view in views:
        view.close()


def drag(view, button, *, to):
    view.handle_event({"type": "pointer_down", "x": 10, "y": 10, "button": button})
    view.handle_event({"type": "pointer_move", "x": 10 + to[0], "y": 10 + to[1], "button": button})
    view.handle_event({"type": "pointer_up", "x": 10 + to[0], "y": 10 + to[1], "button": button})


def hold(view, *keys, frames=3):
    for key in keys:
        view.handle_event({"type": "key_down", "key": key})
    view.get_frame()
    for _ in range(frames):
        time.sleep(0.01)
        view.get_frame()
    for key in keys:
        view.handle_event({"type": "key_up", "key": key})


def settled(view):
    for _ in range(40):
        frame = view.get_frame()
    return frame


@pytest.mark.slow
def test_it_draws_what_the_scenes_camera_sees(show):
    scene = small_scene(ground=NOISE)
    frame = settled(show(scene, time_s=1.5))
    with gs.Renderer(scene, size=SIZE, temporal=True, device="cpu") as renderer:
        want = [renderer.render(1.5).image for _ in range(40)][-1]
    assert frame.shape == want.shape == (54, 96, 3)
    assert frame.dtype == np.uint8
    assert np.abs(frame.astype(int) - want).mean() < 0.5


def test_time_goes_on_only_where_it_plays(show):
    view = show(small_scene(), time_s=2.0)
    view.get_frame()
    view.get_frame()
    assert view.time_s == 2.0
    view.handle_event({"type": "key_down", "key": " "})
    assert view.playing
    view.get_frame()
    time.sleep(0.01)
    view.get_frame()
    assert 2.0 < view.time_s < 3.0
    view.playing = False
    still = view.time_s
    view.get_frame()
    assert view.time_s == still


@pytest.mark.slow
def test_a_picture_that_rests_is_not_drawn_for_ever(show):
    view = show(small_scene())
    asked = []
    view.request_draw = lambda: asked.append(1)
    settled(view)
    asked.clear()
    view.get_frame()
    assert not asked
    drag(view, 1, to=(5, 0))
    view.get_frame()
    assert asked


def test_dragging_turns_or_circles(show):
    view = show(small_scene())
    controller = view.controller
    before, position = controller.forward_ws, controller.position_ws.copy()
    drag(view, 1, to=(-40, 0))
    assert np.allclose(controller.position_ws, position)
    assert controller.forward_ws[0] > before[0], "what was to the right comes to the middle"
    drag(view, 1, to=(40, 0))
    drag(view, 2, to=(30, 10))
    assert controller.position_ws[0] < position[0]
    assert controller.position_ws[1] > position[1]
    direction = controller.pivot_ws - controller.position_ws
    assert np.allclose(direction / np.linalg.norm(direction), controller.forward_ws), "the centre stays there"
    seen = view.camera
    view.handle_event({"type": "pointer_move", "x": 90, "y": 90, "button": 0})  # nothing is held
    assert view.camera == seen


@pytest.mark.slow
def test_keys_walk_over_the_ground(show):
    view = show(small_scene(ground=NOISE))
    heights = HeightField.of(small_scene(ground=NOISE))
    settled(view)
    start = view.controller.position_ws.copy()
    hold(view, "w")
    settled(view)
    ahead = view.controller.position_ws - start
    assert ahead @ view.controller.forward_ws > 0.01
    x, _, z = view.controller.position_ws
    above_m = start[1] - heights.height(start[0], start[2])
    assert view.controller.position_ws[1] - heights.height(x, z) == pytest.approx(above_m, abs=0.02)
    hold(view, "D", "Shift")
    assert (view.controller.position_ws - start - ahead)[0] > 0.01
    settled(view)
    rest_z = view.controller.position_ws[2]
    view.handle_event({"type": "key_down", "key": "w"})
    view.handle_event({"type": "pointer_leave"})
    settled(view)
    assert view.controller.position_ws[2] == pytest.approx(rest_z, abs=1e-4), "a key released elsewhere"


def test_the_wheel_zooms_within_reason(show):
    view = show(small_scene())
    before = view.camera.fov_y_deg
    view.handle_event({"type": "wheel", "dy": -100})
    assert view.camera.fov_y_deg < before
    for dy in [1e9] * 9 + [-1e9] * 30:
        view.handle_event({"type": "wheel", "dy": dy})
        assert 2.0 <= view.camera.fov_y_deg <= 110.0
    assert view.get_frame() is not None


def test_objects_stop_a_walk(show):
    wall = {"kind": "box", "position_m": [0.0, 0.0, 2.5], "size_m": [60.0, 3.0, 0.5]}
    view = show(small_scene(object=[wall]))
    before = view.controller.position_ws[2]
    for _ in range(60):
        view.controller.move(Intent(ahead=1.0), 0.05)
    assert 2.75 < view.controller.position_ws[2] < before


@pytest.mark.slow
@pytest.mark.parametrize(("size", "ratio"), [((120, 50), 1.0), ((60, 40), 2.0), ((1, 1), 1.0)])
def test_frames_follow_the_size_of_the_page(show, size, ratio):
    view = show(small_scene())
    view.get_frame()
    view.handle_event({"type": "resize", "width": size[0], "height": size[1], "ratio": ratio})
    frame = [view.get_frame() for _ in range(3)][-1]
    assert frame.shape == (round(size[1] * ratio), round(size[0] * ratio), 3)
    view.handle_event({"type": "resize", "width": 0, "height": 0, "ratio": 1.0})  # hidden
    assert view.get_frame().shape == frame.shape


@pytest.mark.slow
def test_slow_frames_have_fewer_pixels_until_the_picture_rests(show, monkeypatch):
    from greensward.viewer import widget

    view = show(small_scene(), playing=True)
    monkeypatch.setattr(widget, "_SLOW_S", 0.0)
    widths = [view.get_frame().shape[1] for _ in range(7)]
    assert widths == sorted(widths, reverse=True)
    assert widths[-1] == 48
    view.playing = False
    assert settled(view).shape[1] == 96


@pytest.mark.slow
def test_the_technique_is_switched_and_the_view_stays(show):
    view = show("meadow", technique="bezier-blades", size=(32, 18))
    assert view.technique == "bezier-blades"
    view = show(small_scene())
    drag(view, 1, to=(8, 3))
    seen, first = view.camera, settled(view)
    view.technique = "tessellated-quads"
    assert view.camera == seen
    assert 0 < np.abs(settled(view).astype(int) - first).mean() < 40
    with pytest.raises(gs.SceneError, match=r"technique\.name: must be one of"):
        view.technique = "nothing"
    assert view.technique == "tessellated-quads"
    assert view.get_frame() is not None


def test_where_there_is_no_ground_any_button_circles(show):
    view = show(small_scene(ground={"kind": "none"}, object=[], camera={"height_above_ground": False}))
    pivot = view.controller.pivot_ws.copy()
    distance_m = np.linalg.norm(pivot - view.controller.position_ws)
    drag(view, 1, to=(30, 10))
    assert np.allclose(view.controller.pivot_ws, pivot)
    assert np.linalg.norm(pivot - view.controller.position_ws) == pytest.approx(distance_m)
    start = view.controller.position_ws.copy()
    hold(view, "w")
    direction = view.controller.position_ws - start
    assert np.allclose(direction / np.linalg.norm(direction), view.controller.forward_ws), "it comes nearer"


def test_a_closed_view_has_let_go_of_the_gpu(show):
    view = show(small_scene())
    view.get_frame()
    renderer = view._renderer
    view.close()
    view.close()
    show(small_scene())  # one after the other
    assert renderer._released
    assert view.get_frame() is None
    view.technique = "bezier-blades"
    assert view.get_frame() is None


@pytest.mark.slow
def test_it_draws_whichever_thread_asks(show):
    view = show(small_scene())
    first = view.get_frame()
    drawn = []

    def elsewhere():
        view.handle_event({"type": "resize", "width": 40.0, "height": 30.0, "ratio": 1.0})
        drawn.append(settled(view))

    threads = [threading.Thread(target=elsewhere) for _ in range(2)]
    for thread in threads:
        thread.start()
    here = settled(view)
    for thread in threads:
        thread.join()
    assert first.shape == (54, 96, 3)
    assert [frame.shape for frame in drawn] == [(30, 40, 3)] * 2
    assert here is not None


def test_a_message_of_the_page_arrives(show):
    view = show(small_scene())
    view._rfb_handle_msg(view, {"type": "resize", "width": 40.0, "height": 30.0, "ratio": 1.0}, [])
    view._rfb_handle_msg(view, {"type": "char", "data": "w"}, [])
    view._rfb_handle_msg(view, {"type": "wheel", "dx": 0, "dy": 5, "buttons": [], "modifiers": []}, [])
    assert settled(view).shape == (30, 40, 3)


def test_a_camera_in_the_ground_is_refused_in_words(show):
    with pytest.raises(gs.InputError, match=r"camera\.position_m: must be above the ground"):
        show(small_scene(camera={"position_m": [0.0, -1.0, 4.0]}))


def test_without_the_extra_one_sentence_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def missing(name, *args, **kwargs):
        if name.startswith(("jupyter_rfb", "greensward.viewer.widget")):
            raise ImportError(name, name="jupyter_rfb")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(gs.GreenswardError) as error:
        gs.show(small_scene())
    assert str(error.value) == (
        'a view in a notebook needs jupyter_rfb of an extra: pip install "greensward[notebook]"'
    )
