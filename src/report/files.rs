//! Files that are whole or absent.
//!
//! Every file is written beside its place under a temporary name, flushed to the disk, and renamed
//! over the old one: a reader, or a run that was interrupted, sees the old file or the new one. A
//! link stays one, and what it points to is replaced or created; a pipe or a device is written to
//! and stays what it is; a file that may not be written is not replaced.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use super::ReportError;

/// Writes a file so that it is never seen half-written; an older file of that name is replaced.
///
/// The parent folder must exist. A file that is replaced keeps its permissions; a link is followed,
/// also where nothing is at its end yet. What is no file, a pipe or a device such as `/dev/null`, is
/// not replaced but written to. A file without permission to be written is refused.
///
/// # Errors
///
/// [`ReportError::Write`] with the step, the path and the operating system's answer; the old file,
/// if there was one, is untouched then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let failed =
        |action| move |source| ReportError::Write { action, path: path.to_path_buf(), source };
    let old = fs::metadata(path).ok();
    match &old {
        Some(old) if old.is_dir() => {
            return Err(failed("write")(io::ErrorKind::IsADirectory.into()));
        }
        Some(old) if !old.is_file() => {
            let device = File::options().write(true).open(path);
            return device.and_then(|mut device| device.write_all(bytes)).map_err(failed("write"));
        }
        Some(old) => refuse_protected(path, old).map_err(failed("replace"))?,
        None => {}
    }
    let target = end_of_links(path).map_err(failed("write"))?;
    let folder = folder_of(&target);
    fs::metadata(folder).map_err(failed("write"))?;
    // NOTE: the error itself would name the temporary file, which the reader has never heard of.
    let temporary = temporary_file(folder).map_err(|error| io::Error::from(error.kind()));
    let mut temporary = temporary.map_err(failed("write"))?;
    temporary.write_all(bytes).map_err(failed("write"))?;
    if let Some(old) = old {
        temporary.as_file().set_permissions(old.permissions()).map_err(failed("write"))?;
    }
    temporary.as_file().sync_all().map_err(failed("flush"))?;
    temporary.persist(&target).map_err(|refused| failed("replace")(refused.error))?;
    sync_folder(folder);
    Ok(())
}

/// Refuses a file that may not be written: renaming over it asks for permission of its folder
/// alone.
fn refuse_protected(path: &Path, file: &fs::Metadata) -> io::Result<()> {
    // NOTE: the administrator can open every file.
    if file.permissions().readonly() {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    File::options().append(true).open(path).map(drop)
}

/// Most links that lead from one to the next.
const MOST_LINKS: usize = 40;

/// What a path leads to, whether or not anything is there.
fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut place = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&place) {
            Ok(entry) if entry.is_symlink() => {
                place = folder_of(&place).join(fs::read_link(&place)?);
            }
            _ => return Ok(place),
        }
    }
    Err(io::Error::other("the links lead in a circle"))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(unix)]
fn temporary_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    use std::os::unix::fs::PermissionsExt;
    // NOTE: the default of a temporary file is 0600; 0666 lets the user's umask decide, as for any
    // file.
    tempfile::Builder::new()
        .prefix(".unfinished-")
        .permissions(fs::Permissions::from_mode(0o666))
        .tempfile_in(folder)
}

#[cfg(not(unix))]
fn temporary_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new().prefix(".unfinished-").tempfile_in(folder)
}

/// Makes the new name itself durable where the system allows it; the file is whole either way.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = File::open(folder) {
        let _durable_or_not = handle.sync_all();
    }
}

/// A folder that a run writes its files into, one whole file at a time.
#[derive(Debug, Clone)]
pub struct OutputFolder {
    root: PathBuf,
}

impl OutputFolder {
    /// The folder at `root`, created with its parents where it is absent.
    ///
    /// # Errors
    ///
    /// [`ReportError::Write`] if it cannot be created, or if something else has that name.
    pub fn create(root: impl Into<PathBuf>) -> Result<Self, ReportError> {
        let root = root.into();
        create_folder(&root)?;
        Ok(Self { root })
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Writes one file (see [`write_atomically`]) and returns its path.
    ///
    /// `name` is relative, may name subfolders, which are created, and may not leave the folder.
    ///
    /// # Errors
    ///
    /// [`ReportError::OutsideFolder`] for a name that is empty, absolute or has `..` in it;
    /// [`ReportError::Write`] as for [`write_atomically`].
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<PathBuf, ReportError> {
        let relative = Path::new(name);
        let inside = relative.components().all(|part| matches!(part, Component::Normal(_)));
        if !inside || relative.file_name().is_none() {
            return Err(ReportError::OutsideFolder { name: name.to_owned() });
        }
        let path = self.root.join(relative);
        create_folder(folder_of(&path))?;
        write_atomically(&path, bytes.as_ref())?;
        Ok(path)
    }

    /// Writes files by name, in order.
    ///
    /// # Errors
    ///
    /// As [`write`](Self::write).
    pub fn write_all<'a, B: AsRef<[u8]> + ?Sized + 'a>(
        &self,
        files: impl IntoIterator<Item = (&'a String, &'a B)>,
    ) -> Result<(), ReportError> {
        files.into_iter().try_for_each(|(name, bytes)| self.write(name, bytes).map(drop))
    }
}

fn create_folder(path: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(path).map_err(|source| ReportError::Write {
        action: "create folder",
        path: path.to_path_buf(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder can be made")
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("the folder can be listed");
        entries
            .map(|entry| entry.expect("listed").file_name().to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn a_written_file_replaces_the_old_one_and_leaves_nothing_else() {
        let folder = scratch();
        let path = folder.path().join("map.json");
        write_atomically(&path, b"old").expect("writable");
        write_atomically(&path, b"new").expect("writable");
        assert_eq!(fs::read(&path).expect("readable"), b"new");
        assert_eq!(names_in(folder.path()), ["map.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_also_where_nothing_is_at_its_end() {
        use std::os::unix::fs::symlink;
        let folder = scratch();
        let place = |name: &str| folder.path().join(name);
        fs::create_dir(place("real")).expect("writable");
        symlink("real/map.json", place("link")).expect("writable");
        symlink("link", place("second")).expect("writable");
        for bytes in [b"old", b"new"] {
            write_atomically(&place("second"), bytes).expect("writable");
            assert_eq!(fs::read(place("real/map.json")).expect("readable"), bytes);
            assert!(place("link").is_symlink() && place("second").is_symlink());
        }
        symlink("nowhere/map.json", place("lost")).expect("writable");
        assert!(write_atomically(&place("lost"), b"bytes").is_err());
        assert!(place("lost").is_symlink() && !place("nowhere").exists());
        symlink("b", place("a")).expect("writable");
        symlink("a", place("b")).expect("writable");
        assert!(write_atomically(&place("a"), b"bytes").is_err());
        assert!(place("a").is_symlink() && place("b").is_symlink());
    }

    #[test]
    fn a_file_that_may_not_be_written_is_not_replaced() {
        let folder = scratch();
        let path = folder.path().join("map.json");
        fs::write(&path, "mine").expect("writable");
        let mut permissions = fs::metadata(&path).expect("there").permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).expect("one's own");
        let refused = write_atomically(&path, b"bytes").expect_err("protected");
        assert!(matches!(refused, ReportError::Write { action: "replace", .. }), "{refused}");
        assert_eq!(fs::read(&path).expect("readable"), b"mine");
        assert_eq!(names_in(folder.path()), ["map.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_without_permission_is_reported_and_left_as_it_was() {
        use std::os::unix::fs::PermissionsExt;
        let folder = scratch();
        let closed = folder.path().join("closed");
        fs::create_dir(&closed).expect("writable");
        fs::write(closed.join("map.json"), "mine").expect("writable");
        fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).expect("one's own");
        // The administrator may write everywhere: then nothing is refused, and the file is whole.
        let refuses = File::create(closed.join("probe")).is_err();
        let written = write_atomically(&closed.join("map.json"), b"new");
        assert_eq!(written.is_err(), refuses);
        let expected: &[u8] = if refuses { b"mine" } else { b"new" };
        assert_eq!(fs::read(closed.join("map.json")).expect("readable"), expected);
        fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).expect("one's own");
    }

    #[test]
    fn a_refused_write_leaves_the_target_as_it_was() {
        let folder = scratch();
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).expect("writable");
        let refused = write_atomically(&taken, b"bytes").expect_err("a folder is in the way");
        assert!(refused.to_string().contains("taken"));
        assert_eq!(names_in(folder.path()), ["taken"]);

        let absent = folder.path().join("absent").join("map.json");
        let refused = write_atomically(&absent, b"bytes").expect_err("the parent is absent");
        assert!(matches!(refused, ReportError::Write { action: "write", .. }));
    }

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        let scratch = scratch();
        let folder = OutputFolder::create(scratch.path().join("a/b")).expect("creatable");
        for name in ["", "..", "../x", "/x", "a/../../x"] {
            let refused = folder.write(name, "bytes");
            assert!(matches!(refused, Err(ReportError::OutsideFolder { .. })), "{name}");
        }
        let path = folder.write("src/lib.rs", "bytes").expect("a subfolder is fine");
        assert_eq!(fs::read(path).expect("readable"), b"bytes");
    }

    #[test]
    fn a_file_in_the_place_of_the_folder_is_reported() {
        let scratch = scratch();
        let file = scratch.path().join("out");
        fs::write(&file, "x").expect("writable");
        assert!(matches!(OutputFolder::create(&file), Err(ReportError::Write { .. })));
    }
}
