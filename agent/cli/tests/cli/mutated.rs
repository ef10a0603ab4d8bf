//! Files that were damaged or made to do damage: captures, scenes, meshes, networks, configurations. The program refuses them or
//! takes what is left of them; it does not panic, does not hang, and takes at most 1 GiB more memory than the valid file.
//!
//! `SEMASCAN_TEST_MUTANTS=1000` says how many there are.
#![cfg(target_os = "linux")]

use crate::{semascan, stderr};
use semascan_inspection::ports::{Catalogue, InspectionFilter};
use semascan_store::data::DataFolder;
use semascan_tests::process::peak_resident_bytes;
use semascan_tests::scene;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How many, where [`COUNT`] does not say it.
const MUTANTS: u64 = 60;
const COUNT: &str = "SEMASCAN_TEST_MUTANTS";
/// The first of them, to make one again that failed.
const FIRST: &str = "SEMASCAN_TEST_FIRST_MUTANT";
/// Longer than anything takes here, on a machine that is busy.
const LONGEST: Duration = Duration::from_secs(60);
const MORE_MEMORY: u64 = 1 << 30;

/// Files that belong together, and what the program does with them.
struct Kind {
    name: &'static str,
    /// The valid files.
    folder: PathBuf,
    /// Those that are changed, by name.
    files: Vec<String>,
    /// The arguments; `@` is the folder, `%` the name of the changed file.
    arguments: Vec<&'static str>,
    /// What is mended after the change, so that it is not refused for its checksum.
    mend: fn(&Path, &mut Dice),
}

#[test]
fn mutated_files_neither_panic_nor_hang_nor_take_much_memory() {
    let number = |name: &str| std::env::var(name).ok().map(|n| n.parse::<u64>().expect("a number"));
    let (count, first) = (number(COUNT).unwrap_or(MUTANTS), number(FIRST).unwrap_or(0));
    let root = tempfile::tempdir().expect("temporary folder");
    let kinds = kinds(root.path());
    // What the valid files take.
    let mut most_valid = 0;
    for (kind, file) in kinds.iter().flat_map(|kind| kind.files.iter().map(move |file| (kind, file))) {
        let run = run(kind, &kind.folder, file, root.path());
        assert_eq!(run.code, Some(0), "{} {file}: {}", kind.name, run.said);
        most_valid = most_valid.max(run.peak);
    }
    let work = root.path().join("work");
    let mut outcomes: BTreeMap<&str, [u32; 2]> = BTreeMap::new();
    let (mut slowest, mut largest) = (Duration::ZERO, 0);
    for mutant in first..first + count {
        let kind = &kinds[mutant as usize % kinds.len()];
        let mut dice = Dice(mutant);
        let file = &kind.files[dice.below(kind.files.len())];
        copy(&kind.folder, &work);
        let path = work.join(file);
        let bytes = fs::read(&path).expect("reads");
        let is_text = std::str::from_utf8(&bytes).is_ok();
        let changed =
            if is_text && dice.below(3) > 0 { in_words(bytes, &mut dice) } else { in_bytes(bytes, &mut dice) };
        fs::write(&path, changed).expect("writes");
        (kind.mend)(&path, &mut dice);
        let run = run(kind, &work, file, root.path());
        let what =
            format!("mutant {mutant} ({} {file}): {}", kind.name, run.said.chars().take(2000).collect::<String>());
        assert!(run.ended, "not within {LONGEST:?}: {what}");
        assert!(matches!(run.code, Some(0..=2)), "exit code {:?}: {what}", run.code);
        assert!(!run.said.contains("panicked at"), "{what}");
        let more = run.peak.saturating_sub(most_valid);
        assert!(more <= MORE_MEMORY, "{} MB more memory: {what}", more >> 20);
        outcomes.entry(kind.name).or_default()[usize::from(run.code != Some(0))] += 1;
        (slowest, largest) = (slowest.max(run.time), largest.max(run.peak));
        fs::remove_dir_all(&work).expect("removed");
    }
    for (kind, [taken, refused]) in &outcomes {
        eprintln!("{kind:<22} {taken:>4} taken, {refused:>4} refused");
    }
    eprintln!(
        "{count} mutants: no panic, the slowest {:.1} s, at most {} MB of memory (valid files: {} MB)",
        slowest.as_secs_f64(),
        largest >> 20,
        most_valid >> 20
    );
    assert!(outcomes.values().any(|[_, refused]| *refused > 0), "no mutant was refused: nothing was tested");
}

/// Everything that is read from outside, valid.
fn kinds(root: &Path) -> Vec<Kind> {
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let done = |arguments: &[&str]| {
        let output = semascan(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
        output.stdout
    };
    let at = |name: &str| {
        let folder = root.join(name);
        fs::create_dir(&folder).expect("made");
        folder
    };
    // A capture, and the model that it comes to.
    let data = root.join("data");
    done(&["inspect", "virtual:starter-motor?seed=3&views=2&size=96x72&cell=5", "--data", &text(&data)]);
    let kept = DataFolder::open_beside(&data).expect("a data folder");
    let id = kept.catalogue().inspections(&InspectionFilter::default()).expect("reads")[0].id;
    let (capture, result) = (kept.capture_path(id), kept.result_path(id));
    let captures = at("captures");
    fs::copy(&capture, captures.join("x.mcap")).expect("copied");
    let scene = at("scene");
    scene::write(&scene, 2).expect("writes");
    let scene_files: Vec<String> = files_of(&scene);
    let meshes = at("meshes");
    for name in ["mesh.ply", "cloud.ply", "scene.glb"] {
        fs::copy(result.join(name), meshes.join(name)).expect("copied");
    }
    for format in ["obj", "stl"] {
        done(&["export", &text(&result), "--format", format, "--out", &text(&meshes)]);
    }
    fs::write(meshes.join("cloud.pcd"), pcd()).expect("writes");
    fs::copy(result.join("mesh.ply"), root.join("reference.ply")).expect("copied");
    let readable = |name: &String| [".ply", ".glb", ".obj", ".stl", ".pcd"].iter().any(|end| name.ends_with(end));
    let mesh_files = files_of(&meshes).into_iter().filter(readable).collect();
    let cells = at("cells");
    fs::write(cells.join("cell.toml"), done(&["config", "--sample"])).expect("writes");
    let plain = |_: &Path, _: &mut Dice| {};
    let mut kinds = vec![
        Kind {
            name: "capture",
            folder: captures.clone(),
            files: vec!["x.mcap".into()],
            arguments: vec!["inspect", "@/x.mcap", "--overwrite", "--out", "OUT"],
            mend: plain,
        },
        Kind {
            name: "message of a capture",
            folder: captures,
            files: vec!["x.mcap".into()],
            arguments: vec!["inspect", "@/x.mcap", "--overwrite", "--out", "OUT"],
            mend: change_a_message,
        },
        Kind {
            name: "scene",
            folder: scene,
            files: scene_files,
            arguments: vec!["inspect", "@", "--overwrite", "--out", "OUT"],
            mend: plain,
        },
        Kind {
            name: "mesh",
            folder: meshes,
            files: mesh_files,
            arguments: vec!["evaluate", "@/%", "ROOT/reference.ply", "--samples", "2000"],
            mend: plain,
        },
        Kind {
            name: "cell.toml",
            folder: cells,
            files: vec!["cell.toml".into()],
            arguments: vec!["inspect", "ROOT/scene", "--config", "@/cell.toml", "--overwrite", "--out", "OUT"],
            mend: plain,
        },
    ];
    let judged = at("judged");
    for name in files_of(&result) {
        fs::create_dir_all(judged.join(&name).parent().expect("a folder")).expect("made");
        fs::copy(result.join(&name), judged.join(&name)).expect("copied");
    }
    let criteria = at("criteria");
    fs::write(criteria.join("criteria.toml"), include_str!("../../src/commands/criteria.sample.toml")).expect("writes");
    kinds.push(Kind {
        name: "criteria.toml",
        folder: criteria,
        files: vec!["criteria.toml".into()],
        arguments: vec!["judge", "ROOT/judged", "--print-only", "--criteria", "@/criteria.toml"],
        mend: plain,
    });
    kinds.push(Kind {
        name: "inspection",
        folder: judged,
        files: vec!["inspection.json".into(), "cloud.ply".into(), "mesh.ply".into()],
        arguments: vec!["judge", "@", "--print-only", "--criteria", "ROOT/criteria/criteria.toml"],
        mend: plain,
    });
    if std::env::var_os("ORT_DYLIB_PATH").is_none() {
        eprintln!("SKIPPED: networks: ORT_DYLIB_PATH names no ONNX Runtime");
        return kinds;
    }
    let models = at("models");
    let name = "instance-edge";
    let network = models.join(name);
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name), &network);
    let files =
        files_of(&models).into_iter().filter(|file| file.ends_with(".onnx") || file.ends_with(".toml")).collect();
    kinds.push(Kind {
        name: "network",
        folder: models,
        files,
        arguments: vec![
            "inspect",
            "ROOT/captures/x.mcap",
            "--labels",
            "network",
            "--models",
            "@",
            "--overwrite",
            "--out",
            "OUT",
        ],
        mend: renew_digest,
    });
    kinds
}

/// Names of all files in a folder, folders below it included.
fn files_of(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(below) = folders.pop() {
        for entry in fs::read_dir(below).expect("reads") {
            let path = entry.expect("reads").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                names.push(path.strip_prefix(folder).expect("below").to_str().expect("UTF-8").to_owned());
            }
        }
    }
    names.sort();
    names
}

fn copy(from: &Path, to: &Path) {
    for name in files_of(from) {
        fs::create_dir_all(to.join(&name).parent().expect("a folder")).expect("made");
        fs::copy(from.join(&name), to.join(&name)).expect("copied");
    }
}

fn pcd() -> String {
    let mut text = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 20\nHEIGHT 20\n\
                    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 400\nDATA ascii\n"
        .to_owned();
    for point in 0..400_u32 {
        text.push_str(&format!("{} {} 0.01 {}\n", f64::from(point % 20) * 1e-3, f64::from(point / 20) * 1e-3, point));
    }
    text
}

/// What became of a call.
struct Run {
    ended: bool,
    code: Option<i32>,
    said: String,
    /// Memory that it had resident at most.
    peak: u64,
    time: Duration,
}

/// Calls the program on the files in `folder`, of which `file` was changed.
fn run(kind: &Kind, folder: &Path, file: &str, root: &Path) -> Run {
    let out = root.join("out");
    let replaced = kind.arguments.iter().map(|argument| {
        let argument = argument.replace('@', folder.to_str().expect("UTF-8")).replace('%', file);
        argument.replace("OUT", out.to_str().expect("UTF-8")).replace("ROOT", root.to_str().expect("UTF-8"))
    });
    let log = fs::File::create(root.join("log")).expect("made");
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(replaced).stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
    let begun = Instant::now();
    let mut child = command.spawn().expect("starts");
    let mut peak = 0;
    let (mut ended, mut code) = (true, None);
    loop {
        if let Ok(bytes) = peak_resident_bytes(child.id()) {
            peak = peak.max(bytes);
        }
        if let Some(status) = child.try_wait().expect("a child") {
            code = status.code();
            break;
        }
        if begun.elapsed() > LONGEST {
            child.kill().expect("killed");
            child.wait().expect("gone");
            ended = false;
            break;
        }
        std::thread::sleep(Duration::from_millis(3));
    }
    let said = String::from_utf8_lossy(&fs::read(root.join("log")).expect("reads")).into_owned();
    let _ = fs::remove_dir_all(&out);
    Run { ended, code, said, peak, time: begun.elapsed() }
}

/// Random numbers from a seed: SplitMix64.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Numbers at the ends of their types.
const EXTREMES: [u64; 8] =
    [0, u64::MAX, i64::MAX as u64, 1 << 63, 0x7fff_ffff, 0xffff_ffff, 0x7ff0_0000_0000_0000, 0x7fc0_0000_7fc0_0000];

/// Changes bytes wherever they stand: flipped, cut, left out, doubled, put in, set to extreme numbers.
fn in_bytes(mut bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len());
        let length = dice.below(64.min(bytes.len() - at) + 1);
        match dice.below(7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << dice.below(8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..at + length)),
            3 => {
                let again = bytes[at..at + length].to_vec();
                bytes.splice(at..at, again);
            }
            4 => {
                let new: Vec<u8> = (0..length).map(|_| dice.next() as u8).collect();
                bytes.splice(at..at, new);
            }
            5 => {
                let value = EXTREMES[dice.below(EXTREMES.len())].to_le_bytes();
                bytes.iter_mut().skip(at).zip(&value[..[2, 4, 8][dice.below(3)]]).for_each(|(byte, new)| *byte = *new);
            }
            // Numbers with a length in front of them stand at the beginning of most files.
            _ => bytes.iter_mut().skip(dice.below(256)).take(4).for_each(|byte| *byte = 0xff),
        }
    }
    bytes
}

const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "nan",
    "inf",
    "99999999999999999999",
    "4294967295",
    "2147483648",
    "-2147483649",
    "65536",
    "1000000",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"../../etc/passwd\"",
    "[[[[[[[[[[[[[[[[",
    "ä\u{0}\u{202e}",
    "0.5",
];

/// Changes words of a text: replaced by extreme ones, left out, exchanged, and lines doubled or left out.
fn in_words(bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
    let mut text = String::from_utf8(bytes).expect("UTF-8");
    for _ in 0..=dice.below(4) {
        let is_inside = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '+' | '_');
        let mut words: Vec<(usize, usize)> = Vec::new();
        for (at, c) in text.char_indices().filter(|(_, c)| is_inside(*c)) {
            match words.last_mut() {
                Some((_, end)) if *end == at => *end = at + c.len_utf8(),
                _ => words.push((at, at + c.len_utf8())),
            }
        }
        if words.is_empty() {
            break;
        }
        // Most of a configuration is comment: what counts is a number or a value.
        let is_number = |&(from, to): &(usize, usize)| text[from..to].parse::<f64>().is_ok();
        let numbers: Vec<_> = words.iter().copied().filter(is_number).collect();
        let of = if numbers.is_empty() || dice.below(3) == 0 { &words } else { &numbers };
        let (from, to) = of[dice.below(of.len())];
        match dice.below(6) {
            0..=2 => text.replace_range(from..to, WORDS[dice.below(WORDS.len())]),
            3 => {
                let (other, end) = words[dice.below(words.len())];
                let word = text[other..end].to_owned();
                text.replace_range(from..to, &word);
            }
            kind => {
                let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
                let at = dice.below(lines.len());
                if kind == 4 {
                    lines.insert(at, lines[at]);
                } else {
                    lines.remove(at);
                }
                text = lines.concat();
            }
        }
        // A line that is a comment becomes one that counts.
        if dice.below(4) == 0 {
            let comments: Vec<usize> = text.match_indices("\n#").map(|(at, _)| at + 1).collect();
            if !comments.is_empty() {
                text.remove(comments[dice.below(comments.len())]);
            }
        }
    }
    text.into_bytes()
}

/// Writes the capture anew with one message changed: chunks, lengths and checksums are right.
fn change_a_message(path: &Path, dice: &mut Dice) {
    // What was changed in the bytes of the file is no capture any more: the valid one lies beside the working folder.
    let valid = path.parent().and_then(Path::parent).expect("two folders").join("captures/x.mcap");
    let bytes = fs::read(valid).expect("reads");
    let messages: Vec<_> =
        mcap::MessageStream::new(&bytes).expect("valid").map(|message| message.expect("valid")).collect();
    let chosen = dice.below(messages.len());
    let mut writer = mcap::Writer::new(fs::File::create(path).expect("made")).expect("begins");
    let info = mcap::read::LinearReader::new(&bytes).expect("valid").find_map(|record| match record.expect("valid") {
        mcap::records::Record::Metadata(metadata) => Some(metadata),
        _ => None,
    });
    let mut info = info.expect("what the source is");
    if dice.below(5) == 0 {
        let value = info.metadata.values_mut().next().expect("one");
        *value = String::from_utf8_lossy(&in_words(value.clone().into_bytes(), dice)).into_owned();
    }
    writer.write_metadata(&info).expect("written");
    for (number, message) in messages.into_iter().enumerate() {
        let data = message.data.to_vec();
        let data = if number == chosen { in_bytes(data, dice) } else { data };
        let message = mcap::Message { data: data.into(), ..message };
        writer.write(&message).expect("written");
    }
    writer.finish().expect("written");
}

/// Notes the digest of a changed network in its manifest: whoever makes a bad network says its digest, too.
fn renew_digest(path: &Path, dice: &mut Dice) {
    if path.extension().is_none_or(|extension| extension != "onnx") || dice.below(4) == 0 {
        return;
    }
    let manifest = path.with_file_name("model.toml");
    let digest: String =
        Sha256::digest(fs::read(path).expect("reads")).iter().map(|byte| format!("{byte:02x}")).collect();
    let text = fs::read_to_string(&manifest).expect("reads");
    let lines: Vec<String> = text
        .lines()
        .map(|line| if line.starts_with("sha256") { format!("sha256 = \"{digest}\"") } else { line.to_owned() })
        .collect();
    fs::write(&manifest, lines.join("\n")).expect("writes");
}
