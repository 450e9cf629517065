//! Files that are written atomically, and their contents: figures, and arrays as NPY 1.0.
//!
//! Every file is written beside its place under a temporary name, flushed to the disk, and renamed
//! over the old file: a reader, or a run after an interruption, sees the old file or the new one. A
//! symbolic link is kept, and its target is replaced or created. A pipe or a device is written to
//! directly. A file without write permission is not replaced. A temporary file is locked while it
//! is written, so that a later run can recognise and remove the remains of an interruption.
//!
//! Reference: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

use super::{Figure, ReportError};
use crate::iteration::parallel;

/// Writes a file atomically. An older file of that name is replaced.
///
/// The parent folder must exist. The replaced file's permissions are kept. Links are followed, even
/// to a target that does not exist yet. A pipe or a device, such as `/dev/null`, is written to
/// directly. A file without write permission is refused.
///
/// # Errors
///
/// [`ReportError::Write`] with the step, the path and the operating system's error; an old file is
/// then untouched.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    write_streamed(path, |out| Ok(out.write_all(bytes)?))
}

/// Writes a file as [`write_atomically`] does, from the output of `content`, which is never held in
/// memory as a whole.
///
/// # Errors
///
/// As [`write_atomically`], and those of `content`; an old file is then untouched.
pub fn write_streamed(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> Result<(), ReportError>,
) -> Result<(), ReportError> {
    if let Some(folder) = replace(path, content)? {
        sync_folder(&folder);
    }
    Ok(())
}

/// Writes a file as [`write_streamed`] does, without flushing its folder. Returns that folder if
/// the file was renamed.
fn replace(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> Result<(), ReportError>,
) -> Result<Option<PathBuf>, ReportError> {
    let failed = |action| refused(action, path);
    let Some((target, old)) = replaceable(path)? else {
        let device = File::options().write(true).open(path).map_err(failed("write"))?;
        let mut device = BufWriter::new(device);
        content(&mut device).map_err(|error| named(error, path))?;
        return device.flush().map(|()| None).map_err(failed("write"));
    };
    let folder = folder_of(&target);
    let temporary = temporary_file(folder).map_err(failed("write"))?;
    // NOTE: the file itself, since errors of `NamedTempFile` name the temporary file.
    let mut out = BufWriter::new(temporary.as_file());
    content(&mut out).map_err(|error| named(error, path))?;
    out.flush().map_err(failed("write"))?;
    drop(out);
    if let Some(old) = old {
        temporary.as_file().set_permissions(old.permissions()).map_err(failed("write"))?;
    }
    temporary.as_file().sync_all().map_err(failed("flush"))?;
    temporary.persist(&target).map_err(|refused| failed("replace")(refused.error))?;
    Ok(Some(folder.to_path_buf()))
}

/// Constructor of the error of one step of writing a file.
fn refused(action: &'static str, path: &Path) -> impl Fn(io::Error) -> ReportError {
    move |source| ReportError::Write { action, path: path.to_path_buf(), source }
}

/// File at the end of a path's links, with its metadata if it exists; `None` for a pipe or a
/// device, which is written to directly.
fn replaceable(path: &Path) -> Result<Option<(PathBuf, Option<fs::Metadata>)>, ReportError> {
    let failed = |action| refused(action, path);
    let old = fs::metadata(path).ok();
    match &old {
        Some(old) if old.is_dir() => {
            return Err(failed("write")(io::ErrorKind::IsADirectory.into()));
        }
        Some(old) if !old.is_file() => return Ok(None),
        Some(old) => refuse_protected(path, old).map_err(failed("replace"))?,
        None => {}
    }
    let target = end_of_links(path).map_err(failed("write"))?;
    fs::metadata(folder_of(&target)).map_err(failed("write"))?;
    Ok(Some((target, old)))
}

/// Refuses a path that [`write_atomically`] cannot write to, before the content is computed.
///
/// Creates and removes a file in the folder. Pipes and devices are not opened.
///
/// # Errors
///
/// [`ReportError::Write`] as for [`write_atomically`].
pub fn check_writable(path: &Path) -> Result<(), ReportError> {
    match replaceable(path)? {
        Some((target, _)) => probe(folder_of(&target)).map_err(refused("write", path)),
        None => Ok(()),
    }
}

/// Refuses a folder that [`OutputFolder::create`] cannot create or that is not writable, before its
/// content is computed.
///
/// # Errors
///
/// [`ReportError::Write`] with the operating system's error.
pub fn check_creatable(folder: &Path) -> Result<(), ReportError> {
    let there = folder.ancestors().find(|part| fs::symlink_metadata(part).is_ok());
    let there = there.unwrap_or(Path::new("."));
    let is_folder = fs::metadata(there).map_err(refused("create folder", folder))?.is_dir();
    match is_folder {
        true => probe(there).map_err(refused("write into", folder)),
        false => Err(refused("create folder", folder)(io::ErrorKind::NotADirectory.into())),
    }
}

/// Creates and removes a file in a folder.
fn probe(folder: &Path) -> io::Result<()> {
    new_temporary_file(folder).map(drop)
}

/// Absolute path of the file that is replaced when this path is written, all links followed; `None`
/// if its folder does not exist.
pub fn replaced_path(path: &Path) -> Option<PathBuf> {
    let target = end_of_links(path).ok()?;
    Some(fs::canonicalize(folder_of(&target)).ok()?.join(target.file_name()?))
}

/// Refuses a file without write permission; renaming over it would need only the permission of its
/// folder.
fn refuse_protected(path: &Path, file: &fs::Metadata) -> io::Result<()> {
    // NOTE: the administrator can open every file.
    if file.permissions().readonly() {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    File::options().append(true).open(path).map(drop)
}

/// Longest chain of links that is followed.
const MOST_LINKS: usize = 40;

/// Path at the end of a chain of links, whether or not it exists.
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

/// Adds the path to an error of the operating system.
fn named(error: ReportError, path: &Path) -> ReportError {
    let write = |source| ReportError::Write { action: "write", path: path.to_path_buf(), source };
    match error {
        ReportError::Refused(source) => write(source),
        ReportError::Json(error) if error.is_io() => write(error.into()),
        ReportError::Csv(error) if error.is_io_error() => match error.into_kind() {
            csv::ErrorKind::Io(source) => write(source),
            kind => write(io::Error::other(format!("{kind:?}"))),
        },
        other => other,
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Prefix of the names of temporary files.
const UNFINISHED: &str = ".unfinished-";

/// Creates a locked temporary file. Remains of interrupted runs in its folder are removed.
fn temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    static CLEARED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if CLEARED.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
        remove_abandoned(folder, UNFINISHED);
    }
    loop {
        let file = new_temporary_file(folder)?;
        // NOTE: without file locks, no file counts as abandoned.
        let _locked_or_not = file.as_file().lock();
        // NOTE: another run may have removed the file as abandoned before it was locked.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

fn new_temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // NOTE: the default of a temporary file is 0600; 0666 lets the user's umask decide, as for
        // any file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // NOTE: the error itself would name the temporary file, which is unknown to the reader.
    builder.tempfile_in(folder).map_err(|error| error.kind().into())
}

/// Removes files with this prefix that no running program has locked.
pub(super) fn remove_abandoned(folder: &Path, prefix: &str) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    // NOTE: opening a pipe would block.
    let entries = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    for entry in entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix)) {
        let file = File::options().write(true).open(entry.path());
        if file.is_ok_and(|file| file.try_lock().is_ok()) {
            let _gone_or_not = fs::remove_file(entry.path());
        }
    }
}

/// Flushes a folder, if the system allows it, so that new names survive a crash.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = File::open(folder) {
        let _durable_or_not = handle.sync_all();
    }
}

/// Form in which figures are written: SVG and PNG, and PDF where it is asked for.
///
/// ```
/// use grazemap::report::PictureForm;
///
/// // A column of a journal, 84 mm by 60 mm, for print.
/// let side = |millimetres: f64| (millimetres * 96.0 / 25.4).round() as u32;
/// let size = Some((side(84.0), side(60.0)));
/// let form = PictureForm { size, dots_per_inch: 600, has_pdf: true };
/// assert_eq!(form.size, Some((317, 227)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureForm {
    /// Width and height in CSS pixels, of which 96 are an inch; `None` for each figure's own.
    pub size: Option<(u32, u32)>,
    /// Dots per inch of a PNG, 24 to 1200.
    pub dots_per_inch: u32,
    /// Whether a PDF is written too.
    pub has_pdf: bool,
}

/// Each figure's own size, 192 dots per inch, no PDF.
impl Default for PictureForm {
    fn default() -> Self {
        Self { size: None, dots_per_inch: 192, has_pdf: false }
    }
}

/// Output folder of a run. Files are written atomically; their names are flushed at the end.
#[derive(Debug)]
pub struct OutputFolder {
    root: PathBuf,
    pictures: PictureForm,
    /// Subfolders with new names.
    changed: Mutex<BTreeSet<PathBuf>>,
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        let changed = self.changed.get_mut().unwrap_or_else(PoisonError::into_inner);
        changed.iter().for_each(|folder| sync_folder(folder));
    }
}

impl OutputFolder {
    /// Opens the folder at `root`; creates it and its parents if absent.
    ///
    /// # Errors
    ///
    /// [`ReportError::Write`] if it cannot be created, or if something other than a folder has that
    /// name.
    pub fn create(root: impl Into<PathBuf>) -> Result<Self, ReportError> {
        let root = root.into();
        create_folder(&root)?;
        Ok(Self { root, pictures: PictureForm::default(), changed: Mutex::default() })
    }

    /// The folder with its figures in another form.
    #[must_use]
    pub fn with_pictures(mut self, form: PictureForm) -> Self {
        self.pictures = form;
        self
    }

    /// Form of the folder's figures.
    pub fn pictures(&self) -> &PictureForm {
        &self.pictures
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Writes one file (see [`write_atomically`]) and returns its path.
    ///
    /// `name` is relative and may contain subfolders, which are created; it must not leave the
    /// folder.
    ///
    /// # Errors
    ///
    /// [`ReportError::OutsideFolder`] for a name that is empty, absolute or contains `..`;
    /// [`ReportError::Write`] as for [`write_atomically`].
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<PathBuf, ReportError> {
        let path = self.place(name)?;
        self.replace(&path, |out| Ok(out.write_all(bytes.as_ref())?))?;
        Ok(path)
    }

    /// Writes one file from the output of `content` (see [`write_streamed`]).
    ///
    /// # Errors
    ///
    /// As [`write`](Self::write), and those of `content`.
    pub fn write_streamed(
        &self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        self.replace(&self.place(name)?, content)
    }

    fn replace(
        &self,
        path: &Path,
        content: impl FnOnce(&mut dyn Write) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let folder = replace(path, content)?;
        self.changed.lock().unwrap_or_else(PoisonError::into_inner).extend(folder);
        Ok(())
    }

    /// Path of a file in the folder. Its subfolder is created.
    fn place(&self, name: &str) -> Result<PathBuf, ReportError> {
        let relative = Path::new(name);
        let inside = relative.components().all(|part| matches!(part, Component::Normal(_)));
        if !inside || relative.file_name().is_none() {
            return Err(ReportError::OutsideFolder { name: name.to_owned() });
        }
        let path = self.root.join(relative);
        create_folder(folder_of(&path))?;
        Ok(path)
    }

    /// Writes files by name, in parallel.
    ///
    /// # Errors
    ///
    /// As [`write`](Self::write).
    pub fn write_all(
        &self,
        files: impl IntoIterator<Item = (impl AsRef<str> + Send, impl AsRef<[u8]> + Send)>,
    ) -> Result<(), ReportError> {
        let write = |(name, bytes)| self.write(AsRef::as_ref(&name), bytes).map(drop);
        parallel::try_map(files, write).map(drop)
    }
}

fn create_folder(path: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(path).map_err(|source| ReportError::Write {
        action: "create folder",
        path: path.to_path_buf(),
        source,
    })
}

/// Files by name, or by path in a folder.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// Draws figures, by file name without extension, and returns remarks. A figure that cannot be
/// drawn yields a remark instead of an error.
pub fn pictures<'a>(
    figures: impl IntoIterator<Item = (&'a str, &'a Figure)>,
    form: &PictureForm,
) -> (Files, Vec<String>) {
    let drawn = parallel::map(figures, |(stem, figure)| {
        let resized = form.size.map(|size| Figure { size, ..figure.clone() });
        picture(stem, resized.as_ref().unwrap_or(figure), form)
    });
    let (files, remarks): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
    (files.concat(), remarks.concat())
}

/// Draws one figure.
fn picture(stem: &str, figure: &Figure, form: &PictureForm) -> (Files, Vec<String>) {
    let svg = || figure.to_svg().map(String::into_bytes);
    let (svg, png) = parallel::join(svg, || figure.to_png(form.dots_per_inch));
    let pdf = form.has_pdf.then(|| ("pdf", figure.to_pdf()));
    let (mut files, mut remarks) = (Files::new(), Vec::new());
    for (ending, drawn) in [("svg", svg), ("png", png)].into_iter().chain(pdf) {
        let name = format!("{stem}.{ending}");
        match drawn {
            Ok(bytes) => files.push((name, bytes)),
            Err(error) => remarks.push(format!("warning: {name} is not written: {error}")),
        }
    }
    (files, remarks)
}

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Bytes of an NPY 1.0 file: little-endian doubles in C order (last index fastest).
///
/// `shape` may have any number of axes; an empty shape is a single number. Non-finite values are
/// kept.
///
/// ```
/// let bytes = grazemap::report::npy_bytes(&[2, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])?;
/// assert_eq!(bytes.len(), 128 + 6 * 8);
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if the number of values is not the product of `shape`, or if the
/// shape has so many axes that the header would not fit the 65 535 bytes of version 1.0.
pub fn npy_bytes(shape: &[usize], values: &[f64]) -> Result<Vec<u8>, ReportError> {
    let expected = shape.iter().try_fold(1_usize, |size, &axis| size.checked_mul(axis));
    let refuse = || ReportError::ArrayShape {
        shape: shape.to_vec(),
        expected: expected.unwrap_or(usize::MAX),
        found: values.len(),
    };
    if expected != Some(values.len()) {
        return Err(refuse());
    }
    let header = header(shape);
    let length = u16::try_from(header.len()).map_err(|_| refuse())?;
    let mut bytes = Vec::with_capacity(MAGIC.len() + 2 + header.len() + 8 * values.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    for value in values {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    Ok(bytes)
}

/// Header of the file: a Python dictionary, padded so that the data begin at a multiple of 64
/// bytes.
fn header(shape: &[usize]) -> String {
    let axes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    let mut text = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}{comma}), }}",
        axes.join(", ")
    );
    let preamble = MAGIC.len() + 2;
    let total = (preamble + text.len() + 1).next_multiple_of(64);
    text.push_str(&" ".repeat(total - preamble - text.len() - 1));
    text.push('\n');
    text
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
        // NOTE: root may write everywhere; then nothing is refused.
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
    fn what_an_interruption_left_is_removed_and_what_another_run_writes_is_not() {
        let folder = scratch();
        let left = folder.path().join(".unfinished-left");
        fs::write(&left, "half").expect("writable");
        let running = new_temporary_file(folder.path()).expect("writable");
        running.as_file().lock().expect("lockable");
        write_atomically(&folder.path().join("map.json"), b"whole").expect("writable");
        assert!(!left.exists() && running.path().exists());
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

    fn header_of(bytes: &[u8]) -> (String, usize) {
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8(bytes[10..10 + length].to_vec()).expect("the header is ASCII");
        (text, 10 + length)
    }

    #[test]
    fn header_states_type_order_and_shape_and_data_begin_aligned() {
        for (shape, written) in [
            (vec![], "()"),
            (vec![6], "(6,)"),
            (vec![2, 3], "(2, 3)"),
            (vec![1, 2, 3], "(1, 2, 3)"),
        ] {
            let size = shape.iter().product();
            let bytes = npy_bytes(&shape, &vec![1.5; size]).expect("the shape fits");
            let (header, start) = header_of(&bytes);
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
            assert_eq!(start % 64, 0);
            assert!(header.ends_with('\n'));
            assert_eq!(
                header.trim_end(),
                format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {written}, }}")
            );
            assert_eq!(bytes.len(), start + 8 * size);
        }
    }

    #[test]
    fn values_are_little_endian_doubles_in_the_order_given() {
        let values = [0.1, -0.0, f64::INFINITY, 1e-300];
        let bytes = npy_bytes(&[2, 2], &values).expect("the shape fits");
        let (_, start) = header_of(&bytes);
        for (chunk, value) in bytes[start..].chunks_exact(8).zip(values) {
            let read = f64::from_le_bytes(chunk.try_into().expect("eight bytes"));
            assert_eq!(read.to_bits(), value.to_bits());
        }
    }

    #[test]
    fn shapes_that_do_not_fit_are_refused() {
        assert!(npy_bytes(&[2, 2], &[0.0; 3]).is_err());
        assert!(npy_bytes(&[usize::MAX, 2], &[]).is_err());
        assert!(npy_bytes(&[1; 40_000], &[0.0]).is_err());
        assert!(npy_bytes(&[0, 4], &[]).is_ok());
    }
}
