"""Open3D on the inputs of the metrics benchmark: CPU and wall seconds, and whether its values are ours.

    python rivals.py FOLDER metrics.json

Runs itself once with one thread and once with all. One JSON object goes to stdout; a value that differs by more than
1e-6 (relative) is an error. Needs numpy and open3d.
"""

import json
import os
import subprocess
import sys
import time

RUNS = 5


def measure(folder):
    """Cheapest of several runs, in this process with the threads it was given."""
    import numpy as np
    import open3d as o3d

    def cheapest(run):
        best = [float("inf"), float("inf")]
        for _ in range(RUNS):
            cpu, wall = time.process_time(), time.perf_counter()
            value = run()
            best = [min(best[0], time.process_time() - cpu), min(best[1], time.perf_counter() - wall)]
        return {"cpu_s": best[0], "wall_s": best[1]}, value

    def load(name, kind):
        return np.fromfile(os.path.join(folder, name), kind).reshape(-1, 3)

    a, b = (
        o3d.geometry.PointCloud(o3d.utility.Vector3dVector(load(n, np.float32).astype(np.float64)))
        for n in ("a.f32", "b.f32")
    )

    def clouds():
        d, e = (np.asarray(x.compute_point_cloud_distance(y)) for x, y in ((a, b), (b, a)))
        return {
            "mean_a_to_b": d.mean(),
            "hd95_a_to_b": np.percentile(d, 95),
            "mean_b_to_a": e.mean(),
            "hd95_b_to_a": np.percentile(e, 95),
            "chamfer": d.mean() + e.mean(),
        }

    positions = o3d.core.Tensor(load("positions.f32", np.float32))
    triangles = o3d.core.Tensor(load("triangles.u32", np.uint32))
    queries = o3d.core.Tensor(load("b.f32", np.float32))
    threads = int(os.environ.get("OMP_NUM_THREADS", "0"))

    def mesh():
        scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(positions, triangles)
        d = scene.compute_distance(queries, nthreads=threads).numpy().astype(np.float64)
        return {"mean": d.mean(), "hd95": np.percentile(d, 95)}

    seconds, values = cheapest(clouds)
    mesh_seconds, mesh_values = cheapest(mesh)
    return {
        "version": o3d.__version__,
        "clouds": {**seconds, "values": values},
        "mesh": {**mesh_seconds, "values": mesh_values},
    }


def main():
    if os.environ.get("METRICS_RIVAL"):
        json.dump(measure(sys.argv[1]), sys.stdout)
        return
    found = {}
    for name, threads in (("one_thread", {"OMP_NUM_THREADS": "1"}), ("all_threads", {})):
        environment = {**os.environ, "METRICS_RIVAL": "1", **threads}
        run = subprocess.run([sys.executable, *sys.argv], env=environment, stdout=subprocess.PIPE, check=True)
        found[name] = json.loads(run.stdout)
    with open(sys.argv[2], encoding="utf-8") as file:
        ours = json.load(file)
    one, metrics = found["one_thread"], ours["clouds"]["metrics"]
    pairs = {
        "mean_a_to_b": metrics["a_to_b"]["mean_error"],
        "hd95_a_to_b": metrics["a_to_b"]["hd95"],
        "mean_b_to_a": metrics["b_to_a"]["mean_error"],
        "hd95_b_to_a": metrics["b_to_a"]["hd95"],
        "chamfer": metrics["chamfer"],
    }
    difference = max(abs(value / one["clouds"]["values"][name] - 1) for name, value in pairs.items())
    to_mesh = one["mesh"]["values"]
    mesh_difference = max(
        abs(ours["mesh"]["metrics"][name] / to_mesh[key] - 1) for name, key in (("mean_error", "mean"), ("hd95", "hd95"))
    )
    report = {
        "open3d": found,
        "clouds_relative_difference": difference,
        "mesh_relative_difference": mesh_difference,
    }
    for what in ("clouds", "mesh"):
        for threads, clock in (("one_thread", "cpu_s"), ("one_thread", "wall_s"), ("all_threads", "wall_s")):
            ratio = found[threads][what][clock] / ours[what][threads][clock]
            report[f"{what}_times_faster_{threads}_{clock[:-2]}"] = ratio
    json.dump(report, sys.stdout)
    print()
    # RaycastingScene computes in f32 from world coordinates: its own error is up to 1e-5 of so small a distance.
    if difference > 1e-6 or mesh_difference > 1e-4:
        raise SystemExit(f"the values differ: clouds {difference:.2e}, mesh {mesh_difference:.2e}")


if __name__ == "__main__":
    main()
