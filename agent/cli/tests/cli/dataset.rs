//! `semascan dataset`: a model that a person corrected becomes masks of its views.

use crate::{MOTOR, semascan, stderr};
use jiff::Timestamp;
use semascan_inspection::ports::{Catalogue, InspectionFilter};
use semascan_inspection::review::ReviewDesk;
use semascan_model::InspectionId;
use semascan_store::data::DataFolder;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Output;

const IGNORE: u8 = 255;

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn inspect(more: &[&str]) {
    let output = semascan(&[&["inspect", MOTOR], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

fn dataset(arguments: &[&str]) -> Output {
    semascan(&[&["dataset"], arguments].concat())
}

fn made(arguments: &[&str]) -> Value {
    let output = dataset(&[arguments, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// A person says that all of the model is gear.
fn all_gear(data: &Path, id: InspectionId) {
    let folder = DataFolder::open(data).expect("opens");
    let record = folder.record(id).expect("reads").expect("a record");
    let corners: Vec<[i32; 3]> = (0..8).map(|i| [-(i & 1), -(i >> 1 & 1), -(i >> 2)]).collect();
    let review = json!({
        "id": "00000000-0000-4000-8000-000000000001", "subject": {"kind": "part"}, "seen": 0,
        "person": "A. Reviewer", "reason": "one part",
        "action": {
            "type": "relabel", "component": "gear", "defect": "none",
            "patch": {"kind": "voxels", "edge": 10.0, "cells": corners},
        },
    });
    let review = serde_json::from_value(review).expect("a review");
    let desk = ReviewDesk::new(folder.catalogue().clone());
    desk.take(&record, None, review, Timestamp::UNIX_EPOCH).expect("taken in");
}

fn plane(path: &Path) -> Vec<u8> {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_luma8().into_raw()
}

fn json_of(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("reads")).expect("JSON")
}

#[test]
fn what_a_person_said_of_the_model_is_in_every_view_and_every_format() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    inspect(&["--data", text(&data)]);
    inspect(&["--data", text(&data)]);
    let ids: Vec<InspectionId> = {
        let folder = DataFolder::open_beside(&data).expect("a data folder");
        folder.catalogue().inspections(&InspectionFilter::default()).expect("reads").iter().map(|row| row.id).collect()
    };
    all_gear(&data, ids[1]);

    let bop = root.path().join("bop");
    let manifest = made(&["--from", text(&data), "--out", text(&bop)]);
    assert_eq!((&manifest["views"], &manifest["ignore"]), (&3.into(), &255.into()));
    let entry = &manifest["inspections"][0];
    assert_eq!((&entry["applied"], &entry["entries"]), (&1.into(), &1.into()));
    assert_eq!(entry["log"]["head"].as_str().map(str::len), Some(64));
    assert!(entry["changed"].as_u64() > Some(100), "{entry}");
    assert_eq!(manifest["left_out"][0]["inspection"], ids[0].to_string());
    assert!(manifest["left_out"][0]["reason"].as_str().is_some_and(|r| r.contains("--include-uncorrected")));
    assert_eq!(json_of(&bop.join("manifest.json")), manifest);
    let index = json_of(&bop.join("dataset.json"));
    let gear =
        index["classes"].as_array().expect("a list").iter().position(|name| name == "gear").expect("known") as u8;
    let (mut gears, mut unknown) = (Vec::new(), Vec::new());
    for view in 0..3 {
        let scene = bop.join("000000");
        let labels = plane(&scene.join(format!("labels/{view:06}.png")));
        let shown: BTreeSet<u8> = labels.iter().copied().collect();
        assert!(shown.contains(&gear) && shown.is_subset(&BTreeSet::from([0, gear, IGNORE])), "{shown:?}");
        let mask = plane(&scene.join(format!("mask_visib/{view:06}_000000.png")));
        assert!(mask.iter().zip(&labels).all(|(m, l)| (*m == 255) == (*l == gear)));
        let defects: BTreeSet<u8> = plane(&scene.join(format!("defects/{view:06}.png"))).into_iter().collect();
        assert!(defects.is_subset(&BTreeSet::from([0, IGNORE])), "{defects:?}");
        gears.push(labels.iter().filter(|l| **l == gear).count());
        unknown.push(labels.iter().filter(|l| **l == IGNORE).count());
    }

    // Both inspections are of one part; what is unknown in the set is unknown to an inspection of it.
    assert_eq!(index["parts"], json!({ "000000": entry["part"] }));
    let again = root.path().join("again");
    let scene = bop.join("000000");
    let output = semascan(&["inspect", text(&scene), "--labels", "source", "--out", text(&again)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let record = json_of(&again.join("inspection.json"));
    assert_eq!(record["views"].as_array().map(Vec::len), Some(3));
    assert!(record["views"].as_array().expect("a list").iter().all(|view| view["accepted"] == true), "{record}");

    let coco = root.path().join("coco");
    made(&["--from", text(&data), "--out", text(&coco), "--format", "coco"]);
    let file = json_of(&coco.join("annotations.json"));
    let annotations = file["annotations"].as_array().expect("a list");
    for (image, (gears, unknown)) in (1..).zip(gears.iter().zip(&unknown)) {
        let of_image = || annotations.iter().filter(|a| a["image_id"] == image && a["category_id"] == gear);
        for (crowd, pixels) in [(0, gears), (1, unknown)] {
            let area: u64 = of_image().filter(|a| a["iscrowd"] == crowd).filter_map(|a| a["area"].as_u64()).sum();
            assert_eq!(area, *pixels as u64, "image {image}, crowd {crowd}");
        }
        for annotation in of_image() {
            let runs = annotation["segmentation"]["counts"].as_array().expect("runs");
            let sum = |from: usize| runs.iter().skip(from).step_by(2).filter_map(Value::as_u64).sum::<u64>();
            assert_eq!((sum(0) + sum(1), sum(1)), (160 * 120, annotation["area"].as_u64().expect("an area")));
        }
    }

    let labelme = root.path().join("labelme");
    made(&["--from", text(&data), "--out", text(&labelme), "--format", "labelme"]);
    let file = json_of(&labelme.join("components/000000_000002.json"));
    assert_eq!((&file["imageWidth"], &file["imagePath"]), (&160.into(), &"../images/000000_000002.png".into()));
    assert_eq!(file["part"], entry["part"]);
    let labels: BTreeSet<&str> =
        file["shapes"].as_array().expect("shapes").iter().filter_map(|shape| shape["label"].as_str()).collect();
    assert_eq!(labels, BTreeSet::from(["__ignore__", "gear"]));

    let refused = dataset(&["--from", text(&data), "--out", text(&bop)]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let all = made(&["--from", text(&data), "--out", text(&bop), "--overwrite", "--include-uncorrected"]);
    assert_eq!((&all["views"], all["left_out"].as_array().map(Vec::len)), (&6.into(), Some(0)));
    let parts = json_of(&bop.join("dataset.json"))["parts"].clone();
    assert_eq!(parts, json!({ "000000": entry["part"], "000001": entry["part"] }));
    let reviewed = made(&["--from", text(&data), "--out", text(&bop), "--overwrite", "--only-reviewed"]);
    assert_eq!(reviewed["inspections"][0]["pixels"], entry["pixels"], "all of it was reviewed");
}

#[test]
fn an_inspection_without_a_log_and_wrong_calls_are_named() {
    let root = tempfile::tempdir().expect("temporary folder");
    let (alone, out) = (root.path().join("alone"), root.path().join("set"));
    inspect(&["--out", text(&alone)]);
    let nobody = dataset(&["--from", text(&alone), "--out", text(&out)]);
    assert_eq!(nobody.status.code(), Some(1));
    assert!(stderr(&nobody).contains("nobody reviewed it") && !out.exists(), "{}", stderr(&nobody));
    let manifest = made(&["--from", text(&alone), "--out", text(&out), "--include-uncorrected"]);
    assert_eq!(manifest["views"], 3);
    assert!(manifest["inspections"][0]["log"].is_null());
    let other = "00000000-0000-7000-8000-000000000001";
    for (arguments, word) in [
        (&["--from", text(root.path()), "--out", "x"][..], "semascan.db"),
        (
            &["--from", text(&alone), "--out", text(&alone), "--include-uncorrected", "--overwrite"][..],
            "is no data set",
        ),
        (&["--from", text(&alone), "--out", "x", "--inspection", other][..], other),
        (&["--from", text(&alone), "--out", "x", "--only-reviewed", "--include-uncorrected"][..], "contradict"),
    ] {
        let refused = dataset(arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(word), "{arguments:?}: {}", stderr(&refused));
    }
    // Labels of the source are certain: there is nothing to order by.
    let queue = semascan(&["dataset", "queue", text(&alone), "--json"]);
    assert_eq!(queue.status.code(), Some(0), "{}", stderr(&queue));
    let queue: Value = serde_json::from_slice(&queue.stdout).expect("one JSON object");
    assert_eq!(queue["inspections"].as_array().map(Vec::len), Some(0));
    assert!(queue["left_out"][0]["reason"].as_str().is_some_and(|r| r.contains("no uncertainty")), "{queue}");
}
