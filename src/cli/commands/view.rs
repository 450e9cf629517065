//! `grazemap view`: the page of a run, opened.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

use super::run;
use crate::cli::arguments::SceneOptions;
use crate::cli::output::{CliError, note};

/// A run, and its page in a browser: that of the variable `BROWSER`, else the system's.
pub(in crate::cli) fn run(options: &SceneOptions) -> Result<(), CliError> {
    run::run(options)?;
    let page = run::page_of(&options.common);
    if !opens(&page) && !options.common.outlets.quiet {
        note("no browser could be started; set BROWSER, or open the page yourself");
    }
    Ok(())
}

/// Whether something took the page.
fn opens(page: &Path) -> bool {
    let page = std::path::absolute(page).unwrap_or_else(|_| page.to_owned());
    let opener = match std::env::var_os("BROWSER").filter(|browser| !browser.is_empty()) {
        Some(browser) => browser,
        None if cfg!(target_os = "macos") => OsString::from("open"),
        None if cfg!(windows) => OsString::from("explorer"),
        None => OsString::from("xdg-open"),
    };
    let quiet = || Stdio::null();
    Command::new(opener).arg(page).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn().is_ok()
}
