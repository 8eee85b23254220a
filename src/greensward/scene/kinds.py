"""Models that a field may hold, and the kinds by which a scene file chooses among them."""

from typing import Any, get_args

from pydantic import BaseModel


def models_in(annotation: Any) -> tuple[type[BaseModel], ...]:
    """The models that a field of this type may hold; several where `kind` chooses among them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    return tuple(model for part in get_args(annotation) for model in models_in(part))


def kind_of(model: type[BaseModel]) -> str | None:
    """The `kind` by which a scene file chooses this model, where it does."""
    kinds = get_args(model.model_fields["kind"].annotation) if "kind" in model.model_fields else ()
    return kinds[0] if len(kinds) == 1 else None
