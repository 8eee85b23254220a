"""A scene as the tables and values of TOML, without those that equal their defaults."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from greensward.scene.errors import InputError
from greensward.scene.grass import Grass, species_table
from greensward.scene.raster import Raster

_ALWAYS = ("kind", "species", "name")


def held(table: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    """The keys of a model, those beyond its fields included, or of a table."""
    return {**dict(table), **(table.model_extra or {})} if isinstance(table, BaseModel) else dict(table)


def defaults_of(model: type[BaseModel], given: Mapping[str, Any]) -> dict[str, Any]:
    """Defaults of a table's keys; those of grass depend on its species."""
    if model is Grass and isinstance(species := given.get("species", ""), str) and species in species_table():
        return {**dict(Grass(species=species)), "species": Grass.model_fields["species"].default}
    return {name: field.default for name, field in model.model_fields.items() if not field.is_required()}


def plain(value: Any) -> Any:
    """A model or a value as TOML holds it: every kind, species and name, and each key that is not its default."""
    if isinstance(value, BaseModel):
        keys = held(value)
        known = defaults_of(type(value), keys)
        if array := next((key for key, item in keys.items() if isinstance(item, Raster)), None):
            raise InputError(
                f"{array}: is an array, which TOML cannot hold; save it as a picture or by numpy.save, "
                "and name its file"
            )
        said = {
            key: plain(item)
            for key, item in keys.items()
            if item is not None and ((key in _ALWAYS and item) or key not in known or item != known[key])
        }
        return {key: said[key] for key in sorted(said, key=lambda key: key != "kind")}
    return [plain(item) for item in value] if isinstance(value, tuple | list) else value
