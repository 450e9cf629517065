//! Page of a run: model, orbit, expansion, comparison with direct simulation, diagrams.

use serde::Serialize;

use super::basin_figure::basin_outside_words;
use super::citation::Citation;
use super::diagram_figure::{NEAR_GRAZE, extent};
use super::equations::equations;
use super::sketch::sketch;
use super::table::{digits_needed, minus, significant};
use super::window_words::{
    chart_computed_words, chart_escape_words, chart_outside_words, chart_overlay_words,
    chart_share_words, diagram_escape_words, diagram_outside_words, diagram_share_words,
};
use super::{
    BranchListing, Figure, GrazeStudy, LiveMap, LivePane, MapListing, OrbitListing, Page, Picture,
    Provenance, ReportError, Section, Table, Views, basin_figure, basin_remarks, basin_table,
    basin_words, bounds_words, chart_figure, chart_timing_table, convergence_section,
    diagram_figures, diagram_timing_table, edge_words, error_words, manifold_table, window_remark,
};
use crate::analysis::basin::Basin;
use crate::analysis::chart::Chart;
use crate::analysis::diagram::Diagram;
use crate::convergence::ConvergenceStudy;
use crate::expansion::{LocalMap, MapOrders, WindowEdge};
use crate::model::{ChartObservable, Method, Scene};

/// Time of a stage of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Stage.
    pub stage: &'static str,
    /// Wall-clock time, in seconds.
    pub seconds: f64,
}

/// Multiply-adds of the emitted code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrateSummary {
    /// Step with variable parameters.
    pub step: usize,
    /// Step with frozen parameters.
    pub frozen: usize,
    /// Step with frozen parameters and its Jacobian.
    pub jacobian: usize,
}

/// All results of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunPage<'a> {
    /// Scene.
    pub scene: &'a Scene,
    /// Grazing orbit.
    pub orbit: &'a OrbitListing,
    /// Prediction and measurements at the graze.
    pub graze: &'a GrazeStudy,
    /// Figures of the orbit over its period, the phase portraits first, each with the suffix of its
    /// file name.
    pub pictures: &'a [(String, Figure)],
    /// Local map.
    pub local: &'a LocalMap,
    /// WebAssembly modules of the map, and of maps of lower orders.
    pub modules: &'a [(MapOrders, Vec<u8>)],
    /// Name of the scene in commands, with its overrides.
    pub subject: &'a str,
    /// Expansion.
    pub map: &'a MapListing,
    /// Operation counts of the emitted code.
    pub emitted: CrateSummary,
    /// Comparison of all orders with direct simulation.
    pub study: &'a ConvergenceStudy,
    /// Bifurcation diagrams.
    pub diagrams: &'a [Diagram],
    /// Two-parameter charts.
    pub charts: &'a [Chart],
    /// Branches of periodic orbits over the parameters of the diagrams.
    pub branches: &'a [BranchListing],
    /// Basins of attraction.
    pub basins: &'a [Basin],
    /// Time of each stage.
    pub times: &'a [StageTime],
}

impl RunPage<'_> {
    /// Command on this scene.
    fn command(&self, name: &str) -> String {
        format!("grazemap {name} {}", self.subject)
    }
}

/// Lays out the page of a run.
pub fn run_page(run: &RunPage<'_>) -> Result<Page, ReportError> {
    let model = &run.scene.model;
    let mut page = Page::new(format!("Grazing: {}", model.name), provenance(run))
        .summary(summary(run))
        .section(graze_section(run))
        .section(orbit_section(run))
        .section(model_section(run));
    if !run.charts.is_empty() {
        page = page.section(
            chart_section(run.charts)
                .files(["chart.json", "chart.csv"])
                .command(run.command("chart")),
        );
    }
    if !run.basins.is_empty() {
        page = page.section(
            basin_section(run.basins).files(basin_files(run.basins)).command(run.command("basin")),
        );
    }
    let page = page
        .section(
            convergence_section(run.study)
                .files(["convergence.json", "convergence.csv"])
                .command(run.command("converge")),
        )
        .section(
            expansion_section(run).files(["map.json", "map.csv"]).command(run.command("expand")),
        )
        .section(time_section(run).files(["timings.json"]))
        .section(citation_section(run));
    Ok(page.alive(LiveMap::new(run.local, run.modules, run.diagrams, run.charts, run.branches)?))
}

fn provenance(run: &RunPage<'_>) -> Provenance {
    Provenance {
        scene: run.scene.identifier.clone(),
        source: run.scene.model.source.clone().unwrap_or_default(),
        digest: run.scene.digest.to_string(),
        version: format!("grazemap {}", env!("CARGO_PKG_VERSION")),
        section: run.map.section.words(),
        orders: orders_words(run.map),
        more: vec![("Window".to_owned(), bounds_words(&run.map.window))],
    }
}

fn orders_words(map: &MapListing) -> String {
    let (n, w) = (map.orders.smooth_order, map.orders.contact_weight);
    let weights: Vec<String> =
        map.weights.0.iter().map(|(name, weight)| format!("{name} {weight}")).collect();
    format!("P_smooth to degree N = {n}, D to weight W = {w}; weights: {}", weights.join(", "))
}

fn summary(run: &RunPage<'_>) -> String {
    let solved: Vec<String> = run
        .scene
        .grazing
        .solve_for
        .iter()
        .map(|&parameter| {
            let name = &run.scene.model.parameters[parameter].name;
            let value = run.orbit.parameters.get(name).copied().unwrap_or(f64::NAN);
            format!("{name}* = {}", minus(&significant(value, digits_needed(value, 12))))
        })
        .collect();
    let surfaces: Vec<_> =
        run.orbit.passages.iter().map(|passage| format!("“{}”", passage.surface)).collect();
    let surfaces = match surfaces.as_slice() {
        [one] => format!("the surface {one}"),
        several => format!("the surfaces {} in turn", several.join(", ")),
    };
    let verdict = run.graze.verdict();
    format!("The orbit grazes {surfaces} at {}: {verdict}.", solved.join(", "))
}

fn model_section(run: &RunPage<'_>) -> Section {
    let (scene, model) = (run.scene, &run.scene.model);
    let role = |number: usize| {
        let solved = scene.grazing.solve_for.contains(&number);
        match (solved, scene.expansion.active.contains(&number)) {
            (true, true) => "adjusted so that the orbit grazes; variable of the map",
            (true, false) => "adjusted so that the orbit grazes",
            (false, true) => "variable of the map",
            (false, false) => "fixed",
        }
    };
    let grazing = |parameter: &str| run.orbit.parameters.get(parameter).copied();
    let table = Table::of(model.parameters.iter().enumerate())
        .text("parameter", |(_, parameter)| &parameter.name)
        .shortest("value in the scene", 12, |(_, parameter)| Some(parameter.value.to_f64()))
        .shortest("at the graze", 12, |(_, parameter)| grazing(&parameter.name))
        .text("role", |(number, _)| role(number))
        .made();
    let phase = model.phase.as_ref().map_or(String::new(), |phase| {
        let period = phase.period.to_f64();
        let period = significant(period, digits_needed(period, 12));
        format!(" The forcing phase {} has the period {period}.", phase.name)
    });
    let section = Section::new("The oscillator").markup(equations(model));
    let section = match oscillator_sketch(run) {
        Some(svg) => section.picture(
            Picture { svg, png: Vec::new() },
            "Masses, stops and gaps, not to scale; in blue where the orbit grazes. A spring \
                stands for a stop that yields; the words below a mass are the forces on it in free \
                flight.",
        ),
        None => section,
    };
    section
        .files(["scene.toml"])
        .prose(format!("States: {}.{phase}", model.states.join(", ")))
        .table(table, "Parameters of the scene.")
}

/// Sketch of the oscillator at the grazing point.
fn oscillator_sketch(run: &RunPage<'_>) -> Option<String> {
    let model = &run.scene.model;
    let known = || run.orbit.state.0.iter().chain(&run.orbit.parameters.0);
    let value = |name: &&str| known().find(|(own, _)| own == name).map(|(_, value)| *value);
    let names = [model.full_state_names(), model.parameter_names()].concat();
    let point = names.iter().map(value).collect::<Option<Vec<_>>>()?;
    sketch(model, &point, &run.scene.grazing.passages)
}

fn orbit_section(run: &RunPage<'_>) -> Section {
    let orbit = run.orbit;
    let [re, im] = orbit.multipliers.first().copied().unwrap_or([f64::NAN; 2]);
    let stable = if re.hypot(im) < 1.0 { "attracts" } else { "repels" };
    let xi = conditions_prose(orbit);
    let prose = format!(
        "Newton's method on the extended system ended with a residual of {:.1e} in double-double. \
            Without the stop the orbit {stable}: its largest multiplier has modulus \
            {:.6}.{xi}",
        orbit.residual,
        re.hypot(im)
    );
    let section = Section::new("Grazing orbit").prose(prose);
    let section = run.pictures.iter().fold(section, |section, (ending, figure)| {
        section.figure(figure.clone(), picture_caption(ending))
    });
    let section = section.table(
        orbit.point_table(),
        "The grazing orbit: parameters p*, the (first) grazing point, multipliers of the period \
            map on the section, and xi_n = h_x · (dP_smooth)^n · β.",
    );
    let section = section
        .files(["orbit.json", "trajectory.json", "trajectory.csv"])
        .command(run.command("trajectory"));
    let section = match orbit.hits_table() {
        Some(hits) => section.table(hits, "The hits of a period."),
        None => section,
    };
    if orbit.passages.len() == 1 {
        return section;
    }
    let passages = orbit.passages_table();
    let conditions = orbit.conditions_table();
    section
        .table(passages, "The grazing passages of a period.")
        .table(conditions, "xi_n from one passage to the n-th following of another.")
}

/// Caption of a figure of the orbit, by the suffix of its file name.
fn picture_caption(ending: &str) -> &'static str {
    if ending == "-gaps" {
        "The gaps to the surfaces over a period of the grazing orbit: one is zero where it grazes."
    } else if ending.starts_with("-time") {
        "The grazing orbit over time, a period of it; dashed: where a stop stands still."
    } else {
        "The grazing orbit, a period of it; GR: where it grazes; dashed: where a stop stands still."
    }
}

/// Meaning of the signs of the conditions, as text.
fn conditions_prose(orbit: &OrbitListing) -> String {
    let closing = orbit.conditions.iter().find_map(|pair| {
        let n = pair.values.iter().position(|&xi| xi < 0.0)? + 1;
        let [from, to] = &pair.surfaces;
        Some(if orbit.passages.len() == 1 {
            format!("xi_{n}")
        } else {
            format!("xi_{n} from {from} to {to}")
        })
    });
    match closing {
        Some(name) => format!(
            " {name} is negative: a contact brings the orbit back to the surface then. Where D \
                begins with y, as for rigid and prestressed stops, the grazing bifurcation is \
                discontinuous and orbits leave the neighbourhood of the graze."
        ),
        None if orbit.conditions.iter().all(|pair| pair.values.is_empty()) => String::new(),
        None => " All xi_n computed are positive.".to_owned(),
    }
}

fn expansion_section(run: &RunPage<'_>) -> Section {
    let lost: Vec<String> =
        run.map.lost_digits.0.iter().map(|(name, digits)| format!("{name} {digits:.1}")).collect();
    let prose = format!(
        "Everything is a polynomial in offsets from the grazing orbit; y² = −h_min is the depth \
            that the free flow would reach. Cancellation cost an estimated number of decimal \
            digits of: {}.",
        lost.join(", ")
    );
    let terms: usize = run.map.composed.outputs.0.iter().map(|(_, terms)| terms.len()).sum();
    let cost = format!(
        "The map has {terms} coefficients when it is composed. The emitted crate evaluates a step \
            in {} multiply-adds, {} with the parameters folded in, {} with its Jacobian too.",
        run.emitted.step, run.emitted.frozen, run.emitted.jacobian
    );
    let edges = run.map.depth.iter().filter_map(|laws| laws.window_edge);
    let (within, beyond): (Vec<_>, Vec<_>) = edges.partition(WindowEdge::is_within);
    let mut within: Vec<_> = within.iter().map(edge_sentence).collect();
    // NOTE: passages that are mirror images yield the same sentence.
    within.dedup();
    let share = |edge: &&WindowEdge| edge.omitted_share;
    let worst = beyond.iter().max_by(|a, b| share(a).total_cmp(&share(b)));
    let window = &run.map.window;
    let remark = window_remark(window, run.map.orders, worst);
    let remark = remark.map(|remark| sentence(&format!("{}: {}", remark.kind(), remark.words)));
    let measured = sentence(&error_words(window));
    let mut section = Section::new("Expansion");
    if let Some(decided) = &run.map.section.decided {
        section = section.prose(format!("Decided: {}.", decided.words()));
    }
    let section = section.prose(prose);
    [measured]
        .into_iter()
        .chain(remark)
        .chain(within)
        .fold(section, Section::prose)
        .table(run.map.size_table(), "Coefficients that are not zero.")
        .table(window_table(run), "The window in which the map was measured.")
        .prose(cost)
}

/// Table of the window in offsets and in values.
fn window_table(run: &RunPage<'_>) -> Table {
    let map = run.local;
    let section = &map.section;
    let coordinates = section.coordinates.iter().zip(&section.point).zip(&map.window.state);
    let parameters = map.parameters.iter().map(|own| (&own.name, &own.value));
    let variables = coordinates.chain(parameters.zip(&map.window.parameter));
    let variables = variables.map(|((name, value), &width)| (name, value.to_f64(), width));
    let bound = |value: f64| value.is_finite().then_some(value);
    let table = Table::of(variables)
        .text("variable", |(name, ..)| name)
        .shortest("at the graze", 12, |(_, value, _)| Some(value))
        .shortest("half-width", 4, |(.., width)| bound(width))
        .shortest("from", 9, |(_, value, width)| bound(value - width))
        .shortest("to", 9, |(_, value, width)| bound(value + width));
    table.made()
}

/// Section with what a reader needs to cite the program, and to cite and reproduce the map.
fn citation_section(run: &RunPage<'_>) -> Section {
    let source = run.scene.model.source.as_ref().map_or(String::new(), |own| format!(" ({own})"));
    let words = format!(
        "{}{source}: local map at its graze, {}; window {}; {}. Scene {}, digest {}, grazemap {}.",
        run.scene.model.name,
        orders_words(run.map),
        bounds_words(&run.map.window),
        error_words(&run.map.window),
        run.scene.identifier,
        run.scene.digest,
        env!("CARGO_PKG_VERSION"),
    );
    let citation = Citation::of_program();
    Section::new("To cite")
        .prose("The map and its scene:")
        .quote(capitalised(&words))
        .table(citation.table(), "The program.")
        .code(citation.bibtex())
        .command(run.command("run"))
}

fn edge_sentence(edge: &WindowEdge) -> String {
    format!("At the edge of the window {}.", edge_words(edge))
}

/// Sentence with a capital and a full stop.
fn sentence(words: &str) -> String {
    format!("{}.", capitalised(words))
}

/// Section about the bifurcation at the graze: prediction, and diagrams.
fn graze_section(run: &RunPage<'_>) -> Section {
    let words: Vec<String> = run.graze.theory_words().iter().map(|words| sentence(words)).collect();
    let section = Section::new("What happens at this graze");
    let section = match run.diagrams {
        [] => section,
        _ => diagrams_in(section, run)
            .files(["diagram.json", "diagram.csv"])
            .command(run.command("diagram")),
    };
    let section = section.prose(words.join("\n"));
    let section = match run.graze.measured_table() {
        Some(table) => section.table(
            table,
            "Attractors by guarded iteration on both sides of the graze, by the offset of the \
                parameter; the exponent is per return.",
        ),
        None => section,
    };
    match run.graze.orbits_table() {
        Some(table) => section.table(
            table,
            "Orbits with one contact in n returns that exist near the graze to leading order; \
             nearer to it than the last column they are unstable.",
        ),
        None => section,
    }
}

/// Diagrams, live and as the run drew them, and the impact speeds of branches, as views.
fn diagrams_in(section: Section, run: &RunPage<'_>) -> Section {
    let mut views = Views::default();
    let mut words = Vec::new();
    for (number, diagram) in run.diagrams.iter().enumerate() {
        let name = diagram_name(run.diagrams, diagram);
        views = views.live(format!("live: {name}"), LivePane::Diagram, number);
        let figures = diagram_figures(diagram);
        if figures.is_empty() {
            words.push(format!(
                "There is no figure over {}: no orbit stayed long enough for a value to be kept.",
                diagram.parameter
            ));
        }
        let outside = diagram_outside_words(diagram).map(|words| sentence(&words));
        let shares = [diagram_share_words(diagram), outside, diagram_escape_words(diagram)];
        let mut said =
            shares.into_iter().flatten().fold(String::new(), |all, own| all + " " + &own);
        // The live diagram is the close-up of a page.
        for (ending, figure) in figures.into_iter().filter(|(ending, _)| *ending != NEAR_GRAZE) {
            // What is said of the sweeps stands under their first figure.
            let caption = caption(diagram, ending) + &std::mem::take(&mut said);
            views = views.figure(format!("{name}, {}", view_words(ending)), figure, caption);
        }
        words.extend((!said.is_empty()).then(|| said.trim().to_owned()));
    }
    for listing in run.branches {
        let figures = listing.figures(None);
        let speeds = figures.into_iter().find(|(ending, _)| ending == "-impact_speed");
        if let Some((_, figure)) = speeds {
            let caption = format!(
                "Largest speed at which the periodic orbits of the map meet the stop, over {}; \
                    0 without contact, solid where stable, dashed where not.",
                listing.along
            );
            views = views.figure(format!("impact speed over {}", listing.along), figure, caption);
        }
    }
    words.into_iter().fold(section.views(views), Section::prose)
}

/// Name of a diagram among others: what it shows, and its range where that tells it from another.
fn diagram_name(all: &[Diagram], diagram: &Diagram) -> String {
    let name = |own: &Diagram| format!("{} over {}", own.observable, own.parameter);
    let own = name(diagram);
    if all.iter().filter(|other| name(other) == own).count() == 1 {
        return own;
    }
    let offsets = diagram.sweeps.iter().flat_map(|sweep| &sweep.points).map(|point| point.offset);
    let (from, to) = extent(offsets);
    let [from, to] = [from, to].map(|end| minus(&significant(end, digits_needed(end, 4))));
    format!("{own} from {from} to {to}")
}

/// Name of a figure of a diagram, by the suffix of its file name.
fn view_words(ending: &str) -> &'static str {
    match ending {
        "-map" => "by the map alone",
        "-guarded" => "guarded",
        "-direct" => "by direct simulation",
        "-overlay" => "by all methods",
        "-difference" => "distance of the methods",
        "-lyapunov" => "Lyapunov exponent",
        _ => "as the run drew it",
    }
}

fn caption(diagram: &Diagram, ending: &str) -> String {
    let graze = " GR is the graze.";
    let (what, graze) = match ending {
        "-map" => ("By the map alone", graze),
        "-guarded" => ("By the map inside its window and direct simulation outside", graze),
        "-direct" => ("By direct simulation alone", graze),
        "-overlay" => ("By every method, those drawn first with larger dots", graze),
        "-difference" => ("Distance of what two methods settle on", ""),
        "-lyapunov" => {
            ("Largest Lyapunov exponent, from the map's Jacobian, where the map iterates", graze)
        }
        _ => ("Bifurcation diagram", graze),
    };
    format!(
        "{what}: {} of {} iterates after {} dropped ones at each of {} values of {}, the last \
            state carried along.{graze}",
        diagram.keep,
        diagram.transient + diagram.keep,
        diagram.transient,
        diagram.sweeps.first().map_or(0, |sweep| sweep.points.len()),
        diagram.parameter
    )
}

fn chart_section(charts: &[Chart]) -> Section {
    let mut views = Views::default();
    for (number, chart) in charts.iter().enumerate() {
        let [first, second] = &chart.axes;
        let name = format!("{} and {}", first.parameter, second.parameter);
        views = views.live(format!("live: period over {name}"), LivePane::Chart, number);
        let outside = chart_outside_words(chart).map(|words| sentence(&words));
        let sentences = [
            chart_computed_words(chart),
            chart_overlay_words(chart),
            chart_share_words(chart),
            outside,
            chart_escape_words(chart),
        ];
        let said = sentences.into_iter().flatten();
        let caption = said.fold(chart_caption(chart), |all, own| all + " " + &own);
        let shown = format!("{} over {name}, as the run drew it", observed_words(chart));
        views = views.figure(shown, chart_figure(chart), caption);
    }
    Section::new("Over two parameters").views(views)
}

fn chart_caption(chart: &Chart) -> String {
    let [first, second] = &chart.axes;
    format!(
        "What {} settles on over {} and {}, from {} in each of {} × {} cells: {}, of the last {} \
             of {} iterates. GR is the graze.",
        chart_subject(chart.method),
        first.parameter,
        second.parameter,
        start_words(chart),
        first.offsets.len(),
        second.offsets.len(),
        observed_words(chart),
        2 * chart.longest_period,
        chart.transient + 2 * chart.longest_period
    )
}

/// Starts of a chart's cells, as text.
fn start_words(chart: &Chart) -> String {
    match (&chart.start, chart.starts.len()) {
        (Some(offsets), _) => format!("the offsets {offsets:?}"),
        (None, 0) => "beside the fixed point of P_smooth".to_owned(),
        (None, count) => format!("{count} states"),
    }
}

/// Quantity that a chart shows, as text.
fn observed_words(chart: &Chart) -> String {
    let observed = match chart.observe {
        ChartObservable::Period => "the period in returns",
        ChartObservable::Itinerary => "which returns make contact",
        ChartObservable::Lyapunov => "the largest Lyapunov exponent per return",
        ChartObservable::Attractors => "the number of attractors",
    };
    match (chart.observe, chart.attractors) {
        (ChartObservable::Attractors, _) | (_, 1) => observed.to_owned(),
        (_, count) => format!(
            "{observed} of up to {count} attractors, cells with several having their colours in \
             turn"
        ),
    }
}

fn chart_subject(method: Method) -> &'static str {
    match method {
        Method::Map => "the map alone",
        Method::Guarded => "the map, and direct simulation outside its window,",
        Method::Direct => "direct simulation",
        Method::Atlas => "an atlas",
    }
}

/// File names of basins; those of several basins are numbered.
fn basin_files(basins: &[Basin]) -> Vec<String> {
    let endings = |stem: &str| ["json", "csv"].map(|ending| format!("{stem}.{ending}"));
    match basins {
        [_] => endings("basin").to_vec(),
        _ => (1..=basins.len()).flat_map(|number| endings(&format!("basin-{number}"))).collect(),
    }
}

fn basin_section(basins: &[Basin]) -> Section {
    let mut section = Section::new("Basins of attraction");
    for basin in basins {
        let caption = sentence(basin_words(basin).trim_end());
        section = section.figure(basin_figure(basin), caption).table(
            basin_table(basin),
            "Attractors and other classes with their shares of the cells, what the border leaves \
                uncertain of them, and the standard deviation of so many random states.",
        );
        let manifolds = basin.manifolds.as_ref().filter(|own| !own.branches.is_empty());
        if let Some(manifolds) = manifolds {
            section = section.table(
                manifold_table(basin, manifolds),
                "Manifolds of the saddles; lengths in widths of the plane.",
            );
        }
        let words = basin_outside_words(basin).into_iter().chain(basin_remarks(basin));
        section = words.fold(section, |section, words| section.prose(sentence(&words)));
    }
    section
}

fn time_section(run: &RunPage<'_>) -> Section {
    let table = Table::of(run.times)
        .text("stage", |time| time.stage)
        .number("time", 3, |time| time.seconds)
        .unit("s")
        .made();
    let mut section =
        Section::new("Times").table(table, "What each stage of this run took, by the clock.");
    if !run.diagrams.is_empty() {
        section = section.table(
            diagram_timing_table(run.diagrams),
            "Iterates of the sweeps of diagrams, and times by the clock on so many threads.",
        );
    }
    if !run.charts.is_empty() {
        section = section.table(
            chart_timing_table(run.charts),
            "Cells of charts and what is settled on in them; iterates, and times by the clock on \
                so many threads.",
        );
    }
    for diagram in run.diagrams {
        if let Some(ratio) = diagram.speed_ratio {
            section = section.prose(format!(
                "In the diagram of {} over {} an iterate by direct simulation took {ratio:.0} \
                    times as long as one by the map.",
                diagram.observable, diagram.parameter
            ));
        }
    }
    section
}

/// Text with a capital.
fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    format!("{}{}", first.unwrap_or_default(), letters.as_str())
}
