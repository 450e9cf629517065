//! Progress that a call shows on a terminal: counts of a bar with their bound, and whether they
//! move to the end.

use std::fmt;
use std::fs;
use std::io::{self, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Counts of a bar in the order in which they are drawn.
#[derive(Debug, Default)]
pub(super) struct Shown {
    counts: Vec<Count>,
    /// Text after the last complete word.
    rest: String,
    /// Whether the last word is a bar.
    is_behind_bar: bool,
}

/// Count of a bar when it is first drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Count {
    at: Duration,
    done: u64,
    of: u64,
}

impl Shown {
    /// Reads the progress of a call whose shell command stands in a file, on a terminal of its own,
    /// in its folder. Also returns the duration of the call.
    ///
    /// # Errors
    ///
    /// An error of the system, such as a missing `script`.
    pub(super) fn of_call(file: &Path, folder: &Path) -> io::Result<(Self, Duration)> {
        let call = format!("sh {}", quoted(&file.to_string_lossy()));
        let clock = Instant::now();
        let mut terminal = Command::new("script")
            .args(["-qefc", &call, "/dev/null"])
            .current_dir(folder)
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut shown = Self::default();
        if let Some(mut screen) = terminal.stdout.take() {
            let mut bytes = [0; 1 << 12];
            loop {
                match screen.read(&mut bytes)? {
                    0 => break,
                    read => shown.read(&bytes[..read], clock.elapsed()),
                }
            }
        }
        terminal.wait()?;
        Ok((shown, clock.elapsed()))
    }

    /// Reads more of the screen.
    fn read(&mut self, screen: &[u8], at: Duration) {
        self.rest += &String::from_utf8_lossy(screen);
        while let Some(end) = self.rest.find(char::is_whitespace) {
            let behind = self.rest.split_off(end);
            let word = std::mem::replace(&mut self.rest, behind);
            self.rest.remove(0);
            if word.is_empty() {
                continue;
            }
            let count = word.split_once('/').filter(|_| self.is_behind_bar);
            let count = count.and_then(|(done, of)| Some((done.parse().ok()?, of.parse().ok()?)));
            if let Some((done, of)) = count
                && self.counts.last().is_none_or(|last| [last.done, last.of] != [done, of])
            {
                self.counts.push(Count { at, done, of });
            }
            // A bar is drawn in blocks; bytes of a block that were read apart are no ASCII either.
            self.is_behind_bar = word.chars().all(|character| !character.is_ascii());
        }
    }

    /// Last count and its bound, if the bar states a bound and still moved in the second half of a
    /// call.
    pub(super) fn moving(&self, call: Duration) -> Option<[u64; 2]> {
        let pairs = self.counts.windows(2);
        let mut moved = pairs.filter(|pair| pair[1].done > pair[0].done && pair[1].of > 0);
        let last = moved.next_back().map(|pair| pair[1]);
        last.filter(|last| 2 * last.at >= call).map(|last| [last.done, last.of])
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.counts.last() {
            Some(Count { at, done, of }) => {
                write!(formatter, "it shows {done} of {of} since {:.1} s", at.as_secs_f64())
            }
            None => formatter.write_str("it shows none"),
        }
    }
}

/// Writes the shell command of a call on a terminal of 100 columns, whose standard error alone is
/// shown.
pub(super) fn write_call(
    file: &Path,
    limits: &str,
    program: &Path,
    arguments: &[String],
) -> io::Result<()> {
    let program = program.to_string_lossy();
    let words = std::iter::once(&*program).chain(arguments.iter().map(String::as_str));
    let words: Vec<String> = words.map(quoted).collect();
    let call = words.join(" ");
    fs::write(file, format!("stty cols 100 rows 25\n{limits} && exec {call} > /dev/null\n"))
}

/// Word of a shell command.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', "'\\''"))
}
