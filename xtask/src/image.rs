//! `cargo xtask image`: the image of `docker/Dockerfile` tried without Docker's daemon and without a registry.
//!
//! The root file system is assembled: Debian's by debootstrap, of the release that the Dockerfile begins its last stage with, then
//! what the instructions of that stage do, read from the file. In a chroot its entry point runs as the image's user, answers its
//! health check and gives out the viewer; an inspection with trained networks runs to its end; SIGTERM ends the agent in time.
//! What differs from Docker: the network and the kernel's other resources are the machine's, and the port is a free one.
//!
//! Where this cannot be done (no root, no debootstrap, no mirror) it is skipped, and said; where it can be and something is wrong,
//! it fails.

use crate::dockerfile::{Instruction, Stage, last_stage};
use crate::onnx_runtime;
use crate::packages::{self, NeedsYou};
use crate::process::{capture, exists, line, run as run_command, run_within};
use crate::report::{heading, note, seconds};
use crate::workspace::{Workspace, cargo};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use std::fs;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time in which an agent has to end after SIGTERM.
const END: Duration = Duration::from_secs(5);
/// The agent's exit code where a signal cut its work off: 128 and the signal's number.
const TERMINATED: i32 = 143;
/// Time that an inspection may take.
const INSPECTION: Duration = Duration::from_secs(300);
/// What is inspected with trained networks.
const PART: &str = "virtual:starter-motor?seed=7&views=2&size=320x240";
/// Where programs are looked for in the image.
const PATH: &str = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin";

/// What is tried.
#[derive(Args)]
pub(crate) struct Options {
    /// The agent's binary, with the viewer inside; else it is built as the Dockerfile builds it
    #[arg(long, value_name = "FILE")]
    binary: Option<PathBuf>,
    /// Debian's mirror [default: debootstrap's]
    #[arg(long, value_name = "URL")]
    mirror: Option<String>,
    /// Leave the root file system in target/image
    #[arg(long)]
    keep: bool,
}

/// Assembles the image and tries it.
pub(crate) fn run(options: &Options) -> Result<()> {
    let began = Instant::now();
    let workspace = Workspace::find()?;
    let text = fs::read_to_string(workspace.root.join("docker/Dockerfile")).context("docker/Dockerfile")?;
    let stage = last_stage(&text)?;
    let folder = workspace.target.join("image");
    heading("Debian's root file system");
    let base = match base(&stage.base, &folder, options.mirror.as_deref())? {
        Base::At(base) => base,
        Base::Impossible(reason) => {
            note(format!("SKIPPED: the image was not tried: {reason}"));
            return Ok(());
        }
    };
    heading("docker/Dockerfile, last stage");
    let built = built(&workspace, options.binary.as_deref(), &folder.join("out"))?;
    let mut image = Image::assemble(&stage, &workspace.root, &built, &base, folder.join("root"))?;
    heading("the image runs");
    let tried = image.mount_proc().and_then(|()| image.try_out(&stage));
    // What is mounted is never removed with the rest.
    let unmounted = image.unmount();
    if unmounted.is_ok() && !options.keep {
        remove(&image.root)?;
        remove(&folder.join("out"))?;
    }
    tried?;
    unmounted?;
    note(format!("the image works: {}", seconds(began.elapsed())));
    Ok(())
}

/// Debian's root file system, or why it cannot be had.
enum Base {
    At(PathBuf),
    Impossible(String),
}

/// Debian's root file system of the release that `image` names, made once.
fn base(image: &str, folder: &Path, mirror: Option<&str>) -> Result<Base> {
    let release = release(image)?;
    if !cfg!(target_os = "linux") {
        return Ok(Base::Impossible("it runs on Linux".into()));
    }
    if capture(Command::new("id").arg("-u"))? != "0" {
        return Ok(Base::Impossible("only root may change the root folder of a process".into()));
    }
    if !exists("debootstrap") {
        match packages::install("the image is assembled by debootstrap", &["debootstrap"]) {
            Ok(()) => {}
            Err(error) if error.downcast_ref::<NeedsYou>().is_some() => return Ok(Base::Impossible(error.to_string())),
            Err(error) => return Ok(Base::Impossible(format!("debootstrap cannot be installed: {error}"))),
        }
    }
    let base = folder.join(format!("debian-{release}"));
    if base.is_dir() {
        note(format!("{} is there already", base.display()));
        return Ok(Base::At(base));
    }
    let draft = folder.join(format!("debian-{release}.part"));
    remove(&draft)?;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut make = Command::new("debootstrap");
    make.args(["--variant=minbase", &release]).arg(&draft).args(mirror);
    if let Err(error) = run_command(make.stdout(Stdio::null())) {
        let log = fs::read_to_string(draft.join("debootstrap/debootstrap.log")).unwrap_or_default();
        let last = log.lines().last().unwrap_or_default().to_owned();
        remove(&draft)?;
        return Ok(Base::Impossible(format!("no root file system of Debian {release} could be made: {error}; {last}")));
    }
    fs::rename(&draft, &base).with_context(|| base.display().to_string())?;
    Ok(Base::At(base))
}

/// The release in the name of one of Debian's images: `debian:bookworm-slim@sha256:...`.
fn release(image: &str) -> Result<String> {
    let tag = image.strip_prefix("debian:").map(|tag| tag.split('@').next().unwrap_or_default());
    let release = tag.map(|tag| tag.trim_end_matches("-slim").to_owned());
    let is_name = |name: &String| !name.is_empty() && name.bytes().all(|b| b.is_ascii_lowercase());
    release.filter(is_name).with_context(|| format!("{image} names no release of Debian, such as debian:bookworm-slim"))
}

/// What the first stage leaves in /out: the agent, ONNX Runtime, the networks that are shipped.
fn built(workspace: &Workspace, binary: Option<&Path>, out: &Path) -> Result<PathBuf> {
    let binary = match binary {
        Some(binary) => binary.to_owned(),
        None => {
            run_command(cargo().current_dir(&workspace.root).args(["xtask", "web"]))?;
            let build = ["build", "--release", "--locked", "--package", "semascan-cli", "--bin", "semascan"];
            run_command(cargo().current_dir(&workspace.root).args(build))?;
            workspace.target.join("release/semascan")
        }
    };
    ensure!(binary.is_file(), "{}: there is no such binary", binary.display());
    remove(out)?;
    fs::create_dir_all(out.join("models")).with_context(|| out.display().to_string())?;
    run_command(Command::new("cp").arg("--dereference").arg(&binary).arg(out.join("semascan")))?;
    let library = onnx_runtime::prepare(workspace)?;
    run_command(Command::new("cp").arg("--dereference").arg(&library).arg(out.join("libonnxruntime.so")))?;
    for entry in fs::read_dir(workspace.root.join("agent/models"))? {
        let path = entry?.path();
        if path.is_dir() && path.to_string_lossy().ends_with("-edge") {
            run_command(Command::new("cp").arg("--recursive").arg(&path).arg(out.join("models")))?;
        }
    }
    Ok(out.to_owned())
}

/// A root file system and how programs are started in it.
struct Image {
    root: PathBuf,
    variables: Vec<(String, String)>,
    user: String,
    folder: String,
    has_proc: bool,
}

impl Image {
    /// `base` with what the instructions do; files of other stages come from `built`, which is their `/out`.
    fn assemble(stage: &Stage, context: &Path, built: &Path, base: &Path, root: PathBuf) -> Result<Self> {
        let mounts = fs::read_to_string("/proc/self/mounts").unwrap_or_default();
        let proc = root.join("proc");
        if mounts.lines().any(|line| line.split_whitespace().nth(1).is_some_and(|at| Path::new(at) == proc)) {
            // Of a run that was killed.
            run_command(Command::new("umount").arg(&proc))?;
        }
        remove(&root)?;
        run_command(Command::new("cp").arg("--archive").arg(base).arg(&root))?;
        let variables = vec![("PATH".to_owned(), PATH.to_owned())];
        let mut image = Self { root, variables, user: "0".into(), folder: "/".into(), has_proc: false };
        for instruction in &stage.instructions {
            match instruction {
                Instruction::Run(script) => run_command(&mut image.command(&["/bin/sh", "-c", script]))?,
                Instruction::Copy { stage, from, to } => {
                    for from in from {
                        let source = match stage {
                            None => context.join(from),
                            Some(_) => match from.strip_prefix("/out/") {
                                Some(name) => built.join(name),
                                None => bail!("COPY --from of {from}: only what is in /out is known of that stage"),
                            },
                        };
                        image.copy(&source, to)?;
                    }
                }
                Instruction::Env(more) => image.variables.extend(more.iter().cloned()),
                Instruction::User(user) => image.user.clone_from(user),
                Instruction::Workdir(folder) => {
                    run_command(&mut image.command_as("0", &["mkdir", "-p", folder]))?;
                    image.folder.clone_from(folder);
                }
            }
        }
        Ok(image)
    }

    /// Copies a file to a name, or what a folder holds into a folder, as COPY does; it belongs to root.
    fn copy(&self, from: &Path, to: &str) -> Result<()> {
        let target = self.root.join(to.trim_start_matches('/'));
        let parent = if from.is_dir() || to.ends_with('/') { Some(target.as_path()) } else { target.parent() };
        let parent = parent.context("COPY to nowhere")?;
        fs::create_dir_all(parent).with_context(|| parent.display().to_string())?;
        let source = if from.is_dir() { from.join(".") } else { from.to_owned() };
        run_command(Command::new("cp").args(["--recursive", "--preserve=mode"]).arg(source).arg(&target))?;
        run_command(Command::new("chown").args(["--recursive", "0:0"]).arg(&target))
    }

    /// A command in the image, as the image's user in its folder.
    fn command(&self, words: &[&str]) -> Command {
        self.command_as(&self.user, words)
    }

    fn command_as(&self, user: &str, words: &[&str]) -> Command {
        let mut command = Command::new("chroot");
        // With the colon comes the group that the user has in the image.
        command.arg(format!("--userspec={user}:")).arg(&self.root);
        // chroot begins in /; the first program of the chain that execs the next keeps the process.
        command.args(["/bin/sh", "-c", "cd \"$0\" && exec \"$@\"", &self.folder]).args(words);
        command.env_clear().envs(self.variables.iter().map(|(name, value)| (name, value)));
        command.stdin(Stdio::null());
        command
    }

    /// The kernel's files, as every container has them.
    fn mount_proc(&mut self) -> Result<()> {
        let proc = self.root.join("proc");
        match run_command(Command::new("mount").args(["-t", "proc", "proc"]).arg(&proc)) {
            Ok(()) => self.has_proc = true,
            Err(error) => note(format!("/proc is not there, as it would be in a container ({error})")),
        }
        Ok(())
    }

    fn unmount(&mut self) -> Result<()> {
        if self.has_proc {
            run_command(Command::new("umount").arg(self.root.join("proc")))?;
            self.has_proc = false;
        }
        Ok(())
    }

    /// Starts it and asks of it what people will.
    fn try_out(&mut self, stage: &Stage) -> Result<()> {
        let port = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port().to_string();
        let entrypoint: Vec<&str> = stage.entrypoint.iter().map(String::as_str).collect();
        let demo: Vec<&str> = entrypoint.iter().copied().chain(stage.command.iter().map(String::as_str)).collect();
        self.variables.push(("SEMASCAN_PORT".into(), port.clone()));
        let began = Instant::now();
        let mut agent = Agent::start(self.command(&[&demo[..], &["--port", &port]].concat()))?;
        note(format!("runs as {}", agent.identity()?));
        ensure!(agent.identity()? == self.identity()?, "the agent runs as another user than the image says");
        self.wait_until_healthy(stage, &mut agent)?;
        note(format!("healthy after {}", seconds(began.elapsed())));
        let page = fetch(&port, "/")?;
        ensure!(page.contains("<html") && page.contains("Semascan"), "the page is not the viewer's: {}", head(&page));
        note(format!("the page has {} bytes", page.len()));
        let out = "/tmp/image-inspection";
        let inspect = [&entrypoint[..], &["inspect", PART, "--labels", "network", "--out", out, "--quiet"]].concat();
        let inspected = Instant::now();
        run_within(&mut self.command(&inspect), INSPECTION)?;
        let record = fs::read_to_string(self.root.join("tmp/image-inspection/inspection.json"))?;
        let record: serde_json::Value = serde_json::from_str(&record).context("inspection.json")?;
        ensure!(record["outcome"]["state"] == "finished", "the inspection ended as {}", record["outcome"]);
        let models = record["networks"]["models"].as_array().map_or(0, Vec::len);
        let points = record["points"].as_u64().unwrap_or_default();
        ensure!(models > 0 && points > 0, "the inspection used {models} networks and came to {points} points");
        note(format!("{models} networks labelled {points} points: {}", seconds(inspected.elapsed())));
        let ended = agent.end()?;
        note(format!("SIGTERM ended it in {}", seconds(ended)));
        Ok(())
    }

    /// User and group that the image's processes have, by numbers.
    fn identity(&self) -> Result<String> {
        capture(&mut self.command(&["/bin/sh", "-c", "echo $(id -u):$(id -g)"]))
    }

    fn wait_until_healthy(&self, stage: &Stage, agent: &mut Agent) -> Result<()> {
        let check = stage.healthcheck.as_ref().context("the Dockerfile has no HEALTHCHECK")?;
        let words: Vec<&str> = check.command.iter().map(String::as_str).collect();
        // Docker lets failures within the start period pass, then three in a row make a container unhealthy.
        let limit = check.start_period + 3 * check.interval;
        let began = Instant::now();
        loop {
            agent.still_runs()?;
            match run_within(&mut self.command(&words), check.timeout) {
                Ok(()) => return Ok(()),
                Err(error) if began.elapsed() > limit => return Err(error.context("the agent does not become healthy")),
                Err(_) => sleep(Duration::from_millis(500)),
            }
        }
    }
}

/// The agent in the image; ended when it is dropped.
struct Agent(Child);

impl Agent {
    fn start(mut command: Command) -> Result<Self> {
        eprintln!("   $ {}", line(&command));
        Ok(Self(command.spawn().context("chroot cannot be started")?))
    }

    fn still_runs(&mut self) -> Result<()> {
        match self.0.try_wait()? {
            None => Ok(()),
            Some(status) => bail!("the agent ended by itself: {status}"),
        }
    }

    /// User and group of the process once it runs in the image, by numbers.
    fn identity(&self) -> Result<String> {
        let path = format!("/proc/{}/status", self.0.id());
        let of = |text: &str, name: &str| -> Option<String> {
            let line = text.lines().find(|line| line.starts_with(name))?;
            line.split_whitespace().nth(1).map(str::to_owned)
        };
        for _ in 0..50 {
            let text = fs::read_to_string(&path).context("the agent is not there")?;
            // Until chroot has become the agent it is root's.
            if of(&text, "Name:").is_some_and(|name| name != "chroot" && name != "sh") {
                let ids = [of(&text, "Uid:"), of(&text, "Gid:")].map(Option::unwrap_or_default);
                return Ok(ids.join(":"));
            }
            sleep(Duration::from_millis(100));
        }
        bail!("the agent did not begin to run")
    }

    /// Asks it to end as `docker stop` does; how long that took.
    fn end(mut self) -> Result<Duration> {
        let began = Instant::now();
        run_command(Command::new("kill").args(["-TERM", &self.0.id().to_string()]))?;
        while began.elapsed() < END {
            if let Some(status) = self.0.try_wait()? {
                // The second where an inspection was cut off by it.
                ensure!(matches!(status.code(), Some(0 | TERMINATED)), "SIGTERM ended the agent with {status}");
                return Ok(began.elapsed());
            }
            sleep(Duration::from_millis(20));
        }
        bail!("SIGTERM did not end the agent within {}", seconds(END))
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        // One that has ended already has nothing to end.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What the agent gives out under `path`, with status 200.
fn fetch(port: &str, path: &str) -> Result<String> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port.parse()?));
    let mut stream = TcpStream::connect_timeout(&address, Duration::from_secs(5))?;
    stream.set_read_timeout(Some(Duration::from_secs(10)))?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n")?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (headers, body) = answer.split_once("\r\n\r\n").context("no answer of HTTP")?;
    ensure!(headers.starts_with("HTTP/1.1 200"), "{path}: {}", headers.lines().next().unwrap_or_default());
    Ok(body.to_owned())
}

fn head(text: &str) -> String {
    text.chars().take(80).collect()
}

/// Removes a folder, if it is there.
fn remove(folder: &Path) -> Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| folder.display().to_string())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_release_is_in_the_name_of_the_base_image() {
        assert_eq!(release("debian:bookworm-slim@sha256:ab").expect("a release"), "bookworm");
        assert_eq!(release("debian:trixie").expect("a release"), "trixie");
        for other in ["alpine:3", "debian", "debian:12", "debian:../x"] {
            assert!(release(other).is_err(), "{other}");
        }
    }
}
