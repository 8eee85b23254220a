"""Base colours of the materials of a glTF file."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from greensward.io.accessors import Accessors, bytes_at
from greensward.io.parts import Floats, Material, Pixels, Wrap
from greensward.io.rasters import rgba_from
from greensward.scene.errors import InputError

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
Table = dict[str, Any]


def materials_of(path: Path, tree: Table, accessors: Accessors) -> list[Material]:
    """The materials of a file by number. Raises `InputError` for a picture that cannot be read."""
    pictures: dict[int, Pixels] = {}
    found = []
    for said in tree.get("materials", []):
        base, texture = said.get("pbrMetallicRoughness", {}), _base_texture(said)
        picture, wrap = None, _wrap(tree, texture)
        if texture:
            number = _image(tree["textures"][texture["index"]])
            if number not in pictures:
                pictures[number] = _picture(path, tree["images"][number], number, accessors)
            picture = pictures[number]
        red, green, blue, alpha = np.clip(base.get("baseColorFactor", [1.0] * 4), 0.0, 1.0).tolist()
        mode = said.get("alphaMode", "OPAQUE")
        cutoff = {"OPAQUE": 0.0, "BLEND": 0.5}.get(mode, said.get("alphaCutoff", 0.5))
        found.append(Material((red, green, blue, alpha), picture, cutoff, wrap))
    return found


def uses_uv(material: Table) -> int:
    """Number of the texture coordinates that lay a material's base colour out."""
    texture = _base_texture(material)
    number: int = (texture | _transform(texture)).get("texCoord", 0)
    return number


def texture_transform(material: Table, uv: Floats) -> Floats:
    """Texture coordinates (n, 2) as a material moves, turns and scales them (KHR_texture_transform)."""
    said = _transform(_base_texture(material))
    turn = said.get("rotation", 0.0)
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    result: Floats = (uv * said.get("scale", [1.0, 1.0])) @ turned + said.get("offset", [0.0, 0.0])
    return result


def _base_texture(material: Table) -> Table:
    texture: Table = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
    return texture


def _transform(texture: Table) -> Table:
    said: Table = texture.get("extensions", {}).get("KHR_texture_transform", {})
    return said


def _wrap(tree: Table, texture: Table) -> tuple[Wrap, Wrap]:
    sampler = tree["textures"][texture["index"]].get("sampler") if texture else None
    said = {} if sampler is None else tree["samplers"][sampler]
    return _WRAPS[said.get("wrapS", 10497)], _WRAPS[said.get("wrapT", 10497)]


def _image(texture: Table) -> int:
    """Number of the image of a texture, its WebP where it has one."""
    webp = texture.get("extensions", {}).get("EXT_texture_webp", texture)
    return int(webp["source"])


def _picture(path: Path, said: Table, number: int, accessors: Accessors) -> Pixels:
    label = f"{path}: image {said.get('uri', number) if len(said.get('uri', '')) < 100 else number}"
    try:
        data = accessors.bytes_of(said["bufferView"]) if "bufferView" in said else bytes_at(path, said["uri"])
    except InputError as error:
        raise InputError(f"{error}, or set the object's colour") from None
    return rgba_from(label, io.BytesIO(data))
