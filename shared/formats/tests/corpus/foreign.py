"""Reads the corpus by plyfile, pypcd4 and trimesh and compares with the values that its files were made of.

Usage: foreign.py FOLDER, which holds the files and expected.json. Prints how many files each reader read; fails, with a
line for each, where a file holds something else.
"""

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import trimesh
from plyfile import PlyData
from pypcd4 import PointCloud


def surface(positions, triangles):
    """The triangles by the places of their corners, each beginning with its least, sorted."""
    places = np.rint(np.asarray(positions, dtype=float) * 1000).astype(int)
    found = []
    for triangle in triangles:
        corners = [tuple(places[v]) for v in triangle]
        least = corners.index(min(corners))
        found.append(tuple(corners[least:] + corners[:least]))
    return sorted(found)


def by_plyfile(path):
    """Positions, triangles and columns of a PLY file."""
    data = PlyData.read(str(path))
    vertex = data["vertex"].data
    triangles = []
    if "face" in data:
        for polygon in data["face"].data["vertex_indices"]:
            corners = [int(v) for v in polygon]
            triangles += [[corners[0], corners[k - 1], corners[k]] for k in range(2, len(corners))]
    columns = {name: vertex[name] for name in vertex.dtype.names}
    return np.stack([vertex[axis].astype(float) for axis in "xyz"], axis=1), triangles, columns


def by_pypcd4(path):
    """Positions and columns of a PCD file."""
    data = PointCloud.from_path(path).pc_data
    columns = {name: data[name] for name in data.dtype.names}
    return np.stack([columns[axis].astype(float) for axis in "xyz"], axis=1), [], columns


def by_trimesh(path):
    """Positions and triangles of a mesh; glTF is turned so that z is up."""
    scene = trimesh.load_scene(str(path), process=False, maintain_order=True)
    positions, triangles, count = [], [], 0
    for part in scene.dump():
        positions.append(np.asarray(part.vertices, dtype=float))
        triangles += [[count + int(v) for v in face] for face in getattr(part, "faces", [])]
        count += len(part.vertices)
    positions = np.concatenate(positions)
    if path.suffix in (".glb", ".gltf"):
        positions = np.stack([positions[:, 0], -positions[:, 2], positions[:, 1]], axis=1)
    return positions, triangles, {}


READERS = {".ply": by_plyfile, ".pcd": by_pypcd4}


def fault(expected, positions, triangles, columns):
    """What is not as it was made; None if nothing."""
    if expected["triangles"]:
        if surface(positions, triangles) != surface(expected["positions"], expected["triangles"]):
            return "another surface"
    elif len(triangles) or np.shape(positions) != np.shape(expected["positions"]):
        return f"{len(positions)} points, {len(triangles)} triangles"
    elif not np.allclose(positions, expected["positions"], rtol=0, atol=1e-5):
        return "other points"
    for name, values in expected["columns"].items():
        if name not in columns or not np.allclose(np.asarray(columns[name], dtype=float), values, rtol=1e-6, atol=1e-6):
            return f"another column {name}"
    return None


def main():
    """Reads every file."""
    folder = Path(sys.argv[1])
    read, faults = Counter(), []
    for expected in json.loads((folder / "expected.json").read_text()):
        path = folder / expected["file"]
        reader = READERS.get(path.suffix, by_trimesh)
        read[reader.__name__] += 1
        try:
            found = fault(expected, *reader(path))
        except Exception as error:  # noqa: BLE001 (a reader may fail in any way; which file it was is what counts)
            found = f"{type(error).__name__}: {error}"
        if found:
            faults.append(f"{path.name}: {reader.__name__}: {found}")
    print(", ".join(f"{count} files {name.replace('_', ' ')}" for name, count in read.items()))
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
