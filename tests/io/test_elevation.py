"""Elevation in: every sample type, scale, hole, reference and byte order; what is not read is named."""

import sys
import warnings

import numpy as np
import pytest
from PIL import Image

from greensward.cli.check import _read
from greensward.ground.height_field import height_map_size_m
from greensward.io.elevation import extent_m, read_heights
from greensward.scene import HeightMapGround
from greensward.scene.errors import InputError, SceneError
from greensward.scene.load import load

rasterio = pytest.importorskip("rasterio")
from rasterio.crs import CRS  # noqa: E402
from rasterio.transform import Affine  # noqa: E402


def from_origin(west, north, width, height):
    return Affine(width, 0, west, 0, -height, north)


HILL = np.add.outer(3 * np.arange(16), np.arange(20)) + 12
UTM = {"crs": "EPSG:25832", "transform": from_origin(437000, 5301000, 2, 3)}


@pytest.fixture(autouse=True)
def _silent(recwarn, capfd):
    """Nothing is printed, logged to the screen or warned of, whatever the file."""
    yield
    assert not recwarn.list
    assert capfd.readouterr() == ("", "")


@pytest.mark.filterwarnings("ignore")
def tif(path, *bands, about=(), tags=(), mask=None, **profile):
    bands = bands or (HILL,)
    rows, columns = bands[0].shape
    profile = {"driver": "GTiff", "dtype": bands[0].dtype, **UTM} | profile
    with warnings.catch_warnings(), rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        warnings.simplefilter("ignore")
        with rasterio.open(path, "w", height=rows, width=columns, count=len(bands), **profile) as file:
            for number, band in enumerate(bands, 1):
                file.write(band, number)
            for name, value in dict(about).items():
                setattr(file, name, value)
            file.update_tags(1, **dict(tags))
            if mask is not None:
                file.write_mask(mask)
    return path


def refused(function, path, **options):
    with pytest.raises(InputError) as caught:
        function(path, **options)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"])
def test_a_geotiff_of_every_type_is_in_metres(tmp_path, kind):
    low = 20 if kind[0] != "u" else 0
    path = tif(tmp_path / "a.tif", (HILL - low).astype(kind))
    np.testing.assert_array_equal(read_heights(path), HILL - low)
    stretched = read_heights(path, height_m=(5, 6), height_scale=2)
    assert (stretched.min(), stretched.max()) == (10, 12)


@pytest.mark.parametrize("options", [{"compress": "lerc"}, {"compress": "zstd"}, {"bigtiff": "YES"}, {"tiled": True}])
def test_a_geotiff_of_every_packing(tmp_path, options):
    blocks = {"blockxsize": 16, "blockysize": 16} if "tiled" in options else {}
    path = tif(tmp_path / "a.tif", HILL.astype("f4"), **options, **blocks)
    np.testing.assert_allclose(read_heights(path), HILL, atol=1e-3)


@pytest.mark.parametrize("kind", ["i2", "i4", "f8"])
def test_scale_offset_and_unit_hold(tmp_path, kind):
    about = {"scales": (0.1,), "offsets": (400.0,)}
    path = tif(tmp_path / "a.tif", HILL.astype(kind), about=about)
    np.testing.assert_allclose(read_heights(path), HILL * 0.1 + 400, atol=1e-4)
    feet = tif(tmp_path / "b.tif", HILL.astype(kind), about={**about, "units": ("US survey foot",)})
    np.testing.assert_allclose(read_heights(feet), (HILL * 0.1 + 400) * 1200 / 3937, atol=1e-4)
    strange = tif(tmp_path / "c.tif", HILL.astype(kind), about={"units": ("fathom",)})
    assert refused(read_heights, strange).startswith("its heights are in 'fathom'; convert them")


def test_feet_of_a_vertical_reference_become_metres(tmp_path):
    path = tif(tmp_path / "a.tif", HILL.astype("f4"), crs="EPSG:2263+6360", GEOTIFF_VERSION="1.1")
    np.testing.assert_allclose(read_heights(path), HILL * 1200 / 3937, atol=1e-4)


def test_holes_by_no_data_mask_and_alpha(tmp_path):
    hole = np.zeros(HILL.shape, np.bool_)
    hole[4:7, 5:9] = True
    spoilt = np.where(hole, -9999, HILL).astype("i2")
    opaque = np.where(hole, 0, 255).astype("u1")
    paths = [
        tif(tmp_path / "a.tif", spoilt, nodata=-9999),
        tif(tmp_path / "b.tif", spoilt, mask=opaque),
        tif(tmp_path / "c.tif", spoilt, np.where(hole, 0, 255).astype("i2"), alpha="yes"),
    ]
    for path in paths:
        heights = read_heights(path)
        np.testing.assert_array_equal(heights[~hole], HILL[~hole])
        assert np.abs(heights - HILL)[hole].max() < 6
    picture = np.dstack([np.full(HILL.shape, 51, np.uint8), opaque])
    picture[hole, 0] = 255
    Image.fromarray(picture).save(tmp_path / "d.png")
    np.testing.assert_allclose(read_heights(tmp_path / "d.png"), 2.0, atol=1e-5)


@pytest.mark.parametrize("nodata", [None, -9999])
def test_blocks_that_were_left_out_are_no_data_or_zero(tmp_path, nodata):
    path = tmp_path / "a.tif"
    options = {"sparse_ok": True, "tiled": True, "blockxsize": 16, "blockysize": 16}
    with rasterio.open(
        path, "w", driver="GTiff", height=32, width=32, count=1, dtype="int16", nodata=nodata, **UTM, **options
    ) as file:
        file.write(np.full((16, 16), 500, "i2"), 1, window=((0, 16), (0, 16)))
    heights = read_heights(path)
    assert (heights[:16, :16] == 500).all()
    assert (heights[16:, 16:] == (500 if nodata else 0)).all()


def test_one_of_several_bands_is_chosen(tmp_path):
    path = tif(tmp_path / "a.tif", HILL.astype("f4"), 2 * HILL.astype("f4"))
    assert refused(read_heights, path) == "holds 2 bands; choose one with band, from 1 to 2"
    np.testing.assert_array_equal(read_heights(path, band=2), 2 * HILL)
    assert refused(read_heights, path, band=3) == "has no band 3 of heights; it holds 1, 2"
    np.save(tmp_path / "a.npy", HILL)
    assert refused(read_heights, tmp_path / "a.npy", band=2) == "has no band 2; it is read as one picture or array"
    paletted = tif(tmp_path / "b.tif", HILL.astype("u1"), photometric="palette")
    with rasterio.open(paletted, "r+") as file:
        file.write_colormap(1, {1: (9, 9, 9, 255)})
    assert "has a colour table" in refused(read_heights, paletted)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("driver", ["PNG", "GTiff"])
@pytest.mark.parametrize("bands", [2, 3, 4])
def test_pictures_of_16_bits_keep_them_beside_colours_and_alpha(tmp_path, driver, bands):
    ramp = np.linspace(0, 65535, 320).reshape(16, 20).astype("u2")
    full = np.full_like(ramp, 65535)
    layers = [ramp, full] if bands == 2 else [ramp] * 3 + [full] * (bands - 3)
    plain = {"driver": driver, "crs": None, "transform": Affine.identity()}
    alpha = {"alpha": "yes"} if driver == "GTiff" and bands % 2 == 0 else {}
    path = tif(
        tmp_path / "a.img", *layers, **plain, **alpha, **({"photometric": "rgb"} if bands > 2 and alpha else {})
    )
    np.testing.assert_allclose(read_heights(path), ramp / 6553.5, atol=1e-5)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", ["u1", "u2"])
@pytest.mark.parametrize("compress", ["none", "zstd"])
def test_where_white_is_zero_it_is_high(tmp_path, kind, compress):
    ramp = np.linspace(0, np.iinfo(kind).max, 320).reshape(16, 20).astype(kind)
    plain = {"crs": None, "transform": Affine.identity(), "photometric": "MINISWHITE", "compress": compress}
    heights = read_heights(tif(tmp_path / "a.tif", ramp, **plain))
    np.testing.assert_allclose(heights, 10 - 10 * (ramp / np.iinfo(kind).max), atol=1e-4)


@pytest.mark.parametrize("flip", [(1, -1), (1, 1), (-1, -1), (-1, 1)])
def test_north_stays_north_and_the_size_is_that_of_the_file(tmp_path, flip):
    east, north = flip
    transform = Affine(2 * east, 0, 437000, 0, 3 * north, 5301000)
    path = tif(tmp_path / "a.tif", HILL.astype("f4")[::-north, ::east], transform=transform)
    np.testing.assert_array_equal(read_heights(path), HILL)
    assert extent_m(path) == (38, 45)
    assert height_map_size_m(HeightMapGround(file="a.tif"), path) == (38, 45)
    assert height_map_size_m(HeightMapGround(file="a.tif", size_m=(1, 2)), path) == (1, 2)


def test_sizes_in_feet_and_degrees(tmp_path):
    feet = tif(tmp_path / "a.tif", HILL.astype("f4"), crs="EPSG:2263")
    assert extent_m(feet) == pytest.approx((38 * 1200 / 3937, 45 * 1200 / 3937))
    degrees = tif(tmp_path / "b.tif", HILL.astype("f4"), crs="EPSG:4326", transform=from_origin(7, 60, 1e-3, 1e-3))
    # of Vincenty's formulae on the ellipsoid
    assert extent_m(degrees) == pytest.approx((19 * 55.812, 15 * 111.411), rel=2e-4)
    wide = tif(tmp_path / "c.tif", HILL.astype("f4"), crs="EPSG:4326", transform=from_origin(7, 60, 1, 1))
    assert "gdalwarp -t_srs EPSG:32633 c.tif metres.tif" in refused(extent_m, wide)


@pytest.mark.parametrize(
    ("profile", "told"),
    [
        (
            {"crs": None},
            "its cells have no unit, as it names no reference system; set ground.size_m, which is [38, 45]",
        ),
        ({"crs": "EPSG:3857"}, "distances in its reference system, WGS 84 / Pseudo-Mercator, are not those on the"),
        (
            {"transform": Affine(2, 1, 0, 1, -3, 0)},
            "its rows do not run from west to east; turn it north up: gdalwarp",
        ),
        ({"transform": from_origin(0, 0, 20000, 3)}, "covers 380,000 × 45 m, and a ground at most 200,000 m a side"),
    ],
)
def test_references_that_do_not_tell_the_size(tmp_path, profile, told):
    path = tif(tmp_path / "a.tif", HILL.astype("f4"), **profile)
    assert refused(lambda it: height_map_size_m(HeightMapGround(file="a.tif"), it), path).startswith(told)


def test_a_world_file_beside_a_tiff_is_a_reference_and_statistics_are_none(tmp_path):
    plain = tif(tmp_path / "a.tif", HILL.astype("u2"), crs=None, transform=None, tags={"STATISTICS_MAXIMUM": 69})
    assert read_heights(plain).max() == pytest.approx(HILL.max() / 6553.5)
    (tmp_path / "a.tfw").write_text("2\n0\n0\n-3\n437000\n5301000\n")
    np.testing.assert_array_equal(read_heights(plain), HILL)
    assert "set ground.size_m, which is [38, 45]" in refused(extent_m, plain)


def test_an_esri_grid(tmp_path):
    rows = "\n".join(" ".join(map(str, row)) for row in np.where(HILL == 12, -9999, HILL))
    head = "ncols 20\nnrows 16\nxllcorner 437000\nyllcorner 5301000\ncellsize 2.5\nNODATA_value -9999\n"
    path = tmp_path / "a.asc"
    path.write_text(head + rows)
    heights = read_heights(path)
    np.testing.assert_array_equal(heights.ravel()[1:], HILL.ravel()[1:])
    assert heights[0, 0] == pytest.approx(12, abs=3)
    assert "set ground.size_m, which is [47.5, 37.5]" in refused(extent_m, path)
    (tmp_path / "a.prj").write_text(CRS.from_epsg(25832).to_wkt())
    assert extent_m(path) == (47.5, 37.5)


def test_srtm(tmp_path):
    path = tmp_path / "N46E007.hgt"
    heights = np.full((21, 21), 400, ">i2")
    heights[3, 4], heights[20, 0] = -32768, 99
    path.write_bytes(heights.tobytes())
    read = read_heights(path)
    assert (read[3, 4], read[20, 0], read[0, 0]) == (400, 99, 400)
    assert extent_m(path) == pytest.approx((76763, 111161), rel=1e-4)
    path = path.rename(tmp_path / "alps.hgt")
    assert "must be named by its corner" in refused(extent_m, path)
    path.write_bytes(b"\0" * 22)
    assert refused(read_heights, path).startswith("must be square or 3601 × 1801, of 16 bits (got 22 bytes)")


def test_raw_needs_its_byte_order(tmp_path):
    path = tmp_path / "a.raw"
    ramp = np.linspace(0, 65535, 256).reshape(16, 16)
    path.write_bytes(ramp.astype(">u2").tobytes())
    assert "does not tell the order of its bytes; set ground.byte_order" in refused(read_heights, path)
    np.testing.assert_allclose(read_heights(path, byte_order="big"), ramp / 6553.5, atol=2e-4)
    path.write_bytes(b"\0" * 100)
    assert "must be square and of 16 bits (got 100 bytes)" in refused(read_heights, path, byte_order="big")
    np.save(tmp_path / "a.npy", ramp)
    assert "has no byte_order big; only a RAW" in refused(read_heights, tmp_path / "a.npy", byte_order="big")


@pytest.mark.parametrize(
    ("magic", "told"),
    [(b"v/1\1", "is OpenEXR, which is not read; convert it: oiiotool a.exr -o"), (b"\x89HDF", "is HDF5 or netCDF")],
)
def test_what_is_not_read_is_named(tmp_path, magic, told):
    (tmp_path / "a.exr").write_bytes(magic + b"\0" * 60)
    assert refused(read_heights, tmp_path / "a.exr").startswith(told)


def test_several_pictures_in_a_file_are_refused(tmp_path):
    first = Image.fromarray(HILL.astype("u1"))
    first.save(tmp_path / "a.tif", save_all=True, append_images=[first])
    assert refused(read_heights, tmp_path / "a.tif").startswith("holds 2 pictures; take one out: gdal_translate")


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_damaged_geotiff_is_told_in_a_sentence(tmp_path, part):
    path = tif(tmp_path / "a.tif", HILL.astype("f8"))
    data = path.read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    assert "GTiff" in refused(read_heights, path)


def test_without_rasterio_plain_pictures_are_read_and_others_refused(tmp_path, monkeypatch):
    measured = tif(tmp_path / "a.tif", HILL.astype("u2"))
    Image.fromarray(HILL.astype("u2")).save(tmp_path / "b.tif")
    monkeypatch.setitem(sys.modules, "rasterio", None)
    assert refused(read_heights, measured).endswith('pip install "greensward[geo]"')
    assert read_heights(tmp_path / "b.tif").max() == pytest.approx(HILL.max() / 6553.5)
    assert extent_m(tmp_path / "b.tif") is None


def test_check_reads_heights_and_their_reference(tmp_path):
    tif(tmp_path / "a.tif", HILL.astype("f4"), crs=None)
    (tmp_path / "a.toml").write_text('[ground]\nkind = "heightmap"\nfile = "a.tif"\n')
    with pytest.raises(SceneError, match="its cells have no unit"):
        load(tmp_path / "a.toml", read_file=_read)
    (tmp_path / "a.toml").write_text('[ground]\nkind = "endless"\nfile = "a.toml"\n')
    with pytest.raises(SceneError, match="is not a picture"):
        load(tmp_path / "a.toml", read_file=_read)
