//! Saved files with changes that a slip, a full disk or an attacker could make: orbits, maps,
//! pieces of shards, and atlases. The digests of every second changed atlas and of every second
//! changed file of pieces are forged.

use std::fs;
use std::path::Path;
use std::process::Command;

use grazemap::model::Digest;
use grazemap::report::{pieces_from_bytes, pieces_to_bytes};

use super::mutation::VALUES;
use crate::random::Random;

/// File that the program writes, with the calls that read it.
struct Kind {
    /// Name of the file.
    file: &'static str,
    /// Arguments of the call that writes it.
    written: &'static [&'static str],
    /// Arguments of calls that read it, with `FILE` in its place.
    read: &'static [&'static [&'static str]],
}

/// Calls that read a saved orbit or map.
const ORBIT: &[&[&str]] = &[
    &["check", "FILE"],
    &["locate", "FILE", "--json", "-"],
    &["expand", "FILE", "--csv", "-"],
    &["emit", "FILE", "-o", "out"],
    &["image", "FILE", "--states", "states.csv"],
    &["image", "FILE", "--states", "states.csv", "--method", "direct"],
];

/// Call that joins two shards.
const MERGE: &[&[&str]] =
    &[&["merge", "diagram-1-of-2.pieces", "diagram-2-of-2.pieces", "-o", "out"]];

/// Call that takes the results from the one file of a shard.
const ALONE: &[&[&str]] = &[&["merge", "FILE", "-o", "out"]];

/// Call that goes on with an atlas.
const LOAD: &[&[&str]] =
    &[&["atlas", "linear", "--load", "FILE", "--boxes", "5", "--points", "20"]];

/// First line of an atlas; the digest of what follows the second line is the second line.
const ATLAS: &str = "grazemap atlas 1\n";

/// All kinds of files.
const KINDS: [Kind; 11] = [
    Kind {
        file: "orbit.json",
        written: &["locate", "linear", "--json", "orbit.json"],
        read: ORBIT,
    },
    Kind {
        file: "two_stops.json",
        written: &["locate", "two_stops_t1_rigid", "--json", "two_stops.json"],
        read: ORBIT,
    },
    Kind {
        file: "map.json",
        written: &["expand", "linear", "--json", "map.json", LOW[0], LOW[1], LOW[2], LOW[3]],
        read: ORBIT,
    },
    Kind {
        file: "composed.json",
        written: &[
            "expand",
            "two_stops_t1_rigid",
            "--json",
            "composed.json",
            LOW[0],
            LOW[1],
            LOW[2],
            LOW[3],
        ],
        read: ORBIT,
    },
    Kind {
        file: "flown.json",
        written: &[
            "expand",
            "soft_b_stiff",
            "--json",
            "flown.json",
            LOW[0],
            LOW[1],
            LOW[2],
            LOW[3],
        ],
        read: ORBIT,
    },
    Kind { file: "diagram-1-of-2.pieces", written: &SHARDS[0], read: MERGE },
    Kind { file: "diagram-2-of-2.pieces", written: &SHARDS[1], read: MERGE },
    Kind {
        file: "chart-1-of-1.pieces",
        written: &[
            "chart",
            "linear",
            "--plane",
            "alpha,omega",
            "--points",
            "6",
            "--shard",
            "1/1",
            "-o",
            ".",
            LOW[0],
            LOW[1],
            LOW[2],
            LOW[3],
        ],
        read: ALONE,
    },
    Kind {
        file: "basin-1-of-1.pieces",
        written: &[
            "basin",
            "linear",
            "--points",
            "9",
            "--at",
            "alpha=1e-4",
            "--shard",
            "1/1",
            "-o",
            ".",
            LOW[0],
            LOW[1],
            LOW[2],
            LOW[3],
        ],
        read: ALONE,
    },
    Kind {
        file: "branch-1-of-1.pieces",
        written: &[
            "branch", "linear", "--along", "alpha", "--period", "2", "--shard", "1/1", "-o", ".",
            LOW[0], LOW[1], LOW[2], LOW[3],
        ],
        read: ALONE,
    },
    Kind {
        file: "linear.atlas",
        written: &["atlas", "linear", "--save", "linear.atlas", "--boxes", "9", "--points", "20"],
        read: LOAD,
    },
];

/// Orders at which a map has few numbers.
const LOW: [&str; 4] = ["--set", "expansion.smooth_order=2", "--set", "expansion.contact_weight=3"];

/// Calls that write the pieces of a diagram.
const SHARDS: [[&str; 12]; 2] = [shard("1/2"), shard("2/2")];

const fn shard(share: &'static str) -> [&'static str; 12] {
    [
        "diagram",
        "linear",
        "--shard",
        share,
        "-o",
        ".",
        "--set",
        "diagram.0.points=20",
        "--set",
        "diagram.0.transient=20",
        "--set",
        "diagram.0.keep=4",
    ]
}

/// Files as the program wrote them.
#[derive(Debug)]
pub(super) struct Saved {
    contents: Vec<Vec<u8>>,
}

/// Changed file and a call that reads it.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Name of the file.
    pub(super) file: &'static str,
    /// Content as it was.
    pub(super) before: Vec<u8>,
    /// Changed content.
    pub(super) content: Vec<u8>,
    /// Arguments of the call.
    pub(super) arguments: Vec<String>,
}

impl Saved {
    /// Files that a program writes into a folder.
    ///
    /// # Errors
    ///
    /// A file that the program does not write.
    pub(super) fn written(program: &Path, folder: &Path) -> Result<Self, String> {
        let written = |kind: &Kind| {
            let mut call = Command::new(program);
            let output = call.args(kind.written).arg("--quiet").current_dir(folder).output();
            let output = output.map_err(|error| error.to_string())?;
            if !output.status.success() {
                return Err(String::from_utf8_lossy(&output.stderr).into_owned());
            }
            fs::read(folder.join(kind.file)).map_err(|error| format!("{}: {error}", kind.file))
        };
        Ok(Self { contents: KINDS.iter().map(written).collect::<Result<_, _>>()? })
    }

    /// Case with a number in the campaign of a seed.
    pub(super) fn change(&self, seed: u64, number: u64) -> Change {
        let mut random = Random::new(seed, number);
        let place = random.below(KINDS.len());
        let Kind { file, read, .. } = KINDS[place];
        let before = self.contents[place].clone();
        let forged = random.one_in(2);
        let mut content = before.clone();
        if !(forged && forge_piece(&mut content, &mut random)) {
            for _ in 0..1 + random.below(3) {
                change(&mut content, &mut random);
            }
        }
        if forged {
            forge(&mut content);
        }
        let words = random.of(read).iter().map(|&word| if word == "FILE" { file } else { word });
        let arguments = words.chain(["--threads", "1"]).map(str::to_owned).collect();
        Change { file, before, content, arguments }
    }
}

/// Texts that readers of JSON and of lengths often mishandle.
const INSERTED: [&str; 10] = ["{", "}", "[", "]", "\"", ",", "\0", "null", "1e999", "\u{feff}"];

/// Changes a content at a random place.
fn change(content: &mut Vec<u8>, random: &mut Random) {
    if content.is_empty() {
        return;
    }
    let from = random.below(content.len());
    let to = (from + 1 + random.below(64)).min(content.len());
    match random.below(8) {
        0..=2 => {
            let number = number_after(content, from);
            content.splice(number, random.of(&VALUES).bytes());
        }
        3 => content[from] ^= 1 << random.below(8),
        4 => drop(content.drain(from..to)),
        5 => {
            let again = content[from..to].to_vec();
            content.splice(from..from, again);
        }
        6 => content.truncate(from),
        _ => drop(content.splice(from..from, random.of(&INSERTED).bytes())),
    }
}

/// Numbers as pieces hold them, much larger than any count in a piece: 2^64 - 1, 2^40, 2^31, and
/// 2^21 - 1.
pub const HUGE: [&[u8]; 4] = [
    &[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01],
    &[0x80, 0x80, 0x80, 0x80, 0x80, 0x20],
    &[0x80, 0x80, 0x80, 0x80, 0x08],
    &[0xff, 0xff, 0x7f],
];

/// Changes one record of a file of pieces and writes its digest anew; `false` for other files.
fn forge_piece(content: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some(mut pieces) = pieces_from_bytes(content).filter(|pieces| !pieces.is_empty()) else {
        return false;
    };
    let number = random.below(pieces.len());
    let Some(piece) = pieces.values_mut().nth(number).filter(|piece| !piece.is_empty()) else {
        return false;
    };
    if random.one_in(2) {
        change(piece, random);
    } else {
        // Sizes are at the start of a piece.
        let end = if random.one_in(2) { piece.len().min(8) } else { piece.len() };
        let from = random.below(end);
        piece.splice(from..from + 1, random.of(&HUGE).iter().copied());
    }
    *content = pieces_to_bytes(&pieces);
    true
}

/// Writes the digest of a changed atlas.
fn forge(content: &mut Vec<u8>) {
    let start = ATLAS.len();
    let Some(rest) = content.get(start..).filter(|_| content.starts_with(ATLAS.as_bytes())) else {
        return;
    };
    if let Some(length) = rest.iter().position(|&byte| byte == b'\n') {
        let digest = Digest::of_bytes(&rest[length + 1..]).to_string();
        content.splice(start..start + length, digest.into_bytes());
    }
}

/// Range of the first number that begins after a place; the end of the content if there is none.
fn number_after(content: &[u8], place: usize) -> std::ops::Range<usize> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let digit = content[place..].iter().position(u8::is_ascii_digit);
    let start = digit.map_or(content.len(), |digit| place + digit);
    let length = content[start..].iter().take_while(|byte| is_part(byte)).count();
    start..start + length
}
