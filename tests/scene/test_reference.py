"""The reference page is what the models say today."""

from pathlib import Path

from greensward.scene import Scene
from greensward.scene.grass import species_table
from greensward.scene.kinds import models_in
from greensward.scene.reference import reference
from greensward.techniques import SETTINGS

PAGE = Path(__file__).parents[2] / "docs" / "scene-reference.md"


def test_the_page_is_current():
    assert PAGE.read_text(encoding="utf-8") == reference(SETTINGS), (
        "docs/scene-reference.md is stale: write greensward.scene.reference.reference(SETTINGS) into it"
    )


def test_every_key_has_help_and_a_row():
    page = reference({})
    for field in Scene.model_fields.values():
        for model in models_in(field.annotation):
            assert model.__doc__
            for key, inner in model.model_fields.items():
                assert f"| `{key}` | " in page
                assert inner.description or key == "kind", f"{model.__name__}.{key} has no help"


def test_rows_tell_type_default_range_and_unit():
    page = reference(SETTINGS)
    for row in (
        "| `fov_y_deg` | number | `50` | above 0.1 to 360 | ° | "
        "Vertical field of view; below 170 unless it is a fisheye. |",
        "| `width_m` | 2 numbers | `[0.003, 0.006]` | from 0.0001 to 2 | m | Greatest width. |",
        "| `seed` | whole number | `1` | from 0 to 4294967295 |  | Seed of all randomness. |",
        "| `enabled` | true or false | `true` |  |  | Shadows of grass, objects and ground on or off. |",
        '| `tip_colour` | colour | `"#7f9a3c"` |  |  | sRGB at the tip. |',
    ):
        assert row in page
    assert "| `file` | file | *required* |" in page
    for name in species_table():
        assert f"| `{name}` | " in page
    for name in SETTINGS:
        assert f'### `[technique]` with `name = "{name}"`' in page
