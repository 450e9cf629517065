//! Path of the program beside an example.

use std::error::Error;
use std::path::{Path, PathBuf};

/// Path of the program built last.
pub(crate) fn program() -> Result<PathBuf, Box<dyn Error>> {
    let example = std::env::current_exe()?;
    let folder = example.parent().and_then(Path::parent).ok_or("not in a folder of builds")?;
    let program = folder.join(format!("grazemap{}", std::env::consts::EXE_SUFFIX));
    match program.is_file() {
        true => Ok(program),
        false => Err(format!("{} is not there; build it first", program.display()).into()),
    }
}
