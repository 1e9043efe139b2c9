"""Left ventricles by formulas, as OFF files and their table: python3 ventricles.py FOLDER

Eight subjects at the end of diastole and systole, in millimetres: four that eject 60 % of their volume, and four round
ones that eject a third.
"""

import pathlib
import sys

import numpy as np

ROWS, COLUMNS = 13, 20


def ventricle(rng, width, length, roundness):
    """A closed bag with a flat lid, its wall a little uneven: vertices (n, 3) and faces (m, 3)."""
    theta = np.linspace(0, np.pi, ROWS + 2)[1:-1, None]
    phi = 2 * np.pi * np.arange(COLUMNS)[None] / COLUMNS
    bumps = sum(a * np.cos(k * phi + b) for k, (a, b) in enumerate(zip(0.03 * rng.standard_normal(3), rng.uniform(0, 6, 3)), 1))
    ring = width * np.sin(theta) ** roundness * (1 + bumps * np.sin(theta) ** 2)
    height = length * np.where(np.cos(theta) > 0.3, 0.3 + 0.2 * (np.cos(theta) - 0.3), np.cos(theta))
    wall = np.stack([ring * np.cos(phi), ring * np.sin(phi), np.broadcast_to(height, ring.shape)], axis=2)
    points = np.concatenate([[[0, 0, length * 0.44]], wall.reshape(-1, 3), [[0, 0, -length]]])
    at = lambda i, j: 1 + i * COLUMNS + j % COLUMNS  # noqa: E731
    last = len(points) - 1
    faces = [(0, at(0, j), at(0, j + 1)) for j in range(COLUMNS)]
    faces += [(last, at(ROWS - 1, j + 1), at(ROWS - 1, j)) for j in range(COLUMNS)]
    for i in range(ROWS - 1):
        for j in range(COLUMNS):
            faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    return points, faces


def main(folder):
    rng = np.random.default_rng(1)
    rows = ["file,label,subject,time,age"]
    for k in range(8):
        ill = k >= 4
        width, length = rng.normal(30 if ill else 24, 1), rng.normal(72, 2)
        for time in (0, 1):
            narrow, short = ((0.86, 0.9) if ill else (0.68, 0.86)) if time else (1, 1)
            seed = np.random.default_rng(k)  # the same bumps at both times
            points, faces = ventricle(seed, width * narrow, length * short, 0.8 if ill else 0.95)
            name = f"heart{k + 1}_{('ED', 'ES')[time]}.off"
            lines = [f"OFF\n{len(points)} {len(faces)} 0"]
            lines += ["{:.4f} {:.4f} {:.4f}".format(*point) for point in points]
            lines += ["3 {} {} {}".format(*face) for face in faces]
            (folder / name).write_text("\n".join(lines) + "\n")
            rows.append(f"{name},{'dilated' if ill else 'healthy'},heart{k + 1},{time},{50 + 3 * k}")
    (folder / "labels.csv").write_text("\n".join(rows) + "\n")


main(pathlib.Path(sys.argv[1]))
