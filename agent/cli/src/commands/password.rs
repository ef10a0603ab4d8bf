//! Passwords that people give: typed without being shown, or from a pipe. They are never arguments, which everybody on the
//! machine can read.

use super::Failure;
use anyhow::{Context, anyhow};
use std::io::{self, BufRead, IsTerminal, Read};

/// Bytes that are read of a password.
const LONGEST: u64 = 4 << 10;

/// A new password for user `name`: typed twice on a terminal, else the first line of stdin.
pub(super) fn read_new(name: &str) -> Result<String, Failure> {
    if !io::stdin().is_terminal() {
        return first_line(&mut io::stdin().lock());
    }
    let ask =
        |prompt: String| rpassword::prompt_password(prompt).context("the password cannot be read from the terminal");
    let typed = ask(format!("Password of {name}: "))?;
    let again = ask("The same again: ".to_owned())?;
    if typed == again { Ok(typed) } else { Err(Failure::Call(anyhow!("the two passwords differ"))) }
}

/// The first line, without its end.
fn first_line(input: &mut impl BufRead) -> Result<String, Failure> {
    let mut line = String::new();
    input.take(LONGEST).read_line(&mut line).context("the password cannot be read from stdin")?;
    let password = line.strip_suffix('\n').unwrap_or(&line);
    let password = password.strip_suffix('\r').unwrap_or(password);
    if password.is_empty() {
        return Err(Failure::Call(anyhow!("no password was given: type it, or write it to stdin as one line")));
    }
    Ok(password.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_is_the_password_with_all_its_blanks() {
        let read = |text: &str| first_line(&mut text.as_bytes()).ok();
        assert_eq!(read(" correct horse \r\nmore").as_deref(), Some(" correct horse "));
        assert_eq!(read("without an end").as_deref(), Some("without an end"));
        assert_eq!((read(""), read("\n")), (None, None));
    }
}
