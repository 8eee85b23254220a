"""Pictures with ground truth for training, drawn by worker processes: python examples/hosts/dataset.py -o sheet.png

torch.utils.data.DataLoader takes `Meadows` as it is, with multiprocessing_context="spawn". Here a pool of Python's
own does the loader's work, so this runs without PyTorch.
"""

import argparse
import multiprocessing
from pathlib import Path

import numpy as np
from PIL import Image
from shared import meadow

import greensward as gs


class Meadows:
    """A data set with the methods that PyTorch asks for: item `i` is the same whichever process draws it."""

    def __init__(self, scene, count, size, seed=0):
        self.scene, self.count, self.size, self.seed = scene, count, size, seed
        self.renderer = None

    def __getstate__(self):  # a renderer stays in its process; each worker gets one of its own
        return {**self.__dict__, "renderer": None}

    def __len__(self):
        return self.count

    def __getitem__(self, item):
        if not 0 <= item < self.count:
            raise IndexError(item)
        if self.renderer is None:  # the first item in this process
            self.renderer = gs.Renderer(self.scene, size=self.size)
        random = np.random.default_rng((self.seed, item))
        x, z = random.uniform(-100.0, 100.0, 2)
        camera = self.scene.camera.model_copy(
            update={"position_m": (x, random.uniform(1.0, 2.5), z), "target_m": (x + 3.0, 0.5, z - 5.0)}
        )
        frame = self.renderer.render(random.uniform(0.0, 60.0), camera=camera, aovs=("depth", "class"))
        picture = np.float32(frame.image.transpose(2, 0, 1) / 255.0)  # channels first
        return picture, frame.truth["class"].astype(np.int64), frame.truth["depth"]


def open_dataset(dataset):
    global opened
    opened = dataset


def draw(item):
    return opened[item]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--items", type=int, default=4)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("sheet.png"))
    chosen = parser.parse_args()
    dataset = Meadows(meadow(), chosen.items, tuple(map(int, chosen.size.split("x"))))
    spawn = multiprocessing.get_context("spawn")  # a forked process cannot use the OpenGL of its parent
    columns = []
    with spawn.Pool(chosen.workers, open_dataset, (dataset,)) as pool:
        for picture, classes, _ in pool.imap(draw, range(len(dataset))):
            shown = np.uint8(255.0 * picture.transpose(1, 2, 0) + 0.5)
            mask = np.uint8(classes == gs.SurfaceClass.GRASS) * 255
            columns.append(np.concatenate([shown, np.repeat(mask[..., None], 3, axis=2)]))
    Image.fromarray(np.concatenate(columns, axis=1)).save(chosen.out)
    print(f"{chosen.out}: {len(columns)} pictures and where each shows grass")


if __name__ == "__main__":
    main()
