//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use super::points::starting_points;
use super::{Contacts, open};
use crate::cli::arguments::ImageOptions;
use crate::cli::output::{CliError, Destination, deliver, note_all};
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
    let mut images = map.image_answer(request)?;
    if outlets.json.is_none() && outlets.csv.is_none() && outlets.output.is_none() {
        outlets.csv = Some(Destination::Standard);
    }
    deliver(&mut images, &outlets)
}
