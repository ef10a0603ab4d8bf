"""Open3D's VoxelBlockGrid on the views of the sequence benchmark, with the poses that come with them: seconds, peak
memory, and the error of the depth that rays find on its mesh, judged as ours.

    python rivals.py FOLDER sequence.json

Depth and colours are integrated, nothing is registered. Each number of views runs in a process of its own with all
threads. The truncation is Open3D's default of 8 voxels and the weight threshold of the extraction its default; a smaller
one is tried too, and the better mesh counts. One JSON object goes to stdout. Needs numpy and open3d.
"""

import json
import os
import resource
import subprocess
import sys
import time

WIDTH, HEIGHT, FOCAL, CENTRE = 640, 480, 525.0, (319.5, 239.5)
STEP = 1e-3
VOXEL = 5e-3
TRUNCATIONS = (4.0, 8.0)
JUDGES = 10
LARGEST = 0.05


def fuse(folder, views, truncation):
    import numpy as np
    import open3d as o3d

    core, geometry = o3d.core, o3d.t.geometry
    with open(os.path.join(folder, "poses.json"), encoding="utf-8") as file:
        poses = [np.array(both["given"]) for both in json.load(file)]
    k = core.Tensor(np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1.0]]))
    cpu, wall = time.process_time(), time.perf_counter()
    grid = geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight", "color"),
        attr_dtypes=(core.float32, core.float32, core.float32),
        attr_channels=((1), (1), (3)),
        voxel_size=VOXEL,
        block_resolution=16,
        block_count=20000,
        device=core.Device("CPU:0"),
    )
    for i in range(views):
        depth = np.fromfile(os.path.join(folder, f"depth-{i}.u16"), np.uint16).reshape(HEIGHT, WIDTH, 1)
        color = np.fromfile(os.path.join(folder, f"color-{i}.rgb"), np.uint8).reshape(HEIGHT, WIDTH, 3)
        depth, color = geometry.Image(core.Tensor(depth)), geometry.Image(core.Tensor(color))
        extrinsic = core.Tensor(np.linalg.inv(poses[i]))
        scale = 1.0 / STEP
        blocks = grid.compute_unique_block_coordinates(depth, k, extrinsic, scale, 6.0, truncation)
        grid.integrate(blocks, depth, color, k, k, extrinsic, scale, 6.0, truncation)
    mesh = grid.extract_triangle_mesh()
    seconds = {"cpu_s": time.process_time() - cpu, "wall_s": time.perf_counter() - wall}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    error = judge(folder, views, mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy())
    return {**seconds, "peak_mb": peak, "error_mm": error * 1e3, "version": o3d.__version__}


def judge(folder, views, vertices, triangles):
    """As `judge` of the benchmark: every seventh measured pixel of ten views, cut at 50 mm, from their true poses."""
    import numpy as np
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(triangles.astype(np.uint32)))
    with open(os.path.join(folder, "poses.json"), encoding="utf-8") as file:
        poses = [np.array(both["true"]) for both in json.load(file)]
    pixels = np.arange(0, WIDTH * HEIGHT, 7)
    rays = np.stack([(pixels % WIDTH - CENTRE[0]) / FOCAL, (pixels // WIDTH - CENTRE[1]) / FOCAL, np.ones(len(pixels))])
    total, count = 0.0, 0
    for i in range(0, views, max(views // JUDGES, 1)):
        shot = np.fromfile(os.path.join(folder, f"depth-{i}.u16"), np.uint16)[pixels]
        truth = np.fromfile(os.path.join(folder, f"true-depth-{i}.f32"), np.float32)[pixels]
        measured = shot > 0
        directions = (poses[i][:3, :3] @ rays).T[measured]
        origins = np.broadcast_to(poses[i][:3, 3], directions.shape)
        cast = np.concatenate([origins, directions], 1).astype(np.float32)
        hit = scene.cast_rays(o3d.core.Tensor(cast))["t_hit"].numpy()
        error = np.minimum(np.abs(hit - truth[measured]), LARGEST)
        total, count = total + float(error.sum()), count + len(error)
    return total / max(count, 1)


def main():
    folder = sys.argv[1]
    if "SEQUENCE_RIVAL" in os.environ:
        views, truncation = os.environ["SEQUENCE_RIVAL"].split()
        json.dump(fuse(folder, int(views), float(truncation)), sys.stdout)
        return
    with open(sys.argv[2], encoding="utf-8") as file:
        ours = json.load(file)["runs"]
    report = {}
    for views in sorted({run["views"] for run in ours}):
        tried = []
        for truncation in TRUNCATIONS:
            environment = {**os.environ, "SEQUENCE_RIVAL": f"{views} {truncation}"}
            done = subprocess.run([sys.executable, *sys.argv], env=environment, stdout=subprocess.PIPE, check=True)
            tried.append({**json.loads(done.stdout), "truncation_voxels": truncation})
        open3d = min(tried, key=lambda run: run["error_mm"])
        given = next(run for run in ours if run["views"] == views and run["method"] == "given")
        registered = next(run for run in ours if run["views"] == views and run["method"] == "registered")
        report[str(views)] = {
            "open3d": open3d,
            "cpu_ratio": given["cpu_s"] / open3d["cpu_s"],
            "memory_ratio": given["peak_mb"] / open3d["peak_mb"],
            "error_ratio": given["error_mm"] / open3d["error_mm"],
            "error_ratio_registered": registered["error_mm"] / open3d["error_mm"],
        }
    json.dump(report, sys.stdout)
    print()


if __name__ == "__main__":
    main()
