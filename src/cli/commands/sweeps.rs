//! `grazemap diagram`, `chart` and `basin`: bifurcation diagrams, two-parameter charts, and basins
//! of attraction in a plane of the section.

use super::{Contacts, open, resumable, shard, tables};
use crate::cli::arguments::{BasinArguments, ChartArguments, DiagramArguments};
use crate::cli::output::{Bar, CliError, deliver, note_all, refuse};
use grazemap::Error;
use grazemap::analysis::{Joining, basin_bytes, charts_bytes, diagrams_bytes};
use grazemap::model::{ChartOverlay, Method, Scene};
use grazemap::pipeline::{BasinKeys, Device};

/// Runs `grazemap diagram`.
pub(in crate::cli) fn diagram(options: &DiagramArguments) -> Result<(), CliError> {
    let common = &options.sweep.scene.common;
    tables::check_iterates(&options.iterates, options.along.is_some(), ["diagram", "--along"])?;
    let (source, outlets) = (open(&options.sweep.scene)?, &common.outlets);
    let direct = match options.along {
        Some(_) => !options.iterates.method.is_empty() && is_direct(&options.iterates.method),
        None if source.scene().diagrams.is_empty() => return Err(CliError::NoDiagram),
        None => {
            check_diagrams(source.scene(), outlets.quiet)?;
            source.scene().diagrams.iter().all(|diagram| is_direct(&diagram.with))
        }
    };
    let map = Contacts::unless(direct, Contacts::Unused).map(source, outlets.quiet)?;
    let (map, remarks) = match tables::diagram(options, &map)? {
        Some(tables::AskedTable { table, mut remarks }) => {
            let map = map.asking(&table)?;
            check_diagrams(map.scene(), outlets.quiet)?;
            remarks.extend(map.diagram_held_remarks());
            (map, remarks)
        }
        None => {
            let remarks = map.diagram_offset_remarks();
            (map, remarks)
        }
    };
    if let Some(share) = options.sweep.sharding.share {
        return shard(share, ("diagram", &map, ""), outlets, |shard| map.share_diagrams(shard));
    }
    let resumable = resumable("diagram", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("diagram", outlets.quiet).resuming(0, resumable.journal());
    note_all(&remarks, outlets.quiet);
    note_all(map.diagram_time_remark().as_slice(), outlets.quiet);
    let mut diagrams = map.drawn_diagrams(&Joining::new(&bar, common.pieces()))?;
    drop(bar);
    deliver(&mut diagrams, outlets)?;
    resumable.finish();
    Ok(())
}

/// Runs `grazemap chart`.
pub(in crate::cli) fn chart(options: &ChartArguments) -> Result<(), CliError> {
    let is_asked = !options.plane.is_empty();
    tables::check_iterates(&options.iterates, is_asked, ["chart", "--plane"])?;
    let device = Device::open(&options.device)?;
    let common = &options.sweep.scene.common;
    let (source, outlets) = (open(&options.sweep.scene)?, &common.outlets);
    let (direct, with_loci) = match is_asked {
        true => {
            let methods = &options.iterates.method;
            let direct = !methods.is_empty() && is_direct(methods);
            (direct, options.overlay.iter().any(|curve| curve == "loci"))
        }
        false if source.scene().charts.is_empty() => return Err(CliError::NoChart),
        false => {
            check_charts(source.scene(), outlets.quiet)?;
            let charts = &source.scene().charts;
            let mut overlays = charts.iter().flat_map(|chart| &chart.overlay);
            let with_loci = overlays.any(|&overlay| overlay == ChartOverlay::Loci);
            (charts.iter().all(|chart| is_direct(&chart.with)), with_loci)
        }
    };
    let contacts = if with_loci { Contacts::Searched } else { Contacts::Unused };
    let contacts = Contacts::unless(direct && matches!(device, Device::Processor), contacts);
    let map = contacts.map(source, outlets.quiet)?;
    let (map, remarks) = match tables::chart(options, &map)? {
        Some(tables::AskedTable { table, mut remarks }) => {
            let map = map.asking(&table)?;
            check_charts(map.scene(), outlets.quiet)?;
            remarks.extend(map.chart_held_remarks());
            (map, remarks)
        }
        None => {
            let remarks = map.chart_offset_remarks();
            (map, remarks)
        }
    };
    let map = map.on(&device)?;
    if let Some(share) = options.sweep.sharding.share {
        return shard(share, ("chart", &map, ""), outlets, |shard| map.share_charts(shard));
    }
    let resumable = resumable("chart", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("chart", outlets.quiet).resuming(0, resumable.journal());
    note_all(&remarks, outlets.quiet);
    note_all(map.chart_time_remark().as_slice(), outlets.quiet);
    let mut charts = map.drawn_charts(&Joining::new(&bar, common.pieces()))?;
    drop(bar);
    deliver(&mut charts, outlets)?;
    resumable.finish();
    Ok(())
}

pub(in crate::cli) fn basin(options: &BasinArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let source = open(&options.scene)?;
    let contacts = basin_contacts(&options.keys, source.scene());
    let map = contacts.map(source, outlets.quiet)?;
    let keys = &options.keys;
    let (requests, remarks) = match keys.name_any() || map.scene().basins.is_empty() {
        true => {
            let request = keys.request(&map).map_err(grazemap::Error::from)?;
            (vec![request], keys.offset_remarks(&map))
        }
        false => {
            let requests = map.basin_requests()?;
            let remarks = map.basin_offset_remarks(&requests);
            (requests, remarks)
        }
    };
    let found = requests.len();
    if found > 1 && (outlets.json.is_some() || outlets.csv.is_some()) {
        return Err(CliError::SeveralBasins { found });
    }
    let bytes = requests.iter().map(basin_bytes).fold(0, u64::saturating_add);
    refuse(bytes, outlets.quiet)?;
    let decisive = format!("{requests:?}");
    if let Some(share) = options.sharding.share {
        let asked = ("basin", &map, &*decisive);
        return shard(share, asked, outlets, |shard| map.share_basins(&requests, shard));
    }
    let resumable = resumable("basin", outlets.folder(), &map, &decisive, outlets.quiet)?;
    let bar = Bar::new("basin", outlets.quiet).resuming(0, resumable.journal());
    note_all(&remarks, outlets.quiet);
    note_all(map.basin_time_remark(&requests).as_slice(), outlets.quiet);
    let joining = Joining::new(&bar, options.scene.common.pieces());
    let mut basins = map.drawn_basins(&requests, &joining)?;
    drop(bar);
    deliver(&mut basins, outlets)?;
    resumable.finish();
    Ok(())
}

/// Whether all methods are direct simulation.
fn is_direct(methods: &[Method]) -> bool {
    methods.iter().all(|method| method.is_direct())
}

/// Refuses diagrams of a scene that cannot be computed, or that memory does not hold.
fn check_diagrams(scene: &Scene, quiet: bool) -> Result<(), CliError> {
    scene.check_diagrams().map_err(Error::from)?;
    refuse(diagrams_bytes(scene), quiet)
}

/// Refuses charts of a scene that cannot be computed, or that memory does not hold.
fn check_charts(scene: &Scene, quiet: bool) -> Result<(), CliError> {
    scene.check_charts().map_err(Error::from)?;
    refuse(charts_bytes(scene), quiet)
}

/// Role of the map's contacts in the basins asked for.
fn basin_contacts(keys: &BasinKeys, scene: &Scene) -> Contacts {
    let plans = &scene.basins;
    let (direct, manifolds) = match keys.name_any() || plans.is_empty() {
        true => (keys.with.is_some_and(Method::is_direct), keys.manifolds.is_some()),
        false => {
            let mut methods = plans.iter().flat_map(|plan| &plan.with);
            let direct = methods.all(|method| method.is_direct());
            (direct, plans.iter().any(|plan| plan.manifolds.is_some()))
        }
    };
    let contacts = if manifolds { Contacts::Searched } else { Contacts::Unused };
    Contacts::unless(direct, contacts)
}
