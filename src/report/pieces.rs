//! Finished pieces of a long computation, in files: an interrupted run resumes from its journal,
//! and the files of shards are joined.
//!
//! A record holds a length, the place of a piece, its bytes and their digest, and is written with
//! one call. Bytes after the last complete record of a journal are the remains of an interruption
//! and are cut off. The name of the file contains a key of everything that determines the pieces,
//! and the file is locked while a run uses it: no other run and no other settings ever read it.
//!
//! The file of a shard consists of records too. The first one describes the others and states their
//! number, so that an incomplete file is refused.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::files::{Files, remove_abandoned};
use crate::analysis::{Pieces, Share};
use crate::model::Digest;

/// Journal of finished pieces, by place.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    file: File,
    /// Pieces of earlier runs.
    known: HashMap<Vec<u64>, Vec<u8>>,
    /// Places of the pieces in the file. A piece that is kept twice counts once.
    places: HashSet<Vec<u64>>,
}

impl Journal {
    /// Opens the journal of a command in the folder of its results, which is created if need be.
    /// Journals of the same command with other keys are removed. `None`, and no pieces are kept, if
    /// another run uses the journal, if a link, a pipe or a folder has its name, or if the folder
    /// is not writable.
    pub fn open(folder: &Path, command: &str, key: Digest) -> Option<Self> {
        let prefix = format!(".resume-{command}-");
        let path = folder.join(format!("{prefix}{key}"));
        fs::create_dir_all(folder).ok()?;
        let mut file = own_file(&path)?;
        file.try_lock().ok()?;
        remove_abandoned(folder, &prefix);
        let known = read_records(&mut file).ok()?;
        // NOTE: another run may have removed the file, as one of another key, before it was locked.
        path.exists().then_some(())?;
        let places = known.keys().cloned().collect();
        Some(Self { path, state: Mutex::new(State { file, known, places }) })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes the piece at a place, if an earlier run kept it.
    pub fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        self.state().known.remove(place)
    }

    /// Keeps a piece. If the file cannot be written, the piece is lost.
    pub fn keep(&self, place: &[u64], piece: &[u8]) {
        let mut state = self.state();
        if state.file.write_all(&record(place, piece)).is_ok() {
            state.places.insert(place.to_vec());
        }
    }

    /// Number of pieces in the file, of this run and of earlier ones.
    pub fn pieces(&self) -> usize {
        self.state().places.len()
    }

    /// Blocks further pieces during `meanwhile`, in which a message is printed and the program
    /// exits.
    pub fn hold<T>(&self, meanwhile: impl FnOnce(&Path) -> T) -> T {
        let _held = self.state();
        meanwhile(&self.path)
    }

    /// Removes the file, once the results are written.
    pub fn finish(&self) {
        let _gone_or_not = fs::remove_file(&self.path);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Opens or creates a journal. A link of its name is not followed, since others may write into the
/// folder; a pipe is not opened, since that would block.
fn own_file(path: &Path) -> Option<File> {
    let mut options = File::options();
    options.read(true).append(true);
    match fs::symlink_metadata(path) {
        Ok(entry) => entry.is_file().then(|| options.open(path).ok()).flatten(),
        Err(_) => options.create_new(true).open(path).ok(),
    }
}

/// Size of the numbers at both ends of a record, in bytes.
const NUMBER: usize = 8;

/// Record: length of the rest, length of the place, place, piece, digest of all these.
fn record(place: &[u64], piece: &[u8]) -> Vec<u8> {
    let length = NUMBER * (place.len() + 2) + piece.len();
    let mut bytes = Vec::with_capacity(length + NUMBER);
    let numbers = [length as u64, place.len() as u64];
    for number in numbers.iter().chain(place) {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes.extend_from_slice(piece);
    let digest = Digest::of_bytes(&bytes);
    bytes.extend_from_slice(&digest.0.to_le_bytes());
    bytes
}

/// Complete records of a file. The file is cut after the last of them.
fn read_records(file: &mut File) -> io::Result<HashMap<Vec<u64>, Vec<u8>>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    let (mut known, mut rest) = (HashMap::new(), &bytes[..]);
    while let Some((place, piece, behind)) = next_record(rest) {
        known.insert(place, piece.to_vec());
        rest = behind;
    }
    file.set_len((bytes.len() - rest.len()) as u64)?;
    Ok(known)
}

/// First record of these bytes, and the bytes after it.
fn next_record(bytes: &[u8]) -> Option<(Vec<u64>, &[u8], &[u8])> {
    let number = |bytes: &[u8]| {
        let first = bytes.first_chunk::<NUMBER>()?;
        usize::try_from(u64::from_le_bytes(*first)).ok()
    };
    let length = number(bytes)?;
    let (record, behind) = bytes.split_at_checked(length.checked_add(NUMBER)?)?;
    let (content, digest) = record.split_at_checked(length)?;
    (Digest::of_bytes(content).0.to_le_bytes() == digest).then_some(())?;
    let places = number(content.get(NUMBER..)?)?.checked_mul(NUMBER)?;
    let (place, piece) = content.get(2 * NUMBER..)?.split_at_checked(places)?;
    let place = place.chunks_exact(NUMBER).map(|chunk| chunk.try_into().map(u64::from_le_bytes));
    Some((place.collect::<Result<_, _>>().ok()?, piece, behind))
}

/// Header of a shard's file. Shards are joined if their headers agree in all but their numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardHeader {
    /// Version of the program.
    pub version: String,
    /// Digest of the executable: another build may compute another last bit.
    pub program: Digest,
    /// The command.
    pub command: String,
    /// Digest of the scene's text, for commands that have a scene.
    pub scene: Option<Digest>,
    /// Digest of everything that determines the pieces.
    pub settings: Digest,
    /// Number of shards.
    pub of: usize,
    /// Number of this shard, from 1.
    pub number: usize,
    /// Arguments of the command.
    pub arguments: Vec<String>,
    /// Map, for commands that have one.
    pub map: Option<String>,
    /// Number of pieces that follow.
    pub pieces: usize,
}

/// Reason why files of pieces cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum ShardError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not one of pieces.
    #[error(
        "{} holds no pieces of this version of grazemap; expected a file that a command wrote \
         for a shard", .path.display()
    )]
    Foreign {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file is incomplete or damaged.
    #[error(
        "{} is damaged or cut off; compute shard {number}/{of} again", .path.display()
    )]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// Number of the shard.
        number: usize,
        /// Number of shards.
        of: usize,
    },
    /// The pieces were computed by another program.
    #[error(
        "the pieces were computed by another {what} than this one; merge them with the program \
         that computed them"
    )]
    Elsewhere {
        /// Property that differs.
        what: &'static str,
    },
    /// The files belong to different computations.
    #[error(
        "{} and {} differ in their {what}; shards of one computation are expected",
        .first.display(), .other.display()
    )]
    Mixed {
        /// Property that differs.
        what: &'static str,
        /// Path given first.
        first: PathBuf,
        /// Path given later.
        other: PathBuf,
    },
    /// A shard is given twice.
    #[error(
        "shard {number} is in {} and in {}; name one of them",
        .first.display(), .other.display()
    )]
    Twice {
        /// Number of the shard.
        number: usize,
        /// Path given first.
        first: PathBuf,
        /// Path given later.
        other: PathBuf,
    },
    /// Shards are missing.
    #[error(
        "of {of} shards there is no file of {}; compute them too",
        list(.missing)
    )]
    Missing {
        /// Numbers of the missing shards; only the first ones if there are many.
        missing: Vec<usize>,
        /// Number of shards.
        of: usize,
    },
}

/// Largest number of missing shards that are named.
const MOST_NAMED: usize = 20;

fn list(numbers: &[usize]) -> String {
    let named = numbers.iter().take(MOST_NAMED).map(ToString::to_string);
    let more = (numbers.len() > MOST_NAMED).then(|| "more".to_owned());
    named.chain(more).collect::<Vec<_>>().join(", ")
}

impl ShardHeader {
    /// Content of the file of pieces with this header.
    pub fn file(mut self, pieces: &Pieces) -> Vec<u8> {
        self.pieces = pieces.len();
        // NOTE: serialising a header of plain values cannot fail.
        let header = serde_json::to_vec(&self).unwrap_or_default();
        [record(&[], &header), pieces_to_bytes(pieces)].concat()
    }

    /// Name of that file.
    pub fn file_name(&self) -> String {
        format!("{}-{}-of-{}.pieces", self.command, self.number, self.of)
    }

    /// Refuses pieces computed by another version or another build than this one.
    ///
    /// # Errors
    ///
    /// [`ShardError::Elsewhere`] with the property that differs.
    pub fn check_program(&self, version: &str, program: Digest) -> Result<(), ShardError> {
        let own = Self { version: version.to_owned(), program, ..self.clone() };
        let what = self.difference(&own);
        what.map_or(Ok(()), |what| Err(ShardError::Elsewhere { what }))
    }

    /// Property, other than the shard's number, in which two headers differ.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        let same = [
            ("version of grazemap", self.version == other.version),
            ("command", self.command == other.command),
            ("scene", self.scene == other.scene),
            ("number of shards", self.of == other.of),
            ("build of grazemap", self.program == other.program),
            ("settings", self.settings == other.settings && self.map == other.map),
        ];
        same.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
    }
}

/// Joins the pieces of all shards. Also returns their common header.
///
/// # Errors
///
/// [`ShardError`] for files that are incomplete, of different computations, or not all shards of
/// one.
pub fn join_shards(paths: &[PathBuf]) -> Result<(ShardHeader, Pieces), ShardError> {
    let mut read: Vec<(&Path, ShardHeader)> = Vec::new();
    let mut all = Pieces::new();
    for path in paths {
        let (header, pieces) = read_shard(path)?;
        if let Some((first, known)) = read.first()
            && let Some(what) = known.difference(&header)
        {
            return Err(ShardError::Mixed { what, first: first.into(), other: path.clone() });
        }
        if let Some((first, _)) = read.iter().find(|(_, known)| known.number == header.number) {
            let number = header.number;
            return Err(ShardError::Twice { number, first: first.into(), other: path.clone() });
        }
        all.extend(pieces);
        read.push((path, header));
    }
    let of = read.first().map_or(0, |(_, header)| header.of);
    let is_there = |number: &usize| read.iter().any(|(_, header)| header.number == *number);
    // NOTE: the number of shards stated in a file may be anything.
    let missing = (1..=of).filter(|number| !is_there(number));
    let missing: Vec<usize> = missing.take(MOST_NAMED + 1).collect();
    match read.into_iter().next() {
        Some((_, header)) if missing.is_empty() => Ok((header, all)),
        _ => Err(ShardError::Missing { missing, of }),
    }
}

/// Reads the file of a shard.
fn read_shard(path: &Path) -> Result<(ShardHeader, Pieces), ShardError> {
    let bytes = fs::read(path)
        .map_err(|source| ShardError::Unreadable { path: path.to_owned(), source })?;
    let header = next_record(&bytes).filter(|(place, ..)| place.is_empty());
    let header = header.and_then(|(_, header, rest)| {
        let header: ShardHeader = serde_json::from_slice(header).ok()?;
        Share::new(header.number, header.of)?;
        Some((header, rest))
    });
    let (header, rest) = header.ok_or_else(|| ShardError::Foreign { path: path.to_owned() })?;
    let pieces = pieces_from_bytes(rest).filter(|pieces| pieces.len() == header.pieces);
    let ShardHeader { number, of, .. } = header;
    let damaged = || ShardError::Damaged { path: path.to_owned(), number, of };
    Ok((header, pieces.ok_or_else(damaged)?))
}

/// Pieces as records.
pub fn pieces_to_bytes(pieces: &Pieces) -> Vec<u8> {
    pieces.iter().flat_map(|(place, piece)| record(place, piece)).collect()
}

/// Reads the records of [`pieces_to_bytes`]; `None` for incomplete bytes.
pub fn pieces_from_bytes(mut bytes: &[u8]) -> Option<Pieces> {
    let mut pieces = Pieces::new();
    while !bytes.is_empty() {
        let (place, piece, rest) = next_record(bytes)?;
        pieces.insert(place, piece.to_vec());
        bytes = rest;
    }
    Some(pieces)
}

/// End of a command: the reason if it has no results.
pub type CommandEnd = Result<(), String>;

/// Packs the files of a folder, with those of its subfolders, and the end of the command that wrote
/// them into one piece.
///
/// # Errors
///
/// Errors of the operating system.
pub fn pack_folder(folder: &Path, ended: &CommandEnd) -> io::Result<Vec<u8>> {
    let mut files = Vec::new();
    read_files(folder, "", &mut files)?;
    postcard::to_stdvec(&(ended, files)).map_err(io::Error::other)
}

/// Reads the content of [`pack_folder`].
pub fn unpack_folder(piece: &[u8]) -> Option<(CommandEnd, Files)> {
    postcard::from_bytes(piece).ok()
}

fn read_files(folder: &Path, path: &str, files: &mut Files) -> io::Result<()> {
    for entry in fs::read_dir(folder.join(path))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let name = if path.is_empty() { name } else { format!("{path}/{name}") };
        match entry.path().is_dir() {
            true => read_files(folder, &name, files)?,
            false => files.push((name, fs::read(entry.path())?)),
        }
    }
    files.sort();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(folder: &Path, key: u64) -> Journal {
        Journal::open(folder, "diagram", Digest(key)).expect("a folder of its own")
    }

    #[test]
    fn pieces_are_read_back_up_to_where_a_record_was_torn() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let journal = open(folder.path(), 1);
        journal.keep(&[0, 7], b"seven");
        journal.keep(&[1], b"");
        journal.keep(&[2, 3], b"torn");
        let path = journal.path().to_owned();
        drop(journal);
        let whole = fs::read(&path).expect("readable");
        for torn in 1..record(&[2, 3], b"torn").len() {
            fs::write(&path, &whole[..whole.len() - torn]).expect("writable");
            let journal = open(folder.path(), 1);
            assert_eq!(journal.pieces(), 2);
            assert_eq!(journal.recall(&[2, 3]), None);
            journal.keep(&[2, 3], b"again");
            drop(journal);
            let journal = open(folder.path(), 1);
            assert_eq!(journal.recall(&[0, 7]).as_deref(), Some(&b"seven"[..]));
            assert_eq!(journal.recall(&[1]).as_deref(), Some(&b""[..]));
            assert_eq!(journal.recall(&[2, 3]).as_deref(), Some(&b"again"[..]));
        }
    }

    #[test]
    fn a_piece_that_is_kept_twice_is_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let journal = open(folder.path(), 1);
        for place in [0, 1, 0, 2, 1] {
            journal.keep(&[place], b"piece");
        }
        assert_eq!(journal.pieces(), 3);
        drop(journal);
        assert_eq!(open(folder.path(), 1).pieces(), 3);
    }

    #[test]
    fn another_key_starts_afresh_and_a_journal_in_use_is_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let journal = open(folder.path(), 1);
        journal.keep(&[0], b"old");
        assert!(Journal::open(folder.path(), "diagram", Digest(1)).is_none());
        let other = open(folder.path(), 2);
        assert!(journal.path().exists() && other.recall(&[0]).is_none());
        drop((journal, other));
        let third = open(folder.path(), 3);
        let names = fs::read_dir(folder.path()).expect("listed").count();
        assert_eq!(names, 1, "only {}", third.path().display());
        third.finish();
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 0);
    }

    fn header(number: usize) -> ShardHeader {
        ShardHeader {
            version: "1".to_owned(),
            program: Digest(1),
            command: "chart".to_owned(),
            scene: Some(Digest(2)),
            settings: Digest(3),
            of: 2,
            number,
            arguments: Vec::new(),
            map: Some("{}".to_owned()),
            pieces: 0,
        }
    }

    fn pieces(number: u64) -> Pieces {
        Pieces::from([(vec![number], b"one".to_vec()), (vec![number, 7], Vec::new())])
    }

    /// Result of joining two files with these headers.
    fn joined(first: ShardHeader, second: ShardHeader) -> Result<Pieces, String> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let paths = [(0, first), (1, second)].map(|(number, header)| {
            let path = folder.path().join(number.to_string());
            fs::write(&path, header.file(&pieces(number))).expect("writable");
            path
        });
        join_shards(&paths).map(|(_, pieces)| pieces).map_err(|error| error.to_string())
    }

    #[test]
    fn shards_of_one_computation_are_joined_and_others_are_refused() {
        let all: Pieces = [pieces(0), pieces(1)].into_iter().flatten().collect();
        assert_eq!(joined(header(2), header(1)), Ok(all));
        let other = || header(2);
        for (second, word) in [
            (ShardHeader { version: "2".to_owned(), ..other() }, "version"),
            (ShardHeader { command: "basin".to_owned(), ..other() }, "command"),
            (ShardHeader { scene: None, ..other() }, "scene"),
            (ShardHeader { of: 3, ..other() }, "number of shards"),
            (ShardHeader { program: Digest(7), ..other() }, "build"),
            (ShardHeader { settings: Digest(7), ..other() }, "settings"),
            (ShardHeader { map: None, ..other() }, "settings"),
            (header(1), "shard 1 is in"),
        ] {
            let refused = joined(header(1), second).expect_err(word);
            assert!(refused.contains(word), "{refused}");
        }
        let of = |number| ShardHeader { of: 4, ..header(number) };
        let refused = joined(of(1), of(3)).expect_err("two are missing");
        assert!(refused.contains("no file of 2, 4"), "{refused}");
    }

    #[test]
    fn pieces_of_another_program_are_refused() {
        let own = header(1);
        assert!(own.check_program("1", Digest(1)).is_ok());
        for (version, program, word) in [("2", 1, "version"), ("1", 2, "build")] {
            let refused = own.check_program(version, Digest(program)).expect_err(word).to_string();
            assert!(refused.contains(word), "{refused}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_others_took_is_neither_followed_nor_waited_for() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let name = |key: u64| folder.path().join(format!(".resume-diagram-{}", Digest(key)));
        let victim = folder.path().join("victim");
        fs::write(&victim, "mine").expect("writable");
        symlink(&victim, name(1)).expect("writable");
        symlink(folder.path().join("absent"), name(2)).expect("writable");
        let pipe = std::process::Command::new("mkfifo").arg(name(3)).status();
        assert!(pipe.expect("mkfifo can be started").success());
        for key in [1, 2, 3] {
            assert!(Journal::open(folder.path(), "diagram", Digest(key)).is_none(), "{key}");
        }
        assert!(Journal::open(folder.path(), "diagram", Digest(4)).is_some());
        assert_eq!(fs::read(&victim).expect("readable"), b"mine");
        assert!(!folder.path().join("absent").exists());
    }

    #[test]
    fn a_file_that_is_not_whole_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("one");
        let whole = header(1).file(&pieces(1));
        let read = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("writable");
            read_shard(&path).map_err(|error| error.to_string())
        };
        assert!(read(&whole).is_ok());
        let first = whole.len() - pieces_to_bytes(&pieces(1)).len();
        for length in 0..whole.len() {
            let word = if length < first { "holds no pieces" } else { "compute shard 1/2 again" };
            let refused = read(&whole[..length]).expect_err("cut off");
            assert!(refused.contains(word), "{refused}");
        }
        for place in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[place] ^= 4;
            assert!(read(&damaged).is_err(), "byte {place}");
        }
    }
}
