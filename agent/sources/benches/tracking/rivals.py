"""The peers of the tracker, on the same files: Open3D's dense SLAM and its odometry from frame to frame.

`rivals.py FOLDER NAME.json`: FOLDER/sequence is the TUM RGB-D folder that the bench left. Prints one JSON object: absolute
trajectory error (root mean square after the best rigid motion), error over one second, milliseconds a frame (wall and
processor). A trajectory that a peer did not finish is reported by how far it came.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation

UNITS = 5000.0
FARTHEST = 3.0
RATE = 30


def sequence(folder):
    """Pictures, depth pictures and true poses, in order."""
    names = [line.split()[1] for line in (folder / "rgb.txt").read_text().splitlines() if not line.startswith("#")]
    depths = [line.split()[1] for line in (folder / "depth.txt").read_text().splitlines() if not line.startswith("#")]
    truth = np.loadtxt(folder / "groundtruth.txt")
    poses = np.tile(np.eye(4), (len(truth), 1, 1))
    poses[:, :3, 3] = truth[:, 1:4]
    poses[:, :3, :3] = Rotation.from_quat(truth[:, 4:8]).as_matrix()
    assert len(names) == len(depths) == len(poses), "one pose and one depth picture a picture"
    return [folder / n for n in names], [folder / d for d in depths], poses


def absolute_error(found, truth):
    """Root mean square distance of the cameras after the best rigid motion, metres."""
    p, q = found[:, :3, 3], truth[:, :3, 3]
    p0, q0 = p.mean(0), q.mean(0)
    u, _, vt = np.linalg.svd((p - p0).T @ (q - q0))
    turn = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return float(np.sqrt((np.linalg.norm((p - p0) @ turn.T - (q - q0), axis=1) ** 2).mean()))


def error_over_a_second(found, truth):
    """Root mean square of the translation's error over RATE frames, metres."""
    errors = []
    for i in range(len(found) - RATE):
        a = np.linalg.inv(found[i]) @ found[i + RATE]
        b = np.linalg.inv(truth[i]) @ truth[i + RATE]
        errors.append(np.linalg.norm((np.linalg.inv(b) @ a)[:3, 3]))
    return float(np.sqrt(np.square(errors).mean()))


def figures(found, truth, wall, processor):
    """What is reported of a trajectory."""
    frames = len(truth)
    return {
        "ate_mm": 1e3 * absolute_error(found, truth),
        "rpe_1s_mm": 1e3 * error_over_a_second(found, truth),
        "wall_ms": 1e3 * wall / frames,
        "processor_ms": 1e3 * processor / frames,
    }


def progress(frame):
    """Says how far a peer has come."""
    if frame % 100 == 0:
        print(f"   frame {frame}", file=sys.stderr, flush=True)


def intrinsics(folder):
    """Focal lengths and principal point of the sequence, pixels."""
    m = json.loads((folder / "camera_intrinsic.json").read_text())
    k = m["intrinsic_matrix"]
    return m["width"], m["height"], k[0], k[4], k[6], k[7]


def dense_slam(folder, names, depths, truth):
    """Open3D's dense SLAM (t.pipelines.slam) with the settings of its example."""
    _, _, fx, fy, cx, cy = intrinsics(folder)
    camera = o3d.core.Tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], o3d.core.Dtype.Float64)
    device = o3d.core.Device("CPU:0")
    pose = o3d.core.Tensor(np.eye(4))
    model = o3d.t.pipelines.slam.Model(0.0058, 16, 40000, pose, device)
    reference = o3d.t.io.read_image(str(depths[0]))
    seen = o3d.t.pipelines.slam.Frame(reference.rows, reference.columns, camera, device)
    shown = o3d.t.pipelines.slam.Frame(reference.rows, reference.columns, camera, device)
    found, wall, processor, lost = [], 0.0, 0.0, 0
    for i, (name, depth) in enumerate(zip(names, depths)):
        picture, measured = o3d.t.io.read_image(str(name)).to(device), o3d.t.io.read_image(str(depth)).to(device)
        begun, used = time.perf_counter(), time.process_time()
        seen.set_data_from_image("depth", measured)
        seen.set_data_from_image("color", picture)
        if i > 0:
            try:
                result = model.track_frame_to_model(seen, shown, UNITS, FARTHEST, 0.07)
                pose = pose @ result.transformation
            except RuntimeError:
                lost += 1
        model.update_frame_pose(i, pose)
        model.integrate(seen, UNITS, FARTHEST, 8.0)
        model.synthesize_model_frame(shown, UNITS, 0.1, FARTHEST, 8.0, False)
        wall += time.perf_counter() - begun
        processor += time.process_time() - used
        found.append(pose.cpu().numpy())
        progress(i)
    return {**figures(np.array(found), truth, wall, processor), "not_tracked": lost}


def frame_to_frame(folder, names, depths, truth):
    """Open3D's RGB-D odometry (hybrid of picture and surface) from each frame to the next."""
    width, height, fx, fy, cx, cy = intrinsics(folder)
    camera = o3d.camera.PinholeCameraIntrinsic(width, height, fx, fy, cx, cy)
    option = o3d.pipelines.odometry.OdometryOption()
    jacobian = o3d.pipelines.odometry.RGBDOdometryJacobianFromHybridTerm()
    pose, last = np.eye(4), None
    found, wall, processor, lost = [], 0.0, 0.0, 0
    for name, depth in zip(names, depths):
        picture, measured = o3d.io.read_image(str(name)), o3d.io.read_image(str(depth))
        begun, used = time.perf_counter(), time.process_time()
        frame = o3d.geometry.RGBDImage.create_from_color_and_depth(picture, measured, UNITS, FARTHEST)
        if last is not None:
            ok, step, _ = o3d.pipelines.odometry.compute_rgbd_odometry(
                frame, last, camera, np.eye(4), jacobian, option
            )
            lost += not ok
            pose = pose @ (step if ok else np.eye(4))
        last = frame
        wall += time.perf_counter() - begun
        processor += time.process_time() - used
        found.append(pose)
        progress(len(found) - 1)
    return {**figures(np.array(found), truth, wall, processor), "not_tracked": lost}


def main():
    """Runs both peers."""
    folder = Path(sys.argv[1]) / "sequence"
    names, depths, truth = sequence(folder)
    print("Open3D: odometry from frame to frame", file=sys.stderr)
    result = {"frame_to_frame": frame_to_frame(folder, names, depths, truth)}
    print(f"   {result['frame_to_frame']}\nOpen3D: dense SLAM", file=sys.stderr)
    result["dense_slam"] = dense_slam(folder, names, depths, truth)
    print(f"   {result['dense_slam']}", file=sys.stderr)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
