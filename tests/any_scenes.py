"""Tables of valid scenes, at random."""

import string

from hypothesis import strategies as st

from greensward.scene.grass import species_table


def numbers(low, high):
    return st.floats(low, high, allow_subnormal=False)


def spans(low, high):
    return st.tuples(numbers(low, high), numbers(low, high)).map(lambda pair: tuple(sorted(pair)))


colours = st.integers(0, 0xFFFFFF).map(lambda value: f"#{value:06x}")
points = st.tuples(*[numbers(-1e6, 1e6)] * 3)


def table(**fields):
    """A table in which any of these keys may be left out."""
    return st.fixed_dictionaries({}, optional=fields)


valid_scenes = table(
    title=st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    seed=st.integers(0, 2**32 - 1),
    ground=table(size_m=st.tuples(numbers(0.1, 1e5), numbers(0.1, 1e5)), texture_m=numbers(0.1, 1000))
    | table(octaves=st.integers(1, 12), gain=numbers(0, 1)).map(lambda t: {"kind": "noise", **t}),
    grass=st.lists(
        table(
            species=st.sampled_from(sorted(species_table())),
            share=numbers(0, 1e6),
            height_m=spans(0.001, 20),
            tilt_deg=spans(0, 85),
            tip_colour=colours,
            head=st.sampled_from(["none", "cup"]),
        ),
        max_size=4,
    ),
    colour=table(
        strength=numbers(0, 1),
        noise=st.lists(table(channel=st.sampled_from(["red", "all"]), weight=numbers(0.1, 9)), max_size=4),
    ).map(lambda t: {"kind": "noise", **t}),
    phong=table(specular=numbers(0, 1), shininess=numbers(1, 1000)),
    mass=table(reference_kg=numbers(1e-6, 1000)),
    sowing=table(density_per_m2=numbers(0, 1e5), drift=numbers(0, 1)),
    wind=st.lists(table(speed_mps=numbers(0, 200), direction_deg=numbers(-360, 360)), max_size=3),
    object=st.lists(
        st.fixed_dictionaries({"kind": st.sampled_from(["box", "sphere"]), "position_m": points}), max_size=3
    ),
    camera=table(position_m=points, height_above_ground=st.booleans(), fov_y_deg=numbers(1, 169)),
    shadows=table(enabled=st.booleans(), cascades=st.integers(1, 4)),
    technique=st.dictionaries(
        st.text(string.ascii_lowercase, min_size=5, max_size=8),
        st.integers(-(2**60), 2**60) | st.booleans() | st.lists(st.text(string.printable, max_size=5), max_size=3),
        max_size=3,
    ),
    post=table(exposure_ev=numbers(-20, 20), tone_map=st.sampled_from(["filmic", "linear"])),
)
