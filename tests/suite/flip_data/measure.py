"""Measures FLIP with NVIDIA's own program, for tests/suite/flip.rs.

Needs `pip install numpy flip-evaluator`. From the root of the repository, with FOLDER a new, empty folder:

    NEPHROID_FLIP_PAIRS=FOLDER cargo test --release --test flip means       # writes the pairs
    python3 tests/suite/flip_data/measure.py FOLDER > tests/suite/flip_data/nvidia.txt            # measures them, leaves whole maps in FOLDER
    NEPHROID_FLIP_PAIRS=FOLDER cargo test --release --test flip means -- --nocapture   # compares every pixel
"""

import sys
from importlib.metadata import version
from pathlib import Path

import flip_evaluator
import numpy

BY_PLACE = 32  # pixels of each map in even steps through the picture
BY_RANK = 32  # and in even steps from its least value to its greatest


def measure(folder, name, kind, width, height, pixels_per_degree):
    """The mean and the map of one pair."""
    shape = (height, width, 3)
    # The program may write to what it is given.
    pictures = [numpy.fromfile(folder / f"{name}.{which}.f32", "<f4").reshape(shape).copy() for which in ("reference", "test")]
    parameters = {"ppd": pixels_per_degree}
    flip_map, mean, _ = flip_evaluator.evaluate(*pictures, kind, inputsRGB=False, applyMagma=False, parameters=parameters)
    flip_map = numpy.asarray(flip_map, "<f4").reshape(height, width)
    flip_map.tofile(folder / f"{name}.map.f32")
    # The program's own mean is a sum of 32-bit floats; it serves as a check.
    exact = float(flip_map.astype("f8").mean())
    assert abs(exact - mean) < 1e-4, (name, exact, mean)
    return exact, flip_map


def main():
    folder = Path(sys.argv[1])
    print(f"# FLIP by flip_evaluator {version('flip-evaluator')} (NVIDIA) of the pairs of tests/suite/flip.rs.")
    print("# To make this file again: see tests/suite/flip_data/measure.py. A case is `case NAME MEAN`, then pixels as `X Y VALUE`.")
    for line in (folder / "pairs.txt").read_text().splitlines():
        name, kind, width, height, pixels_per_degree = line.split()
        width, height = int(width), int(height)
        mean, flip_map = measure(folder, name, kind, width, height, float(pixels_per_degree))
        print(f"case {name} {mean:.9f}")
        values = flip_map.ravel()
        by_place = (numpy.arange(BY_PLACE) + 0.5) * values.size / BY_PLACE
        by_rank = numpy.argsort(values, kind="stable")[numpy.linspace(0, values.size - 1, BY_RANK).astype(int)]
        for index in sorted({int(i) for i in by_place} | {int(i) for i in by_rank}):
            print(index % width, index // width, f"{values[index]:.9f}".rstrip("0").rstrip("."))


main()
