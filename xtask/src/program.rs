//! Path of the program beside this one.

use std::error::Error;
use std::path::PathBuf;

/// Path of the program built last.
pub(crate) fn program() -> Result<PathBuf, Box<dyn Error>> {
    let own = std::env::current_exe()?;
    let program = own.with_file_name(format!("grazemap{}", std::env::consts::EXE_SUFFIX));
    match program.is_file() {
        true => Ok(program),
        false => Err(format!("{} is not there; build it first", program.display()).into()),
    }
}
