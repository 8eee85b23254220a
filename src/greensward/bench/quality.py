"""Quality against cost: each technique's image of a scene, compared with a clean one of the same scene."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.bench.protocol import Pace, measure
from greensward.bench.workloads import Scale, drawn_by, toy
from greensward.library import load
from greensward.renderer import Renderer
from greensward.scene import GreenswardError

SIZE = (640, 360)
REFERENCE_SAMPLES = 64
SAMPLES: dict[Scale, tuple[int, ...]] = {"quick": (1, 4), "full": (1, 4, 16), "toy": (1,)}
WORKLOAD = "quality"
SCENE = "meadow"
INSTALL = 'pip install "greensward[bench]"'
_REFERENCE = {"error_px": 0.1, "max_level": 32}
Picture = npt.NDArray[np.uint8]


def flip_distance() -> Callable[[Picture, Picture], float]:
    """The mean FLIP difference of two pictures (Andersson et al. 2020). Raises `GreenswardError` if it is missing."""
    try:
        from flip_evaluator import evaluate  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ImportError:
        raise GreenswardError(f"FLIP distances need flip-evaluator: {INSTALL}") from None

    def distance(reference: Picture, image: Picture) -> float:
        pair = [np.ascontiguousarray(each, np.float32) / np.float32(255.0) for each in (reference, image)]
        return float(evaluate(*pair, "LDR")[1])

    return distance


def compare_techniques(
    techniques: Sequence[str], at: Pace, scale: Scale, device: str, keep: Callable[[dict[str, Any], Picture], None]
) -> str:
    """Measure every technique's picture of the meadow, by samples for each pixel, the reference first.

    `keep` receives each row and picture at once. Returns why there are no distances, if so. Raises `GreenswardError`.
    """
    scene, size, reference_samples, samples = load(SCENE), SIZE, REFERENCE_SAMPLES, SAMPLES[scale]
    if scale == "toy":
        scene, size, reference_samples = toy(scene), (48, 27), 4
    exact = drawn_by("visibility-buffer", scene, _REFERENCE)
    with Renderer(exact, size=size, samples=reference_samples, device=device) as renderer:
        reference = renderer.render().image
    distance, missing = None, ""
    try:
        distance = flip_distance()
    except GreenswardError as error:
        missing = str(error)
    keep({}, reference)
    for technique in techniques:
        drawn = drawn_by(technique, scene, {})
        for count in samples:
            with Renderer(drawn, size=size, samples=count, device=device) as renderer:
                image = renderer.render().image
                measured = measure(renderer, drawn.camera, size, at)
            row = {
                "workload": WORKLOAD,
                "technique": technique,
                "case": f"{SCENE}, {count} sample{'s' * (count > 1)}",
            }
            flip = round(distance(reference, image), 5) if distance else None
            keep({**row, "width": size[0], "height": size[1], **measured, "samples": count, "flip": flip}, image)
    return missing
