"""Height maps and pictures in, pictures and arrays out, and every way in which a file may be wrong."""

import io
import os
import struct
import zipfile
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from greensward.io import rasters
from greensward.io.elevation import read_heights
from greensward.io.rasters import PICTURES, read_colours, read_rgba, spread, write_npz, write_picture
from greensward.scene.errors import GreenswardError, InputError
from greensward.scene.files import check_writable, written_aside

GREY8 = np.array([[0, 51], [102, 255], [204, 153]], np.uint8)
GREY16 = GREY8.astype(np.uint16) * 257


def saved(path, array, mode=None, **options):
    image = Image.fromarray(array)
    (image.convert(mode) if mode else image).save(path, **options)
    return path


def refused(function, path, *args, **options):
    with pytest.raises(InputError) as caught:
        function(path, *args, **options)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
@pytest.mark.parametrize("array", [GREY8, GREY16], ids=["8", "16"])
def test_black_and_white_span_the_heights_of_a_picture(tmp_path, name, array):
    path = saved(tmp_path / name, array)
    heights = read_heights(path)
    assert heights.dtype == np.float32
    np.testing.assert_allclose(heights, GREY8 / 25.5, atol=1e-5)
    np.testing.assert_allclose(read_heights(path, height_m=(100, 355)), GREY8 + 100.0, atol=1e-4)
    np.testing.assert_allclose(read_heights(path, height_m=(255, 0), height_scale=2), 2 * (255.0 - GREY8), atol=1e-4)


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "LA"])
def test_a_picture_without_colours_is_grey_whatever_its_mode(tmp_path, mode):
    path = saved(tmp_path / "a.png", GREY8, mode)
    np.testing.assert_allclose(read_heights(path, height_m=(0, 255)), GREY8, atol=1e-4)


def test_big_endian_and_signed_and_wide_tiffs_hold_metres(tmp_path):
    metres = np.array([[-5, 300], [70000, 2]], np.int32)
    np.testing.assert_array_equal(read_heights(saved(tmp_path / "i.tif", metres)), metres)
    np.testing.assert_array_equal(read_heights(saved(tmp_path / "f.tif", metres.astype(np.float32))), metres)
    stretched = read_heights(tmp_path / "f.tif", height_m=(10, 20))
    assert (stretched.min(), stretched.max()) == (10, 20)
    big = Image.frombytes("I;16B", (2, 3), GREY16.astype(">u2").tobytes())
    big.save(tmp_path / "b.tif")
    np.testing.assert_allclose(read_heights(tmp_path / "b.tif"), GREY8 / 25.5, atol=1e-5)


@pytest.mark.parametrize("dtype", ["u1", "i2", ">i4", "f2", "f4", ">f8", "?"])
def test_an_array_holds_metres(tmp_path, dtype):
    array = np.array([[0, 1], [1, 0], [1, 1]]).astype(dtype)
    np.save(tmp_path / "a.npy", array)
    np.savez_compressed(tmp_path / "a.npz", only=array)
    np.savez(tmp_path / "b.npz", first=array, second=array * array)
    for heights in (
        read_heights(tmp_path / "a.npy"),
        read_heights(tmp_path / "a.npz"),
        read_heights(tmp_path / "b.npz", key="second"),
    ):
        np.testing.assert_array_equal(heights, array.astype(np.float32))
    np.testing.assert_array_equal(read_heights(tmp_path / "a.npy", height_m=(5, 7)), 5 + 2 * array.astype(np.float32))


def test_a_level_array_takes_the_lowest_height(tmp_path):
    np.save(tmp_path / "a.npy", np.full((3, 3), 7.0))
    assert (read_heights(tmp_path / "a.npy", height_m=(5, 9)) == 5).all()


@pytest.mark.parametrize("hole", [np.nan, np.inf, -np.inf, -9999.0, -3.4028234663852886e38])
def test_holes_are_filled_smoothly_from_around_them(tmp_path, hole):
    rows, columns = np.mgrid[:60, :80].astype(np.float32)
    slope = 100 + 2 * rows + columns
    holed = slope.copy()
    holed[20:40, 30:50] = hole
    holed[0, 0] = holed[59, :] = hole
    np.save(tmp_path / "a.npy", holed)
    heights = read_heights(tmp_path / "a.npy", no_data=hole if abs(hole) < np.inf else None)
    known = holed != hole if np.isfinite(hole) else np.isfinite(holed)
    np.testing.assert_array_equal(heights[known], slope[known])
    assert np.abs(heights - slope)[:59].max() < 8
    assert heights.min() >= slope.min()
    assert heights.max() <= slope.max()
    assert max(np.abs(np.diff(heights, axis=0)).max(), np.abs(np.diff(heights, axis=1)).max()) < 8


def test_no_data_of_other_precision_and_range_is_found(tmp_path):
    for dtype, hole in (("f4", -9999.9), ("u2", 65535), ("u1", 300)):
        array = np.full((4, 4), 5, dtype)
        if hole != 300:
            array[1, 1] = hole
        np.save(tmp_path / "a.npy", array)
        assert (read_heights(tmp_path / "a.npy", no_data=hole) == 5).all()


def test_a_geotiff_declares_its_no_data(tmp_path):
    array = np.full((4, 4), 5, np.float32)
    array[2, 2] = -32768
    saved(tmp_path / "a.tif", array, tiffinfo={42113: "-32768"})
    assert (read_heights(tmp_path / "a.tif") == 5).all()


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        (np.zeros((3, 3, 3)), "must have 2 dimensions, rows and columns (got 3)"),
        (np.zeros(9), "must have 2 dimensions, rows and columns (got 1)"),
        (np.zeros((1, 9)), "must be at least 2 × 2 (got 9 × 1)"),
        (np.zeros((0, 9)), "must be at least 2 × 2 (got 9 × 0)"),
        (np.zeros((2, 16385), np.uint8), "must be at most 16,384 on a side (got 16,385 × 2)"),
        (np.zeros((3, 3), complex), "must hold plain numbers (got complex numbers)"),
        (np.full((3, 3), "x"), "must hold plain numbers (got text)"),
        (np.full((3, 3), None), "must hold plain numbers (got Python objects)"),
        (np.zeros((3, 3), "M8[s]"), "must hold plain numbers (got the type datetime64[s])"),
        (np.zeros((3, 3), [("a", "f4")]), "must hold plain numbers (got a table of named columns)"),
        (np.zeros((3, 3), [("草", "f4")]), "must hold plain numbers (got a table of named columns)"),
        (np.full((3, 3), np.nan), "holds no height: every value is NaN, infinite or no_data"),
        (np.array([[1.0] + [np.nan] * 19] * 2), "at most 90 % of its values may be missing (got 95.0 %)"),
        (
            np.array([[-3.4e38, 1], [2, 3]], "f4"),
            "heights must lie within ±100,000 m (got -3.4e+38 to 3 m); if",
        ),
        (np.full((2, 2), 1e300), "heights must lie within ±100,000 m"),
    ],
)
@pytest.mark.filterwarnings("ignore:Stored array")
def test_an_array_that_is_no_ground_is_refused(tmp_path, array, expected):
    np.save(tmp_path / "a.npy", array)
    assert expected in refused(read_heights, tmp_path / "a.npy")
    np.savez(tmp_path / "a.npz", array)
    assert expected in refused(read_heights, tmp_path / "a.npz")


def test_the_array_of_an_npz_must_be_told_where_there_are_several(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, elevation=np.zeros((2, 2)), slope=np.zeros((2, 2)))
    assert refused(read_heights, path) == "holds several arrays; choose one with key: elevation, slope"
    told = refused(read_heights, path, key="elevaton")
    assert told == "has no array elevaton; it holds elevation, slope; did you mean elevation?"
    np.savez(path)
    assert refused(read_heights, path) != ""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.txt", "x")
    assert refused(read_heights, path) == "holds no array"
    saved(tmp_path / "a.png", GREY8)
    assert refused(read_heights, tmp_path / "a.png", key="x").startswith("has no key x; only an .npz")


def test_an_array_is_judged_by_its_header_before_its_data_is_read(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (40000, 40000)})
    (tmp_path / "a.npy").write_bytes(header.getvalue())
    assert "must be at most 16,384 on a side (got 40,000 × 40,000)" in refused(read_heights, tmp_path / "a.npy")


def png(width, height):
    """A PNG of that size by its header, without the data."""
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunk = struct.pack(">I", len(head)) + b"IHDR" + head + struct.pack(">I", zlib.crc32(b"IHDR" + head))
    data = struct.pack(">I", 0) + b"IDAT" + struct.pack(">I", zlib.crc32(b"IDAT"))
    return b"\x89PNG\r\n\x1a\n" + chunk + data


@pytest.mark.parametrize("read", [read_heights, read_rgba])
def test_files_that_are_no_pictures_are_refused(tmp_path, read):
    path = tmp_path / "a.png"
    assert refused(read, path) == "no such file"
    assert refused(read, tmp_path) == "is a folder, not a file"
    assert refused(read, tmp_path / "a\0b")
    path.write_bytes(b"")
    assert refused(read, path) == "is empty (0 bytes)"
    path.write_bytes(b"hello, this is no picture")
    assert refused(read, path).startswith("is not a picture of PNG, TIFF, JPEG, WebP or BMP")
    path.write_bytes(png(40000, 40000))
    told = refused(read, path)
    assert told == "must be at most 16,384 on a side (got 40,000 × 40,000); scale it down, or cut out a part"
    path.write_bytes(png(0, 5))
    refused(read, path)
    path.write_bytes(png(50, 50))
    assert "cut short" in refused(read, path)


def test_our_size_limit_leaves_pillows_as_it_was(tmp_path):
    theirs = Image.MAX_IMAGE_PIXELS
    read_rgba(saved(tmp_path / "a.png", GREY8))
    assert theirs == Image.MAX_IMAGE_PIXELS


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_rather_than_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    assert refused(read_rgba, tmp_path / "a.png") == "is not a file"


def test_a_coloured_height_map_is_refused(tmp_path):
    path = saved(tmp_path / "a.png", np.arange(48, dtype=np.uint8).reshape(4, 4, 3))
    assert refused(read_heights, path).startswith("must be a grey picture, but it has colours")


@given(st.data())
def test_damaged_files_are_read_or_refused(tmp_path, data):
    name = data.draw(st.sampled_from(["a.png", "a.tif", "a.npy", "a.npz", "a.jpg", "a.webp"]))
    noise = np.random.default_rng(1).integers(0, 65536, (20, 20)).astype(np.uint16)
    path = tmp_path / name
    if name == "a.npy":
        np.save(path, noise)
    elif name == "a.npz":
        np.savez_compressed(path, noise)
    else:
        saved(path, noise if name in ("a.png", "a.tif") else (noise >> 8).astype(np.uint8))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(1, len(content)))])
    for read in (read_heights, read_rgba):
        told = "fine"
        try:
            assert np.isfinite(read(path)).all()
        except InputError as error:
            told = str(error)
        assert told
        assert "Traceback" not in told


@pytest.mark.parametrize(
    ("mode", "array", "expected"),
    [
        ("L", GREY8, np.stack([GREY8] * 3 + [GREY8 * 0 + 255], axis=-1)),
        (None, GREY16, np.stack([GREY8] * 3 + [GREY8 * 0 + 255], axis=-1)),
        ("1", GREY8 // 255 * 255, np.stack([GREY8 // 255 * 255] * 3 + [GREY8 * 0 + 255], axis=-1)),
        ("P", GREY8, np.stack([GREY8] * 3 + [GREY8 * 0 + 255], axis=-1)),
        ("RGBA", np.arange(24, dtype=np.uint8).reshape(3, 2, 4), np.arange(24).reshape(3, 2, 4)),
    ],
)
def test_a_picture_becomes_rgba_of_8_bits(tmp_path, mode, array, expected):
    pixels = read_rgba(saved(tmp_path / "a.png", array, mode))
    assert pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels, expected)


def test_pictures_of_no_known_white_are_refused(tmp_path):
    assert "floating-point" in refused(read_rgba, saved(tmp_path / "f.tif", np.ones((2, 2), np.float32)))
    assert "32-bit" in refused(read_rgba, saved(tmp_path / "i.tif", np.full((2, 2), 70000, np.int32)))


@pytest.mark.parametrize("name", ["a.png", "a.PNG", "a.jpg", "a.jpeg", "a.tif", "a.tiff", "a.webp"])
def test_a_picture_is_written_in_the_format_of_its_ending(tmp_path, name):
    image = np.full((4, 6, 3), 128, np.uint8)
    check_writable(tmp_path / name, tuple(PICTURES))
    write_picture(tmp_path / name, image)
    with Image.open(tmp_path / name) as picture:
        assert picture.format == rasters.PICTURES[name[1:].lower()]
        assert picture.size == (6, 4)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_arrays_are_written_whole(tmp_path):
    write_npz(tmp_path / "a.npz", {"depth": np.eye(3, dtype=np.float32), "camera": "{}"})
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_array_equal(arrays["depth"], np.eye(3))
        assert str(arrays["camera"]) == "{}"


@pytest.mark.parametrize(
    "failure", [OSError(28, "No space left on device"), ValueError("too wide"), KeyboardInterrupt()]
)
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def write():
        with written_aside(path) as stream:
            stream.write(b"half")
            raise failure

    with pytest.raises(GreenswardError if isinstance(failure, Exception) else KeyboardInterrupt) as caught:
        write()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    if isinstance(failure, OSError):
        assert str(caught.value) == f"{path}: cannot be written: No space left on device"
        assert caught.value.exit_code == 1


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX")
def test_what_is_written_has_the_usual_mode(tmp_path):
    (tmp_path / "usual").touch()
    write_picture(tmp_path / "a.png", np.zeros((2, 2, 3), np.uint8))
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_an_output_that_cannot_be_written_is_told_before_the_work(tmp_path):
    assert "must end in one of .png, .jpg" in refused(check_writable, tmp_path / "a.gif", tuple(PICTURES))
    assert refused(check_writable, tmp_path / "a", tuple(PICTURES)).endswith("(it has none)")
    assert "there is no folder" in refused(check_writable, tmp_path / "no" / "a.png", tuple(PICTURES))
    (tmp_path / "d.png").mkdir()
    assert "is a folder" in refused(check_writable, tmp_path / "d.png", tuple(PICTURES))
    (tmp_path / "f").touch()
    assert "there is no folder" in refused(check_writable, tmp_path / "f" / "a.png", tuple(PICTURES))
    assert "cannot be written" in refused(check_writable, tmp_path / ("x" * 300 + ".png"), tuple(PICTURES))
    assert refused(check_writable, tmp_path / "a\0.png", tuple(PICTURES))
    check_writable(tmp_path / "a.npz", (".npz",))
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    tmp_path.chmod(0o500)
    assert "cannot be written: Permission denied" in refused(check_writable, tmp_path / "a.png", tuple(PICTURES))


def test_hidden_colours_are_those_of_what_is_visible_beside_them(tmp_path):
    picture = np.full((13, 21, 4), 255, np.uint8)
    picture[..., 3] = 0  # white, where it is transparent
    picture[:, :5] = 200, 0, 0, 255
    picture[6:, 14:] = 0, 0, 100, 128
    found = read_colours(saved(tmp_path / "a.png", picture))
    np.testing.assert_array_equal(found[..., 3], picture[..., 3])
    seen = picture[..., 3] > 0
    np.testing.assert_array_equal(found[seen], picture[seen])
    assert found[..., 1].max() == 0
    np.testing.assert_array_equal(found[:, 5, :3], [[200, 0, 0]] * 13)
    np.testing.assert_array_equal(found[6:, 13, :3], [[0, 0, 100]] * 7)
    for whole in (np.full((3, 3, 4), 255, np.uint8), np.zeros((3, 3, 4), np.uint8)):
        assert spread(whole) is whole


@pytest.mark.parametrize("turn", range(1, 9))
def test_a_turn_by_exif_is_applied(tmp_path, turn):
    upright = Image.fromarray(np.arange(6, dtype=np.uint8).reshape(2, 3) * 40)
    opposite = {2: 0, 3: 3, 4: 1, 5: 5, 6: 2, 7: 6, 8: 4}  # what EXIF asks to be done, undone
    stored = upright if turn == 1 else upright.transpose(Image.Transpose(opposite[turn]))
    exif = Image.Exif()
    exif[0x0112] = turn
    stored.save(tmp_path / "a.png", exif=exif)
    np.testing.assert_array_equal(read_rgba(tmp_path / "a.png")[..., 0], np.asarray(upright))
    np.testing.assert_allclose(read_heights(tmp_path / "a.png"), np.asarray(upright) / 25.5, atol=1e-5)


def test_values_of_a_tiff_that_pillow_would_wrap_are_refused(tmp_path):
    Image.fromarray(GREY8).save(tmp_path / "a.tif", tiffinfo={339: 2})
    assert refused(read_rgba, tmp_path / "a.tif").startswith("holds signed values or leaves blocks out")
