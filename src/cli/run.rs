//! `grazemap run`: everything a scene asks for, with a report page.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::arguments::{Common, SceneOptions};
use super::chart::{chart_files, charts};
use super::converge::convergence_files;
use super::diagram::{diagram_files, diagrams, warn_of_values};
use super::emit::{Measurement, emit, write_crate};
use super::error::CliError;
use super::expand::expand;
use super::output::{Results, note};
use super::prepare::{Loaded, grazing_orbit, plan, prepare, refuse_frozen_sweeps, settle};
use super::progress::Bar;
use grazemap::analysis::chart::Chart;
use grazemap::analysis::diagram::{Diagram, Sweep, SweepHeading};
use grazemap::convergence::{ConvergenceOptions, converge};
use grazemap::emission::{EmittedCrate, Target};
use grazemap::model::Method;
use grazemap::report::{
    CrateSummary, OrbitDocument, OutputFolder, RunPage, StageTime, run_page, to_dense_json,
    to_exact_json,
};

/// Where results go when no folder is named.
const FOLDER: &str = "out";
/// The scene of a run without a scene.
const BUILT_IN: &str = "cantilever_3_5_soft";

/// What was measured in a run: times alone, so that every other file is the same from run to run.
#[derive(Debug, Serialize)]
struct Timings<'a> {
    scene: &'a str,
    digest: String,
    stages: &'a [StageTime],
    diagrams: Vec<DiagramTimes<'a>>,
    charts: Vec<ChartTimes<'a>>,
}

/// What a chart took.
#[derive(Debug, Serialize)]
struct ChartTimes<'a> {
    parameters: [&'a str; 2],
    iterates: u64,
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
    seconds: f64,
    nanoseconds_per_iterate: f64,
}

/// The built-in scene, start to finish.
pub(super) fn built_in(common: &Common) -> Result<(), CliError> {
    run(&SceneOptions {
        scene: PathBuf::from(BUILT_IN),
        common: common.clone(),
    })
}

/// A scene, start to finish.
pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let mut clock = Clock::new(options.common.quiet);
    let loaded = prepare(options)?;
    refuse_frozen_sweeps(&loaded.scene)?;
    let folder = OutputFolder::create(
        options
            .common
            .output
            .clone()
            .unwrap_or_else(|| PathBuf::from(FOLDER)),
    )?;
    folder.write("scene.toml", &loaded.text)?;

    let orbit = clock.time("grazing orbit", || grazing_orbit(&loaded.scene))?;
    let settled = clock.time("section", || {
        settle(&loaded.scene, &orbit, options.common.quiet)
    })?;
    let (scene, orbit) = (&settled.scene, &settled.orbit);
    let orbit_document = OrbitDocument::new(scene, orbit);
    folder.write("orbit.json", to_dense_json(&orbit_document)?)?;

    let plan = clock.time("orders", || plan(&settled))?;
    let expanded = clock.time("expansion", || expand(&plan, orbit, options.common.quiet))?;
    folder.write("map.json", to_exact_json(&expanded.document)?)?;
    folder.write("map.csv", expanded.document.coefficient_table()?.to_csv()?)?;

    let module = clock.time("emission", || {
        emit(
            &plan,
            orbit,
            &expanded,
            Measurement::WithTolerance,
            Target::Rust,
        )
    })?;
    write_crate(
        &EmittedCrate::standalone(&module)?,
        &folder.path().join("crate"),
    )?;

    let bar = Bar::new("convergence", &options.common);
    let study = clock.time("convergence", || {
        Ok(converge(
            scene,
            orbit,
            &ConvergenceOptions::of(scene),
            &bar,
        )?)
    })?;
    drop(bar);
    for (name, bytes) in convergence_files(&study, &plan.section)? {
        folder.write(&name, bytes)?;
    }

    let bar = Bar::new("diagram", &options.common);
    let diagrams = clock.time("diagrams", || diagrams(scene, orbit, &expanded.map, &bar))?;
    drop(bar);
    warn_of_values(&diagrams, options.common.quiet);
    let untimed: Vec<Diagram> = diagrams.iter().map(Diagram::without_timing).collect();
    for (name, bytes) in diagram_files(&untimed, &expanded.window_edges, &plan.section)? {
        folder.write(&name, bytes)?;
    }

    let charts = if scene.charts.is_empty() {
        Vec::new()
    } else {
        let bar = Bar::new("chart", &options.common);
        clock.time("charts", || charts(scene, orbit, &expanded.map, &bar))?
    };
    if !charts.is_empty() {
        let untimed: Vec<Chart> = charts.iter().map(Chart::without_timing).collect();
        for (name, bytes) in chart_files(&untimed, &expanded.window_edges, &plan.section)? {
            folder.write(&name, bytes)?;
        }
    }

    let crate_summary = CrateSummary {
        step: module.step_operations.multiply_adds,
        frozen: module.frozen_operations.multiply_adds,
        jacobian: module.jacobian_operations.multiply_adds,
    };
    let page = run_page(&RunPage {
        scene,
        orbit: &orbit_document,
        map: &expanded.document,
        emitted: crate_summary,
        study: &study,
        diagrams: &diagrams,
        charts: &charts,
        times: &clock.stages,
    })?;
    folder.write("report.html", page.to_html()?)?;
    let timings = Timings {
        scene: &scene.identifier,
        digest: scene.digest.to_string(),
        stages: &clock.stages,
        diagrams: diagrams.iter().map(DiagramTimes::of).collect(),
        charts: charts.iter().map(ChartTimes::of).collect(),
    };
    let timings = to_dense_json(&timings)?;
    folder.write("timings.json", &timings)?;
    finish(&loaded, folder.path(), timings, &options.common)
}

fn finish(
    loaded: &Loaded,
    folder: &Path,
    timings: String,
    common: &Common,
) -> Result<(), CliError> {
    let page = folder.join("report.html");
    let text = format!("{}: done; open {}\n", loaded.name, page.display());
    let mut common = common.clone();
    common.output = None;
    Results::named("run", text, timings, None).deliver("run", &common)
}

impl<'a> ChartTimes<'a> {
    fn of(chart: &'a Chart) -> Self {
        let [first, second] = &chart.axes;
        Self {
            parameters: [&first.parameter, &second.parameter],
            iterates: chart.timing.iterates,
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
        Self {
            quiet,
            stages: Vec::new(),
        }
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
