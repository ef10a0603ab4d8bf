"""Open3D's VoxelBlockGrid on the views of the mesh benchmark: seconds to integrate and to extract, and the error of both
meshes to the true surface, measured by the same code.

    python rivals.py FOLDER mesh.json

Runs itself once with one thread and once with all. Depth alone is integrated (no colours, no labels). The truncation is
the one of several with the least error; the weight threshold of the extraction is Open3D's default. The error of a mesh
is the mean distance of its surface (triangle centres, weighted by area) from the true surface; coverage is the share of
the true surface that either mesh comes within 1 mm of that this mesh does. One JSON object goes to stdout. Needs numpy
and open3d.
"""

import json
import os
import subprocess
import sys
import time

RUNS = 3
VOXEL = 0.0005
# In voxels; Open3D's default is 8.
TRUNCATIONS = (3.0, 4.0, 6.0, 8.0)


def load(folder, name, kind):
    import numpy as np

    return np.fromfile(os.path.join(folder, name), kind).reshape(-1, 3)


def fuse(folder, truncation):
    """Seconds of both steps, cheapest of several runs, and the mesh."""
    import numpy as np
    import open3d as o3d

    core, geometry = o3d.core, o3d.t.geometry
    device = core.Device("CPU:0")
    with open(os.path.join(folder, "cameras.json"), encoding="utf-8") as file:
        cameras = json.load(file)
    views = []
    for i, camera in enumerate(cameras):
        depth = np.fromfile(os.path.join(folder, f"depth-{i}.f32"), np.float32)
        depth = depth.reshape(camera["height"], camera["width"], 1)
        k = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
        pose = np.array(camera["camera_from_table"])
        views.append((geometry.Image(core.Tensor(depth)), core.Tensor(k), core.Tensor(pose)))
    best = {"integrate": [float("inf")] * 2, "extract": [float("inf")] * 2}

    def timed(step, run):
        cpu, wall = time.process_time(), time.perf_counter()
        result = run()
        seconds = [time.process_time() - cpu, time.perf_counter() - wall]
        best[step] = [min(a, b) for a, b in zip(best[step], seconds)]
        return result

    def integrate():
        grid = geometry.VoxelBlockGrid(
            attr_names=("tsdf", "weight"),
            attr_dtypes=(core.float32, core.float32),
            attr_channels=((1), (1)),
            voxel_size=VOXEL,
            block_resolution=16,
            block_count=20000,
            device=device,
        )
        for depth, k, pose in views:
            blocks = grid.compute_unique_block_coordinates(depth, k, pose, 1.0, 10.0, truncation)
            grid.integrate(blocks, depth, k, pose, 1.0, 10.0, truncation)
        return grid

    for _ in range(RUNS):
        grid = timed("integrate", integrate)
        mesh = timed("extract", grid.extract_triangle_mesh)
    vertices = mesh.vertex.positions.numpy().astype(np.float32)
    triangles = mesh.triangle.indices.numpy().astype(np.uint32)
    seconds = {step: {"cpu_s": cpu, "wall_s": wall} for step, (cpu, wall) in best.items()}
    return seconds, vertices, triangles


def scene_of(vertices, triangles):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(vertices), o3d.core.Tensor(triangles))
    return scene


def distances(scene, points):
    import numpy as np
    import open3d as o3d

    return scene.compute_distance(o3d.core.Tensor(np.ascontiguousarray(points, np.float32))).numpy()


def area_and_centres(vertices, triangles):
    import numpy as np

    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), (a + b + c) / 3


def errors(truth, vertices, triangles):
    import numpy as np

    area, centres = area_and_centres(vertices, triangles)
    d = distances(truth, centres) * 1e3
    order = np.argsort(d)
    share = np.cumsum(area[order]) / area.sum()
    return {
        "mean_error_mm": float((d * area).sum() / area.sum()),
        "hd95_mm": float(d[order][np.searchsorted(share, 0.95)]),
        "vertices_mean_error_mm": float(distances(truth, vertices).mean() * 1e3),
        "area_cm2": float(area.sum() * 1e4),
        "triangles": len(triangles),
    }


def main():
    folder = sys.argv[1]
    if os.environ.get("MESH_RIVAL"):
        import numpy as np
        import open3d as o3d

        truncation = float(os.environ["MESH_RIVAL"])
        seconds, vertices, triangles = fuse(folder, truncation)
        vertices.tofile(os.path.join(folder, "rival-vertices.f32"))
        triangles.astype(np.uint32).tofile(os.path.join(folder, "rival-triangles.u32"))
        json.dump({"version": o3d.__version__, "seconds": seconds}, sys.stdout)
        return

    def run(truncation, threads):
        environment = {**os.environ, "MESH_RIVAL": str(truncation), **threads}
        done = subprocess.run([sys.executable, *sys.argv], env=environment, stdout=subprocess.PIPE, check=True)
        return json.loads(done.stdout)

    import numpy as np

    truth_vertices, truth_triangles = load(folder, "truth-vertices.f32", np.float32), load(folder, "truth-triangles.u32", np.uint32)
    truth = scene_of(truth_vertices, truth_triangles)
    tried = {}
    for truncation in TRUNCATIONS:
        done = run(truncation, {"OMP_NUM_THREADS": "1"})
        mesh = load(folder, "rival-vertices.f32", np.float32), load(folder, "rival-triangles.u32", np.uint32)
        tried[truncation] = done, mesh, errors(truth, *mesh)
    best = min(TRUNCATIONS, key=lambda t: tried[t][2]["mean_error_mm"])
    one, mesh, error = tried[best]
    several = run(best, {})
    ours_mesh = load(folder, "mesh-vertices.f32", np.float32), load(folder, "mesh-triangles.u32", np.uint32)
    ours_error = errors(truth, *ours_mesh)
    # The true surface that was seen at all: what either mesh comes near.
    area, centres = area_and_centres(truth_vertices, truth_triangles)
    near = [distances(scene_of(*m), centres) < 0.001 for m in (ours_mesh, mesh)]
    seen = area[near[0] | near[1]].sum()
    ours_error["coverage"], error["coverage"] = (float(area[n].sum() / seen) for n in near)
    with open(sys.argv[2], encoding="utf-8") as file:
        ours = json.load(file)
    total = lambda run, clock: sum(step[clock] for step in run["seconds"].values())
    report = {
        "open3d": {
            "version": one["version"],
            "truncation_voxels": best,
            "one_thread": {**one["seconds"], "cpu_s": total(one, "cpu_s"), "wall_s": total(one, "wall_s")},
            "all_threads": {**several["seconds"], "cpu_s": total(several, "cpu_s"), "wall_s": total(several, "wall_s")},
            "error": error,
            "error_by_truncation_mm": {str(t): tried[t][2]["mean_error_mm"] for t in TRUNCATIONS},
            "cpu_s_by_truncation": {str(t): total(tried[t][0], "cpu_s") for t in TRUNCATIONS},
        },
        "ours": ours_error,
        "times_less_cpu": total(one, "cpu_s") / ours["one_thread"]["cpu_s"],
        "times_less_wall_all_threads": total(several, "wall_s") / ours["all_threads"]["wall_s"],
        "error_ratio": ours_error["mean_error_mm"] / error["mean_error_mm"],
    }
    json.dump(report, sys.stdout)
    print()


if __name__ == "__main__":
    main()
