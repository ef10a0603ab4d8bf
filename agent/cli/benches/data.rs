//! A data folder with 10 000 past inspections: how long `serve --data` takes to start, and what lists, filters and reviews take
//! over HTTP. `cargo xtask bench data`.
//!
//! One inspection is made by the program itself; the others are copies of all its rows and of its record, with parts, states,
//! verdicts and findings of their own. What is asked for stands beside what was measured: a start within 1 s, a list within
//! 20 ms, 99 of 100 reviews within 250 ms. Past that the bench fails.
#![allow(clippy::print_stdout)]

use rusqlite::{Connection, Transaction, params};
use semascan_inspection::ports::{Catalogue, InspectionFilter};
use semascan_model::InspectionId;
use semascan_store::data::DataFolder;
use serde_json::{Map, Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

const INSPECTIONS: u64 = 10_000;
const MOTOR: &str = "virtual:starter-motor?seed=3&views=8&size=320x240&cell=2.5";
/// When the first of them began, milliseconds after 1970; one each minute.
const BEGAN: u64 = 1_700_000_000_000;
const STARTS: usize = 5;
const REQUESTS: usize = 50;
const REVIEWS: usize = 600;

/// What is asked for, milliseconds.
const START_MS: f64 = 1000.0;
const LIST_MS: f64 = 20.0;
const REVIEW_MS: f64 = 250.0;

fn main() -> ExitCode {
    let scratch = tempfile::tempdir().expect("a folder");
    let data = scratch.path().join("data");
    let first = fill(&data);
    let mut starts: Vec<f64> = (0..STARTS).map(|_| Agent::start(&data).started_ms).collect();
    starts.sort_by(f64::total_cmp);
    let agent = Agent::start(&data);
    let mut lists = Map::new();
    let mut slowest: f64 = 0.0;
    for (name, query) in [
        ("first page", ""),
        ("page in the middle", "?until=2023-11-18T00:00:00Z"),
        ("largest page", "?limit=200"),
        ("part", "?part=motor%207"),
        ("piece of few names", "?part=R%20299"),
        ("piece of all names", "?part=OTO"),
        ("piece of no name", "?part=pump"),
        ("state", "?state=failed"),
        ("verdict", "?decision=reject"),
        ("common defect", "?defect=wear"),
        ("rare defect", "?defect=crack"),
        ("unknown defect", "?defect=dent"),
        ("component", "?component=gear"),
        ("conflict", "?conflict=true"),
        (
            "all at once",
            "?part=motor%207&state=finished&decision=reject&component=gear&defect=wear&from=2023-11-16T00:00:00Z",
        ),
    ] {
        let mut connection = agent.connect();
        let mut items = 0;
        let times = Times::of(REQUESTS, |_| {
            let answer = connection.ask("GET", &format!("/api/v1/inspections{query}"), "");
            items = answer["items"].as_array().expect("a list").len();
        });
        slowest = slowest.max(times.p99);
        eprintln!("{name:<20} {items:>4} rows  {times}");
        lists.insert(name.replace(' ', "_"), json!({"rows": items, "p50_ms": times.p50, "p99_ms": times.p99}));
    }
    let mut connection = agent.connect();
    let reviews = Times::of(REVIEWS, |number| {
        let path = format!("/api/v1/inspections/{first}/reviews");
        let review = json!({
            "id": format!("00000000-0000-4000-8000-{number:012x}"), "subject": {"kind": "part"}, "seen": number,
            "action": {"type": if number % 3 == 0 { "accept" } else { "comment" }}, "person": "A", "reason": "because"
        });
        assert_eq!(connection.ask("POST", &path, &review.to_string())["entry"]["sequence"], number + 1);
    });
    eprintln!("{REVIEWS} reviews        {reviews}");
    let start = starts[STARTS - 1];
    eprintln!("start: {:.0} to {start:.0} ms until the first list is answered", starts[0]);
    let bounds = [
        ("a start takes at most 1 s", start <= START_MS),
        ("a list takes at most 20 ms (p99)", slowest <= LIST_MS),
        ("a review takes at most 250 ms (p99)", reviews.p99 <= REVIEW_MS),
    ];
    for (what, held) in bounds {
        eprintln!("{} {what}", if held { "held  " } else { "BROKEN" });
    }
    let figures = json!({
        "inspections": INSPECTIONS, "start_ms": {"median": starts[STARTS / 2], "most": start}, "lists": lists,
        "reviews": {"count": REVIEWS, "p50_ms": reviews.p50, "p99_ms": reviews.p99, "most_ms": reviews.most},
    });
    println!("{figures}");
    if bounds.iter().all(|(_, held)| *held) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Fills a data folder; the inspection that was made.
fn fill(data: &Path) -> InspectionId {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    let made = command.args(["inspect", MOTOR, "--data"]).arg(data).output().expect("starts");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let folder = DataFolder::open_beside(data).expect("a data folder");
    let first = folder.catalogue().inspections(&InspectionFilter::default()).expect("reads")[0].id;
    let record = folder.result_path(first).join("inspection.json");
    drop(folder);
    let mut connection = Connection::open(data.join("semascan.db")).expect("opens");
    // The rows are copied once, and nothing is lost if that is cut off.
    connection.pragma_update(None, "synchronous", "OFF").expect("set");
    let transaction = connection.transaction().expect("begun");
    for number in 1..INSPECTIONS {
        let id = InspectionId::new(BEGAN + 60_000 * number, &[3; 10]);
        copy(&transaction, first, id, number).expect("copied");
        let folder = data.join("inspections").join(id.to_string());
        fs::create_dir(&folder).and_then(|()| fs::hard_link(&record, folder.join("inspection.json"))).expect("linked");
    }
    transaction.commit().expect("written");
    first
}

/// Copies the rows of inspection `first` to the `number`-th one.
fn copy(database: &Transaction<'_>, first: InspectionId, id: InspectionId, number: u64) -> rusqlite::Result<()> {
    let (first, id) = (first.to_string(), id.to_string());
    let part = format!("motor {}", number % 300);
    database.execute("INSERT INTO parts (name) VALUES (?1) ON CONFLICT (name) DO NOTHING", [&part])?;
    let state = if number.is_multiple_of(50) { "failed" } else { "finished" };
    let decision = ["accept", "rework", "person", "reject"][number as usize % 4];
    database.execute(
        "INSERT INTO inspections (id, part, source, spec, began, ended, state, reason, held, views, listed, decision, \
         automatic, conflicts, findings) \
         SELECT ?1, (SELECT id FROM parts WHERE name = ?2), source, spec, began, ended, ?3, reason, held, views, 1, ?4, ?4, \
         ?5, 10 FROM inspections WHERE id = ?6",
        params![id, part, state, decision, u32::from(number.is_multiple_of(500)), first],
    )?;
    for (table, columns) in
        [("views", "number, accepted, record"), ("events", "sequence, time, kind"), ("files", "name, sha256, bytes")]
    {
        let sql = format!(
            "INSERT INTO {table} (inspection, {columns}) SELECT ?1, {columns} FROM {table} WHERE inspection = ?2"
        );
        database.execute(&sql, [&id, &first])?;
    }
    let mut insert = database.prepare(
        "INSERT INTO findings (inspection, id, kind, component, defect, area) VALUES (?1, ?2, 'defect', ?3, ?4, 1e-5)",
    )?;
    for k in 0..10_usize {
        let component = ["gear", "shell", "solenoid", "axle", "plug"][k % 5];
        let is_rare = number % 1000 == 7 && k == 0;
        let defect = if is_rare { "crack" } else { ["wear", "corrosion"][k % 2] };
        insert.execute(params![id, format!("{number}-{k}"), component, defect])?;
    }
    Ok(())
}

/// A server, ended when it is dropped.
struct Agent {
    process: Child,
    address: SocketAddr,
    /// From its start to the first list that it answered.
    started_ms: f64,
}

impl Agent {
    fn start(data: &Path) -> Self {
        let begun = Instant::now();
        let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
        command.args(["serve", "--port", "0", "--data"]).arg(data).stderr(Stdio::piped());
        let mut process = command.spawn().expect("starts");
        let mut lines = BufReader::new(process.stderr.take().expect("piped")).lines().map_while(Result::ok);
        let address = lines.find_map(|line| line.split_once("listening on http://")?.1.trim().parse().ok());
        std::thread::spawn(move || lines.for_each(drop));
        let mut agent = Self { process, address: address.expect("it listens"), started_ms: 0.0 };
        agent.connect().ask("GET", "/api/v1/inspections", "");
        agent.started_ms = 1e3 * begun.elapsed().as_secs_f64();
        agent
    }

    fn connect(&self) -> Connected {
        let stream = TcpStream::connect(self.address).expect("connects");
        stream.set_nodelay(true).expect("set");
        Connected(BufReader::new(stream), self.address)
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A connection that is used for several requests.
struct Connected(BufReader<TcpStream>, SocketAddr);

impl Connected {
    /// What is answered, which must be a success.
    fn ask(&mut self, method: &str, path: &str, body: &str) -> Value {
        let content = match method {
            "POST" => format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len()),
            _ => String::new(),
        };
        let request = format!("{method} {path} HTTP/1.1\r\nHost: {}\r\n{content}\r\n{body}", self.1);
        self.0.get_mut().write_all(request.as_bytes()).expect("sent");
        let mut length = 0;
        let mut status = String::new();
        for line in self.0.by_ref().lines().map(|line| line.expect("an answer")) {
            if line.is_empty() {
                break;
            }
            if let Some(("content-length", value)) = line.to_lowercase().split_once(": ") {
                length = value.parse().expect("a length");
            }
            if status.is_empty() {
                status = line;
            }
        }
        let mut body = vec![0; length];
        self.0.read_exact(&mut body).expect("the content");
        assert!(status.starts_with("HTTP/1.1 20"), "{path}: {status}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("JSON")
    }
}

/// Milliseconds that requests took.
struct Times {
    p50: f64,
    p99: f64,
    most: f64,
}

impl Times {
    fn of(count: usize, mut work: impl FnMut(u64)) -> Self {
        let mut times: Vec<f64> = (0..count as u64)
            .map(|number| {
                let begun = Instant::now();
                work(number);
                1e3 * begun.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((share * count as f64) as usize).min(count - 1)];
        Self { p50: at(0.5), p99: at(0.99), most: at(1.0) }
    }
}

impl std::fmt::Display for Times {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "p50 {:.1} ms, p99 {:.1} ms, most {:.1} ms", self.p50, self.p99, self.most)
    }
}
