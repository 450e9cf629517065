//! Files of a study: tables as CSV and in the page between markers, figures as SVG.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use grazemap::report::{Figure, Table};

use crate::root;

/// Page of a study and folder of its data.
#[derive(Debug)]
pub struct Study {
    folder: PathBuf,
    page: PathBuf,
    text: String,
}

impl Study {
    /// Opens the study `docs/studies/{name}.md`, which must exist.
    pub fn open(name: &str) -> Result<Self, Box<dyn Error>> {
        let studies = root().join("docs/studies");
        let (folder, page) = (studies.join(name), studies.join(format!("{name}.md")));
        fs::create_dir_all(&folder)?;
        let text = fs::read_to_string(&page)?;
        Ok(Self { folder, page, text })
    }

    /// Writes a figure.
    pub fn figure(&self, stem: &str, figure: &Figure) -> Result<(), Box<dyn Error>> {
        Ok(fs::write(self.folder.join(format!("{stem}.svg")), figure.to_svg()?)?)
    }

    /// Writes a table as CSV.
    pub fn data(&self, stem: &str, table: &Table) -> Result<(), Box<dyn Error>> {
        Ok(fs::write(self.folder.join(format!("{stem}.csv")), table.to_csv()?)?)
    }

    /// Writes a table into the page, between the lines `<!-- stem -->` and `<!-- end -->`.
    pub fn shown(&mut self, stem: &str, table: &Table) -> Result<(), Box<dyn Error>> {
        let opening = format!("<!-- {stem} -->\n");
        let (before, rest) = self
            .text
            .split_once(&opening)
            .ok_or_else(|| format!("no {opening:?} in {}", self.page.display()))?;
        let (_, after) = rest.split_once("<!-- end -->").ok_or("no <!-- end -->")?;
        self.text = format!("{before}{opening}{}\n<!-- end -->{after}", table.to_markdown());
        Ok(())
    }

    /// Writes the page.
    pub fn close(self) -> Result<(), Box<dyn Error>> {
        Ok(fs::write(self.page, self.text)?)
    }
}
