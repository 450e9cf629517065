//! Finished pieces of a long computation, kept in a file beside its results: a run that is
//! interrupted goes on from there.
//!
//! One idea: a record is a length, a piece's place, its bytes and their digest, written with one
//! call. What stands behind the last whole record of the file is what an interruption left of one,
//! and is cut off. The name of the file holds a key of everything that decides the pieces, and the
//! file is locked while a run uses it: no other run and no other settings ever read it.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::files::remove_abandoned;
use crate::model::Digest;

/// Finished pieces by their place.
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
    /// Pieces in the file.
    pieces: usize,
}

impl Journal {
    /// The journal of a command in the folder of its results, which is made if need be; journals
    /// of the same command with other keys are removed. `None` where another run uses it, or
    /// where the folder takes no files: then nothing is kept.
    pub fn open(folder: &Path, command: &str, key: Digest) -> Option<Self> {
        let prefix = format!(".resume-{command}-");
        let path = folder.join(format!("{prefix}{key}"));
        fs::create_dir_all(folder).ok()?;
        let options = File::options().read(true).append(true).create(true).clone();
        let mut file = options.open(&path).ok()?;
        file.try_lock().ok()?;
        remove_abandoned(folder, &prefix);
        let known = read(&mut file).ok()?;
        // The file itself may have been taken for one of another key before it was locked.
        path.exists().then_some(())?;
        Some(Self { path, state: Mutex::new(State { file, pieces: known.len(), known }) })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The piece at a place that an earlier run kept.
    pub fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        self.state().known.remove(place)
    }

    /// Keeps a piece; where the file takes no more, it is lost.
    pub fn keep(&self, place: &[u64], piece: &[u8]) {
        let mut state = self.state();
        if state.file.write_all(&record(place, piece)).is_ok() {
            state.pieces += 1;
        }
    }

    /// Pieces of this run and of earlier ones that are in the file.
    pub fn pieces(&self) -> usize {
        self.state().pieces
    }

    /// Holds all further pieces back while a message is said and the program ends.
    pub fn hold<T>(&self, meanwhile: impl FnOnce(&Path) -> T) -> T {
        let _held = self.state();
        meanwhile(&self.path)
    }

    /// Removes the file: the results are written.
    pub fn finish(&self) {
        let _gone_or_not = fs::remove_file(&self.path);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Length of the numbers at both ends of a record.
const NUMBER: usize = 8;

/// The length of the rest, the length of the place, the place, the piece, the digest of all that.
pub(super) fn record(place: &[u64], piece: &[u8]) -> Vec<u8> {
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

/// Every whole record of a file, which is cut after the last of them.
fn read(file: &mut File) -> io::Result<HashMap<Vec<u64>, Vec<u8>>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    let (mut known, mut rest) = (HashMap::new(), &bytes[..]);
    while let Some((place, piece, behind)) = next(rest) {
        known.insert(place, piece.to_vec());
        rest = behind;
    }
    file.set_len((bytes.len() - rest.len()) as u64)?;
    Ok(known)
}

/// The first record of these bytes, and what stands behind it.
pub(super) fn next(bytes: &[u8]) -> Option<(Vec<u64>, &[u8], &[u8])> {
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
}
