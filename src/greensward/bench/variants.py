"""Techniques with settings of their own, as a benchmark compares them: `expanded-roots[storage=texture-array]`."""

import re
from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError

from greensward.scene import InputError, SceneError
from greensward.scene.load import toml_value
from greensward.scene.problems import one_of, sentences, short
from greensward.techniques import SETTINGS

_VARIANT = re.compile(r"([^\[\]]*)(?:\[(.*)\])?")


def split_names(texts: Iterable[str]) -> tuple[str, ...]:
    """Names from texts with commas between them; those within brackets belong to a name."""
    names = (name.strip() for text in texts for name in _parts(text))
    return tuple(name for name in names if name)


def _parts(text: str) -> list[str]:
    """Parts of a text between the commas outside all brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth <= 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def variant_of(name: str) -> tuple[str, dict[str, Any]]:
    """Technique and settings of `technique[key=value,key=value]`, values as TOML writes them. Raises `InputError`."""
    found = _VARIANT.fullmatch(name)
    pairs = [part.partition("=") for part in _parts(found[2])] if found and found[2] is not None else []
    if found is None or not all(key.strip() and value.strip() for key, _, value in pairs):
        raise InputError(
            "--techniques: must be a name, or name[setting=value] such as expanded-roots[storage=texture-array] "
            f"(got {short(name)})"
        )
    return found[1].strip(), {key.strip(): toml_value(value.strip()) for key, _, value in pairs}


def checked(name: str, others: Iterable[str]) -> str:
    """The name of a technique or variant, if it may be measured; `others` have no settings. Raises `InputError`."""
    technique, settings = variant_of(name)
    known = (*SETTINGS, *others)
    if technique not in known:
        raise InputError(f"--techniques: {one_of(technique, known)}")
    if technique not in SETTINGS:
        if "[" in name:
            raise InputError(f"--techniques: {technique} has no settings (got {short(name)}); leave out the brackets")
        return name
    try:
        SETTINGS[technique].model_validate(settings)
    except ValidationError as error:
        raise SceneError(sentences(error, SETTINGS[technique], lambda _: f"--techniques: {technique}")) from None
    return name
