"""Reading, splitting and augmenting."""

import json
import shutil
import threading

import cv2
import numpy as np
import pytest
from conftest import CLASSES, VIEWS, draw_view, write_recipe, write_set

from semascan_training.augment import View, augment, draw_motion, move
from semascan_training.dataset import composition, open_samples, split_by_part
from semascan_training.dataset.cache import cached
from semascan_training.dataset.samples import IGNORE
from semascan_training.dataset.synth import window_around
from semascan_training.errors import TrainingError
from semascan_training.recipe import read_recipe


def test_the_synth_layout_is_read(tmp_path, data):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    samples = open_samples(data, recipe)
    assert len(samples) == 10 * VIEWS and samples.classes == CLASSES
    rgb, depth, labels, _ = draw_view(np.random.default_rng(3))
    assert np.array_equal(samples.rgb[0], rgb)
    assert np.array_equal(samples.depth[0], depth)
    assert np.array_equal(samples.labels[0], labels)
    assert np.array_equal(samples.instances[0] > 0, labels > 0)
    defect = read_recipe(write_recipe(tmp_path / "d.toml", "u-net", "defect", ["red", "green", "blue"]))
    assert open_samples(data, defect).classes == ["none", "corrosion", "wear"]


def test_of_trainings_that_begin_together_one_decodes(tmp_path):
    begun, may_end, fills = threading.Event(), threading.Event(), []

    def fill(arrays):
        fills.append(None)
        begun.set()
        may_end.wait()
        arrays["numbers"][:] = 7

    def read():
        read_by.append(cached(tmp_path, {"set": 1}, {"numbers": ((3,), "u1")}, fill)["numbers"].tolist())

    read_by = []
    first, second = threading.Thread(target=read), threading.Thread(target=read)
    first.start()
    begun.wait()
    second.start()
    second.join(0.2)  # without a lock it decodes, too
    may_end.set()
    first.join()
    second.join()
    assert (read_by, len(fills)) == ([[7, 7, 7]] * 2, 1)


def test_pixels_of_which_nothing_is_known_are_read_where_the_set_says_so(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    (folder := tmp_path / "set").mkdir()
    write_set(folder, parts=10)
    path = folder / "000004" / "labels" / "000001.png"
    labels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    labels[:10] = IGNORE
    cv2.imwrite(str(path), labels)
    with pytest.raises(TrainingError, match="class 255 of 3"):
        open_samples(folder, recipe)
    index = json.loads((folder / "dataset.json").read_text())
    (folder / "dataset.json").write_text(json.dumps(index | {"ignore": IGNORE}))
    row = 4 * VIEWS + 1
    samples = open_samples(folder, recipe)
    assert samples.classes == CLASSES and np.array_equal(samples.labels[row], labels)
    labels[20, 20] = 7
    cv2.imwrite(str(path), labels)
    shutil.rmtree(folder / ".training-cache")
    with pytest.raises(TrainingError, match="class 7 of 3"):
        open_samples(folder, recipe)
    (folder / "dataset.json").write_text(json.dumps(index | {"ignore": 254}))
    with pytest.raises(TrainingError, match="ignore is 254"):
        open_samples(folder, recipe)


def test_no_part_is_on_two_sides():
    parts = [f"{p:06}" for p in range(100) for _ in range(3)]
    split = split_by_part(parts, 7)
    sides = [set(split.train), set(split.validation), set(split.test)]
    assert [len(side) for side in sides] == [80, 10, 10]
    assert len(set.union(*sides)) == 100
    rows = [set(split.rows(parts, side).tolist()) for side in ("train", "validation", "test")]
    assert len(set.union(*rows)) == 300 == sum(map(len, rows))
    assert split == split_by_part(parts[::-1], 7) != split_by_part(parts, 8)


def test_a_part_keeps_its_side_when_the_data_grow():
    parts = [f"{p:06}" for p in range(60)]
    before, after = split_by_part(parts[:25], 1), split_by_part(parts, 1)
    assert set(before.test) < set(after.test) and set(before.validation) < set(after.validation)


def test_parts_with_names_keep_their_side_whatever_else_there_is():
    names = [f"starter motor {k}" for k in range(100)]
    split = split_by_part(names, 1)
    assert {len(split.test), len(split.validation)} <= set(range(3, 20))
    side = {name: kind for kind in ("train", "validation", "test") for name in getattr(split, kind)}
    some = split_by_part(names[7:60], 1)
    assert all(side[name] == kind for kind in ("train", "validation", "test") for name in getattr(some, kind))


def test_a_small_set_trains_and_validates_where_no_test_is_asked_for():
    for names in (["a", "b"], [f"motor {k}" for k in range(5)], ["000000", "000001"]):
        split = split_by_part(names, 1, 0)
        assert split.train and split.validation and not split.test
        assert sorted(split.train + split.validation) == names
    for names, tests in ((["a"], 0), (["a", "b", "c"], 1)):
        with pytest.raises(TrainingError, match="test_parts = 0"):
            split_by_part(names, 1, tests)
    split = split_by_part([f"motor {k}" for k in range(10)], 3)
    assert split.train and split.validation and split.test


def test_two_inspections_of_one_part_are_one_part(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    (folder := tmp_path / "set").mkdir()
    write_set(folder, parts=3)
    index = json.loads((folder / "dataset.json").read_text())
    names = {"000000": "motor 8", "000001": "motor 9", "000002": "motor 8"}
    (folder / "dataset.json").write_text(json.dumps(index | {"parts": names}))
    samples = open_samples(folder, recipe)
    assert samples.parts == [names[f"{scene:06}"] for scene in range(3) for _ in range(VIEWS)]
    (folder / "dataset.json").write_text(json.dumps(index | {"parts": {"000000": 4}}))
    with pytest.raises(TrainingError, match="parts"):
        open_samples(folder, recipe)


def test_a_window_shows_the_part(tmp_path):
    (folder := tmp_path / "set").mkdir()
    write_set(folder, parts=2)
    whole = open_samples(folder, read_recipe(write_recipe(tmp_path / "whole.toml")))
    narrow = {"window": [64, 32]}
    samples = open_samples(folder, read_recipe(write_recipe(tmp_path / "r.toml", data=narrow)))
    assert samples.labels.shape == (2 * VIEWS, 32, 64) and samples.rgb.shape == (2 * VIEWS, 32, 64, 3)
    for row in range(len(samples)):
        labels = whole.labels[row]
        seen = window_around(labels, 32, 64)
        for plane in ("rgb", "depth", "labels", "instances"):
            assert np.array_equal(getattr(samples, plane)[row], getattr(whole, plane)[row][seen])
    labels = np.full((100, 200), IGNORE, np.uint8)
    labels[80:90, 10:30] = 2
    assert window_around(labels, 32, 64) == (slice(68, 100), slice(0, 64))
    assert window_around(np.zeros((100, 200), np.uint8), 32, 64) == (slice(34, 66), slice(68, 132))
    with pytest.raises(TrainingError, match="does not fit"):
        open_samples(folder, read_recipe(write_recipe(tmp_path / "r.toml", data={"window": [128, 64]})))
    with pytest.raises(TrainingError, match="multiples of 32"):
        read_recipe(write_recipe(tmp_path / "r.toml", data={"window": [100, 64]}))


def test_members_differ_in_their_parts_but_stay_in_the_training_side():
    train = [f"{p:06}" for p in range(40)]
    for kind in ("bootstrap", "subset"):
        members = [composition(train, kind, 1, member) for member in range(5)]
        assert all(set(member) < set(train) for member in members)
        assert len({tuple(member) for member in members}) == 5
    assert composition(train, "all", 1, 0) == train


def test_half_of_the_images_stay_as_they_are():
    rng = np.random.default_rng(0)
    same = 0
    for i in range(200):
        view = View(*draw_view(rng)[:3], np.zeros((64, 96), np.uint8))
        same += augment(view, np.random.default_rng(i), 0.5) is view
    assert 75 < same < 125


def test_geometry_moves_all_planes_alike():
    rng = np.random.default_rng(0)
    rgb, _, labels, _ = draw_view(rng)
    rgb = np.repeat((labels * 100)[..., None], 3, 2)
    depth = (4000 + 500 * labels.astype(int)).astype(np.uint16)
    for i in range(20):
        matrix, zoom = draw_motion(np.random.default_rng(i), *labels.shape)
        moved = move(View(rgb, depth, labels, labels), matrix, zoom)
        seen = moved.labels != IGNORE
        # Colour is interpolated, labels are not: they may differ along the outlines only.
        agree = np.abs(moved.rgb[..., 0] / 100.0 - moved.labels)[seen] < 0.5
        assert agree.mean() > 0.97
        assert np.array_equal(moved.instances[seen], moved.labels[seen])
        assert np.all(moved.depth[~seen] == 0)


def test_a_zoom_brings_the_part_nearer_and_keeps_its_relief():
    labels = np.ones((64, 96), np.uint8)
    depth = np.full((64, 96), 5000, np.uint16)
    depth[:, 48:] = 5100
    matrix = np.array([[1.25, 0, -12.0], [0, 1.25, -8.0]])
    moved = move(View(np.zeros((64, 96, 3), np.uint8), depth, labels, labels), matrix, 1.25)
    near, far = moved.depth[32, 10], moved.depth[32, 90]
    assert int(far) - int(near) == 100
    assert abs(int(near) - 5000 / 1.25) < 25


def test_decoding_in_threads_gives_the_same(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    read = []
    for threads in (1, 3):
        (folder := tmp_path / f"{threads}").mkdir()
        write_set(folder, parts=10)
        read.append(open_samples(folder, recipe, threads))
    for plane in ("rgb", "depth", "labels", "instances"):
        assert np.array_equal(getattr(read[0], plane), getattr(read[1], plane))
    (tmp_path / "3" / "000007" / "depth" / "000002.png").write_bytes(b"broken")
    shutil.rmtree(tmp_path / "3" / ".training-cache")
    with pytest.raises(TrainingError, match=r"000007/depth/000002\.png"):
        open_samples(tmp_path / "3", recipe, 3)


def test_labelme_files_name_the_part_or_a_pattern_does(tmp_path):
    cv2.imwrite(str(tmp_path / "000003_000001.png"), np.full((256, 320, 3), 90, np.uint8))
    square = [[10, 20], [110, 20], [110, 70], [10, 70]]
    shapes = [{"label": "gear", "points": square, "shape_type": "polygon"}]
    table = {"imagePath": "000003_000001.png", "shapes": shapes}
    number = "^(\\d+)_"
    for part, pattern, expected in (
        (None, "", "000003_000001"),
        (None, number, "000003"),
        ("motor 8", "", "motor 8"),
        ("motor 8", number, "000003"),
    ):
        named = table if part is None else table | {"part": part}
        (tmp_path / "000003_000001.json").write_text(json.dumps(named))
        data = {"part_pattern": pattern}
        recipe = write_recipe(tmp_path / "r.toml", "u-net", "semantic", ["red", "green", "blue"], data=data)
        assert open_samples(tmp_path, read_recipe(recipe)).parts == [expected]


def test_labelme_polygons_become_masks(tmp_path):
    (tmp_path / "images").mkdir()
    (tmp_path / "labels").mkdir()
    for part in range(10):
        cv2.imwrite(str(tmp_path / "images" / f"{part}.png"), np.full((300, 500, 3), 90, np.uint8))
        square = [[10, 20], [110, 20], [110, 70], [10, 70]]
        shapes = [{"label": "Pitting", "points": square, "shape_type": "polygon"}]
        table = {"imagePath": f"..\\images\\{part}.png", "shapes": shapes}
        (tmp_path / "labels" / f"{part}.json").write_text(json.dumps(table))
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", "u-net", "defect", ["red", "green", "blue"]))
    samples = open_samples(tmp_path, recipe)
    assert samples.classes == ["none", "pitting"]
    assert samples.labels.shape == (10 * 4, 256, 320)
    mask = samples.labels[0]
    assert abs(int((mask == 1).sum()) - 100 * 50) < 160
    assert mask[45, 60] == 1 and mask[10, 60] == 0 and mask[45, 130] == 0


def test_labelme_pieces_are_one_object_and_what_is_ignored_is_unknown(tmp_path):
    for folder in ("images", "components"):
        (tmp_path / folder).mkdir()

    def box(left, top, right, bottom, label, group=None):
        corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
        points = [[x + 0.5, y + 0.5] for x, y in corners]
        return {"label": label, "points": points, "group_id": group, "shape_type": "polygon"}

    shapes = [box(10, 10, 39, 19, "gear", 1), box(10, 20, 39, 29, "gear", 1), box(60, 10, 69, 19, "gear", 2)]
    shapes.append(box(100, 100, 119, 119, "__ignore__"))
    for part in range(10):
        cv2.imwrite(str(tmp_path / "images" / f"{part}.png"), np.full((256, 320, 3), 90, np.uint8))
        table = {"imagePath": f"../images/{part}.png", "shapes": shapes}
        (tmp_path / "components" / f"{part}.json").write_text(json.dumps(table))
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", "u-net", "semantic", ["red", "green", "blue"]))
    samples = open_samples(tmp_path / "components", recipe)
    assert samples.classes == ["none", "gear"]
    expected = np.zeros((256, 320), np.uint8)
    expected[10:30, 10:40], expected[10:20, 60:70], expected[100:120, 100:120] = 1, 1, IGNORE
    assert np.array_equal(samples.labels[3], expected)
    assert set(np.unique(samples.instances[3][10:30, 10:40])) == {1} and samples.instances[3][15, 65] == 2
    assert samples.instances[3][110, 110] == 0


def test_labelme_shapes_without_area_are_refused(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((20, 20, 3), np.uint8))
    shapes = [{"label": "crack", "points": [[1, 1], [5, 5]], "shape_type": "line"}]
    (tmp_path / "a.json").write_text(json.dumps({"imagePath": "a.png", "shapes": shapes}))
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", "u-net", "defect", ["red", "green", "blue"]))
    with pytest.raises(TrainingError, match="'line'"):
        open_samples(tmp_path, recipe)


def test_what_is_wrong_with_the_data_is_named(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    with pytest.raises(TrainingError, match="no such folder"):
        open_samples(tmp_path / "missing", recipe)
    (tmp_path / "dataset.json").write_text('{"schema": 9}')
    with pytest.raises(TrainingError, match=r"dataset\.json: schema 9"):
        open_samples(tmp_path, recipe)
