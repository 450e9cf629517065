//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use super::points::starting_points;
use super::{Contacts, open, remark_on_window};
use crate::cli::arguments::ImageOptions;
use crate::cli::output::{CliError, Destination, note_all};
use grazemap::Error;
use grazemap::analysis::{ImageRequest, Using};
use grazemap::pipeline::is_standard;

pub(in crate::cli) fn run(options: &ImageOptions) -> Result<(), CliError> {
    let mut outlets = options.scene.common.outlets.clone();
    if is_standard(&options.scene.scene) && is_standard(&options.states) {
        return Err(CliError::StandardInputTwice);
    }
    let contacts = Contacts::unless(options.method == Using::Direct, Contacts::Unused);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let request = ImageRequest {
        rows: starting_points(&options.states, map.local())?,
        iterations: options.iterations as usize,
        using: options.method,
        precision: options.precision,
    };
    note_all(map.image_time_remark(&request).as_slice(), outlets.quiet);
    let images = map.image_answer(request)?;
    remark_on_window(&map, outlets.quiet);
    if outlets.json.is_none() && outlets.csv.is_none() && outlets.output.is_none() {
        outlets.csv = Some(Destination::Standard);
    }
    if let Some(folder) = outlets.results()? {
        folder.write("images.json", images.document()?)?;
        folder.write_streamed("images.csv", |out| images.rows().write_csv(out))?;
    }
    if let Some(place) = &outlets.json {
        place.write(&images.document()?)?;
    }
    outlets.write_csv(&|out| images.rows().write_csv(out))?;
    if outlets.shows() {
        Destination::Standard.write_streamed(&|out| images.rows().write_csv(out))?;
    }
    note_all(&images.remarks().collect::<Vec<_>>(), outlets.quiet);
    images.ended().map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}
