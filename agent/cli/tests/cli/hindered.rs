//! `serve --data` while nothing can be kept: the disk is full, its folders cannot be written, no file can be opened. The agent says
//! so, refuses what it cannot keep, loses nothing that it acknowledged, and goes on without a restart when that is over.
//!
//! The full disk is a small file system in a mount namespace of the agent's own.

use crate::serving::{Answer, Serving, review, serve_as};
use crate::{semascan, stderr, without_generation};
use semascan_inspection::ports::{Catalogue, InspectionFilter};
use semascan_model::InspectionId;
use semascan_model::review::Review;
use semascan_store::data::DataFolder;
use serde_json::{Value, json};
use std::fs::{self, File, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::{PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=4&size=128x96&cell=4";
/// Views come slowly enough that the disk can be filled between them.
const PACE: &str = "1";
/// Longer than anything takes that is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// A data folder with one inspection; its identifier and its model, which every other inspection of the same source comes to.
fn inspected(data: &Path) -> (InspectionId, Vec<u8>) {
    let output = semascan(&["inspect", MOTOR, "--data", data.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let folder = DataFolder::open_beside(data).expect("a data folder");
    let id = folder.catalogue().inspections(&InspectionFilter::default()).expect("reads")[0].id;
    (id, model(&folder, id))
}

/// Bytes of the model that an inspection came to, but for the line that is another one in every run.
fn model(folder: &DataFolder, id: InspectionId) -> Vec<u8> {
    without_generation(fs::read(folder.result_path(id).join("cloud.ply")).expect("a cloud"))
}

/// Waits until `is_so` says it.
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The inspection that is made beside the `past` one; nothing before it is begun.
fn made(agent: &Serving, past: InspectionId) -> Option<Value> {
    let list = agent.get("/api/v1/inspections").json();
    let items = list["items"].as_array().expect("a list").clone();
    assert!(items.len() <= 2, "it was begun once: {list}");
    items.into_iter().find(|item| item["id"] != past.to_string())
}

/// That inspection has ended and came to the model that it always comes to, what was `acknowledged` is kept and nothing else, and
/// `verify` finds no fault.
fn check_end(agent: &Serving, past: InspectionId, expected: &[u8], acknowledged: &[Value], mut verify: Command) {
    wait_until("the inspection ends", || made(agent, past).is_some_and(|item| item["state"] != "running"));
    let item = made(agent, past).expect("there");
    assert_eq!((&item["state"], &item["views"]), (&json!("finished"), &json!(4)), "{item}");
    let cloud = agent.get(&format!("/api/v1/inspections/{}/exports/cloud.ply", item["id"].as_str().expect("an id")));
    assert!(without_generation(cloud.body) == expected, "another model");
    let mut kept = Vec::new();
    let mut next = Some(0);
    while let Some(after) = next {
        let page = agent.get(&format!("/api/v1/inspections/{past}/reviews?limit=500&after={after}")).json();
        kept.extend(page["items"].as_array().expect("a list").iter().map(|entry| entry["review"].clone()));
        next = page["next"].as_u64();
    }
    let whole = |review: &Value| {
        let review: Review = serde_json::from_value(review.clone()).expect("a review");
        serde_json::to_value(&review).expect("plain data")
    };
    assert_eq!(kept.iter().map(whole).collect::<Vec<_>>(), acknowledged.iter().map(whole).collect::<Vec<_>>());
    let verified = verify.output().expect("starts");
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
}

fn verify(data: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.arg("verify").arg(data);
    command
}

/// A remark of its own name about the part.
fn remark(number: u64) -> Value {
    review(number, json!({"kind": "part"}), 0, json!({"type": "comment"}))
}

/// What is refused because it cannot be kept: a problem that names the reason, and says that it may be sent again.
fn assert_refused(answer: &Answer, status: u16, word: &str) {
    assert_eq!(answer.status, status, "{}", String::from_utf8_lossy(&answer.body));
    assert_eq!(answer.field(), "");
    let detail = answer.json()["detail"].as_str().unwrap_or_default().to_lowercase();
    assert!(detail.contains(word), "{detail}");
    assert!(answer.headers.contains_key("retry-after"), "{answer:?}");
}

/// Whether this user may mount a file system of their own.
fn can_mount() -> bool {
    let script = "mount -t tmpfs tmpfs /mnt";
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", script]).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[test]
fn a_full_disk_is_said_and_everything_goes_on_when_there_is_room_again() {
    if !can_mount() {
        eprintln!("SKIPPED: no file system can be mounted here (unshare --map-root-user --mount)");
        return;
    }
    let root = tempfile::tempdir().expect("temporary folder");
    let (data, disk) = (root.path().join("data"), root.path().join("disk"));
    let (past, expected) = inspected(&data);
    fs::create_dir(&disk).expect("made");
    let script = "mount -t tmpfs -o size=48m tmpfs \"$1\" && cp -a \"$2\" \"$1\"/data && \
                  exec \"$3\" serve --port 0 --data \"$1\"/data --source \"$4\" --pace \"$5\"";
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", script, "sh"]).args([&disk, &data]);
    command.args([env!("CARGO_BIN_EXE_semascan"), MOTOR, PACE]);
    let agent = serve_as(command);
    // A program that sees the disk as the agent does.
    let mut verify = Command::new("nsenter");
    verify.args(["--target", &agent.child.id().to_string(), "--user", "--mount", "--preserve-credentials"]);
    verify.args([env!("CARGO_BIN_EXE_semascan"), "verify"]).arg(disk.join("data"));
    let disk = PathBuf::from(format!("/proc/{}/root{}", agent.child.id(), disk.display()));
    let views = || made(&agent, past).map_or(0, |item| item["views"].as_u64().expect("a number"));
    wait_until("the first view is kept", || views() > 0);
    assert_eq!(agent.get("/readyz").status, 200);

    let mut ballast = File::create(disk.join("ballast")).expect("made");
    let block = vec![1; 1 << 16];
    while ballast.write_all(&block).is_ok() {}
    while ballast.write_all(&block[..512]).is_ok() {}
    // Some more fit into what the log of the database holds already.
    let mut acknowledged = Vec::new();
    let refused = (1..2000).find_map(|number| {
        let answer = agent.review(past, &remark(number));
        match answer.status {
            201 => acknowledged.push(remark(number)),
            _ => return Some((remark(number), answer)),
        }
        None
    });
    let (refused, answer) = refused.expect("the disk is full at some time");
    assert_refused(&answer, 507, "full");
    // Not by the review that was refused alone: it is tried.
    std::thread::sleep(Duration::from_millis(600));
    let ready = agent.get("/readyz");
    let reason = ready.json()["reason"].as_str().unwrap_or_default().to_lowercase();
    assert!(ready.status == 503 && (reason.contains("space") || reason.contains("full")), "{reason}");
    // The inspection waits for the disk, and says so.
    let health = || agent.get("/healthz");
    wait_until("the inspection waits", || {
        health().json()["message"].as_str().is_some_and(|message| message.contains("cannot be kept"))
    });
    let health = health();
    assert_eq!((health.status, health.json()["state"].as_str()), (200, Some("running")));
    let held = views();
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(views(), held, "no view is acknowledged");
    assert!(held < 4, "the disk was full too late to test anything");
    assert_eq!(agent.review(past, &refused).status, 507);
    assert_eq!(agent.get("/api/v1/inspections").status, 200, "what is kept can be read");
    assert!(metric(&agent, "semascan_ready").ends_with(" 0"));

    drop(ballast);
    fs::remove_file(disk.join("ballast")).expect("removed");
    wait_until("it is ready again", || agent.get("/readyz").status == 200);
    assert_eq!(agent.review(past, &refused).status, 201);
    acknowledged.push(refused);
    assert_eq!(agent.review(past, &acknowledged[0]).status, 200, "it was taken in before");
    check_end(&agent, past, &expected, &acknowledged, verify);
    assert_eq!(agent.get("/readyz").status, 200);
    eprintln!("{} reviews fitted in after the disk was full; none is lost", acknowledged.len() - 1);
}

fn metric(agent: &Serving, name: &str) -> String {
    let text = String::from_utf8(agent.get("/metrics").body).expect("UTF-8");
    text.lines().find(|line| line.starts_with(name)).unwrap_or_default().to_owned()
}

#[test]
fn folders_that_cannot_be_written_are_said_and_waited_for() {
    /// A user without rights: root may write everywhere.
    const NOBODY: u32 = 65534;
    let root = tempfile::tempdir().expect("temporary folder");
    let (home, program) = (root.path().join("home"), root.path().join("semascan"));
    let data = home.join("data");
    fs::create_dir(&home).expect("made");
    let (past, expected) = inspected(&data);
    fs::copy(env!("CARGO_BIN_EXE_semascan"), &program).expect("copied");
    fs::set_permissions(root.path(), Permissions::from_mode(0o755)).expect("set");
    let is_root = chown(&home, Some(NOBODY), None).is_ok();
    let mut folders = vec![home.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("reads") {
            let path = entry.expect("reads").path();
            if is_root {
                chown(&path, Some(NOBODY), None).expect("set");
            }
            if path.is_dir() {
                folders.push(path);
            }
        }
    }
    let allow = |folder: &Path, mode: u32| fs::set_permissions(folder, Permissions::from_mode(mode)).expect("set");
    let serving = || {
        let mut command = Command::new(&program);
        command.args(["serve", "--port", "0", "--source", MOTOR, "--pace", PACE, "--data"]).arg(&data).current_dir("/");
        if is_root {
            command.uid(NOBODY);
        }
        command
    };
    // A folder that cannot be written at all is no data folder: refused by its name.
    allow(&data, 0o555);
    let refused = serving().output().expect("starts");
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
    assert!(stderr(&refused).contains(data.to_str().expect("UTF-8")), "{}", stderr(&refused));
    allow(&data, 0o755);

    // Before it begins.
    let results = data.join("inspections");
    allow(&results, 0o555);
    let agent = serve_as(serving());
    let ready = || {
        let answer = agent.get("/readyz");
        (answer.status, answer.json()["reason"].as_str().unwrap_or_default().to_owned())
    };
    wait_until("it is said", || ready().0 == 503 && ready().1.contains("ermission denied"));
    assert_eq!(agent.get("/healthz").status, 200);
    assert_eq!(agent.review(past, &remark(1)).status, 201, "the log of reviews can be written");
    allow(&results, 0o755);
    wait_until("it begins", || agent.get("/healthz").json()["state"] == "running" && ready().0 == 200);
    // And in the middle: what is captured goes on, and the model waits.
    allow(&results, 0o555);
    allow(&data, 0o555);
    wait_until("it is said again", || ready().0 == 503 && ready().1.contains("ermission denied"));
    wait_until("the model waits", || ready().1.contains("could not be saved"));
    allow(&data, 0o755);
    allow(&results, 0o755);
    check_end(&agent, past, &expected, &[remark(1)], verify(&data));
    wait_until("it is ready", || ready().0 == 200);
    drop(agent);
}

/// A connection that is used for several requests: no further file is opened for them.
struct Kept(BufReader<TcpStream>);

impl Kept {
    fn ask(&mut self, method: &str, path: &str, body: &str) -> Answer {
        let stream = self.0.get_mut();
        let address = stream.peer_addr().expect("connected");
        let content = format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len());
        let content = if method == "POST" { content.as_str() } else { "" };
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: {address}\r\n{content}\r\n{body}").expect("sent");
        let mut lines =
            self.0.by_ref().lines().map(|line| line.expect("an answer")).take_while(|line| !line.is_empty());
        let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).expect("a status");
        let headers = lines.filter_map(|line| line.split_once(": ").map(|(n, v)| (n.to_lowercase(), v.to_owned())));
        let headers: std::collections::BTreeMap<_, _> = headers.collect();
        let mut body = vec![0; headers["content-length"].parse().expect("a length")];
        self.0.read_exact(&mut body).expect("a body");
        Answer { status, headers, body }
    }
}

#[test]
fn an_agent_that_can_open_no_file_says_so_and_goes_on_when_it_can() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("data");
    let (past, expected) = inspected(&data);
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["serve", "--port", "0", "--source", MOTOR, "--pace", PACE, "--data"]).arg(&data);
    let agent = serve_as(command);
    wait_until("it runs", || agent.get("/healthz").json()["state"] == "running");
    let limit = |files: &str| {
        let process = agent.child.id().to_string();
        let set = Command::new("prlimit").args(["--pid", &process, &format!("--nofile={files}")]).status();
        assert!(set.is_ok_and(|status| status.success()), "prlimit is there");
    };
    let connect = || Kept(BufReader::new(TcpStream::connect(agent.address).expect("connects")));
    // A refused command ends its connection.
    let (mut kept, mut commands) = (connect(), connect());
    assert_eq!((kept.ask("GET", "/readyz", "").status, commands.ask("GET", "/readyz", "").status), (200, 200));
    // What is open stays open; no number for another file is left.
    limit("3:");
    let path = format!("/api/v1/inspections/{past}/reviews");
    wait_until("it is said", || {
        let answer = kept.ask("GET", "/readyz", "");
        answer.status == 503 && answer.json()["reason"].as_str().is_some_and(|reason| reason.contains("open files"))
    });
    let refused = commands.ask("POST", &path, &remark(1).to_string());
    assert_refused(&refused, 503, "open files");
    assert_eq!(kept.ask("GET", "/healthz", "").status, 200);
    // The inspection comes to its end, and its model waits.
    wait_until("the model waits", || {
        let answer = kept.ask("GET", "/readyz", "");
        answer.json()["reason"].as_str().is_some_and(|reason| reason.contains("could not be saved"))
    });
    limit("1024:");
    assert_eq!(kept.ask("POST", &path, &remark(1).to_string()).status, 201);
    check_end(&agent, past, &expected, &[remark(1)], verify(&data));
    wait_until("it is ready", || kept.ask("GET", "/readyz", "").status == 200);
    assert_eq!(agent.get("/readyz").status, 200, "new connections are taken again");
}
