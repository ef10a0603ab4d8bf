//! Users, tokens, `init`, and an agent that asks for a login: nothing secret is said anywhere.

use crate::{LONGEST, ended, semascan, stderr};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const PASSWORD: &str = "correct-horse-battery";

/// The program with `input` on its stdin.
fn semascan_with(args: &[&str], input: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    // One that refuses its arguments has ended already.
    let _ = child.stdin.take().expect("piped").write_all(input.as_bytes());
    ended(child, LONGEST)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// Lines of stdout.
fn said(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A cell with the administrator anna; its data folder.
fn cell(root: &Path) -> String {
    let made = semascan_with(&["init", text(root), "--user", "anna"], &format!("{PASSWORD}\n"));
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    text(&root.join("data")).to_owned()
}

#[test]
fn init_makes_a_cell_once_and_nothing_by_halves() {
    let root = tempfile::tempdir().expect("temporary folder");
    let folder = root.path().join("cell");
    for (password, word) in [("short\n", "fewer than 8"), ("", "no password"), ("aaaaaaaaaa\n", "guessed")] {
        let refused = semascan_with(&["init", text(&folder), "--user", "anna"], password);
        assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
        assert!(stderr(&refused).contains(word), "{}", stderr(&refused));
        assert!(!folder.exists(), "nothing was made");
    }
    assert_eq!(semascan(&["init", text(&folder)]).status.code(), Some(2), "no user is named");
    let data = cell(&folder);
    assert_eq!(semascan(&["config", text(&folder.join("cell.toml"))]).status.code(), Some(0));
    let criteria = fs::read_to_string(folder.join("criteria.toml")).expect("reads");
    assert!(criteria.starts_with('#') && criteria.contains("[[defect]]"));
    assert_eq!(semascan(&["verify", &data]).status.code(), Some(0));
    assert!(said(&semascan(&["user", "list", "--data", &data])).starts_with("anna "));
    // Each of the three stands in the way.
    for there in ["cell.toml", "criteria.toml", "data"] {
        let other = root.path().join(format!("with {there}"));
        fs::create_dir(&other).expect("made");
        fs::write(other.join(there), "mine").expect("written");
        let refused = semascan_with(&["init", text(&other), "--user", "anna"], &format!("{PASSWORD}\n"));
        assert_eq!(refused.status.code(), Some(2));
        assert!(stderr(&refused).contains(there) && stderr(&refused).contains("nothing is overwritten"));
        assert_eq!(fs::read_dir(&other).expect("reads").count(), 1);
    }
}

#[test]
fn users_are_added_changed_and_removed() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let user = |args: &[&str], input: &str| semascan_with(&[&["user"], args, &["--data", &data]].concat(), input);
    let add = |name: &str, role: &str| user(&["add", name, "--role", role], &format!("{PASSWORD}\n"));
    assert_eq!(add("otto", "reviewer").status.code(), Some(0));
    for (name, role, word) in [
        ("otto", "viewer", "is a user already"),
        ("Otto", "viewer", "small letters"),
        ("o tto", "viewer", "small letters"),
        ("emil", "boss", "viewer, reviewer, operator, admin"),
    ] {
        let refused = add(name, role);
        assert_eq!(refused.status.code(), Some(2), "{name} {role}");
        assert!(stderr(&refused).contains(word), "{}", stderr(&refused));
    }
    assert_eq!(user(&["role", "otto", "operator"], "").status.code(), Some(0));
    assert_eq!(user(&["password", "otto"], "another-password\n").status.code(), Some(0));
    assert_eq!(user(&["password", "nobody"], "another-password\n").status.code(), Some(2));
    let listed: serde_json::Value = serde_json::from_str(&said(&user(&["list", "--json"], ""))).expect("JSON");
    assert_eq!(listed["users"][1]["name"], "otto");
    assert_eq!(listed["users"][1]["role"], "operator");
    assert!(!listed.to_string().contains("argon2"), "{listed}");
    assert_eq!(user(&["remove", "otto"], "").status.code(), Some(0));
    assert_eq!(user(&["remove", "otto"], "").status.code(), Some(2));
    assert!(stderr(&add("otto", "viewer")).contains("was a user"));
    assert!(said(&user(&["list"], "")).contains("removed"));
    // A slip of the name makes no folder.
    let other = root.path().join("other");
    let refused = semascan(&["user", "list", "--data", text(&other)]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("semascan init") && !other.exists());
}

#[test]
fn a_token_is_shown_once() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let token = |args: &[&str]| semascan(&[&["token"], args, &["--data", &data]].concat());
    let made = token(&["add", "dashboard", "--role", "operator", "--days", "30"]);
    let secret = said(&made).trim().to_owned();
    assert!(secret.starts_with("semascan_") && !secret.contains(char::is_whitespace), "{secret}");
    assert!(!stderr(&made).contains(&secret[9..]));
    for list in [&["list"][..], &["list", "--json"]] {
        let listed = said(&token(list));
        assert!(listed.contains("dashboard") && !listed.contains(&secret[9..20]), "{listed}");
    }
    let database = fs::read(root.path().join("data/semascan.db")).expect("reads");
    assert!(!database.windows(20).any(|window| window == &secret.as_bytes()[9..29]));
    assert_eq!(token(&["add", "dashboard"]).status.code(), Some(2));
    assert_eq!(token(&["revoke", "dashboard"]).status.code(), Some(0));
    assert_eq!(token(&["revoke", "dashboard"]).status.code(), Some(2));
}

#[test]
fn an_agent_that_others_reach_does_not_start_without_users_and_says_what_to_type() {
    let root = tempfile::tempdir().expect("temporary folder");
    let empty = root.path().join("empty");
    let no_user = semascan(&["init", text(&empty), "--no-user"]);
    assert_eq!(no_user.status.code(), Some(0), "{}", stderr(&no_user));
    let empty = text(&empty.join("data")).to_owned();
    for (args, word) in [
        (&["serve", "--port", "0", "--listen", "0.0.0.0"][..], "semascan user add NAME --role admin --data DIR"),
        (&["serve", "--port", "0", "--listen", "::"], "semascan user add"),
        (&["demo", "--no-open", "--port", "0", "--listen", "0.0.0.0"], "semascan user add"),
        (&["serve", "--port", "0", "--listen", "0.0.0.0", "--data", &empty], "semascan user add"),
        (&["serve", "--port", "0", "--login"], "--users"),
        (&["serve", "--port", "0", "--login", "--users", &empty], "semascan user add"),
        (&["serve", "--port", "0", "--tls"], "--tls-cert"),
        (&["serve", "--port", "0", "--tls-cert", "/nonexistent.pem"], "--tls-key"),
        (&["serve", "--port", "0", "--tls-cert", "/nonexistent.pem", "--tls-key", "/none.pem"], "/nonexistent.pem"),
    ] {
        let refused = semascan(args);
        assert_eq!(refused.status.code(), Some(2), "{args:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(word), "{args:?}: {}", stderr(&refused));
    }
}

/// An agent that listens, and what it has said.
struct Agent {
    child: Child,
    address: SocketAddr,
    log: std::sync::mpsc::Receiver<String>,
    said: String,
}

impl Agent {
    fn start(args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
        command.args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("starts");
        let lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let (sender, log) = std::sync::mpsc::channel();
        std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| sender.send(line)));
        let mut said = String::new();
        let address = loop {
            let line = log.recv_timeout(Duration::from_secs(60)).expect("it listens");
            said.push_str(&line);
            said.push('\n');
            if let Some((_, rest)) = line.split_once("listening on http") {
                let rest = rest.trim_start_matches('s').trim_start_matches("://");
                break rest
                    .trim_end_matches(['"', '}'])
                    .split('"')
                    .next()
                    .expect("an address")
                    .parse()
                    .expect("an address");
            }
        };
        Self { child, address, log, said }
    }

    /// The answer to a request.
    fn ask(&self, head: &str, body: &str) -> String {
        let mut stream = TcpStream::connect(self.address).expect("connects");
        stream.set_read_timeout(Some(Duration::from_secs(30))).expect("set");
        let length = if body.is_empty() { String::new() } else { format!("Content-Length: {}\r\n", body.len()) };
        let (line, headers) = head.split_once('\n').unwrap_or((head, ""));
        let headers = headers.replace('\n', "\r\n");
        let end = if headers.is_empty() { "" } else { "\r\n" };
        let request = format!(
            "{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{length}{headers}{end}\r\n{body}",
            self.address
        );
        stream.write_all(request.as_bytes()).expect("sends");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answers");
        answer
    }

    fn log_in(&self, name: &str, password: &str) -> String {
        let body = format!(r#"{{"name":"{name}","password":"{password}"}}"#);
        self.ask("POST /api/v1/login\nContent-Type: application/json\nX-Semascan-Request: 1", &body)
    }

    /// Ends it; all that it said.
    fn end(mut self) -> String {
        #[cfg(unix)]
        Command::new("kill").arg(self.child.id().to_string()).status().expect("kill is there");
        #[cfg(not(unix))]
        self.child.kill().expect("ends");
        self.child.wait().expect("ended");
        self.said + &self.log.iter().collect::<Vec<_>>().join("\n")
    }
}

#[test]
fn nothing_secret_is_in_the_log() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let token = said(&semascan(&["token", "add", "prometheus", "--role", "operator", "--data", &data]));
    let token = token.trim();
    let agent = Agent::start(&["-vv", "--log-format", "json", "serve", "--port", "0", "--login", "--users", &data]);
    let right = agent.log_in("anna", PASSWORD);
    assert!(right.starts_with("HTTP/1.1 200"), "{right}");
    let (_, cookie) = right.split_once("set-cookie: ").expect("a cookie");
    let cookie = cookie.split(';').next().expect("a value");
    assert!(agent.log_in("anna", "wrong-horse-battery").starts_with("HTTP/1.1 401"));
    assert!(agent.log_in("typed-my-password-here", PASSWORD).starts_with("HTTP/1.1 401"));
    assert!(agent.ask("GET /api/v1/me", "").starts_with("HTTP/1.1 401"));
    assert!(agent.ask(&format!("GET /api/v1/me\nCookie: {cookie}"), "").starts_with("HTTP/1.1 200"));
    let metrics = agent.ask(&format!("GET /metrics\nAuthorization: Bearer {token}"), "");
    assert!(metrics.contains("semascan_connections{") && metrics.ends_with("# EOF\n"), "{metrics}");
    assert!(metrics.contains(r#"semascan_refusals_total{of="logins refused"} 2"#), "{metrics}");
    let logout = agent.ask(&format!("POST /api/v1/logout\nCookie: {cookie}\nX-Semascan-Request: 1"), "");
    assert!(logout.starts_with("HTTP/1.1 204"), "{logout}");
    assert!(agent.ask(&format!("GET /api/v1/me\nCookie: {cookie}"), "").starts_with("HTTP/1.1 401"));
    let log = agent.end();
    assert!(log.contains("anna (admin) logged in") && log.contains("login refused"), "{log}");
    let (_, value) = cookie.split_once('=').expect("a pair");
    let (secret, signature) = value.split_once('.').expect("signed");
    for word in [PASSWORD, "wrong-horse", "typed-my-password", &token[9..], secret, signature, "argon2id"] {
        assert!(!log.contains(word), "{word} is in the log");
    }
    for line in log.lines() {
        assert!(serde_json::from_str::<serde_json::Value>(line).is_ok(), "{line}");
    }
}

#[test]
fn what_is_done_with_accounts_is_in_a_log_that_is_verified_and_holds_no_secret() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let right = |output: Output| assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    right(semascan_with(&["user", "add", "otto", "--role", "reviewer", "--data", &data], "battery staple\n"));
    right(semascan(&["user", "role", "otto", "viewer", "--data", &data]));
    let token = said(&semascan(&["token", "add", "prometheus", "--role", "operator", "--data", &data]));
    let agent = Agent::start(&["serve", "--port", "0", "--login", "--users", &data]);
    let answer = agent.log_in("anna", PASSWORD);
    let (_, cookie) = answer.split_once("set-cookie: ").expect("a cookie");
    let cookie = cookie.split(';').next().expect("a value").to_owned();
    for (name, password) in [("anna", "wrong-horse"), ("typed-my-password", PASSWORD)] {
        assert!(agent.log_in(name, password).starts_with("HTTP/1.1 401"));
    }
    let ask = |path: &str, cookie: &str| agent.ask(&format!("GET {path}\nCookie: {cookie}"), "");
    let page = ask("/api/v1/account-log?limit=3", &cookie);
    assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    let (_, body) = page.split_once("\r\n\r\n").expect("a body");
    let page: serde_json::Value = serde_json::from_str(body).expect("JSON");
    assert_eq!((&page["items"][0]["action"]["type"], &page["next"]), (&"login_refused".into(), &5.into()));
    let older = ask("/api/v1/account-log?before=5", &cookie);
    assert!(older.contains(r#""type":"user_added","#) && !older.contains("next"), "{older}");
    assert!(ask("/api/v1/account-log?before=x", &cookie).starts_with("HTTP/1.1 400"));
    let (_, other) = agent
        .log_in("otto", "battery staple")
        .split_once("set-cookie: ")
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .expect("a cookie");
    let other = other.split(';').next().expect("a value");
    assert!(ask("/api/v1/account-log", other).starts_with("HTTP/1.1 403"), "for administrators");
    let logout = agent.ask(&format!("POST /api/v1/logout\nCookie: {cookie}\nX-Semascan-Request: 1"), "");
    assert!(logout.starts_with("HTTP/1.1 204"), "{logout}");
    right(semascan_with(&["user", "password", "otto", "--data", &data], "correct battery\n"));
    right(semascan(&["token", "revoke", "prometheus", "--data", &data]));
    right(semascan(&["user", "remove", "otto", "--data", &data]));
    agent.end();
    let listed = said(&semascan(&["audit", "accounts", "--data", &data]));
    let actions: Vec<&str> = listed.lines().filter_map(|line| line.rsplit_once(": ").map(|(_, what)| what)).collect();
    assert_eq!(
        actions,
        [
            "user anna added as admin",
            "user otto added as reviewer",
            "role of otto set to viewer (was reviewer)",
            "token prometheus made as operator",
            "anna logged in",
            "name or password is wrong",
            "name or password is wrong",
            "otto logged in",
            "anna logged out",
            "password of otto set, 1 session ended",
            "token prometheus revoked",
            "user otto removed",
        ],
        "{listed}"
    );
    assert!(listed.contains("anna from 127.0.0.1: anna logged in"), "{listed}");
    assert!(listed.contains("somebody from 127.0.0.1: login of anna refused"), "{listed}");
    assert!(listed.contains("login of an unknown user refused"), "{listed}");
    assert_eq!(listed.contains("command line (uid "), cfg!(unix));
    let json = said(&semascan(&["audit", "accounts", "--data", &data, "--json", "--last", "1000"]));
    for word in [PASSWORD, "wrong-horse", "typed-my-password", "battery", &token.trim()[9..], "argon2"] {
        assert!(!json.contains(word) && !listed.contains(word), "{word} is in the log");
    }
    let verify = || semascan(&["audit", "verify", "--data", &data, "--json"]);
    let good: serde_json::Value = serde_json::from_slice(&verify().stdout).expect("JSON");
    assert_eq!((&good["accounts"]["entries"], &good["entries"]), (&12.into(), &0.into()));
    let head = good["accounts"]["head"].as_str().expect("a hash");
    right(semascan(&["audit", "verify", "--data", &data, "--accounts-head", head]));
    // Somebody edits the file.
    let database = rusqlite::Connection::open(Path::new(&data).join("semascan.db")).expect("opens");
    let edit = "DROP TRIGGER account_log_is_not_changed; \
                UPDATE account_log SET entry = replace(entry, 'otto', 'anna') WHERE sequence = 3";
    database.execute_batch(edit).expect("edited");
    let bad = verify();
    assert_eq!(bad.status.code(), Some(1));
    assert!(stderr(&bad).contains("entry 3 of the log of accounts was changed"), "{}", stderr(&bad));
    assert_eq!(semascan(&["verify", &data]).status.code(), Some(1));
}

#[test]
fn json_lines_name_the_inspection_that_they_belong_to() {
    let root = tempfile::tempdir().expect("temporary folder");
    let out = root.path().join("out");
    let source = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";
    let done = semascan(&["--log-format", "json", "-v", "inspect", source, "--out", text(&out)]);
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    let record = fs::read_to_string(out.join("inspection.json")).expect("reads");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    let lines: Vec<serde_json::Value> =
        stderr(&done).lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let of_inspection = lines.iter().filter(|line| line["span"]["name"] == "inspection").collect::<Vec<_>>();
    assert!(!of_inspection.is_empty(), "{}", stderr(&done));
    assert!(of_inspection.iter().all(|line| line["span"]["id"] == record["id"]), "{of_inspection:?}");
    // People watch one inspection: its lines do not name it.
    let plain = semascan(&["-v", "inspect", source, "--overwrite", "--out", text(&out)]);
    assert!(!stderr(&plain).contains("inspection{"), "{}", stderr(&plain));
}

#[test]
fn ready_and_healthy_are_two_things() {
    let agent = Agent::start(&["serve", "--port", "0"]);
    let until = |agent: &Agent, path: &str, wanted: &str| {
        for _ in 0..1000 {
            let answer = agent.ask(&format!("GET {path}"), "");
            if answer.contains(wanted) {
                return answer;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{path} does not come to {wanted}: {}", agent.ask(&format!("GET {path}"), ""))
    };
    let ready = until(&agent, "/readyz", r#"{"ready":true}"#);
    assert!(ready.starts_with("HTTP/1.1 200"), "{ready}");
    assert!(agent.ask("GET /healthz", "").contains(r#""state":"waiting""#));
    assert!(agent.ask("GET /metrics", "").contains("semascan_ready 1"));
    agent.end();
    // What an inspection did is counted.
    let source = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";
    let agent = Agent::start(&["serve", "--port", "0", "--source", source]);
    until(&agent, "/healthz", r#""state":"finished""#);
    let metrics = agent.ask("GET /metrics", "");
    for line in [
        r#"semascan_views_total{result="accepted"} 3"#,
        r#"semascan_inspections_total{outcome="finished"} 1"#,
        r#"semascan_stage_seconds_count{stage="fuse"} 3"#,
    ] {
        assert!(metrics.contains(line), "{line} is not in {metrics}");
    }
    agent.end();
}

#[test]
fn every_command_has_a_manual_page() {
    let root = tempfile::tempdir().expect("temporary folder");
    let out = root.path().join("man1");
    assert_eq!(semascan(&["man", "--out", text(&out)]).status.code(), Some(0));
    for page in ["semascan.1", "semascan-serve.1", "semascan-user-add.1", "semascan-token-revoke.1", "semascan-init.1"]
    {
        let text = fs::read_to_string(out.join(page)).expect(page);
        assert!(text.contains(".TH") && text.contains("NAME"), "{page}");
    }
    let serve = fs::read_to_string(out.join("semascan-serve.1")).expect("reads");
    assert!(serve.contains("tls\\-cert"), "options are in it");
}

#[cfg(unix)]
#[test]
fn the_unit_is_one_that_systemd_takes() {
    let unit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docker/semascan.service");
    let text = fs::read_to_string(&unit).expect("reads");
    let command = text.lines().find_map(|line| line.strip_prefix("ExecStart=")).expect("a command");
    // Its arguments are ones that the program knows.
    let folder = tempfile::tempdir().expect("temporary folder");
    let mut arguments = command.split_whitespace().skip(1).map(str::to_owned).collect::<Vec<_>>();
    arguments.push("--help".into());
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    assert_eq!(semascan(&arguments).status.code(), Some(0), "{command}");
    // It is checked with this binary in the place where it would be installed.
    let installed = command.split_whitespace().next().expect("a path");
    let here = folder.path().join("semascan.service");
    fs::write(&here, text.replace(installed, env!("CARGO_BIN_EXE_semascan"))).expect("written");
    match Command::new("systemd-analyze").arg("verify").arg(&here).output() {
        Ok(checked) => assert!(checked.status.success(), "{}", stderr(&checked)),
        Err(error) => eprintln!("SKIPPED: systemd-analyze is not here: {error}"),
    }
}

#[test]
fn metrics_have_an_address_of_their_own_where_one_is_asked_for() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let arguments = ["serve", "--port", "0", "--login", "--users", &data, "--metrics", "127.0.0.1:0"];
    let mut agent = Agent::start(&arguments);
    assert!(agent.ask("GET /metrics", "").starts_with("HTTP/1.1 401"), "the agent's own asks for a login");
    let scraped = loop {
        let line = agent.log.recv_timeout(Duration::from_secs(60)).expect("it says where");
        if let Some((_, rest)) = line.split_once("metrics at http://") {
            break rest.split('/').next().expect("an address").parse().expect("an address");
        }
    };
    agent.address = scraped;
    let metrics = agent.ask("GET /metrics", "");
    assert!(metrics.starts_with("HTTP/1.1 200") && metrics.ends_with("# EOF\n"), "{metrics}");
    for path in ["/", "/healthz", "/api/v1/me", "/api/v1/inspections", "/ws"] {
        let answer = agent.ask(&format!("GET {path}"), "");
        assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
    }
    assert!(agent.ask("POST /metrics", "x").starts_with("HTTP/1.1 405"));
    agent.end();
}

#[test]
fn who_an_identity_provider_vouches_for_is_listed_and_removed_here_and_changed_there() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let database = rusqlite::Connection::open(Path::new(&data).join("semascan.db")).expect("opens");
    let insert = "INSERT INTO users VALUES ('otto (Plant)', 'viewer', '', '2026-01-01T00:00:00Z', '2026-01-01T00:00:00Z', \
                  NULL, 'https://id.plant.example', '7f')";
    assert_eq!(database.execute(insert, []).expect("inserted"), 1);
    let user = |args: &[&str], input: &str| semascan_with(&[&["user"], args, &["--data", &data]].concat(), input);
    for (args, input) in
        [(&["password", "otto (Plant)"][..], "another-password\n"), (&["role", "otto (Plant)", "admin"], "")]
    {
        let refused = user(args, input);
        assert_eq!(refused.status.code(), Some(2), "{args:?}");
        assert!(stderr(&refused).contains("otto (Plant) logs in at https://id.plant.example"), "{}", stderr(&refused));
    }
    assert!(said(&user(&["list"], "")).contains(", of https://id.plant.example"));
    let listed: serde_json::Value = serde_json::from_str(&said(&user(&["list", "--json"], ""))).expect("JSON");
    assert_eq!(listed["users"][1]["identity"]["subject"], "7f");
    assert_eq!(user(&["remove", "otto (Plant)"], "").status.code(), Some(0));
    assert_eq!(
        semascan_with(&["user", "add", "otto (plant)", "--data", &data], "x").status.code(),
        Some(2),
        "no user's name"
    );
}

#[test]
fn a_provider_needs_a_program_that_speaks_to_it_and_says_nothing_secret() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = cell(root.path());
    let config = root.path().join("oidc.toml");
    let section = |text: &str| fs::write(&config, format!("[serve.oidc]\n{text}\n")).expect("written");
    let serve = ["serve", "--port", "0", "--config", text(&config), "--users", &data];
    let refused = |args: &[&str]| {
        let refused = semascan(args);
        assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
        assert!(!stderr(&refused).contains("hunter2"), "{}", stderr(&refused));
        stderr(&refused)
    };
    section("client_secret = \"hunter2\"");
    assert!(refused(&serve).contains("client_secret"));
    section("issuer = \"https://id.plant.example\"");
    if cfg!(not(feature = "oidc")) {
        assert!(refused(&serve).contains("[serve.oidc]: this program was built without OpenID Connect"));
        return;
    }
    assert!(refused(&serve).contains("[serve.oidc]: public_url is missing"));
    let secret = root.path().join("secret");
    fs::write(&secret, "hunter2\n").expect("written");
    let whole = |public: &str| {
        section(&format!(
            "issuer = \"http://127.0.0.1:9\"\nclient_id = \"semascan\"\nclient_secret_file = {:?}\npublic_url = \"{public}\"\n\
             roles = {{ quality = \"reviewer\" }}",
            text(&secret)
        ));
    };
    whole("https://cell.plant.example");
    assert!(refused(&serve).contains("https://cell.plant.example, which is not this machine"));
    whole("http://localhost:4242");
    assert!(refused(&[&serve[..], &["--tls"]].concat()).contains("this agent speaks HTTPS only"));
    let watched = ["serve", "--port", "0", "--config", text(&config), "--anyone-may-watch"];
    assert!(refused(&watched).contains("[serve.oidc]: nobody logs in where everybody may watch"));
    let agent = Agent::start(&[&["-vv"], &serve[..]].concat());
    let begin = "POST /api/v1/oidc\nContent-Type: application/json\nX-Semascan-Request: 1";
    assert!(agent.ask("GET /api/v1/me", "").starts_with("HTTP/1.1 401"), "a login is asked for on loopback, too");
    let elsewhere = agent.ask(begin, r#"{"next":"/"}"#);
    assert!(
        elsewhere.starts_with("HTTP/1.1 421") && elsewhere.contains("http://localhost:4242/login.html"),
        "{elsewhere}"
    );
    let log = agent.end();
    assert!(log.contains("http://localhost:4242/api/v1/oidc/callback") && !log.contains("hunter2"), "{log}");
}
