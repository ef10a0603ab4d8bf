//! A server of the test's own streams pictures; views come of it as from a recording of the same messages.

use super::test_server::{Step, calibration, image, pair, server, transform};
use super::*;
use semascan_perception::view::PoseEvidence;

/// Red, depth and x of a view, millimetres.
type Seen = (u8, u32, Option<i32>);

/// What each view shows, and what the source says of itself in the end.
fn views(uri: &str) -> (Vec<Seen>, Vec<(String, String)>) {
    let mut source = crate::open(uri, OpenOptions::default()).expect("a server");
    let mut found = Vec::new();
    while let Some(view) = source.next_view() {
        let view = view.expect("a view");
        let x = match view.pose {
            PoseEvidence::World { table_from_camera, .. } => {
                Some((table_from_camera.translation.x * 1e3).round() as i32)
            }
            _ => None,
        };
        found.push((view.rgb.get_pixel(0, 0).0[0], (view.depth.metres[0] * 1e3).round() as u32, x));
    }
    (found, source.info().settings.clone())
}

#[test]
fn pairs_become_views_with_the_poses_of_their_times_though_connections_are_cut() {
    let mut steps = vec![calibration()];
    for number in 0..8_u8 {
        let ms = i64::from(number) * 100;
        // The transform of a picture's time comes after it.
        steps.extend(pair(ms, number));
        steps.push(transform(ms, 0.01 * f64::from(number)));
        steps.push(transform(ms + 50, 0.01 * f64::from(number)));
        if number == 4 {
            steps.push(Step::Pause(1800));
            steps.push(Step::Cut);
            steps.push(calibration());
        }
    }
    let (found, settings) = views(&format!("{}?silence_s=3", server(steps)));
    let expected: Vec<_> = (0..8).map(|n| (n, 500 + u32::from(n), Some(10 * i32::from(n)))).collect();
    assert_eq!(found, expected);
    let stream = settings.iter().find(|(name, _)| name == "stream").map(|(_, text)| text.clone()).expect("said");
    assert!(
        stream.starts_with("8 pairs came, 0 were passed over, 0 had no pose, 0 were broken; 0 messages were dropped"),
        "{stream}"
    );
    assert!(stream.contains("2 connections"), "{stream}");
}

#[test]
fn a_view_is_taken_where_the_camera_rests_and_the_stream_ends_with_their_number() {
    let mut steps = vec![calibration()];
    // Half a second at each of three places, and a way of 0.2 s between them.
    for frame in 0..60_u8 {
        let ms = i64::from(frame) * 33;
        let place = f64::from(frame) * 0.033 / 0.7;
        let x = place.floor() * 0.05 + ((place.fract() - 0.714).max(0.0) / 0.286) * 0.05;
        steps.push(transform(ms - 1, x));
        steps.push(transform(ms + 5, x));
        steps.extend(pair(ms, frame));
    }
    steps.push(transform(2000, 0.15));
    let (found, settings) = views(&format!("{}?trigger=still&views=2&still_ms=200&silence_s=3", server(steps)));
    assert_eq!(found.iter().map(|(_, _, x)| *x).collect::<Vec<_>>(), [Some(0), Some(50)], "{settings:?}");
    assert!(found.iter().all(|(red, mm, _)| u32::from(*red) + 500 == *mm), "{found:?}");
}

#[test]
fn what_streams_no_pictures_and_who_does_not_answer_are_named() {
    let error = crate::open("ws://127.0.0.1:9/", OpenOptions::default()).err().expect("nobody").to_string();
    assert!(error.contains("ws://127.0.0.1:9/"), "{error}");
    let error = crate::open("ws://127.0.0.1:9/?colour=/c", OpenOptions::default()).err().expect("no key").to_string();
    assert!(error.contains("trigger") && error.contains("depth"), "{error}");
    let mut source =
        crate::open(&format!("{}?silence_s=1", server(vec![calibration()])), OpenOptions::default()).expect("one");
    let error = source.next_view().expect("why").expect_err("no pictures").to_string();
    assert!(error.contains("no topic has depth pictures") && error.contains("1 s"), "{error}");
    assert!(source.next_view().is_none());
}

#[test]
fn colours_without_depth_are_an_error_though_they_go_on() {
    let colors = (0..40).flat_map(|n| [Step::Send(0, 100 * n, image(100 * n, "rgb8", &[1, 2, 3])), Step::Pause(100)]);
    let steps = [calibration()].into_iter().chain(colors).collect();
    let mut source = crate::open(&format!("{}?silence_s=2", server(steps)), OpenOptions::default()).expect("one");
    let error = source.next_view().expect("why").expect_err("no depth").to_string();
    assert!(error.contains("no topic has depth pictures") && error.contains("/camera/color/image (colour)"), "{error}");
    assert!(source.next_view().is_none());
}

#[test]
fn a_clock_that_is_set_back_loses_what_waits_and_nothing_else() {
    let mut steps = vec![calibration()];
    for (number, ms) in [(0, 5000), (1, 5100), (2, 100), (3, 200)] {
        steps.push(transform(ms - 1, 0.001 * f64::from(number)));
        steps.push(transform(ms + 5, 0.001 * f64::from(number)));
        steps.extend(pair(ms, number));
        steps.push(Step::Pause(900));
    }
    let (found, settings) = views(&format!("{}?silence_s=2", server(steps)));
    assert_eq!(found.iter().map(|(red, ..)| *red).collect::<Vec<_>>(), [0, 1, 2, 3], "{settings:?}");
    assert!(settings.iter().any(|(_, text)| text.contains("the clock was set 1 times")), "{settings:?}");
}

#[test]
fn what_is_recorded_is_inspected_like_the_stream() {
    let mut steps = vec![calibration()];
    for number in 0..5_u8 {
        let ms = i64::from(number) * 100;
        steps.push(transform(ms - 1, 0.01 * f64::from(number)));
        steps.push(transform(ms + 5, 0.01 * f64::from(number)));
        steps.extend(pair(ms, number));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cell.mcap");
    let address = LiveAddress::read(&format!("{}?silence_s=1", server(steps))).expect("an address");
    let recorded = record(&address, &path, None, || false).expect("recorded");
    assert_eq!(recorded.messages["/camera/color/image"], 5, "{recorded:?}");
    assert!(recorded.end.contains("1 s"), "{recorded:?}");
    assert!(record(&address, &path, None, || false).is_err(), "no file is replaced");
    let (found, _) = views(&path.display().to_string());
    assert_eq!(found, (0..5).map(|n| (n, 500 + u32::from(n), Some(10 * i32::from(n)))).collect::<Vec<_>>());
}

#[test]
fn a_view_is_taken_after_each_message_of_a_topic_and_when_it_is_asked_for() {
    let mut steps = vec![calibration()];
    for number in 0..100_u8 {
        let ms = i64::from(number) * 33;
        steps.push(transform(ms - 1, 0.001 * f64::from(number)));
        steps.push(transform(ms + 5, 0.001 * f64::from(number)));
        steps.extend(pair(ms, number));
        if number == 70 || number == 90 {
            let Step::Send(_, _, message) = transform(ms, 0.0) else { continue };
            steps.push(Step::Send(4, ms, message));
        }
        steps.push(Step::Pause(33));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("all.mcap");
    let uri = format!("{}?trigger=topic:/cell/capture&silence_s=2&record={}", server(steps), file.display());
    let mut source = crate::open(&uri, OpenOptions::default()).expect("a server");
    let trigger = source.capture_trigger().expect("it can be asked");
    let asked = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(2600));
        trigger.ask()
    });
    let views: Vec<u8> =
        std::iter::from_fn(|| source.next_view()).map(|view| view.expect("a view").rgb.get_pixel(0, 0).0[0]).collect();
    assert!(asked.join().expect("asked"));
    assert_eq!(views.len(), 3, "{views:?}");
    let after = |at: u8| views.iter().any(|view| (at + 1..at + 4).contains(view));
    assert!(after(70) && after(90), "the next pair after a message: {views:?}");
    let stream = source.info().settings.iter().find(|(name, _)| name == "stream").map(|(_, said)| said.clone());
    // 100 pairs, 200 transforms, one calibration, two messages of the trigger's topic.
    assert!(stream.as_ref().is_some_and(|said| said.ends_with("403 messages were recorded and 0 lost")), "{stream:?}");
    drop(source);
    let (recorded, _) = self::views(&file.display().to_string());
    assert_eq!(recorded.len(), 100, "everything is in the file, whatever was taken");
}

#[test]
fn a_server_is_listened_to_for_what_it_is_like() {
    let mut steps = vec![calibration()];
    for number in 0..60_u8 {
        let ms = i64::from(number) * 33;
        steps.push(transform(ms - 1, 0.001 * f64::from(number)));
        steps.extend(pair(ms, number));
        steps.push(Step::Pause(33));
    }
    let address = LiveAddress::read(&server(steps)).expect("an address");
    let probed = probe(&address, &OpenOptions::default(), Duration::from_millis(1200)).expect("a server");
    let depth = &probed.topics["/camera/depth/image"];
    assert!(depth.rate.is_some_and(|rate| (15.0..40.0).contains(&rate)), "{depth:?}");
    assert!(depth.behind.is_some_and(|behind| behind > 1e8), "the stamps are of 1970: {depth:?}");
    assert_eq!(probed.chosen, Ok((Some("/camera/color/image".to_owned()), "/camera/depth/image".to_owned())));
    assert_eq!(probed.pose, Ok(("table".to_owned(), "camera".to_owned())));
    let view = probed.view.expect("a view");
    assert!((view.depth.metres[0] - 0.5).abs() < 0.1, "{}", view.depth.metres[0]);
    assert!(probed.faults.is_empty(), "{:?}", probed.faults);
}
