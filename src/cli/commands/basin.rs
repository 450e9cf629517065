//! `grazemap basin`: where the states of a plane of the section go.

use super::orbits::{ACTIVE, COORDINATES, named_offsets, place_of};
use super::sweeps::{ByMap, pictures, resumable};
use super::{map, open, remark_on_window};
use crate::cli::arguments::BasinArguments;
use crate::cli::memory::refuse_memory;
use crate::cli::output::{Bar, CliError, note, pairs, stem};
use grazemap::Map;
use grazemap::analysis::basin::{Basin, BasinRequest, basin_bytes};
use grazemap::model::Method;
use grazemap::report::{
    DocumentKind, OutputFolder, ReportError, basin_array, basin_figure, basin_outside_words,
    basin_remarks, basin_rows, basin_table, basin_words, manifold_rows, manifold_table, write_json,
};

pub(in crate::cli) fn run(options: &BasinArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let requests = match options.ask() || map.scene().basins.is_empty() {
        true => vec![request(options, &map)?],
        false => map.basin_requests()?,
    };
    let found = requests.len();
    if found > 1 && (outlets.json.is_some() || outlets.csv.is_some()) {
        return Err(CliError::SeveralBasins { found });
    }
    refuse_memory(requests.iter().map(basin_bytes).sum(), outlets.quiet)?;
    let decisive = format!("{requests:?}");
    let resumable = resumable("basin", outlets.folder(), &map, &decisive, outlets.quiet)?;
    let bar = Bar::new("basin", outlets.quiet).resuming(0, resumable.journal());
    let mut basins = map.basins(&requests, &bar)?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    warn_of_basins(&basins, outlets.quiet);
    let texts = basins.iter().map(text).collect::<Result<Vec<_>, _>>()?;
    basins.iter_mut().for_each(Basin::take_timing);
    if let [basin] = &basins[..] {
        let document = ByMap::new(DocumentKind::Basin, basin, &map);
        outlets.write_json(&|out| write_json(out, &document))?;
        outlets.write_csv(&|out| basin_rows(basin).write_csv(out))?;
    }
    if let Some(folder) = &outlets.output {
        write_basins(&OutputFolder::create(folder)?, &basins, &map)?;
    }
    resumable.finish();
    outlets.show(&texts.join("\n"))
}

/// Says where the map alone leaves its window.
pub(super) fn warn_of_basins(basins: &[Basin], quiet: bool) {
    let words = basins.iter().filter_map(basin_outside_words).filter(|_| !quiet);
    words.for_each(|words| note(&format!("warning: {words}")));
}

/// What the options ask for, in numbers.
fn request(options: &BasinArguments, map: &Map) -> Result<BasinRequest, CliError> {
    let mut request = BasinRequest::over_the_window(map.local());
    let active = map.local().parameters.iter();
    let active: Vec<&str> = active.map(|parameter| parameter.name.as_str()).collect();
    let coordinates = map.local().section.coordinates.iter();
    let coordinates: Vec<&str> = coordinates.map(String::as_str).collect();
    if let Some(at) = &options.at {
        request.parameters = named_offsets("--at", ACTIVE, at, &active)?;
    }
    if let Some(start) = &options.start {
        request.origin = named_offsets("--start", COORDINATES, start, &coordinates)?;
    }
    if let [first, second] = &options.axes[..] {
        let place = |name: &str| place_of("--axes", COORDINATES, name, &coordinates);
        request = request.over([place(first)?, place(second)?], map.local());
    } else if !options.axes.is_empty() {
        return Err(CliError::NotTwoAxes { found: options.axes.len() });
    }
    for (name, range) in options.range.iter().flat_map(|ranges| &ranges.0) {
        let place = place_of("--range", COORDINATES, name, &coordinates)?;
        let axis = request.axes.iter().position(|&axis| axis == place);
        let axis = axis.ok_or_else(|| CliError::NoAxis { name: name.clone() })?;
        request.ranges[axis] = *range;
    }
    match options.points[..] {
        [] => {}
        [both] => request.points = [both as usize; 2],
        [first, second] => request.points = [first as usize, second as usize],
        _ => return Err(CliError::NotTwoAxes { found: options.points.len() }),
    }
    request.method = options.with.map_or(request.method, Method::from);
    request.manifolds = options.manifolds.map(usize::from);
    Ok(request)
}

/// The basin as a person reads it.
fn text(basin: &Basin) -> Result<String, ReportError> {
    let mut text = format!("{}\n{}\n", basin_words(basin), basin_table(basin)?.to_text());
    if let Some(manifolds) = &basin.manifolds {
        text.push_str(&format!("{}\n", manifold_table(basin, manifolds)?.to_text()));
    }
    for remark in basin_remarks(basin) {
        text.push_str(&format!("{remark}\n"));
    }
    let timing = &basin.timing;
    text.push_str(&format!(
        "{} iterates in {:.2} s on {} threads\n",
        timing.iterates, timing.seconds, timing.threads
    ));
    Ok(text)
}

/// Writes data and pictures of basins without times: the same bytes from run to run.
pub(super) fn write_basins(
    folder: &OutputFolder,
    basins: &[Basin],
    map: &Map,
) -> Result<(), ReportError> {
    for (number, basin) in basins.iter().enumerate() {
        let named = |name: &str| stem(name, number, basins.len());
        let stem = named("basin");
        let document = ByMap::new(DocumentKind::Basin, basin, map);
        folder.write_streamed(&format!("{stem}.json"), |out| write_json(out, &document))?;
        folder.write_streamed(&format!("{stem}.csv"), |out| basin_rows(basin).write_csv(out))?;
        if let Some(manifolds) = &basin.manifolds {
            let rows = || manifold_rows(basin, manifolds);
            let name = format!("{}.csv", named("manifolds"));
            folder.write_streamed(&name, |out| rows().write_csv(out))?;
        }
        folder.write(&format!("{stem}.npy"), basin_array(basin)?)?;
        folder.write_all(pairs(&pictures(&stem, &basin_figure(basin))))?;
    }
    Ok(())
}
