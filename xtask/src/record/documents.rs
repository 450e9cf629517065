//! Golden texts of the JSON documents that the program prints: a line for every member, with
//! numbers to twelve significant digits.
//!
//! A document's bits are not recorded here, so that a result that moves by its last places keeps
//! its golden text. Whatever is smaller than [`NOISE`] is rounding, and is written as zero.

use std::error::Error;
use std::io::{self, Write as _};
use std::process::{Command, Stdio};

use serde_json::Value;

use super::answers::STAMPS;
use super::recorder::Page;
use super::subject::Subjects;
use crate::program::program;

/// Significant digits of a number.
const DIGITS: usize = 12;
/// Magnitude below which a number is rounding.
const NOISE: f64 = 1e-18;

/// Largest number of steps in which a list of objects or lists is gone through.
const STEPS: usize = 6;

/// Members of saved orbits and maps that are read back bit by bit, and are the listing's again.
const SAVED: [&str; 3] = ["source", "orbit", "map"];
/// Endings of the names of members that hold measured times, or what they decide.
const TIMES: [&str; 3] = ["seconds", "_ns", "pareto"];

/// Documents: name, command line, and text on standard input.
const DOCUMENTS: &[(&str, &str, &str)] = &[
    ("check", "check linear", ""),
    ("locate", "locate linear --measure", ""),
    ("safe", "safe linear --tolerance omega=1% --points 4", ""),
    ("contact", "contact linear --restitution 0.8", ""),
    ("curve", "curve linear --along omega --from @1.8 --to @1.801 --xi 2", ""),
    ("curve nearest", "curve linear --nearest alpha,omega", ""),
    ("expand", "expand linear --set expansion.smooth_order=2 --set expansion.contact_weight=3", ""),
    ("expand choice", "expand linear --set expansion.tolerance=1e-4", ""),
    ("converge", "converge linear --fresh 20", ""),
    ("emit", "emit linear -o emitted", ""),
    ("image map", "image linear --states - --iterations 2", STATES),
    ("image direct", "image linear --states - --method direct", STATES),
    (
        "diagram map",
        "diagram linear --along alpha --points 9 --method map --transient 20 --keep 4",
        "",
    ),
    (
        "diagram direct",
        "diagram linear --along alpha --points 9 --method direct --transient 20 --keep 4",
        "",
    ),
    ("chart", "chart linear --plane alpha,omega --points 3 --transient 20 --keep 4", ""),
    ("basin map", "basin linear --points 4 --method map --manifolds 1", ""),
    ("basin direct", "basin linear --points 4 --method direct", ""),
    ("trajectory", "trajectory linear --samples 6", ""),
    ("derivatives", "derivatives linear --order 2", ""),
    ("noise", "noise linear --deviation alpha=1e-5 --orbits 4 --keep 20 --cells 4", ""),
    ("orbits map", "orbits linear --period 2", ""),
    ("orbits direct", "orbits linear --itinerary 1 --method direct", ""),
    ("branch map", "branch linear --along alpha --itinerary 1 --from=-1e-5 --to 1e-5", ""),
    (
        "branch direct",
        "branch linear --along alpha --itinerary 1 --from=-1e-5 --to 1e-5 --method direct",
        "",
    ),
    ("loci", "loci linear --plane alpha,omega --itinerary 10 --from=-1e-5 --to 1e-5", ""),
    ("fit", "fit linear --data - --parameters alpha --piece 0 --method map", MEASURED),
];

/// Starting points of images.
const STATES: &str = "x,theta,alpha\n1e-5,1e-4,1e-5\n-1e-4,2e-4,-1e-5\n";
/// Measured section points of two series.
const MEASURED: &str = "series,x,theta\na,1e-5,1e-4\na,-5.9e-5,-7.7e-5\na,8.7e-5,5e-5\n\
                        b,-2e-5,1e-4\nb,-3.5e-5,-8.2e-5\nb,7e-5,5.9e-5\n";

/// Records the golden texts of the program's documents.
///
/// # Panics
///
/// If the program refuses a command or does not print a document.
pub(super) fn documents(subjects: &Subjects, page: &mut Page) {
    for (name, line, input) in DOCUMENTS {
        let mut words = line.split(' ');
        if words.nth(1) != Some(subjects.name) {
            continue;
        }
        let document = printed(line, input).and_then(|text| Ok(serde_json::from_str(&text)?));
        // A refusal that was recorded would be compared as a result.
        let document = document.unwrap_or_else(|error| panic!("`grazemap {line}`: {error}"));
        put(page, name, without_saved(document));
    }
}

/// Document that a command prints.
fn printed(line: &str, input: &str) -> Result<String, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(program()?);
    command.args(line.split(' ')).args(["-q", "--json", "-"]);
    command.current_dir(folder.path()).env("XDG_CACHE_HOME", folder.path());
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    let written = child.stdin.take().map_or(Ok(()), |mut pipe| pipe.write_all(input.as_bytes()));
    // A command that ends before it reads says why on its standard error.
    written.or_else(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => Ok(()),
        _ => Err(error),
    })?;
    let output = child.wait_with_output()?;
    match output.status.success() {
        true => Ok(String::from_utf8(output.stdout)?),
        false => Err(String::from_utf8_lossy(&output.stderr).into()),
    }
}

/// Document without the members of saved orbits and maps.
fn without_saved(mut document: Value) -> Value {
    if let Some(members) = document.as_object_mut() {
        SAVED.iter().for_each(|&name| drop(members.remove(name)));
    }
    document
}

/// Adds a line for every member. A list of plain values is one line; of a long list of others,
/// members at even steps and the last are added.
fn put(page: &mut Page, path: &str, value: Value) {
    match value {
        Value::Object(members) if !members.is_empty() => {
            for (name, member) in members {
                let is_time = TIMES.iter().any(|ending| name.ends_with(ending));
                if !is_time && !STAMPS.contains(&&*name) {
                    put(page, &format!("{path}/{name}"), member);
                }
            }
        }
        Value::Array(list) if list.iter().any(|one| one.is_object() || one.is_array()) => {
            let (last, step) = (list.len() - 1, (list.len() - 1).div_ceil(STEPS).max(1));
            for (number, member) in list.into_iter().enumerate() {
                if number % step == 0 || number == last {
                    put(page, &format!("{path}/{number:03}"), member);
                }
            }
        }
        value => {
            // The name of a recorded line ends at its last space.
            page.line(path, golden_text(&value.to_string()).replace(' ', "\\u0020"));
        }
    }
}

/// Text whose numbers have at most twelve significant digits, in quotes too.
pub fn golden_text(text: &str) -> String {
    let mut rounded = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(|letter: char| letter.is_ascii_digit()) {
        let (before, number) = rest.split_at(start);
        let length = length_of_number(number);
        let (number, after) = number.split_at(length);
        rounded.push_str(before);
        rounded.push_str(&short(number));
        rest = after;
    }
    rounded + rest
}

/// Length of the number at the beginning of a text: digits, a fraction, an exponent.
fn length_of_number(text: &str) -> usize {
    let digits = |from: usize| {
        let rest = text[from..].bytes();
        from + rest.take_while(u8::is_ascii_digit).count()
    };
    let whole = digits(0);
    let fraction = if text[whole..].starts_with('.') { digits(whole + 1) } else { whole };
    let exponent = text[fraction..].strip_prefix(['e', 'E']).map(|exponent| {
        let sign = usize::from(exponent.starts_with(['+', '-']));
        (fraction + 1 + sign, digits(fraction + 1 + sign))
    });
    exponent.filter(|(from, to)| to > from).map_or(fraction, |(_, to)| to)
}

/// Number with at most twelve significant digits.
fn short(number: &str) -> String {
    let mantissa = number.split(['e', 'E']).next().unwrap_or_default();
    let significant = mantissa.trim_start_matches(['0', '.']).bytes().filter(u8::is_ascii_digit);
    let Ok(value) = number.parse::<f64>() else {
        return number.to_owned();
    };
    if value < NOISE {
        return "0".to_owned();
    }
    match significant.count() > DIGITS {
        true => {
            let shown = format!("{value:.*e}", DIGITS - 1);
            let (mantissa, exponent) = shown.split_once('e').unwrap_or((&shown, "0"));
            let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
            format!("{mantissa}e{exponent}")
        }
        false => number.to_owned(),
    }
}
