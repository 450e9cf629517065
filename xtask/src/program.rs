//! Path of the program beside this one, or beside the folder of this test.

use std::error::Error;
use std::path::PathBuf;

/// Path of the program built last.
pub(crate) fn program() -> Result<PathBuf, Box<dyn Error>> {
    let own = std::env::current_exe()?;
    let folder = own.parent().unwrap_or(&own);
    let folder = folder.parent().filter(|_| folder.ends_with("deps")).unwrap_or(folder);
    let program = folder.join(format!("grazemap{}", std::env::consts::EXE_SUFFIX));
    match program.is_file() {
        true => Ok(program),
        false => Err(format!("{} is not there; build it first", program.display()).into()),
    }
}
