//! The instructions of a Dockerfile's last stage, as far as ours uses them: what else stands there is refused by name, so that an
//! image is never said to work of which a part was not looked at.

use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::time::Duration;

/// An instruction that changes files or how programs are started.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Instruction {
    /// A command line for the shell.
    Run(String),
    /// Files of a stage, or of the build's context where there is none, and where they go.
    Copy { stage: Option<String>, from: Vec<String>, to: String },
    /// Variables of all that follows.
    Env(Vec<(String, String)>),
    /// Who runs what follows.
    User(String),
    /// Where it is run.
    Workdir(String),
}

/// The command by which a container is known to work.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Healthcheck {
    pub(crate) command: Vec<String>,
    pub(crate) interval: Duration,
    pub(crate) timeout: Duration,
    pub(crate) start_period: Duration,
}

/// The last stage.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stage {
    /// The image that it begins with, arguments filled in.
    pub(crate) base: String,
    /// In their order.
    pub(crate) instructions: Vec<Instruction>,
    pub(crate) entrypoint: Vec<String>,
    pub(crate) command: Vec<String>,
    pub(crate) ports: Vec<String>,
    pub(crate) healthcheck: Option<Healthcheck>,
}

/// The last stage of the Dockerfile `text`.
///
/// # Errors
/// Naming the line that is not understood.
pub(crate) fn last_stage(text: &str) -> Result<Stage> {
    let lines = lines(text);
    let words = |line: &str| {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        (word.to_ascii_uppercase(), rest.trim().to_owned())
    };
    let is_from = |(_, line): &(usize, String)| words(line).0 == "FROM";
    let first = lines.iter().position(is_from).context("the Dockerfile has no FROM")?;
    let last = lines.iter().rposition(is_from).unwrap_or(first);
    let mut arguments = BTreeMap::new();
    for (number, line) in &lines[..first] {
        let (word, rest) = words(line);
        ensure!(word == "ARG", "line {number} of the Dockerfile: {word} before the first FROM");
        let (name, value) = rest.split_once('=').unwrap_or((&rest, ""));
        arguments.insert(name.to_owned(), value.to_owned());
    }
    let mut stage = Stage::of(&filled(&words(&lines[last].1).1, &arguments)?);
    for (number, line) in &lines[last + 1..] {
        let (word, rest) = words(line);
        stage.add(&word, &rest).with_context(|| format!("line {number} of the Dockerfile: {line}"))?;
    }
    Ok(stage)
}

impl Stage {
    /// Nothing but an image, of which `from` may give a name after AS.
    fn of(from: &str) -> Self {
        let base = from.split_whitespace().next().unwrap_or_default().to_owned();
        let (instructions, entrypoint, command, ports) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { base, instructions, entrypoint, command, ports, healthcheck: None }
    }

    fn add(&mut self, word: &str, rest: &str) -> Result<()> {
        match word {
            "RUN" => self.instructions.push(Instruction::Run(rest.to_owned())),
            "COPY" => self.instructions.push(copy(rest)?),
            "ENV" => self.instructions.push(Instruction::Env(variables(rest)?)),
            "USER" => self.instructions.push(Instruction::User(rest.to_owned())),
            "WORKDIR" => self.instructions.push(Instruction::Workdir(rest.to_owned())),
            "EXPOSE" => self.ports.extend(rest.split_whitespace().map(str::to_owned)),
            "ENTRYPOINT" => self.entrypoint = words(rest)?,
            "CMD" => self.command = words(rest)?,
            "HEALTHCHECK" => self.healthcheck = Some(healthcheck(rest)?),
            _ => bail!("{word} is not known here"),
        }
        Ok(())
    }
}

/// Lines with what continues them, without comments; each with its number.
fn lines(text: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let mut continues = false;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (own, more) = match line.strip_suffix('\\') {
            Some(own) => (own.trim_end(), true),
            None => (line, false),
        };
        match found.last_mut() {
            Some((_, begun)) if continues => *begun = format!("{begun} {own}"),
            _ => found.push((number, own.to_owned())),
        }
        continues = more;
    }
    found
}

/// `${NAME}` by the build's arguments.
fn filled(text: &str, arguments: &BTreeMap<String, String>) -> Result<String> {
    let mut text = text.to_owned();
    while let Some(start) = text.find("${") {
        let end = text[start..].find('}').map(|at| start + at).context("a brace is not closed")?;
        let name = &text[start + 2..end];
        let value = arguments.get(name).with_context(|| format!("no ARG gives {name}"))?.clone();
        text.replace_range(start..=end, &value);
    }
    ensure!(!text.contains('$'), "a variable without braces");
    Ok(text)
}

fn copy(rest: &str) -> Result<Instruction> {
    let mut stage = None;
    let mut places = Vec::new();
    for word in rest.split_whitespace() {
        match word.strip_prefix("--") {
            None => places.push(word.to_owned()),
            Some(option) => {
                let name = option.strip_prefix("from=").with_context(|| format!("--{option} is not known here"))?;
                stage = Some(name.to_owned());
            }
        }
    }
    let to = places.pop().context("COPY without places")?;
    ensure!(!places.is_empty() && to.starts_with('/'), "COPY takes places and one absolute place that they go to");
    Ok(Instruction::Copy { stage, from: places, to })
}

fn variables(rest: &str) -> Result<Vec<(String, String)>> {
    ensure!(!rest.contains(['"', '\'', '$']), "quotes and variables are not known here");
    let pair = |word: &str| {
        let (name, value) = word.split_once('=').with_context(|| format!("{word} has no value"))?;
        Ok((name.to_owned(), value.to_owned()))
    };
    rest.split_whitespace().map(pair).collect()
}

/// A list of words as JSON has it, or a line for the shell.
fn words(rest: &str) -> Result<Vec<String>> {
    if rest.starts_with('[') {
        return serde_json::from_str(rest).context("is no list of words");
    }
    ensure!(!rest.is_empty(), "no command");
    Ok(["/bin/sh", "-c", rest].map(str::to_owned).to_vec())
}

fn healthcheck(rest: &str) -> Result<Healthcheck> {
    let mut rest = rest;
    // Docker's own defaults.
    let (mut interval, mut timeout, mut start_period) =
        (Duration::from_secs(30), Duration::from_secs(30), Duration::ZERO);
    while let Some(option) = rest.strip_prefix("--") {
        let (option, more) = option.split_once(char::is_whitespace).context("HEALTHCHECK without CMD")?;
        let (name, value) = option.split_once('=').context("an option without a value")?;
        let seconds = value.strip_suffix('s').and_then(|value| value.parse().ok()).map(Duration::from_secs);
        let value = seconds.with_context(|| format!("--{name}: {value} is no number of seconds such as 10s"))?;
        match name {
            "interval" => interval = value,
            "timeout" => timeout = value,
            "start-period" => start_period = value,
            _ => bail!("--{name} is not known here"),
        }
        rest = more.trim_start();
    }
    let command = words(rest.strip_prefix("CMD").context("HEALTHCHECK without CMD")?.trim())?;
    Ok(Healthcheck { command, interval, timeout, start_period })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_stage_is_read_as_it_stands() {
        let text = "# comment\nARG BASE=debian:bookworm-slim@sha256:aa\nFROM rust AS build\nCOPY . .\nADD x y\nFROM ${BASE}\n\
                    RUN one \\\n # within\n && two\nCOPY --from=build /out/a /usr/bin/a\nENV A=1 B=/x\nUSER 10001\n\
                    WORKDIR /var\nEXPOSE 8787\nHEALTHCHECK --interval=10s --timeout=3s --start-period=5s CMD [\"check\"]\n\
                    ENTRYPOINT [\"a\"]\nCMD [\"demo\", \"--no-open\"]\n";
        let strings = |words: &[&str]| words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>();
        let stage = last_stage(text).expect("is read");
        assert_eq!(stage.base, "debian:bookworm-slim@sha256:aa");
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let copied =
            Instruction::Copy { stage: Some("build".into()), from: strings(&["/out/a"]), to: "/usr/bin/a".into() };
        let instructions = [
            Instruction::Run("one && two".into()),
            copied,
            Instruction::Env(vec![pair("A", "1"), pair("B", "/x")]),
            Instruction::User("10001".into()),
            Instruction::Workdir("/var".into()),
        ];
        assert_eq!(stage.instructions, instructions);
        assert_eq!((stage.entrypoint, stage.command), (strings(&["a"]), strings(&["demo", "--no-open"])));
        let healthcheck = stage.healthcheck.expect("there");
        assert_eq!(healthcheck.command, ["check"]);
        let seconds = [healthcheck.interval, healthcheck.timeout, healthcheck.start_period].map(|d| d.as_secs());
        assert_eq!((seconds, stage.ports), ([10, 3, 5], strings(&["8787"])));
    }

    #[test]
    fn what_is_not_understood_is_refused_with_its_line() {
        for (text, word) in [
            ("FROM a\nADD x /y\n", "ADD"),
            ("FROM a\nCOPY --chown=1 x /y\n", "--chown"),
            ("FROM ${A}\n", "no ARG gives A"),
            ("RUN x\nFROM a\n", "before the first FROM"),
            ("FROM a\nHEALTHCHECK --retries=3 CMD x\n", "3"),
            ("FROM a\nENV A=\"b c\"\n", "quotes"),
            ("\n", "no FROM"),
        ] {
            let error = format!("{:#}", last_stage(text).expect_err(text));
            assert!(error.contains(word), "{text:?}: {error}");
        }
    }

    #[test]
    fn ours_is_understood() {
        let text =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docker/Dockerfile")).expect("there");
        let stage = last_stage(&text).expect("is read");
        assert!(stage.base.starts_with("debian:") && stage.healthcheck.is_some(), "{stage:?}");
        assert!(stage.instructions.iter().any(|i| matches!(i, Instruction::User(_))));
    }
}
