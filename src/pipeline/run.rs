//! Runs everything that a scene asks for and writes it into a folder with a report page.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::commands::{diagram_branches, study_answer, trajectory_answer};
use super::{
    EmitRequest, Error, Map, Results as _, Settled, Source, StudyRequest, TrajectoryKeys,
    refuse_memory, write_emitted,
};
use crate::analysis::chart::Chart;
use crate::analysis::diagram::{Diagram, Sweep, SweepHeading};
use crate::analysis::{
    NoProgress, Progress, TimeSeries, basin_bytes, charts_bytes, diagrams_bytes, time_series,
};
use crate::emission::{EmittedCrate, Target};
use crate::expansion::check_orders;
use crate::model::{Digest, Method};
use crate::report::{
    CrateSummary, GrazeStudy, OrbitListing, OutputFolder, PictureForm, RunPage, StageTime,
    basin_warnings, chart_warnings, diagram_warnings, run_page, time_series_figures, to_json,
};

/// Observer of a run. Also keeps its pieces.
pub trait RunWatch {
    /// Called when a stage ends.
    fn stage(&self, _stage: &StageTime) {}
    /// Called with each warning.
    fn remark(&self, _words: &str) {}
    /// Called with the chosen section of a scene that allows any.
    fn settled(&self, _settled: &Settled) {}
    /// Called with folder and map before the long computations begin.
    fn begin(&self, _folder: &Path, _map: &Map) {}
    /// Progress of a computation, by its heading and its number within the run.
    fn progress(&self, _heading: &'static str, _number: u64) -> Box<dyn Progress + '_> {
        Box::new(NoProgress)
    }
    /// Scene and overrides as words of a command, for the page.
    fn subject(&self) -> Option<String> {
        None
    }
    /// Command that reproduces the crate, for its header.
    fn emission(&self, _folder: &Path) -> Option<String> {
        None
    }
}

/// Measured times of a run. They have a file of their own, so that all other files are
/// reproducible.
#[derive(Debug, Serialize)]
struct Timings<'a> {
    scene: &'a str,
    digest: Digest,
    stages: &'a [StageTime],
    diagrams: Vec<DiagramTimes<'a>>,
    charts: Vec<ChartTimes<'a>>,
}

/// Times of a chart.
#[derive(Debug, Serialize)]
struct ChartTimes<'a> {
    parameters: [&'a str; 2],
    iterates: u64,
    threads: usize,
    seconds: f64,
    nanoseconds_per_iterate: f64,
}

/// Times of a diagram.
#[derive(Debug, Serialize)]
struct DiagramTimes<'a> {
    parameter: &'a str,
    observable: &'a str,
    /// Ratio of the times of one iterate: direct simulation over map.
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

/// Computes everything that a scene asks for and writes it into a folder. Returns the document of
/// times.
///
/// # Errors
///
/// Errors of every step; [`Error::Report`] if a file cannot be written, [`Error::Emission`] if the
/// folder holds a crate that is not an emission, [`Error::Memory`] for results that exceed the
/// machine's memory.
pub fn run(
    source: Source,
    folder: PathBuf,
    form: PictureForm,
    watch: &dyn RunWatch,
) -> Result<String, Error> {
    let mut clock = Clock { watch, stages: Vec::new() };
    let remarks = |remarks: Vec<String>| remarks.iter().for_each(|words| watch.remark(words));
    let memory = |bytes| -> Result<(), Error> {
        remarks(refuse_memory(bytes)?.into_iter().collect());
        Ok(())
    };
    let scene = source.scene();
    check_orders(scene)?;
    scene.check_diagrams()?;
    scene.check_charts()?;
    memory(diagrams_bytes(scene).saturating_add(charts_bytes(scene)))?;
    let crate_folder = folder.join("crate");
    EmittedCrate::refuse_foreign(&crate_folder, &Target::Rust.files(&scene.identifier))?;
    let folder = OutputFolder::create(folder)?.with_pictures(form);
    folder.write("scene.toml", &*scene.text)?;

    let saved = match &source {
        Source::Map(map) => Some(map.clone()),
        Source::Scene(_) | Source::Graze(_) => None,
    };
    let graze = clock.time("grazing orbit", || source.graze())?;
    let source = saved.clone().map_or(Source::Graze(graze), Source::Map);
    let settled = clock.time("section", || {
        let settled = source.settle()?;
        watch.settled(&settled);
        Ok(settled)
    })?;
    let (scene, orbit) = (settled.scene().clone(), settled.orbit().clone());
    folder.write("orbit.json", settled.graze().to_json()?)?;
    let series = clock.time("trajectory", || write_trajectory(&settled, &folder, watch))?;

    let map = match saved {
        Some(map) => map,
        None => {
            let plan = clock.time("orders", || settled.plan())?;
            clock.time("expansion", || {
                let map = plan.expand()?;
                map.listing()?;
                Ok(map)
            })?
        }
    };
    remarks(map.remarks().collect());
    watch.begin(folder.path(), &map);
    folder.write("map.json", map.to_json()?)?;
    folder.write("map.csv", map.listing()?.coefficient_table().to_csv()?)?;

    let request = EmitRequest { command: watch.emission(&crate_folder), ..EmitRequest::default() };
    let module = clock.time("emission", || map.module(request))?;
    write_emitted(&EmittedCrate::standalone(&module)?, &crate_folder)?;

    let request =
        StudyRequest { fresh: StudyRequest::FRESH, sections: false, chosen: map.choice().cloned() };
    let study = clock.time("convergence", || {
        map.settled().study(&request, &*watch.progress("convergence", 2))
    })?;
    let mut answer = study_answer(&study, &map.section())?;
    remarks(answer.write_files(&folder)?);
    remarks(answer.remarks);

    remarks(map.diagram_offset_remarks());
    let mut diagrams =
        clock.time("diagrams", || map.drawn_diagrams(&*watch.progress("diagram", 0)))?;
    remarks(diagram_warnings(&diagrams.results));
    remarks(diagrams.write_files(&folder)?);
    let diagrams = diagrams.results;

    let mut charts = Vec::new();
    if !scene.charts.is_empty() {
        remarks(map.chart_offset_remarks());
        let mut drawn = clock.time("charts", || map.drawn_charts(&*watch.progress("chart", 1)))?;
        remarks(chart_warnings(&drawn.results));
        remarks(drawn.write_files(&folder)?);
        charts = drawn.results;
    }

    let mut basins = Vec::new();
    let requests = map.basin_requests()?;
    if !requests.is_empty() {
        memory(requests.iter().map(basin_bytes).fold(0, u64::saturating_add))?;
        remarks(map.basin_offset_remarks(&requests));
        let progress = watch.progress("basin", 3);
        let mut drawn = clock.time("basins", || map.drawn_basins(&requests, &*progress))?;
        remarks(basin_warnings(&drawn.results));
        remarks(drawn.write_files(&folder)?);
        basins = drawn.results;
    }

    let theory = map.settled().graze().theory()?;
    // NOTE: nothing can be measured in a parameter that the map does not keep.
    let measured = map.measure_graze(&theory.parameter).unwrap_or_default();
    let modules = [vec![(map.orders(), map.web_module()?)], map.lower_web_modules()?].concat();
    let branches = clock.time("branches", || Ok(diagram_branches(&map, &diagrams)))?;
    let page = run_page(&RunPage {
        scene: &scene,
        orbit: &OrbitListing::new(&scene, &orbit),
        graze: &GrazeStudy { theory, measured },
        pictures: &time_series_figures(&scene, &orbit, &series),
        local: map.local(),
        modules: &modules,
        // NOTE: the folder of the page holds the scene.
        subject: &watch.subject().unwrap_or_else(|| "scene.toml".to_owned()),
        map: map.listing()?,
        emitted: CrateSummary {
            step: module.step_operations.multiply_adds,
            frozen: module.frozen_operations.multiply_adds,
            jacobian: module.jacobian_operations.multiply_adds,
        },
        study: &study,
        diagrams: &diagrams,
        charts: &charts,
        branches: &branches,
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
    Ok(timings)
}

/// Writes the time series of the grazing orbit over one period.
fn write_trajectory(
    settled: &Settled,
    folder: &OutputFolder,
    watch: &dyn RunWatch,
) -> Result<TimeSeries, Error> {
    let (request, _) = TrajectoryKeys::default().request(settled, &NoProgress)?;
    let series = time_series(settled.scene(), settled.orbit(), &request, &NoProgress)?;
    let mut answer = trajectory_answer(settled, &request, &series)?;
    answer.write_files(folder)?.iter().for_each(|words| watch.remark(words));
    answer.remarks.iter().for_each(|words| watch.remark(words));
    Ok(series)
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

/// Measures the stages of a run, and reports each as it ends.
struct Clock<'a> {
    watch: &'a dyn RunWatch,
    stages: Vec<StageTime>,
}

impl Clock<'_> {
    fn time<T>(
        &mut self,
        stage: &'static str,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let start = Instant::now();
        let done = work()?;
        self.stages.push(StageTime { stage, seconds: start.elapsed().as_secs_f64() });
        if let Some(time) = self.stages.last() {
            self.watch.stage(time);
        }
        Ok(done)
    }
}
