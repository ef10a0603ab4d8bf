"""Detectors do not take the unknown for background."""

import pytest
from conftest import write_recipe

torch = pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.dataset.samples import IGNORE
from semascan_training.networks import make_network
from semascan_training.networks.unknown_boxes import NOT_JUDGED, leave_out_unknown, share_within
from semascan_training.recipe import read_recipe

HEIGHT, WIDTH = 96, 128


def left_half():
    unknown = torch.zeros(HEIGHT, WIDTH, dtype=torch.bool)
    unknown[:, : WIDTH // 2] = True
    return unknown


def test_the_share_of_a_box_is_counted_within_the_picture():
    boxes = torch.tensor(
        [[0, 0, 64, 96], [60, 10, 68, 20], [96, 0, 128, 96], [-40, 0, 20, 10], [200, 0, 300, 9]]
    ).float()
    assert share_within(boxes, left_half()).tolist() == [1.0, 0.5, 0.0, 1.0, 0.0]


def test_background_in_the_unknown_is_not_judged_and_objects_are():
    boxes = torch.tensor([[0, 0, 40, 40], [0, 0, 40, 40], [50, 0, 90, 40], [80, 0, 120, 40]]).float()
    for kind in (torch.int64, torch.float32):  # heads have classes, proposals shares
        labels = torch.tensor([0, 3, 0, 0], dtype=kind)
        assert leave_out_unknown(labels, boxes, left_half()).tolist() == [NOT_JUDGED, 3, 0, 0]
        assert leave_out_unknown(labels, boxes, torch.zeros(HEIGHT, WIDTH, dtype=torch.bool)) is labels


@pytest.fixture(scope="module")
def detector(tmp_path_factory):
    channels = ["red", "green", "blue", "depth"]
    recipe = write_recipe(
        tmp_path_factory.mktemp("recipe") / "r.toml", "md-net", channels=channels,
        network={"fusion": "early"}, training={"loss": "mask-rcnn"},
    )  # fmt: skip
    torch.manual_seed(2)
    return make_network(read_recipe(recipe), 3).train()


def scene():
    """An object on the right; of the left half nothing is known."""
    torch.manual_seed(1)
    image = torch.rand(2, 4, HEIGHT, WIDTH)
    labels = torch.zeros(2, HEIGHT, WIDTH, dtype=torch.int64)
    labels[:, 20:60, 80:120] = 1
    labels[:, :, : WIDTH // 2] = IGNORE
    return image, labels, (labels == 1).long()


def judged(detector, image, labels, instances):
    """Labels of all anchors and of all proposals, with their boxes."""
    seen = {}
    rpn, heads = detector.detector.rpn, detector.detector.roi_heads
    anchors_of, proposals_of = type(rpn).assign_targets_to_anchors, type(heads).assign_targets_to_proposals

    def anchors(self, boxes, targets):
        answer = anchors_of(self, boxes, targets)
        seen["anchors"] = list(zip(boxes, answer[0]))
        return answer

    def proposals(self, boxes, *others):
        answer = proposals_of(self, boxes, *others)
        seen["proposals"] = list(zip(boxes, answer[1]))
        return answer

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(rpn), "assign_targets_to_anchors", anchors)
        patch.setattr(type(heads), "assign_targets_to_proposals", proposals)
        losses = detector.own_losses(image, labels, instances)
    assert all(torch.isfinite(loss) for loss in losses.values()), losses
    return seen


def test_neither_anchors_nor_proposals_in_the_unknown_are_background(detector):
    image, labels, instances = scene()
    for kind, images in judged(detector, image, labels, instances).items():
        for (boxes, given), one in zip(images, labels):
            within = share_within(boxes, one == IGNORE) > 0.5
            assert within.any() and not (given[within] == 0).any(), kind
            assert (given[~within] == 0).any() and (given > 0).any(), kind
    known = torch.where(labels == IGNORE, 0, labels)
    for kind, images in judged(detector, image, known, instances).items():
        for (boxes, given), one in zip(images, labels):
            assert (given[share_within(boxes, one == IGNORE) > 0.5] == 0).any(), kind


def test_a_picture_of_which_next_to_nothing_is_known_costs_nothing(detector):
    image, labels, instances = scene()
    losses = detector.own_losses(image, torch.full_like(labels, IGNORE), torch.zeros_like(instances))
    assert sum(losses.values()).item() == 0
    sum(losses.values()).backward()
    labels[1], instances[1] = IGNORE, 0
    assert all(torch.isfinite(loss) for loss in detector.own_losses(image, labels, instances).values())
