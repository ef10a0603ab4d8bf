//! The source of a cell held against what `cell.toml` says of it.

use super::super::cell_section::CellSection;
use super::super::source;
use super::{Finding, Health, picture};
use jiff::Timestamp;
use semascan_formats::regular_file;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibrationRecord};
use semascan_sources::OpenOptions;
use semascan_sources::live::{LiveAddress, Probe, Trigger, probe};
use serde_json::json;
use std::time::Duration;

/// A server that takes longer is far away, or has too much to do.
const SLOW: Duration = Duration::from_millis(250);
/// Share of the expected pictures that must come.
const LEAST_RATE: f64 = 0.9;
/// Seconds that stamps may be off this machine's clock.
const CLOCK: f64 = 1.0;
/// Faults that are said.
const MOST_FAULTS: usize = 5;

/// Looks at the source; how many bytes a second it sends, where it streams.
pub(super) fn findings(cell: &CellSection, spec: &InspectionSpec, listened: Duration) -> (Vec<Finding>, Option<f64>) {
    let Some(uri) = &spec.source.uri else {
        let mend = "name what is inspected: source.uri in cell.toml, ws://HOST:8765 for a robot under ROS";
        return (vec![Finding::wrong("source", Health::Warning, "the configuration names none", mend)], None);
    };
    let mut found = Vec::new();
    if !LiveAddress::is_one(uri) {
        found.push(match source::open(uri, spec) {
            Ok(source) => Finding::ok("source", format!("{uri}: {}", source.info().part)),
            Err(error) => Finding::wrong("source", Health::Failed, error.to_string(), "mend source.uri in cell.toml"),
        });
        return (found, None);
    }
    let listened_to = LiveAddress::read(uri)
        .map_err(|reason| (reason, "mend the key that is named, in [cell] of cell.toml or in source.uri"))
        .and_then(|address| {
            let probed = probe(&address, &OpenOptions::from(spec), listened);
            let mend = "start the server: `ros2 launch foxglove_bridge foxglove_bridge_launch.xml` on a robot under ROS 2; and see \
                        that source.uri has its host and port, and that no firewall is between";
            probed.map(|probed| (address, probed)).map_err(|error| (error.to_string(), mend))
        });
    match listened_to {
        Err((reason, mend)) => {
            found.push(Finding::wrong("source", Health::Failed, reason, mend));
            (found, None)
        }
        Ok((address, probed)) => {
            found.extend(judged(cell, &address, &probed));
            let stream = probed.bytes as f64 / probed.listened.as_secs_f64().max(1e-3);
            (found, Some(stream))
        }
    }
}

/// The calibration: whether it can be read and is of this cell, and whether it is due.
pub(super) fn calibration(cell: &CellSection, temperature: Option<f64>) -> Option<Finding> {
    let what = "calibration";
    let path = cell.calibration.as_deref()?;
    let name = path.display();
    let read = || -> anyhow::Result<CalibrationRecord> {
        let record: CalibrationRecord = serde_json::from_slice(&regular_file::read(path)?)?;
        anyhow::ensure!(record.schema == CALIBRATION_SCHEMA, "is of version {}", record.schema);
        Ok(record)
    };
    let record = match read() {
        Ok(record) => record,
        Err(error) => {
            let mend =
                "calibrate the cell: `semascan calibrate --write cell.toml`, or name its file with cell.calibration";
            return Some(Finding::wrong(what, Health::Failed, format!("{name}: {error}"), mend));
        }
    };
    let mut spec = InspectionSpec::default();
    spec.source.uri = Some("ws://cell".to_owned());
    cell.complete(&mut spec);
    if let Err(reason) = LiveAddress::read(spec.source.uri.as_deref().unwrap_or_default()) {
        let mend = "say in [cell.frames] what it is of: `ee`, or `base` and `table_joint`; or calibrate again";
        return Some(Finding::wrong(what, Health::Failed, reason, mend));
    }
    let made = record.made.map_or_else(|| "nobody noted when".to_owned(), |made| made.to_string());
    let weak: Vec<String> =
        record.reminders(Timestamp::now(), temperature).into_iter().chain(record.warnings).collect();
    let details = json!({ "made": record.made, "weak": weak });
    let text = format!("{name}, made: {made}");
    let found = match weak.is_empty() {
        true => Finding::ok(what, text),
        false => {
            let text = format!("{text}: {}", weak.join("; "));
            Finding::wrong(what, Health::Warning, text, "calibrate again: `semascan calibrate --help` says how")
        }
    };
    Some(Finding { details, ..found })
}

/// What was heard, judged.
fn judged(cell: &CellSection, address: &LiveAddress, probed: &Probe) -> Vec<Finding> {
    let mut found = vec![network(probed), topics(cell, probed), clocks(probed), transforms(cell, address, probed)];
    match &probed.view {
        Ok(view) => found.extend(picture::findings(view, cell.working_distance)),
        Err(reason) => {
            let mend =
                "what is named in the reason: a calibration of the camera, pictures of one clock, another encoding";
            found.push(Finding::wrong("picture", Health::Failed, reason.as_str(), mend));
        }
    }
    if !probed.faults.is_empty() {
        let said = probed.faults.iter().map(ToString::to_string).collect::<std::collections::BTreeSet<_>>();
        let text = said.into_iter().take(MOST_FAULTS).collect::<Vec<_>>().join("; ");
        let mend = "the programs that publish these topics write them wrongly, or the connection is bad";
        found.push(Finding::wrong("messages", Health::Warning, text, mend));
    }
    found
}

fn network(probed: &Probe) -> Finding {
    let (ms, rate) = (probed.connected_in.as_secs_f64() * 1e3, probed.bytes as f64 / probed.listened.as_secs_f64());
    let text = format!("connected in {ms:.0} ms, {:.1} MB/s come", rate * 1e-6);
    let details = json!({ "connected_ms": ms, "bytes_per_s": rate });
    let found = if probed.connected_in > SLOW {
        Finding::wrong("network", Health::Warning, text, "use a cable, and a network that others do not fill")
    } else {
        Finding::ok("network", text)
    };
    Finding { details, ..found }
}

/// Which topics are inspected, and how often they come.
fn topics(cell: &CellSection, probed: &Probe) -> Finding {
    let what = "topics";
    let details = probed.topics.iter().map(|(name, topic)| {
        json!({ "topic": name, "type": topic.type_name, "messages": topic.messages, "rate_hz": topic.rate })
    });
    let details = json!(details.collect::<Vec<_>>());
    let found = match &probed.chosen {
        Err(reason) => {
            let mend =
                "start the camera's driver; name the topics with cell.camera.color, depth, color_info and depth_info";
            Finding::wrong(what, Health::Failed, reason.as_str(), mend)
        }
        Ok((color, depth)) => {
            let rate = |name: &String| probed.topics.get(name).and_then(|topic| topic.rate);
            let said = |name: &String| {
                let rate = rate(name).map_or_else(|| "one picture came".to_owned(), |rate| format!("{rate:.1} Hz"));
                format!("{name} {rate}")
            };
            let text = color.iter().chain([depth]).map(said).collect::<Vec<_>>().join(", ");
            let slowest =
                color.iter().chain([depth]).map(|name| rate(name).unwrap_or(0.0)).fold(f64::INFINITY, f64::min);
            match cell.camera.rate_hz {
                Some(expected) if slowest < LEAST_RATE * expected => {
                    let mend = "lower the resolution, send compressed pictures, use USB 3 or a faster network; or say with \
                                cell.camera.rate_hz what is right";
                    Finding::wrong(what, Health::Failed, format!("{text}, and {expected} Hz are expected"), mend)
                }
                _ => Finding::ok(what, text),
            }
        }
    };
    Finding { details, ..found }
}

/// The stamps against this machine's clock.
fn clocks(probed: &Probe) -> Finding {
    let what = "clocks";
    let behind = probed.topics.iter().filter_map(|(name, topic)| Some((name, topic.behind?)));
    let Some((name, behind)) = behind.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else {
        return Finding::wrong(what, Health::Warning, "no picture came", "start the camera's driver");
    };
    let side = if behind >= 0.0 { "behind" } else { "ahead of" };
    let text = format!("the stamps of {name} are {:.3} s {side} this machine's clock", behind.abs());
    let found = if behind.abs() > CLOCK {
        let mend = "set all clocks by one: chrony or PTP on the robot, the camera's computer and here; no simulated time \
                    (use_sim_time) outside of a simulation";
        Finding::wrong(what, Health::Failed, text, mend)
    } else {
        Finding::ok(what, text)
    };
    Finding { details: json!({ "topic": name, "behind_s": behind }), ..found }
}

/// Whether the transforms lead to the camera.
fn transforms(cell: &CellSection, address: &LiveAddress, probed: &Probe) -> Finding {
    let what = "transforms";
    match &probed.pose {
        Ok((fixed, camera)) => Finding::ok(what, format!("lead from {fixed:?} to {camera:?}")),
        Err(reason) => {
            // A camera that somebody holds has none; who names frames means to have them.
            let frames = &cell.frames;
            let are_meant =
                [&frames.base, &frames.ee, &frames.camera, &frames.table].iter().any(|frame| frame.is_some());
            let (health, instead) = match are_meant || address.trigger == Trigger::Still {
                true => (Health::Failed, ""),
                false => (Health::Warning, "; poses are found by the pictures alone"),
            };
            let mend = "start the robot's state publisher (robot_state_publisher) and the driver of the joints; join the camera to it \
                        with a static transform, or calibrate it and name cell.frames.ee";
            Finding::wrong(what, health, format!("{reason}{instead}"), mend)
        }
    }
}
