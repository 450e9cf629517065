//! `grazemap run`: everything a scene asks for, with a report page.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::basin::{warn_of_basins, write_basins};
use super::converge::convergence_files;
use super::emit::Reproduction;
use super::sweeps::{
    resumable, take_chart_times, warn_of_values, warn_of_windows, write_charts, write_diagrams,
};
use super::trajectory::{grazing_series, trajectory_files};
use super::{open, refuse_orders, remark_on_window, settle};
use crate::cli::arguments::{Common, SceneOptions};
use crate::cli::memory::refuse_memory;
use crate::cli::output::{Bar, CliError, Outlets, Results, note, pairs};
use grazemap::analysis::basin::{Basin, basin_bytes};
use grazemap::analysis::chart::{Chart, chart_bytes};
use grazemap::analysis::diagram::{Diagram, Sweep, SweepHeading, Timing, diagram_bytes};
use grazemap::emission::{EmittedCrate, Target, shell_word};
use grazemap::model::{Digest, Method};
use grazemap::pipeline::{EmitRequest, Source, StudyRequest, write_emitted};
use grazemap::report::{
    CrateSummary, GrazeStudy, OrbitListing, OutputFolder, RunPage, StageTime, run_page,
    time_series_figures, to_json,
};

/// Where results go when no folder is named.
const FOLDER: &str = "out";
/// The scene of a run without a scene.
const BUILT_IN: &str = "cantilever_3_5_soft";

/// What was measured in a run: times alone, so that every other file is the same from run to run.
#[derive(Debug, Serialize)]
struct Timings<'a> {
    scene: &'a str,
    digest: Digest,
    stages: &'a [StageTime],
    diagrams: Vec<DiagramTimes<'a>>,
    charts: Vec<ChartTimes<'a>>,
}

/// What a chart took.
#[derive(Debug, Serialize)]
struct ChartTimes<'a> {
    parameters: [&'a str; 2],
    iterates: u64,
    threads: usize,
    seconds: f64,
    nanoseconds_per_iterate: f64,
}

/// What the sweeps of a diagram took.
#[derive(Debug, Serialize)]
struct DiagramTimes<'a> {
    parameter: &'a str,
    observable: &'a str,
    /// Time of one iterate by direct simulation over that by the map.
    speed_ratio: Option<f64>,
    sweeps: Vec<SweepTimes>,
}

#[derive(Debug, Serialize)]
struct SweepTimes {
    method: Method,
    heading: SweepHeading,
    iterates: u64,
    threads: usize,
    seconds: f64,
    nanoseconds_per_iterate: f64,
}

/// The built-in scene, start to finish.
pub(in crate::cli) fn built_in(common: &Common) -> Result<(), CliError> {
    run(&SceneOptions { scene: PathBuf::from(BUILT_IN), common: common.clone() })
}

/// A scene, start to finish.
pub(in crate::cli) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let mut outlets = options.common.outlets.clone();
    let quiet = outlets.quiet;
    let mut clock = Clock::new(quiet);
    let source = open(options)?;
    let scene = source.scene();
    refuse_orders(scene)?;
    scene.check_diagrams().and_then(|()| scene.check_charts()).map_err(grazemap::Error::from)?;
    refuse_memory(diagram_bytes(scene) + chart_bytes(scene), quiet)?;
    let folder = outlets.output.take().unwrap_or_else(|| PathBuf::from(FOLDER));
    let crate_folder = folder.join("crate");
    let files = Target::Rust.files(&source.scene().identifier);
    EmittedCrate::refuse_foreign(&crate_folder, &files).map_err(grazemap::Error::from)?;
    let folder = OutputFolder::create(folder)?;
    folder.write("scene.toml", &*source.scene().text)?;

    let saved = match &source {
        Source::Map(map) => Some(map.clone()),
        Source::Scene(_) | Source::Graze(_) => None,
    };
    let graze = clock.time("grazing orbit", || Ok(source.graze()?))?;
    let source = saved.clone().map_or(Source::Graze(graze), Source::Map);
    let settled = clock.time("section", || settle(source, quiet))?;
    let (scene, orbit) = (settled.scene().clone(), settled.orbit().clone());
    folder.write("orbit.json", settled.graze().to_json()?)?;
    let series = clock.time("trajectory", || grazing_series(&settled))?;
    folder.write_all(pairs(&trajectory_files(&settled, &series)?))?;

    let map = match saved {
        Some(map) => map,
        None => {
            let plan = clock.time("orders", || Ok(settled.plan()?))?;
            clock.time("expansion", || {
                let map = plan.expand()?;
                map.listing()?;
                Ok(map)
            })?
        }
    };
    remark_on_window(&map, quiet);
    let resumable = resumable("run", Some(folder.path()), &map, "", quiet)?;
    folder.write("map.json", map.to_json()?)?;
    folder.write("map.csv", map.listing()?.coefficient_table()?.to_csv()?)?;

    let again = Reproduction {
        scene: Some(&options.scene),
        overrides: &options.common.set,
        target: Target::Rust,
        measure: true,
    };
    let command = Some(again.command(&crate_folder));
    let request = EmitRequest { command, ..EmitRequest::default() };
    let module = clock.time("emission", || Ok(map.module(request)?))?;
    let emitted = EmittedCrate::standalone(&module).map_err(grazemap::Error::from)?;
    write_emitted(&emitted, &crate_folder)?;

    let request =
        StudyRequest { fresh: StudyRequest::FRESH, sections: false, chosen: map.choice().cloned() };
    let bar = Bar::new("convergence", quiet).resuming(2, resumable.journal());
    let study = clock.time("convergence", || Ok(map.settled().study(&request, &bar)?))?;
    drop(bar);
    folder.write_all(pairs(&convergence_files(&study, &map.section())?))?;

    let bar = Bar::new("diagram", quiet).resuming(0, resumable.journal());
    let diagrams = clock.time("diagrams", || Ok(map.diagrams(&bar)?))?;
    drop(bar);
    warn_of_values(&diagrams, quiet);
    warn_of_windows(&diagrams, &[], quiet);
    let untimed: Vec<Diagram> = diagrams.iter().map(Diagram::without_timing).collect();
    write_diagrams(&folder, &untimed, &map)?;
    drop(untimed);

    let mut charts = Vec::new();
    if !scene.charts.is_empty() {
        let bar = Bar::new("chart", quiet).resuming(1, resumable.journal());
        charts = clock.time("charts", || Ok(map.charts(&bar)?))?;
        drop(bar);
        warn_of_windows(&[], &charts, quiet);
        let times: Vec<Timing> = charts.iter().map(|chart| chart.timing).collect();
        take_chart_times(&mut charts);
        write_charts(&folder, &charts, &map)?;
        charts.iter_mut().zip(times).for_each(|(chart, timing)| chart.timing = timing);
    }

    let mut basins = Vec::new();
    let requests = map.basin_requests()?;
    if !requests.is_empty() {
        refuse_memory(requests.iter().map(basin_bytes).sum(), quiet)?;
        let bar = Bar::new("basin", quiet).resuming(3, resumable.journal());
        basins = clock.time("basins", || Ok(map.basins(&requests, &bar)?))?;
        drop(bar);
        warn_of_basins(&basins, quiet);
        basins.iter_mut().for_each(Basin::take_timing);
        write_basins(&folder, &basins, &map)?;
    }

    let theory = map.settled().graze().theory()?;
    // Of a parameter that the map does not keep nothing is measured.
    let measured = map.measure_graze(&theory.parameter).unwrap_or_default();
    let modules = [vec![(map.orders(), map.web_module()?)], map.lower_web_modules()?].concat();
    let page = run_page(&RunPage {
        scene: &scene,
        orbit: &OrbitListing::new(&scene, &orbit),
        graze: &GrazeStudy { theory, measured },
        pictures: &time_series_figures(&scene, &orbit, &series.1),
        local: map.local(),
        modules: &modules,
        subject: &subject(options),
        map: map.listing()?,
        emitted: CrateSummary {
            step: module.step_operations.multiply_adds,
            frozen: module.frozen_operations.multiply_adds,
            jacobian: module.jacobian_operations.multiply_adds,
        },
        study: &study,
        diagrams: &diagrams,
        charts: &charts,
        basins: &basins,
        times: &clock.stages,
    })?;
    folder.write("report.html", page.to_html()?)?;
    let timings = to_json(&Timings {
        scene: &scene.identifier,
        digest: scene.digest,
        stages: &clock.stages,
        diagrams: diagrams.iter().map(DiagramTimes::of).collect(),
        charts: charts.iter().map(ChartTimes::of).collect(),
    })?;
    folder.write("timings.json", &timings)?;
    resumable.finish();
    finish(&options.scene, folder.path(), timings, &outlets)
}

/// The scene and what is set of it, as words of a command.
fn subject(options: &SceneOptions) -> String {
    let scene = shell_word(options.scene.as_os_str().as_encoded_bytes());
    let set = options.common.set.iter();
    let set = set.map(|(name, value)| shell_word(format!("{name}={value}").as_bytes()));
    set.fold(scene, |words, own| words + " --set " + &own)
}

/// The page of a run with these options.
pub(super) fn page_of(common: &Common) -> PathBuf {
    let folder = common.outlets.output.as_deref();
    folder.unwrap_or(Path::new(FOLDER)).join("report.html")
}

fn finish(scene: &Path, folder: &Path, timings: String, outlets: &Outlets) -> Result<(), CliError> {
    let (scene, page) = (scene.display(), folder.join("report.html"));
    let text = format!("{scene}: done; open {}\n", page.display());
    Results::named("run", text, timings, None).deliver("run", outlets)
}

impl<'a> ChartTimes<'a> {
    fn of(chart: &'a Chart) -> Self {
        let [first, second] = &chart.axes;
        Self {
            parameters: [&first.parameter, &second.parameter],
            iterates: chart.timing.iterates,
            threads: chart.timing.threads,
            seconds: chart.timing.seconds,
            nanoseconds_per_iterate: chart.timing.nanoseconds_per_iterate(),
        }
    }
}

impl<'a> DiagramTimes<'a> {
    fn of(diagram: &'a Diagram) -> Self {
        let times = |sweep: &Sweep| SweepTimes {
            method: sweep.method,
            heading: sweep.heading,
            iterates: sweep.timing.iterates,
            threads: sweep.timing.threads,
            seconds: sweep.timing.seconds,
            nanoseconds_per_iterate: sweep.timing.nanoseconds_per_iterate(),
        };
        Self {
            parameter: &diagram.parameter,
            observable: &diagram.observable,
            speed_ratio: diagram.speed_ratio,
            sweeps: diagram.sweeps.iter().map(times).collect(),
        }
    }
}

/// Times the stages of a run, and says each as it ends.
#[derive(Debug)]
struct Clock {
    quiet: bool,
    stages: Vec<StageTime>,
}

impl Clock {
    fn new(quiet: bool) -> Self {
        Self { quiet, stages: Vec::new() }
    }

    fn time<T>(
        &mut self,
        stage: &'static str,
        work: impl FnOnce() -> Result<T, CliError>,
    ) -> Result<T, CliError> {
        let start = Instant::now();
        let done = work()?;
        let seconds = start.elapsed().as_secs_f64();
        self.stages.push(StageTime { stage, seconds });
        if !self.quiet {
            note(&format!("{stage:<16} {seconds:8.3} s"));
        }
        Ok(done)
    }
}
