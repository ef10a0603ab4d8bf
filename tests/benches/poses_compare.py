"""Poses of real captures judged by their pictures: ours, the robot's, and Open3D's multiway registration.

    python poses_compare.py SEMASCAN DATA FOLDER

Every BOP scene below DATA whose views have colours and robot poses is inspected by the program SEMASCAN into FOLDER. The
peers are Open3D's pairwise ICP (each view with its next five, from 12 to 6 mm, 3 mm voxels), point to plane with Tukey's
loss and coloured, each with a pose graph, from the robot's poses. Two judges, neither of which needs truth: SIFT matches
between views carried by depth and poses (mean over pairs of the median error, pixels), and `semascan evaluate
--photometric`, all poses on the same matches. One JSON object goes to stdout, a table to stderr. Needs numpy, scipy,
opencv-python-headless and open3d.
"""

import itertools
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation

# Depth that the peers use, metres: the shelf's sensor measures from 0.25 m, and beyond 0.9 m lies the room.
NEAREST, FARTHEST = 0.25, 0.9
VOXEL = 0.003
NEXT_VIEWS = 5
# Matches count where the robot or ours puts them within so many pixels: the rest are mistaken.
MISTAKEN = 15.0
FEWEST_MATCHES = 10


@dataclass
class View:
    """A view of a scene: grey picture, colours, depth in metres, camera matrix, the robot's pose (scene from camera)."""

    index: int
    colour: np.ndarray
    depth: np.ndarray
    camera: np.ndarray
    robot: np.ndarray


def scenes(data):
    """Folders of real BOP scenes with enough views; files that were made to try readers with are none."""
    for cameras in sorted(data.rglob("scene_camera.json")):
        scene = cameras.parent
        if "foreign-files" not in scene.parts and len(json.loads(cameras.read_text())) >= 3:
            yield scene


def read_scene(scene):
    views = []
    for name, camera in json.loads((scene / "scene_camera.json").read_text()).items():
        index = int(name)
        colour = cv2.imread(str(scene / f"rgb/{index:06d}.png"))
        depth = cv2.imread(str(scene / f"depth/{index:06d}.png"), cv2.IMREAD_UNCHANGED)
        if colour is None or depth is None or "cam_R_w2c" not in camera:
            raise SystemExit(f"{scene}: view {index}: no picture or no robot pose")
        camera_from_scene = np.eye(4)
        camera_from_scene[:3, :3] = np.array(camera["cam_R_w2c"]).reshape(3, 3)
        camera_from_scene[:3, 3] = np.array(camera["cam_t_w2c"]) / 1000
        metres = depth.astype(float) * camera["depth_scale"] / 1000
        matrix = np.array(camera["cam_K"]).reshape(3, 3)
        views.append(View(index, colour, metres, matrix, np.linalg.inv(camera_from_scene)))
    return views


def pose_of(record):
    rotation, pose = record["rotation"], np.eye(4)
    pose[:3, :3] = Rotation.from_quat([rotation[axis] for axis in "xyzw"]).as_matrix()
    pose[:3, 3] = record["translation"]
    return pose


def record_of(pose):
    rotation = dict(zip("xyzw", Rotation.from_matrix(pose[:3, :3]).as_quat().tolist(), strict=True))
    return {"rotation": rotation, "translation": pose[:3, 3].tolist()}


def inspected(semascan, scene, folder):
    """Our poses and the seconds that the whole inspection took."""
    begun = time.perf_counter()
    command = [semascan, "inspect", scene, "--overwrite", "--out", folder]
    subprocess.run([str(c) for c in command], check=True, stderr=subprocess.DEVNULL)
    seconds = time.perf_counter() - begun
    views = json.loads((folder / "inspection.json").read_text())["views"]
    return {v["index"]: pose_of(v["pose"]) for v in views if v["accepted"]}, seconds


def with_open3d(views, coloured):
    """Open3D's poses and the seconds that they took."""
    registration = o3d.pipelines.registration
    begun = time.perf_counter()
    clouds = []
    for view in views:
        depth = np.where((view.depth < NEAREST) | (view.depth > FARTHEST), 0, view.depth).astype(np.float32)
        picture = o3d.geometry.Image(np.ascontiguousarray(cv2.cvtColor(view.colour, cv2.COLOR_BGR2RGB)))
        image = o3d.geometry.RGBDImage.create_from_color_and_depth(
            picture, o3d.geometry.Image(depth), depth_scale=1.0, depth_trunc=1.0, convert_rgb_to_intensity=False
        )
        (height, width), k = depth.shape, view.camera
        camera = o3d.camera.PinholeCameraIntrinsic(width, height, k[0, 0], k[1, 1], k[0, 2], k[1, 2])
        cloud = o3d.geometry.PointCloud.create_from_rgbd_image(image, camera).voxel_down_sample(VOXEL)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.01, 30))
        cloud.orient_normals_towards_camera_location()
        clouds.append(cloud)
    graph = registration.PoseGraph()
    for view in views:
        graph.nodes.append(registration.PoseGraphNode(view.robot))
    criteria = registration.ICPConvergenceCriteria(1e-6, 1e-6, 40)
    for a, b in itertools.combinations(range(len(views)), 2):
        if b > a + NEXT_VIEWS:
            continue
        motion, result = np.linalg.inv(views[b].robot) @ views[a].robot, None
        try:
            for reach in (0.012, 0.006):
                if coloured:
                    estimation = registration.TransformationEstimationForColoredICP()
                    result = registration.registration_colored_icp(
                        clouds[a], clouds[b], reach, motion, estimation, criteria
                    )
                else:
                    loss = registration.TukeyLoss(k=0.004)
                    estimation = registration.TransformationEstimationPointToPlane(loss)
                    result = registration.registration_icp(clouds[a], clouds[b], reach, motion, estimation, criteria)
                motion = result.transformation
        except RuntimeError:
            # Coloured ICP raises where it finds no pairs: there is no edge.
            continue
        if result.fitness < 0.3:
            continue
        information = registration.get_information_matrix_from_point_clouds(clouds[a], clouds[b], 0.006, motion)
        graph.edges.append(registration.PoseGraphEdge(a, b, motion, information, uncertain=b > a + 1))
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(
            max_correspondence_distance=0.006, edge_prune_threshold=0.25, reference_node=0
        ),
    )
    poses = {view.index: np.array(node.pose) for view, node in zip(views, graph.nodes, strict=True)}
    return poses, time.perf_counter() - begun


def judged_by_sift(views, sets):
    """For each set of poses the mean over pairs of the median error in pixels, and the number of pairs."""
    sift = cv2.SIFT_create(3000)
    features = [sift.detectAndCompute(cv2.cvtColor(v.colour, cv2.COLOR_BGR2GRAY), None) for v in views]
    medians = {name: [] for name in sets}
    for (a, of_a), (b, of_b) in itertools.combinations(zip(views, features, strict=True), 2):
        pairs = cv2.BFMatcher().knnMatch(of_a[1], of_b[1], k=2)
        matches = [m[0] for m in pairs if len(m) == 2 and m[0].distance < 0.7 * m[1].distance]
        if len(matches) < 15:
            continue
        in_a = np.array([of_a[0][m.queryIdx].pt for m in matches])
        in_b = np.array([of_b[0][m.trainIdx].pt for m in matches])
        height, width = a.depth.shape
        z = a.depth[in_a[:, 1].round().astype(int).clip(0, height - 1), in_a[:, 0].round().astype(int).clip(0, width - 1)]
        known = z > 0.2
        k = a.camera
        x, y = (in_a[:, 0] - k[0, 2]) / k[0, 0] * z, (in_a[:, 1] - k[1, 2]) / k[1, 1] * z
        points = np.stack([x, y, z, np.ones(len(z))], 1)[known]
        errors = {}
        for name, poses in sets.items():
            carried = (np.linalg.inv(poses[b.index]) @ poses[a.index] @ points.T)[:3]
            pixels = b.camera @ carried
            errors[name] = np.linalg.norm((pixels[:2] / pixels[2]).T - in_b[known], axis=1)
        keep = np.minimum(errors["ours"], errors["kinematic"]) < MISTAKEN
        if keep.sum() >= FEWEST_MATCHES:
            for name in sets:
                medians[name].append(np.median(errors[name][keep]))
    pairs = len(medians["ours"])
    return {name: float(np.mean(m)) if m else None for name, m in medians.items()}, pairs


def judged_by_semascan(semascan, scene, ours, others):
    """What `semascan evaluate --photometric` says of our poses, the robot's and the others."""
    command = [semascan, "evaluate", "--photometric", "--json", ours, scene]
    for path in others.values():
        command += ["--poses", path]
    output = subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    report = json.loads(output.stdout)
    return dict(zip(["ours", *others, "kinematic"], [p["error"] for p in report["poses"]], strict=True)), report


def main():
    semascan, data, folder = (Path(argument) for argument in sys.argv[1:4])
    figures = {}
    for scene in scenes(data):
        views, out = read_scene(scene), folder / scene.name
        ours, seconds = inspected(semascan, scene, out)
        views = [v for v in views if v.index in ours]
        sets = {"ours": ours, "kinematic": {v.index: v.robot for v in views}}
        took, files = {"ours": seconds}, {}
        for name, coloured in (("open3d_plane", False), ("open3d_coloured", True)):
            sets[name], took[name] = with_open3d(views, coloured)
            files[name] = out / f"{name}.json"
            posed = [{"index": v.index, "accepted": True, "pose": record_of(sets[name][v.index])} for v in views]
            files[name].write_text(json.dumps({"views": posed}))
        sift, pairs = judged_by_sift(views, sets)
        own, report = judged_by_semascan(semascan, scene, out, files)
        print(f"{scene.name}: {len(views)} views; SIFT {pairs} pairs, semascan {report['pairs']}", file=sys.stderr)
        of_scene = {"views": len(views), "sift_pairs": pairs, "semascan_pairs": report["pairs"]}
        for name in sets:
            of_scene[name] = {"sift_px": sift[name], "semascan_px": own[name], "seconds": took.get(name)}
            said = [f"{v:8.2f}" if v is not None else "       -" for v in of_scene[name].values()]
            print(f"  {name:<16} sift px {said[0]}  semascan px {said[1]}  s {said[2]}", file=sys.stderr)
        figures[scene.name] = of_scene
    if not figures:
        raise SystemExit(f"{data}: holds no real scene with colours and robot poses")
    json.dump(figures, sys.stdout)


main()
