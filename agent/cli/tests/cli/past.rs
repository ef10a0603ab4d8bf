//! `serve --data`: past inspections are listed, shown, reviewed and streamed again.

use crate::serving::{Serving, ask, review, serve, serve_as};
use crate::{MOTOR, semascan, stderr};
use image::{DynamicImage, ImageFormat};
use semascan_captures::CaptureReader;
use semascan_inspection::ports::{Catalogue, InspectionFilter, InspectionState, ReviewLog};
use semascan_model::InspectionId;
use semascan_model::finding::Finding;
use semascan_model::record::InspectionRecord;
use semascan_protocol::server_message::Body;
use semascan_protocol::{InspectionFile, Phase, TAKES_REVIEWS, decode_server};
use semascan_store::data::DataFolder;
use semascan_store::read_inspection;
use semascan_tests::client::{Client, Holdings};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::time::Duration;

const CRITERIA: &str = "version = 1\nname = \"motor\"\nrevision = \"3\"\n\
    [[defect]]\ndefect = \"corrosion\"\nlargest_area_mm2 = 1\nthen = \"rework\"\n\
    [[defect]]\ndefect = \"wear\"\nlargest_area_mm2 = 1\nthen = \"rework\"\n";

/// A motor that was inspected and judged in `data`.
fn inspected(data: &Path) -> InspectionId {
    let criteria = data.with_extension("toml");
    fs::write(&criteria, CRITERIA).expect("writes");
    let arguments =
        ["inspect", MOTOR, "--data", data.to_str().expect("UTF-8"), "--criteria", criteria.to_str().expect("UTF-8")];
    let output = semascan(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let folder = DataFolder::open_beside(data).expect("a data folder");
    folder.catalogue().inspections(&InspectionFilter::default()).expect("reads")[0].id
}

fn record(data: &Path, id: InspectionId) -> InspectionRecord {
    DataFolder::open_beside(data).expect("a data folder").record(id).expect("reads").expect("a record")
}

#[test]
fn past_inspections_are_listed_and_everything_of_them_can_be_had() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    let id = inspected(&data);
    let record = record(&data, id);
    let verdict = record.verdict.clone().expect("judged");
    let agent = serve(&data);
    let own = format!("/api/v1/inspections/{id}");

    // The list, its filters and its tag.
    let all = agent.get("/api/v1/inspections");
    assert_eq!((all.status, all.headers["content-type"].as_str()), (200, "application/json"));
    let item = all.json()["items"][0].clone();
    assert_eq!((item["id"].as_str(), item["state"].as_str()), (Some(id.to_string().as_str()), Some("finished")));
    assert_eq!(item["decision"], verdict.decision().name());
    let found = record.findings.as_ref().expect("looked").list.len();
    assert!(found > 0 && item["findings"] == found, "{item}");
    let defect = record.findings.as_ref().and_then(|f| f.list[0].kind.defect()).expect("a defect").name.clone();
    for (query, count) in [
        (format!("defect={defect}&state=finished&decision={}", verdict.decision().name()), 1),
        ("part=MOTOR".into(), 1),
        ("part=er%20mo".into(), 1),
        ("part=pump".into(), 0),
        ("defect=dent".into(), 0),
        ("state=failed".into(), 0),
        ("conflict=true".into(), 0),
        ("until=2020-01-01T00:00:00Z".into(), 0),
        (format!("cursor={id}"), 0),
    ] {
        let listed = agent.get(&format!("/api/v1/inspections?{query}"));
        assert_eq!(listed.json()["items"].as_array().map(Vec::len), Some(count), "{query}: {listed:?}");
    }
    let known = agent.ask("GET", "/api/v1/inspections", &[("If-None-Match", &all.headers["etag"])], &[]);
    assert_eq!((known.status, known.body.len()), (304, 0));
    for (query, field) in [
        ("state=done", "state"),
        ("decision=ok", "decision"),
        ("limit=0", "limit"),
        ("limit=201", "limit"),
        ("cursor=x", "cursor"),
        ("from=yesterday", "from"),
        ("conflict=maybe", "conflict"),
    ] {
        let refused = agent.get(&format!("/api/v1/inspections?{query}"));
        assert_eq!((refused.status, refused.field().as_str()), (400, field));
    }
    let slip = agent.get("/api/v1/inspections?stat=failed");
    assert!(slip.status == 400 && slip.json()["detail"].as_str().is_some_and(|d| d.contains("stat")), "{slip:?}");

    // One inspection, its views and their pictures.
    let one = agent.get(&own).json();
    assert_eq!(one["record"]["generation"], record.files.as_ref().expect("files").generation.as_str());
    let views = agent.get(&format!("{own}/views?limit=2")).json();
    assert_eq!((views["items"].as_array().map(Vec::len), &views["next"]), (Some(2), &json!(2)));
    assert_eq!(views["items"][1]["pose"], serde_json::to_value(record.views[1].pose).expect("plain data"));
    assert_eq!(agent.get(&format!("{own}/views?cursor=2")).json()["items"][0]["index"], 2);
    let folder = DataFolder::open_beside(&data).expect("a data folder");
    let mut captured = CaptureReader::open(&folder.capture_path(id)).expect("a capture");
    let view =
        std::iter::from_fn(|| captured.next_view()).nth(1).expect("two views").expect("whole").view.expect("a view");
    let picture = |name: &str| {
        let answer = agent.get(&format!("{own}/views/1/{name}"));
        assert_eq!(answer.status, 200, "{name}: {}", String::from_utf8_lossy(&answer.body));
        let picture = image::load_from_memory_with_format(&answer.body, ImageFormat::Png).expect("a PNG");
        (picture, answer.headers)
    };
    assert_eq!(picture("color.png").0.to_rgb8(), *view.rgb);
    let (depth, headers) = picture("depth.png");
    let unit: f32 = headers["depth-unit-metres"].parse().expect("a number");
    let DynamicImage::ImageLuma16(depth) = depth else { panic!("16 bits") };
    for (step, metres) in depth.iter().zip(&view.depth.metres) {
        assert!((f32::from(*step) * unit - metres).abs() <= 0.51 * unit && (*step == 0) == (*metres == 0.0));
    }
    let labels = view.labels.as_ref().expect("labels");
    for (of, expected) in [("components", &labels.components), ("defects", &labels.defects)] {
        let DynamicImage::ImageLuma16(found) = picture(&format!("labels.png?of={of}")).0 else { panic!("16 bits") };
        let same = found.iter().zip(expected).filter(|(a, b)| a == b).count();
        // What lies outside of the region of interest has lost its labels.
        assert!(same * 10 > expected.len() * 9, "{of}: {same} of {}", expected.len());
        assert!(found.iter().any(|class| *class > 0) == expected.iter().any(|class| *class > 0), "{of}");
    }
    let certain = agent.get(&format!("{own}/views/1/sigma.png"));
    assert!(certain.status == 404 && certain.json()["detail"].as_str().is_some_and(|d| d.contains("uncertainty")));
    for (path, status, field) in [
        ("/views/99/color.png", 404, ""),
        ("/views/x/color.png", 400, "view"),
        ("/views/1/labels.png?of=pixels", 400, "of"),
        ("/exports/secret", 400, "file"),
        ("/exports/..%2F..%2Fsemascan.db", 400, "file"),
        ("/nothing", 404, ""),
    ] {
        let refused = agent.get(&format!("{own}{path}"));
        assert_eq!((refused.status, refused.field().as_str()), (status, field), "{path}");
    }
    assert_eq!(agent.get("/api/v1/inspections/x").field(), "inspection");
    assert_eq!(agent.get(&format!("/api/v1/inspections/{}", InspectionId::new(1, &[1; 10]))).status, 404);

    // Findings, criteria, verdict and files.
    let findings = agent.get(&format!("{own}/findings")).json();
    assert_eq!(findings["measured"], serde_json::to_value(&record.findings).expect("plain data"));
    assert_eq!(findings["now"], findings["measured"]["list"]);
    // Labels of the source are certain: nothing would teach more than anything else.
    let teaching = agent.get(&format!("{own}/teaching?limit=3")).json();
    assert!(teaching["nothing"].as_str().is_some_and(|reason| reason.contains("no uncertainty")), "{teaching}");
    assert_eq!(agent.get(&format!("{own}/teaching?limit=0")).status, 400);
    let day = agent.get("/api/v1/trends").json()["days"][0].clone();
    let known = record.component_confidence().expect("labelled");
    assert!(day["confidence"].as_f64().is_some_and(|mean| (mean - known).abs() < 1e-9), "{day}, {known}");
    let criteria = agent.get(&format!("{own}/criteria")).json();
    assert_eq!(criteria["record"]["sha256"], verdict.criteria.sha256.as_str());
    assert_eq!(criteria["criteria"]["defect"][0]["largest_area_mm2"], 1.0);
    assert_eq!(
        agent.get(&format!("{own}/verdict")).json()["measured"],
        serde_json::to_value(&verdict).expect("plain data")
    );
    for name in ["cloud.ply", "mesh.ply", "scene.glb", "inspection.json", "truth.ply"] {
        let file = agent.get(&format!("{own}/exports/{name}"));
        assert!(file.body == fs::read(folder.result_path(id).join(name)).expect("reads"), "{name}");
        let known =
            agent.ask("GET", &format!("{own}/exports/{name}"), &[("If-None-Match", &file.headers["etag"])], &[]);
        assert_eq!(known.status, 304, "{name}");
    }
    let file = |query: &str| {
        let answer = agent.get(&format!("{own}/inspection.semascan{query}"));
        assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
        InspectionFile::read(answer.body.into()).expect("a whole file")
    };
    let whole = file("?photographs=true");
    for answer in &whole.answers {
        assert!(answer.body == agent.get(&answer.path).body, "{}", answer.path);
    }
    let count = |ending: &str| whole.answers.iter().filter(|answer| answer.path.ends_with(ending)).count();
    assert_eq!([count("/color.png"), count("/findings"), count("/reviews")], [record.views.len(), 1, 1]);
    let progress = whole.messages.iter().rev().find_map(|message| {
        match decode_server(&message.message).expect("a message of the stream").body {
            Some(Body::Progress(progress)) => Some(progress),
            _ => None,
        }
    });
    let progress = progress.expect("how it ended");
    assert_eq!((progress.phase(), progress.points), (Phase::Finished, record.points));
    assert_eq!(whole.messages.last().map(|message| message.views), Some(record.views.len() as u32));
    let small = file("");
    assert_eq!((small.messages, small.answers.len()), (whole.messages, whole.answers.len() - record.views.len()));
    let described = agent.get("/api/v1/openapi.json").json();
    assert!(described["openapi"].as_str().is_some_and(|version| version.starts_with("3.1.")));
    let head = agent.ask("HEAD", &own, &[], &[]);
    assert_eq!((head.status, head.body.len()), (200, 0));
}

#[test]
fn reviews_are_taken_in_once_told_to_viewers_and_audited() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    let id = inspected(&data);
    let record = record(&data, id);
    let finding = record.findings.as_ref().expect("looked").list[0].clone();
    let agent = serve(&data);
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let mut holdings = Holdings::default();
    let viewer = Client::connect_to(agent.address, "/ws", &[TAKES_REVIEWS], &mut holdings);
    let mut viewer = runtime.block_on(viewer).expect("follows");

    let part = json!({"kind": "part"});
    let first = review(1, part.clone(), 0, json!({"type": "accept"}));
    let taken = agent.review(id, &first);
    assert_eq!(taken.status, 201, "{}", String::from_utf8_lossy(&taken.body));
    assert_eq!(
        (taken.json()["entry"]["sequence"].as_u64(), taken.json()["decision"].as_str()),
        (Some(1), Some("accept"))
    );
    let again = agent.review(id, &first);
    assert_eq!((again.status, again.json()["entry"].clone()), (200, taken.json()["entry"].clone()));
    let other = agent.review(id, &review(1, part.clone(), 0, json!({"type": "reject"})));
    assert_eq!((other.status, other.field().as_str()), (409, "id"));
    // Two people decide about the same version of a finding.
    let subject = json!({"kind": "finding", "finding": finding.id});
    assert_eq!(agent.review(id, &review(2, subject.clone(), 0, json!({"type": "accept"}))).status, 201);
    let conflict = agent.review(id, &review(3, subject.clone(), 0, json!({"type": "reject"})));
    assert_eq!((conflict.status, conflict.json()["conflicts"].as_u64()), (201, Some(1)));
    let listed = agent.get("/api/v1/inspections?conflict=true").json();
    assert_eq!(listed["items"][0]["conflicts"], 1);
    let mut settling = review(4, subject, 3, json!({"type": "reject"}));
    settling["resolves"] = json!([conflict.json()["entry"]["review"]["id"], first["id"]]);
    assert_eq!(agent.review(id, &settling).field(), "resolves[1]");
    settling["resolves"][1] = review(2, part.clone(), 0, Value::Null)["id"].clone();
    assert_eq!(agent.review(id, &settling).json()["conflicts"], 0);
    let outline = json!([[0.0, 0.0, 0.05], [0.01, 0.0, 0.05], [0.0, 0.01, 0.05]]);
    let action = json!({"type": "new_finding", "outline": outline, "component": finding.component.name});
    assert_eq!(agent.review(id, &review(5, part.clone(), 0, action)).status, 201);
    let now = agent.get(&format!("/api/v1/inspections/{id}/findings")).json();
    assert_eq!(now["now"].as_array().map(Vec::len), Some(record.findings.as_ref().map_or(0, |f| f.list.len()) + 1));
    let page = agent.get(&format!("/api/v1/inspections/{id}/reviews?after=1&limit=2")).json();
    assert_eq!((page["items"][0]["sequence"].as_u64(), page["next"].as_u64()), (Some(2), Some(3)));

    // What was told to the viewer, in order.
    let told = runtime.block_on(async {
        let mut told = Vec::new();
        while told.len() < 5 {
            if let Body::Review(change) = viewer.step(&mut holdings).await.expect("follows") {
                told.push((change.sequence, change.action, change.conflicts));
            }
        }
        told
    });
    let expected = [(1, "accept", 0), (2, "accept", 0), (3, "reject", 1), (4, "reject", 0), (5, "new_finding", 0)];
    assert_eq!(told, expected.map(|(sequence, action, conflicts)| (sequence, action.to_owned(), conflicts)));

    // The report says who decided what; the file of the set stays what it was when the inspection ended.
    let report = agent.get(&format!("/api/v1/inspections/{id}/report"));
    assert!(report.headers["content-security-policy"].contains("style-src 'unsafe-inline'"), "{:?}", report.headers);
    let text = String::from_utf8(report.body).expect("UTF-8");
    for said in [
        "by A. Reviewer, ",
        "can be ground",
        " contradicts no. 2",
        " settles no. 3, 2",
        "is what was written: 5 entries. ",
    ] {
        assert!(text.contains(said), "{said}");
    }
    let of_the_set = fs::read_to_string(data.join(format!("inspections/{id}/report.html"))).expect("reads");
    assert!(!of_the_set.contains("A. Reviewer"));

    // What is not taken in.
    let path = format!("/api/v1/inspections/{id}/reviews");
    let body = review(9, part.clone(), 0, json!({"type": "accept"})).to_string();
    let json_type = ("Content-Type", "application/json");
    let ask = |headers: &[(&str, &str)], body: &str| agent.ask("POST", &path, headers, body.as_bytes());
    assert_eq!(ask(&[], &body).status, 415);
    assert_eq!(ask(&[("Content-Type", "text/plain")], &body).status, 415);
    assert_eq!(ask(&[json_type, ("Origin", "http://evil.example")], &body).status, 403);
    assert_eq!(ask(&[json_type, ("Sec-Fetch-Site", "cross-site")], &body).status, 403);
    assert_eq!(ask(&[json_type], &" ".repeat((2 << 20) + 1)).status, 413);
    assert_eq!(ask(&[json_type], "{").status, 400);
    assert_eq!(ask(&[json_type], &body.replace("\"seen\":0", "\"seen\":7")).field(), "seen");
    assert_eq!(ask(&[json_type], &body.replace("\"person\"", "\"nobody\"")).status, 400);
    assert_eq!(agent.ask("POST", "/api/v1/inspections", &[json_type], body.as_bytes()).status, 405);
    assert_eq!(agent.ask("DELETE", &path, &[], &[]).headers["allow"], "GET, HEAD, POST");
    let unknown = InspectionId::new(1, &[1; 10]);
    assert_eq!(agent.review(unknown, &review(9, part, 0, json!({"type": "accept"}))).status, 404);
    drop(agent);

    // Files that are kept are not replaced; a report elsewhere has the reviews, too.
    let folder = data.to_str().expect("UTF-8");
    let set = data.join("inspections").join(id.to_string());
    let set = set.to_str().expect("UTF-8");
    let inside = format!("{set}/report.html");
    for refused in [
        &["report", set][..],
        &["report", set, "--out", &inside],
        &["report", set, "--format", "csv", "--out", set],
        &["judge", set, "--criteria", "criteria.toml"],
    ] {
        let refused = semascan(refused);
        assert_eq!(refused.status.code(), Some(2));
        assert!(stderr(&refused).contains("is kept in the data folder"), "{}", stderr(&refused));
    }
    let elsewhere = root.path().join("report.html");
    let written = semascan(&["report", set, "--out", elsewhere.to_str().expect("UTF-8")]);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    assert!(fs::read_to_string(&elsewhere).expect("reads").contains("by A. Reviewer, "));
    assert_eq!(semascan(&["verify", folder]).status.code(), Some(0));

    // The log is good, and says so after a restart; then somebody edits the file.
    let audit = |more: &[&str]| semascan(&[&["audit", "verify", "--data", folder, "--json"], more].concat());
    let good = audit(&[]);
    assert_eq!(good.status.code(), Some(0), "{}", stderr(&good));
    let report: Value = serde_json::from_slice(&good.stdout).expect("JSON");
    assert_eq!((&report["entries"], &report["accounts"]["entries"]), (&json!(5), &json!(0)));
    assert_eq!(audit(&["--head", report["head"].as_str().expect("a hash")]).status.code(), Some(0));
    let lost = audit(&["--head", &"ab".repeat(32)]);
    assert_eq!(lost.status.code(), Some(1));
    assert_eq!(audit(&["--head", "xyz"]).status.code(), Some(2));
    let database = rusqlite::Connection::open(data.join("semascan.db")).expect("opens");
    database
        .execute_batch(
            "DROP TRIGGER reviews_are_not_changed; \
             UPDATE reviews SET entry = replace(entry, 'accept', 'reject') WHERE sequence = 2",
        )
        .expect("edited");
    drop(database);
    let bad = audit(&[]);
    assert_eq!(bad.status.code(), Some(1));
    assert!(stderr(&bad).contains("entry 2 (review 00000000-0000-4000-8000-000000000002)"), "{}", stderr(&bad));
    assert_eq!(semascan(&["verify", folder]).status.code(), Some(1));
    // Nor is it taken for what was decided.
    let agent = serve(&data);
    let refused = agent.get(&format!("/api/v1/inspections/{id}/verdict"));
    assert_eq!(refused.status, 503, "{refused:?}");
}

/// Servers that are killed while reviews are sent, where the variable does not say it.
const KILLS: u32 = 5;

#[test]
fn a_review_that_was_answered_survives_a_kill() {
    let kills = std::env::var("SEMASCAN_TEST_KILLS").map_or(KILLS, |count| count.parse().expect("a number of kills"));
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    let id = inspected(&data);
    let mut answered = Vec::new();
    for kill in 0..kills {
        let mut agent = serve(&data);
        let address = agent.address;
        let sender = std::thread::spawn(move || {
            let path = format!("/api/v1/inspections/{id}/reviews");
            let mut answered = Vec::new();
            for number in 1.. {
                let remark =
                    review(u64::from(kill) << 20 | number, json!({"kind": "part"}), 0, json!({"type": "comment"}));
                let json_type = [("Content-Type", "application/json")];
                match ask(address, "POST", &path, &json_type, remark.to_string().as_bytes()) {
                    Ok(answer) if answer.status == 201 => answered.push(remark),
                    // Whoever got no answer sends it again; here it is dropped.
                    Ok(answer) => panic!("{answer:?}"),
                    Err(_) => break,
                }
            }
            answered
        });
        let moment = (f64::from(kill + 1) * 0.618_033_988_749_895).fract();
        std::thread::sleep(Duration::from_secs_f64(0.6 * moment));
        agent.child.kill().expect("killed");
        answered.extend(sender.join().expect("no other answer"));
    }
    assert!(answered.len() > kills as usize, "{} reviews were answered", answered.len());
    let audited = semascan(&["audit", "verify", "--data", data.to_str().expect("UTF-8")]);
    assert_eq!(audited.status.code(), Some(0), "{}", stderr(&audited));
    let log = DataFolder::open_beside(&data).expect("a data folder");
    let kept = log.catalogue().entries(id, 0, u32::MAX).expect("reads");
    let kept: BTreeMap<String, Value> = kept
        .into_iter()
        .map(|logged| logged.entry)
        .map(|entry| (entry.review.id.to_string(), serde_json::to_value(&entry.review).expect("plain data")))
        .collect();
    for remark in &answered {
        assert_eq!(kept.get(remark["id"].as_str().expect("an id")), Some(remark));
    }
    eprintln!("{kills} servers were killed, {} reviews answered, {} kept: none is lost", answered.len(), kept.len());
}

#[test]
fn a_past_inspection_is_streamed_as_it_was() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    let id = inspected(&data);
    let saved =
        read_inspection(&DataFolder::open_beside(&data).expect("a data folder").result_path(id)).expect("reads");
    let agent = serve(&data);
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let follow = |query: &str| {
        runtime.block_on(async {
            let mut holdings = Holdings::default();
            let path = format!("/ws?inspection={id}{query}");
            let mut client = Client::connect_to(agent.address, &path, &[], &mut holdings).await.expect("follows");
            client.finish(&mut holdings).await.expect("to the end");
            (client, holdings)
        })
    };
    let (client, holdings) = follow("&speed=2");
    assert_eq!((holdings.inspection.id.as_str(), client.progress.message.as_str()), (id.to_string().as_str(), ""));
    assert_eq!((holdings.points(), client.progress.model_hash), (saved.cloud.len(), holdings.hash()));
    assert_eq!(client.progress.views_done as usize, saved.record.views.len());
    assert!(client.views.iter().all(|view| !view.thumbnail_jpeg.is_empty() && view.intrinsics.is_some()));
    // The model grew, as it did then: chunks came more than once, and each epoch began with a clear page.
    let events = DataFolder::open_beside(&data).expect("a data folder").catalogue().events(id, 0, 1000).expect("reads");
    let epochs: BTreeSet<u64> = events
        .iter()
        .map(|event| serde_json::from_str::<Value>(&event.kind).expect("JSON"))
        .filter(|kind| kind["type"] == "model_changed")
        .filter_map(|kind| kind["epoch"].as_u64())
        .collect();
    assert_eq!(client.clears as usize, epochs.len());
    let messages = client.chunk_messages as usize;
    assert!(messages > holdings.chunks.len(), "{messages} messages for {} chunks", holdings.chunks.len());
    // Every label and colour is that of the saved model, wherever it lies.
    let labels = |labels: &mut dyn Iterator<Item = (u16, u16, [u8; 3])>| {
        let mut count = BTreeMap::new();
        labels.for_each(|key| *count.entry(key).or_insert(0_u32) += 1);
        count
    };
    let streamed =
        labels(&mut holdings.chunks.values().flat_map(|c| c.cloud.iter()).map(|p| (p.label, p.defect, p.color)));
    let kept = labels(&mut saved.cloud.iter().map(|p| (p.label, p.defect, p.color)));
    assert_eq!(streamed, kept);
    // From the last event on, and faster than it was: the same end.
    let (late, again) = follow("&from=1000000");
    assert_eq!((again.hash(), late.progress.phase()), (holdings.hash(), client.progress.phase()));

    // Without the capture the final model is shown, and why it is no more than that.
    fs::remove_file(DataFolder::open_beside(&data).expect("a data folder").capture_path(id)).expect("removed");
    drop(agent);
    let agent = serve(&data);
    let (client, alone) = runtime.block_on(async {
        let mut holdings = Holdings::default();
        let path = format!("/ws?inspection={id}");
        let mut client = Client::connect_to(agent.address, &path, &[], &mut holdings).await.expect("follows");
        client.finish(&mut holdings).await.expect("to the end");
        while !client.progress.message.contains("only the final model") {
            client.step(&mut holdings).await.expect("says why");
        }
        (client, holdings)
    });
    assert_eq!(alone.points(), saved.cloud.len(), "{}", client.progress.message);
    for (query, status) in [("inspection=x", 400), ("inspection=00000000-0000-7000-8000-000000000000", 404)] {
        let refused =
            runtime.block_on(Client::connect_to(agent.address, &format!("/ws?{query}"), &[], &mut Holdings::default()));
        assert!(format!("{:?}", refused.err()).contains(&status.to_string()), "{query}");
    }
    let slow = format!("/ws?inspection={id}&speed=0");
    assert!(runtime.block_on(Client::connect_to(agent.address, &slow, &[], &mut Holdings::default())).is_err());
}

#[test]
fn an_agent_judges_what_it_inspects_by_the_criteria_that_it_was_given() {
    let root = tempfile::tempdir().expect("temporary folder");
    let at = |name: &str| root.path().join(name).to_str().expect("UTF-8").to_owned();
    let (data, criteria) = (at("cell"), at("criteria.toml"));
    fs::write(&criteria, CRITERIA).expect("writes");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["serve", "--port", "0", "--source", MOTOR, "--data", &data, "--criteria", &criteria]);
    let agent = serve_as(command);
    let first = ended(&agent);
    drop(agent);
    let own = |agent: &Serving, path: &str| agent.get(&format!("/api/v1/inspections/{first}{path}")).json();
    let agent = serve(Path::new(&data));
    let verdict = own(&agent, "/verdict")["measured"].clone();
    assert_eq!((&verdict["criteria"]["name"], &verdict["criteria"]["revision"]), (&json!("motor"), &json!("3")));
    assert_eq!(own(&agent, "/criteria")["record"], verdict["criteria"], "their text is kept");
    assert!(own(&agent, "")["decision"].is_string());
    drop(agent);

    // As if it had been killed before it ended, and with the criteria in cell.toml: what is continued is judged, too.
    let folder = DataFolder::open(Path::new(&data)).expect("opens");
    let row = &folder.catalogue().inspections(&InspectionFilter::default()).expect("reads")[0];
    folder.catalogue().close(row.id, row.began, InspectionState::Running, None).expect("set");
    drop(folder);
    let (cell, newer) = (at("cell.toml"), at("newer.toml"));
    fs::write(&newer, CRITERIA.replace("\"3\"", "\"4\"")).expect("writes");
    fs::write(&cell, format!("[serve]\ncriteria = \"{newer}\"\n")).expect("writes");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["serve", "--port", "0", "--data", &data, "--config", &cell]);
    let agent = serve_as(command);
    assert_eq!(ended(&agent), first);
    assert_eq!(own(&agent, "/verdict")["measured"]["criteria"]["revision"], "4");
    drop(agent);

    // What cannot be used is refused before anything is served, inspected or kept.
    let slip = at("slip.toml");
    fs::write(&slip, CRITERIA.replace("largest_area_mm2", "largest_aera_mm2")).expect("writes");
    for (file, word) in [(at("nowhere.toml"), "nowhere.toml"), (slip, "largest_aera_mm2")] {
        let refused = semascan(&["serve", "--port", "0", "--data", &at("none"), "--criteria", &file]);
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains(word) && !said.contains("listening"), "{said}");
    }
    assert!(!Path::new(&at("none")).exists());
    let strange = at("strange.toml");
    fs::write(&strange, CRITERIA.replace("wear", "dents")).expect("writes");
    let refused = semascan(&["serve", "--port", "0", "--source", MOTOR, "--criteria", &strange]);
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("dents"), "{}", stderr(&refused));
    let refused = semascan(&["inspect", MOTOR, "--data", &at("empty"), "--criteria", &strange]);
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("dents"), "{}", stderr(&refused));
    let folder = DataFolder::open_beside(Path::new(&at("empty"))).expect("a data folder");
    assert_eq!(folder.catalogue().inspections(&InspectionFilter::default()).expect("reads"), []);
}

/// Waits until the newest inspection of `agent` has ended; its name.
fn ended(agent: &Serving) -> String {
    for _ in 0..3000 {
        let newest = agent.get("/api/v1/inspections").json()["items"][0].clone();
        if newest["state"] == "finished" {
            return newest["id"].as_str().expect("a name").to_owned();
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("the inspection does not end: {:?}", agent.get("/api/v1/inspections"));
}

#[test]
fn what_a_person_draws_or_measures_is_kept_with_its_figures() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("cell");
    let id = inspected(&data);
    let record = record(&data, id);
    let list = &record.findings.as_ref().expect("looked").list;
    let area = |finding: &Finding| finding.area().map_or(0.0, |area| area.value);
    let largest = list.iter().max_by(|a, b| area(a).total_cmp(&area(b))).expect("findings");
    let region = largest.region.as_ref().expect("measured");
    let defect = largest.kind.defect().expect("a defect").name.clone();
    let agent = serve(&data);
    // Somebody draws around what was found: what is within the curve is as large, as long and as deep.
    let draw = |number: u64, outline: Value| {
        let action = json!({
            "type": "new_finding", "outline": outline, "component": largest.component.name, "defect": defect
        });
        agent.review(id, &review(number, json!({"kind": "part"}), 0, action))
    };
    let taken = draw(1, json!(region.outlines[0]));
    assert_eq!(taken.status, 201, "{}", String::from_utf8_lossy(&taken.body));
    let found = agent.get(&format!("/api/v1/inspections/{id}/findings")).json();
    let drawn = found["now"].as_array().expect("a list").last().expect("findings").clone();
    assert_eq!(drawn["kind"], "drawn");
    let near = |name: &str, expected: f64, share: f64| {
        let value = drawn["region"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name} in {drawn}"));
        assert!((value / expected - 1.0).abs() < share, "{name}: {value} for {expected}");
    };
    near("area", region.area.value, 0.1);
    near("length", region.length.value, 0.15);
    near("width", region.width.value, 0.25);
    assert!(drawn["region"]["area"]["expanded"].as_f64().is_some_and(|u| u > 0.0), "{drawn}");
    assert_eq!(drawn["region"]["area_budget"]["labels"], 0.0, "a person drew the rim");
    let views = |region: &Value| -> BTreeSet<u64> {
        region["views"].as_array().expect("views").iter().filter_map(|view| view["view"].as_u64()).collect()
    };
    // A view that saw no more than the rim may not have seen the simplified curve.
    let seen = views(&drawn["region"]);
    let before: BTreeSet<u64> = region.views.iter().map(|view| view.view.into()).collect();
    assert!(seen.is_subset(&before) && seen.contains(&region.views[0].view.into()), "{seen:?} of {before:?}");
    assert!(drawn["region"]["confidence"]["mean"].as_f64().is_some_and(|mean| mean > 0.5));
    // The same after a restart: the figures stand in the log.
    let again = draw(1, json!(region.outlines[0]));
    assert_eq!(again.status, 200);
    // Beside the model there is nothing to measure, and it is said.
    let beside = json!([[1.0, 0.0, 0.0], [1.01, 0.0, 0.0], [1.0, 0.01, 0.0]]);
    assert_eq!(draw(2, beside).status, 201);
    let found = agent.get(&format!("/api/v1/inspections/{id}/findings")).json();
    let outline = found["drawn"].as_array().expect("a list").last().expect("two").clone();
    assert!(outline["note"].as_str().is_some_and(|note| note.contains("no surface of the model")), "{outline}");
    // What somebody measured is kept, told to everybody, and withdrawn with a reason.
    let point = |x: f64| json!({"kind": "point", "picked": [x, 0.0, 0.1], "position": [x, 0.0, 0.1]});
    let measurement = json!({
        "kind": "distance", "figure": {"value": 0.02, "expanded": 0.001}, "features": [point(0.0), point(0.02)],
        "voxel": 0.0014, "place": [0.01, 0.0, 0.1], "lines": [[[0.0, 0.0, 0.1], [0.02, 0.0, 0.1]]]
    });
    for number in [3, 4] {
        let action = json!({"type": "measure", "measurement": measurement});
        let taken = agent.review(id, &review(number, json!({"kind": "part"}), 0, action));
        assert_eq!(taken.status, 201, "{}", String::from_utf8_lossy(&taken.body));
    }
    let kept = || agent.get(&format!("/api/v1/inspections/{id}/measurements")).json()["items"].clone();
    assert_eq!(kept().as_array().map(Vec::len), Some(2));
    let withdraw = json!({"type": "withdraw", "review": kept()[0]["review"]});
    assert_eq!(agent.review(id, &review(5, json!({"kind": "part"}), 0, withdraw)).status, 201);
    let left = kept();
    assert_eq!((left.as_array().map(Vec::len), &left[0]["measurement"]["figure"]["value"]), (Some(1), &json!(0.02)));
    assert_eq!(left[0]["is_of_earlier_model"], false);
    // Reports and tables have all of it, findings with a picture.
    let page = agent.get(&format!("/api/v1/inspections/{id}/report"));
    let page = String::from_utf8_lossy(&page.body).into_owned();
    assert_eq!(page.matches("<article class=\"finding\"").count(), list.len() + 2);
    assert!(page.contains("(drawn by a person)") && page.contains("within the curve that was drawn"));
    assert!(page.contains("20.0 ± 1.0 mm") && page.contains("withdrew a measurement: no. 3"), "{page}");
    drop(agent);
    let set = data.join("inspections").join(id.to_string());
    let tables = root.path().join("tables");
    fs::create_dir(&tables).expect("made");
    let (set, into) = (set.to_str().expect("UTF-8"), tables.to_str().expect("UTF-8"));
    let written = semascan(&["report", set, "--format", "csv", "--out", into]);
    assert_eq!(written.status.code(), Some(0), "{}", stderr(&written));
    let rows = fs::read_to_string(tables.join("findings.csv")).expect("reads");
    assert_eq!(rows.lines().count(), 1 + list.len() + 2, "{rows}");
    let rows = fs::read_to_string(tables.join("measurements.csv")).expect("reads");
    assert!(rows.lines().count() == 2 && rows.contains(",distance,20,1,mm,"), "{rows}");
    let dfq = semascan(&["report", set, "--format", "dfq", "--out", &format!("{into}/report.dfq")]);
    assert_eq!(dfq.status.code(), Some(0), "{}", stderr(&dfq));
    assert_eq!(semascan(&["verify", data.to_str().expect("UTF-8")]).status.code(), Some(0));
}
