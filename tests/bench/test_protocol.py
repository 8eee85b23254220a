"""How frames are measured: paths, medians, passes, floors, and what was counted."""

from dataclasses import replace
from itertools import count

import moderngl
import numpy as np
import pytest

from greensward.bench import protocol
from greensward.bench.floor import floor_ms
from greensward.bench.frame_statistics import counted, gpu_bytes
from greensward.bench.protocol import DeviceLostError, Pace, camera_on_path, measure, pace, spread
from greensward.bench.strips import InstancedStrips
from greensward.io.camera_path import CameraPath
from greensward.renderer import Renderer
from greensward.scene import Camera
from live_objects import live_objects
from small_scenes import small_scene

COLUMNS = {
    "blades_considered", "blades_simulated", "blades_drawn", "blade_pixels", "vertices", "primitives", "draw_calls",
    "frames", "frame_ms_median", "frame_ms_p95", "frame_ms_min", "frame_ms_max", "cpu_ms_median", "floor_ms",
    "pass_ms", "gpu_bytes",
}  # fmt: skip
SIZE = (48, 27)


@pytest.fixture
def triangle(ctx):
    corner = "gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1), 0, 1);"
    program = ctx.program(
        vertex_shader=f"#version 430\nvoid main() {{ {corner} }}",
        fragment_shader="#version 430\nout vec4 c; void main() { c = vec4(1.0); }",
    )
    array = ctx.vertex_array(program, [])
    yield array
    array.release()
    program.release()


def test_the_path_is_a_loop_of_forty_seconds_that_starts_at_rest():
    camera = Camera(position_m=(3.0, 1.7, 4.0), target_m=(0.0, 1.0, -9.0))
    first, last = camera_on_path(camera, 0), camera_on_path(camera, 2400)
    assert np.allclose(first.position_m, camera.position_m)
    assert np.allclose(first.target_m, camera.target_m)
    assert np.allclose(last.position_m, first.position_m)
    steps = np.array([camera_on_path(camera, step).position_m for step in range(2401)])
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() < 0.02
    assert np.all(steps[:, 1] == 1.7)
    assert np.ptp(steps[:, 0]) > 1.0


def test_a_camera_path_takes_the_place_of_the_loop_and_begins_anew():
    path = CameraPath.recorded([(3.0, Camera()), (4.0, Camera(position_m=(2.0, 1.7, 8.0)))])
    camera = Camera(near_m=0.5)
    assert camera_on_path(camera, 0, path) == camera_on_path(camera, 60, path) == camera
    assert camera_on_path(camera, 30, path).position_m == pytest.approx((1.0, 1.7, 8.0))


def test_the_protocols():
    assert pace("thesis", None, software=False).frames == 10_000
    assert pace("thesis", None, software=True).least_s == 40.0
    assert pace("thesis", 20, software=True) == Pace("thesis", 20, 0.0, 3)
    assert pace("quick", None, software=False).frames > pace("quick", None, software=True).frames >= 5


def test_slow_frames_may_be_fewer_but_not_too_few():
    at = pace("quick", None, software=True)
    assert at.goes_on(4, 100.0)
    assert not at.goes_on(5, 100.0)
    assert at.goes_on(5, 1.0)
    assert not at.goes_on(7, 1.0)
    assert pace("quick", 20, software=True).goes_on(19, 100.0)
    assert not pace("thesis", None, software=True).goes_on(10_000, 40.0)


def test_outliers_are_told_and_kept():
    told = spread([10.0, 10.1, 9.9, 10.0, 10.0, 10.1, 9.9, 90.0])
    assert (told["outliers"], told["outliers_ms"], told["frame_ms_max"]) == (1, [90.0], 90.0)
    assert told["frame_ms_mean"] == pytest.approx(20.0)
    assert told["frame_ms_median"] == 10.0
    assert told["frame_ms_min"] == 9.9


def test_calls_and_primitives_are_counted(ctx, device, triangle):
    target = ctx.framebuffer([ctx.texture((8, 8), 4)])
    target.use()
    with counted(device) as counts:
        triangle.render(moderngl.TRIANGLES, vertices=3, instances=4)
        triangle.render(moderngl.TRIANGLES, vertices=3)
    assert (counts.draw_calls, counts.dispatches, counts.primitives) == (2, 0, 5)
    assert counts.vertices in (15, None)
    assert counts.primitives_in_view <= 5
    triangle.render(moderngl.TRIANGLES, vertices=3)
    assert counts.draw_calls == 2


def test_a_driver_without_statistics_leaves_vertices_open(ctx, device, triangle, monkeypatch):
    monkeypatch.setattr("greensward.bench.frame_statistics._STATISTICS", "GL_none")
    ctx.simple_framebuffer((8, 8)).use()
    with counted(device) as counts:
        triangle.render(moderngl.TRIANGLES, vertices=3)
    assert (counts.vertices, counts.primitives, counts.primitives_in_view) == (None, 1, 1)


def test_memory_is_that_of_what_is_there(ctx):
    before = gpu_bytes(ctx)
    kept = [ctx.buffer(reserve=1000), ctx.texture((8, 4), 2, dtype="f2"), ctx.texture_array((4, 4, 3), 1)]
    assert gpu_bytes(ctx) - before == 1000 + 8 * 4 * 2 * 2 + 4 * 4 * 3
    for each in kept:
        each.release()
    assert gpu_bytes(ctx) == before


def test_the_floor_covers_the_pixels_asked_for(ctx, device, monkeypatch):
    size, blade_pixels, pictures = (200, 100), 3000, []
    render = moderngl.VertexArray.render

    def watching(self, *arguments, **options):
        render(self, *arguments, **options)
        if options.get("instances", 0) > 1:
            pictures.append(np.frombuffer(ctx.fbo.read(components=4), np.uint8)[3::4])

    monkeypatch.setattr(moderngl.VertexArray, "render", watching)
    took = floor_ms(device, size, blades=500, primitives=100, blade_pixels=blade_pixels, repeats=2)
    assert took > 0.0
    # strips overlap, and some stick out of the picture
    assert 0.7 * blade_pixels < np.count_nonzero(pictures[0]) < 1.05 * blade_pixels


def test_a_row_counts_everything(renderer):
    scene = small_scene()
    row = measure(renderer(scene, size=SIZE), scene.camera, SIZE, Pace("quick", 3, warm_up=1))
    assert set(row) >= COLUMNS
    assert row["blades_considered"] >= row["blades_drawn"] > 0
    assert 0 < row["blade_pixels"] <= SIZE[0] * SIZE[1]
    assert row["frames"] == 3
    assert row["frame_ms_min"] <= row["frame_ms_median"] <= row["frame_ms_p95"] <= row["frame_ms_max"]
    assert row["cpu_ms_median"] is None
    assert {"move", "grass", "ground", "light", "post", "blit"} <= set(row["pass_ms"])
    assert row["dispatches"] > 0
    assert row["over_floor"] == pytest.approx(row["frame_ms_median"] / row["floor_ms"], rel=0.05, abs=0.02)


def test_the_first_frame_counts_from_when_building_began(renderer, monkeypatch):
    """By a clock of which every look takes a second."""
    scene, clock, looks = small_scene(), count(10), []
    subject = renderer(scene, size=SIZE)
    draw = subject.draw
    monkeypatch.setattr(protocol.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(subject, "draw", lambda *args, **more: (looks.append(next(clock)), draw(*args, **more)))
    row = measure(subject, scene.camera, SIZE, Pace("quick", 1, warm_up=3), None, False, 4)
    assert looks[0] < 4 + row["first_frame_s"] < looks[1]


def test_a_flight_goes_straight_on(renderer, monkeypatch):
    scene = small_scene(camera={"position_m": [0.0, 1.7, 4.0], "target_m": [3.0, 0.7, 0.0]})
    subject, cameras = renderer(scene, size=SIZE), []
    draw = subject.draw
    monkeypatch.setattr(
        subject, "draw", lambda *rest, camera: (cameras.append(camera), draw(*rest, camera=camera))[1]
    )
    row = measure(subject, scene.camera, SIZE, Pace("quick", 3, warm_up=1), flight_mps=12.0)
    flown = np.array([each.position_m for each in cameras[-3:]]) - scene.camera.position_m
    assert np.allclose(flown, np.outer([0.0, 0.2, 0.4], [0.6, 0.0, -0.8]))
    assert np.allclose([np.subtract(each.target_m, each.position_m) for each in cameras], [3.0, -1.0, -4.0])
    assert row["wall_ms_median"] <= row["wall_ms_p95"] <= row["wall_ms_p99"] <= row["wall_ms_max"]


@pytest.mark.parametrize(("still", "places"), [(True, 1), (False, 4)])
def test_a_camera_may_stand_where_its_path_begins(renderer, monkeypatch, still, places):
    scene, cameras = small_scene(), []
    subject = renderer(scene, size=SIZE)
    draw = subject.draw
    monkeypatch.setattr(subject, "draw", lambda *args, **more: (cameras.append(more["camera"]), draw(*args, **more)))
    path = CameraPath.recorded([(0.0, Camera()), (1.0, Camera(position_m=(2.0, 1.7, 8.0)))])
    row = measure(subject, scene.camera, SIZE, Pace("quick", 4, warm_up=1), path, still)
    assert len(set(cameras)) == places
    assert cameras[0] == camera_on_path(scene.camera, 0, path)
    assert row["first_frame_s"] is None


def test_with_timer_queries_each_pass_has_both_times(device, renderer, monkeypatch):
    monkeypatch.setattr(device, "features", replace(device.features, timer_queries=True))
    scene = small_scene()
    subject = renderer(scene, size=SIZE)
    row = measure(subject, scene.camera, SIZE, Pace("quick", 3, warm_up=1))
    assert protocol.clock(subject.device, subject.timers).startswith("GPU timer queries")
    assert set(row["cpu_pass_ms"]) == set(row["pass_ms"])
    assert row["cpu_ms_median"] > 0.0
    assert row["wall_ms_median"] >= row["cpu_ms_median"]


def test_a_driver_without_timer_queries_says_so(device, renderer, monkeypatch):
    subject = renderer(small_scene(), size=SIZE)
    assert protocol.clock(subject.device, subject.timers) == "wall clock around finish(), as the CPU draws"
    monkeypatch.setattr(device, "software", False)
    assert protocol.clock(subject.device, subject.timers).endswith("this driver has no timer queries")


def test_the_thesis_protocol_lasts_as_long_as_it_must(renderer):
    scene = small_scene()
    row = measure(renderer(scene, size=SIZE), scene.camera, SIZE, Pace("thesis", 2, least_s=0.5, warm_up=1))
    assert row["lasted_s"] >= 0.5
    assert row["frames"] > 2


def test_strips_draw_every_blade_of_the_field():
    ground = {"size_m": [20.0, 20.0], "beyond": "bare"}
    scene = small_scene(ground=ground, sowing={"full_density_m": 1000.0, "reach_m": 1000.0})
    with Renderer(scene, size=(160, 90)) as renderer:
        renderer.render()
        sown = renderer.blades
    with InstancedStrips(scene, size=(160, 90)) as strips:
        target = strips.ctx.framebuffer([strips.ctx.texture((160, 90), 4)], strips.ctx.depth_renderbuffer((160, 90)))
        row = measure(strips, scene.camera, (160, 90), Pace("quick", 3, warm_up=1))
        assert row["blades_drawn"] == strips.blades == sown
        assert row["primitives"] == 5 * strips.blades
        assert row["vertices"] in (7 * strips.blades, None)
        strips.draw(target, 0.0)
        assert strips.counts.pixels > 500
        still = target.read()
        strips.draw(target, 0.7)
        assert target.read() != still


def test_a_measurement_leaves_nothing_behind(device, renderer):
    drawn = renderer(small_scene(), size=SIZE)
    drawn.render()
    before = live_objects(device)
    for _ in range(2):
        measure(drawn, drawn.scene.camera, SIZE, Pace("quick", 1, warm_up=1))
        assert {kind: len(names) for kind, names in live_objects(device).items()} == {
            kind: len(names) for kind, names in before.items()
        }


def test_a_lost_device_ends_the_measurement():
    lost = type("Lost", (), {"error": "GL_CONTEXT_LOST"})()
    with pytest.raises(DeviceLostError, match="the driver failed with GL_CONTEXT_LOST"):
        protocol._refuse_lost(lost)


def test_a_gpu_is_warmed_up_for_a_second():
    assert pace("quick", None, software=False).warm_s == pace("thesis", None, software=False).warm_s == 1.0
    assert pace("quick", None, software=True).warm_s == 0.0


@pytest.mark.parametrize(("warm_s", "least", "most"), [(0.0, 1, 5), (6.0, 8, 61)])
def test_frames_to_warm_up_go_on_for_so_long(renderer, monkeypatch, warm_s, least, most):
    """By a clock of which every look takes a tenth of a second."""
    drawn, cameras, clock = renderer(small_scene(), size=SIZE), [], count()
    draw = drawn.draw
    monkeypatch.setattr(drawn, "draw", lambda *args, **more: (cameras.append(more["camera"]), draw(*args, **more)))
    monkeypatch.setattr(protocol.time, "perf_counter", lambda: 0.1 * next(clock))
    measure(drawn, drawn.scene.camera, SIZE, Pace("quick", 1, warm_up=1, warm_s=warm_s))
    assert least <= cameras.count(cameras[0]) <= most
