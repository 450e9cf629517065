//! `grazemap basin`: where the states of a plane of the section go.

use super::sweeps::resumable;
use super::{map, open, remark_on_window, shard};
use crate::cli::arguments::BasinArguments;
use crate::cli::output::{Bar, CliError, note_all, refuse};
use grazemap::analysis::Joining;
use grazemap::analysis::basin::{Basin, basin_bytes};
use grazemap::pipeline::BasinKeys;
use grazemap::report::{
    OutputFolder, ReportError, basin_remarks, basin_rows, basin_table, basin_warnings, basin_words,
    manifold_table, write_json,
};

pub(in crate::cli) fn run(options: &BasinArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let keys = keys(options);
    let requests = match !keys.is_empty() || map.scene().basins.is_empty() {
        true => vec![keys.request(&map).map_err(grazemap::Error::from)?],
        false => map.basin_requests()?,
    };
    let found = requests.len();
    if found > 1 && (outlets.json.is_some() || outlets.csv.is_some()) {
        return Err(CliError::SeveralBasins { found });
    }
    refuse(requests.iter().map(basin_bytes).sum(), outlets.quiet)?;
    let decisive = format!("{requests:?}");
    if let Some(share) = options.sharding.share {
        let asked = ("basin", &map, &*decisive);
        return shard(share, asked, outlets, |shard| map.share_basins(&requests, shard));
    }
    let resumable = resumable("basin", outlets.folder(), &map, &decisive, outlets.quiet)?;
    let bar = Bar::new("basin", outlets.quiet).resuming(0, resumable.journal());
    let mut basins = map.basins(&requests, &Joining::new(&bar, options.scene.common.pieces()))?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    note_all(&basin_warnings(&basins), outlets.quiet);
    let texts = basins.iter().map(text).collect::<Result<Vec<_>, _>>()?;
    basins.iter_mut().for_each(Basin::take_timing);
    if let [basin] = &basins[..] {
        let document = map.basin_document(basin);
        outlets.write_json(&|out| write_json(out, &document))?;
        outlets.write_csv(&|out| basin_rows(basin).write_csv(out))?;
    }
    if let Some(folder) = &outlets.output {
        let remarks = map.write_basins(&OutputFolder::create(folder)?, &basins)?;
        note_all(&remarks, false);
    }
    resumable.finish();
    outlets.show(&texts.join("\n"))
}

/// The options as keys.
fn keys(options: &BasinArguments) -> BasinKeys {
    BasinKeys {
        at: options.at.clone().unwrap_or_default(),
        axes: options.axes.clone(),
        range: options.range.clone().map(|ranges| ranges.0).unwrap_or_default(),
        points: options.points.clone(),
        start: options.start.clone().unwrap_or_default(),
        with: options.with.map(Into::into),
        manifolds: options.manifolds,
    }
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
