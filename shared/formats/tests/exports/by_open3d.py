"""Reads cloud.ply and mesh.ply by Open3D and compares every column with the values that were written.

Usage: by_open3d.py FOLDER, which holds the files and expected.json: for each file its columns by name. Fails, with a line for
each, where a column is missing or holds something else. Exits with 77 where there is no Open3D.
"""

import json
import sys
from pathlib import Path

try:
    import numpy as np
    import open3d as o3d
except ImportError as error:
    print(error)
    sys.exit(77)

# Open3D gathers these into columns of several numbers.
GATHERED = {"positions": ["x", "y", "z"], "normals": ["nx", "ny", "nz"], "colors": ["red", "green", "blue"]}


def columns_of(path):
    """Every column that Open3D keeps, by the name that the file has for it."""
    found = {}
    for name, values in o3d.t.io.read_point_cloud(str(path)).point.items():
        values = values.numpy()
        for k, column in enumerate(GATHERED.get(name, [name])):
            found[column] = values[:, k]
    return found


def main():
    """Compares every file."""
    folder, faults = Path(sys.argv[1]), []
    for expected in json.loads((folder / "expected.json").read_text()):
        path = folder / expected["file"]
        found = columns_of(path)
        for name, values in expected["columns"].items():
            if name not in found:
                faults.append(f"{path.name}: no column {name}")
            elif not np.array_equal(np.asarray(found[name], dtype=np.float32), np.asarray(values, dtype=np.float32)):
                faults.append(f"{path.name}: another column {name}")
        triangles = len(o3d.io.read_triangle_mesh(str(path)).triangles) if expected["triangles"] else 0
        if triangles != expected["triangles"]:
            faults.append(f"{path.name}: {triangles} triangles of {expected['triangles']}")
        print(f"{path.name}: {len(found)} columns by Open3D {o3d.__version__}")
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
