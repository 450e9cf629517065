//! Safety of a scene: whether its orbit is clear of the stop, and by how much; as fields, words,
//! tables, one picture and one page.

use serde::Serialize;

use super::figure::{Annotation, Axis, AxisScale, Figure, Guide, Marker, Series, Stroke, symbol};
use super::table::{quoted, significant};
use super::{Cell, Column, Named, Page, Provenance, Section, Table};
use crate::analysis::branches::BranchLabel;
use crate::model::Scene;

/// Digits of values in words.
const DIGITS: usize = 8;

/// Ratio of the largest to the smallest change in a picture above which the axis is logarithmic.
const SPREAD: f64 = 50.0;

/// Height of a picture without rows and of a row, in CSS pixels.
const HEIGHT: u32 = 110;
const ROW: u32 = 44;

/// Distance of the line of a tolerance below that of its parameter, in rows.
const BELOW: f64 = 0.25;

/// Answer of `safe`.
#[derive(Clone, Debug, Serialize)]
pub struct SafetyListing {
    /// Name of the stop that the scene's orbit grazes.
    pub surface: String,
    /// Stops that intervals and boxes count, that one first.
    pub stops: Vec<String>,
    /// Whether the orbit of the free flight is clear of every stop at the scene's values.
    pub clears: bool,
    /// Whether the orbit is unstable at the scene's values: a motion leaves it.
    pub unstable: bool,
    /// Another stop beyond which the orbit goes at the scene's values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub through: Option<String>,
    /// Stops that intervals and boxes do not count, since their grazes could not be followed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<String>,
    /// Intervals without contact, one per parameter.
    pub intervals: Vec<SafeInterval>,
    /// Box of tolerances; `None` if none was asked for.
    pub tolerance: Option<ToleranceBox>,
    /// Attractors found by direct simulation at the scene's values, the one with the largest share
    /// first.
    pub attractors: Vec<OtherAttractor>,
    /// Parameter along which the attractors are followed.
    pub along: String,
    /// Number of starts of direct simulation.
    pub starts: usize,
    /// Share of the starts without a return: beyond a stop, where no flight leads, or at rest.
    pub no_image: f64,
    /// Share of the starts whose motion goes beyond the bounds of what is followed.
    pub escaped: f64,
}

/// Interval of a parameter, about the scene's value, in which no graze was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SafeInterval {
    /// Name of the parameter.
    pub parameter: String,
    /// Value in the scene.
    pub value: f64,
    /// Nearest graze below; `None` if none was found.
    pub below: Option<f64>,
    /// Nearest graze above; `None` if none was found.
    pub above: Option<f64>,
    /// Value below at which the orbit ends in a fold before it grazes.
    pub fold_below: Option<f64>,
    /// Value above at which the orbit ends in a fold before it grazes.
    pub fold_above: Option<f64>,
    /// Stop that is grazed below; `None` without a graze there or if there is only one stop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_below: Option<String>,
    /// Stop that is grazed above; `None` as for the one below.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_above: Option<String>,
}

/// Box of tolerances.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToleranceBox {
    /// Tolerances relative to the scene's values.
    pub tolerances: Named<f64>,
    /// Number of edges along the first parameter that were looked at: at the corners of the other
    /// parameters, and through the middle.
    pub edges: usize,
    /// Values at which the orbit touches a stop or lies beyond it, one per edge where it does.
    pub touched: Vec<Named<f64>>,
    /// Stops touched there, in the same order; empty if there is only one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<String>,
    /// Values at which the orbit ends in a fold, one per edge where it does and is not known to
    /// touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub folds: Vec<Named<f64>>,
}

/// Attractor at the scene's values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherAttractor {
    /// Name of the orbit, hits and periods; `None` without a period.
    pub orbit: Option<String>,
    /// Share of the starts that come to it.
    pub fraction: f64,
    /// Largest impact speed; `None` without an impact.
    pub impact_speed: Option<f64>,
    /// First start found that comes to it, as offsets from the graze.
    pub start: Named<f64>,
    /// Lower end of its interval of the followed parameter; `None` if it was not followed.
    pub from: Option<AttractorEnd>,
    /// Upper end of the interval; `None` if the attractor was not followed.
    pub to: Option<AttractorEnd>,
}

/// End of the interval of a parameter along which an attractor was followed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AttractorEnd {
    /// Value of the parameter.
    pub value: f64,
    /// Special point at which the attractor ends; `None` if it was followed no farther.
    pub label: Option<BranchLabel>,
}

impl AttractorEnd {
    /// End in words; `beyond` says on which side the attractor exists farther, if it does.
    fn words(self, beyond: &str) -> String {
        let value = significant(self.value, DIGITS);
        match self.label {
            Some(label) => format!("{value} {}", label.letters()),
            None => format!("{beyond} {value}"),
        }
    }
}

impl OtherAttractor {
    /// Name of the orbit, or that it has no period.
    fn name(&self) -> String {
        self.orbit.clone().unwrap_or_else(|| "no period".to_owned())
    }

    /// Share of the starts and impact speed.
    fn share_words(&self) -> String {
        let share = format!("{} %", significant(100.0 * self.fraction, 3));
        match self.impact_speed {
            Some(speed) => format!("{share}, speed {}", significant(speed, 3)),
            None => format!("{share}, no contact"),
        }
    }
}

impl SafeInterval {
    /// Unit of changes of the parameter: the size of its value, or 1 where that is 0.
    fn unit(&self) -> f64 {
        if self.value == 0.0 { 1.0 } else { self.value.abs() }
    }

    /// Ends with their labels, the lower one first; `None` where none was found.
    fn ends(&self) -> [Option<(f64, BranchLabel)>; 2] {
        [(self.below, self.fold_below), (self.above, self.fold_above)].map(|(graze, fold)| {
            let graze = graze.map(|value| (value, BranchLabel::Graze));
            graze.or(fold.map(|value| (value, BranchLabel::SaddleNode)))
        })
    }

    /// Change from the scene's value to another one, in percent of the unit.
    fn percent(&self, value: f64) -> f64 {
        100.0 * (value - self.value) / self.unit()
    }
}

impl SafetyListing {
    /// Table of the intervals.
    pub fn table(&self) -> Table {
        let mut table = Table::of(&self.intervals)
            .text("parameter", |interval| &interval.parameter)
            .number("value", 15, |interval| interval.value)
            .number("graze below", 15, |interval| interval.below)
            .number("graze above", 15, |interval| interval.above);
        let folds = |interval: &SafeInterval| interval.fold_below.or(interval.fold_above);
        if self.intervals.iter().any(|interval| folds(interval).is_some()) {
            table = table.number("fold below", 15, |interval| interval.fold_below).number(
                "fold above",
                15,
                |interval| interval.fold_above,
            );
        }
        let stops = |interval: &SafeInterval| {
            interval.stop_below.is_some() || interval.stop_above.is_some()
        };
        if self.intervals.iter().any(stops) {
            let named = |stop: &Option<String>| stop.as_ref().map_or(Cell::Missing, Cell::text);
            table = table
                .column(Column::text("stop below"), move |interval| named(&interval.stop_below))
                .column(Column::text("stop above"), move |interval| named(&interval.stop_above));
        }
        table.made()
    }

    /// Whether the orbit is clear of the stops, in words.
    fn verdict(&self, scene: &str) -> String {
        let words = match self.clears {
            true => {
                let stops = quoted(&self.stops);
                format!("`{scene}` is clear of {stops}: its periodic orbit does not touch\n")
            }
            false => format!(
                "`{scene}` is not clear of `{}`: without the stop its periodic orbit would go \
                 beyond it\n",
                self.through.as_ref().unwrap_or(&self.surface)
            ),
        };
        let unstable = match self.unstable {
            true => "this orbit is unstable: motions leave it\n",
            false => "",
        };
        words + unstable + &self.other_without_contact()
    }

    /// Line on attractors without contact beside an orbit that goes beyond a stop; empty without
    /// any.
    fn other_without_contact(&self) -> String {
        let is_free = |attractor: &&OtherAttractor| {
            attractor.orbit.is_some() && attractor.impact_speed.is_none()
        };
        let share: f64 = self.attractors.iter().filter(is_free).map(|other| other.fraction).sum();
        if self.clears || share == 0.0 {
            return String::new();
        }
        format!(
            "it is an orbit of the free flight, as if there were no stop; from {} % of the starts \
             the oscillator settles on another motion, without contact\n",
            significant(100.0 * share, 3)
        )
    }

    /// Answer as text.
    pub fn text(&self, scene: &str) -> String {
        let mut text = self.verdict(scene);
        if let Some(tolerance) = &self.tolerance {
            text.push_str(&tolerance.words(&self.surface));
        }
        let heading = if self.clears { "without contact" } else { "between grazes" };
        text.push_str(&format!(
            "\n{heading}, one parameter at a time:\n\n{}",
            self.table().to_text()
        ));
        text.push_str(
            "-: no graze was found on that side, along the branch of this orbit, at a distance of \
             up to ten times the value; listed are the parameters of `expansion.active` and of the \
             tolerances\n",
        );
        text.push_str(&self.others_words());
        if !self.attractors.is_empty() {
            text.push_str(&format!(
                "\nattractors at these values, by direct simulation from {} states:\n\n{}",
                self.starts,
                self.attractor_table().to_text()
            ));
            text.push_str(&self.lost_words());
            text.push_str(&self.ends_explained());
        }
        text
    }

    /// Line on the stops that are not followed; empty without any.
    fn others_words(&self) -> String {
        if self.others.is_empty() {
            return String::new();
        }
        format!(
            "grazes of {} could not be followed: set `grazing.surface` and a guess for them\n",
            quoted(&self.others)
        )
    }

    /// Line on the starts that come to no attractor; empty if all come to one.
    fn lost_words(&self) -> String {
        let said = [
            (self.no_image, "have no return: they lie beyond a stop, or at rest"),
            (self.escaped, "go beyond the bounds of what is followed"),
        ];
        let said = said.into_iter().filter(|(share, _)| *share > 0.0);
        let said: Vec<String> =
            said.map(|(share, what)| format!("{} {what}", significant(share, 4))).collect();
        match said.is_empty() {
            true => String::new(),
            false => format!("of the states, {}\n", said.join("; ")),
        }
    }

    /// Table of the attractors, for people.
    fn attractor_table(&self) -> Table {
        let end = |end: Option<AttractorEnd>, beyond: &str| {
            end.map_or(Cell::Missing, |end| Cell::text(end.words(beyond)))
        };
        let column = |end: &str| Column::text(format!("{end} {}", self.along));
        Table::of(&self.attractors)
            .text(&format!("orbit ({},periods)", self.surface), OtherAttractor::name)
            .number("share of starts", 4, |attractor| attractor.fraction)
            .number("largest impact speed", 6, |attractor| attractor.impact_speed)
            .column(column("from"), |attractor| end(attractor.from, "below"))
            .column(column("to"), |attractor| end(attractor.to, "above"))
            .made()
    }

    /// Table of the attractors, for programs.
    pub fn attractor_data(&self) -> Table {
        let value = |end: Option<AttractorEnd>| end.map(|end| end.value);
        let label = |end: Option<AttractorEnd>| {
            let label = end.and_then(|end| end.label);
            label.map_or(Cell::Missing, |label| Cell::text(label.letters()))
        };
        Table::of(&self.attractors)
            .text("orbit", |attractor| attractor.orbit.clone().unwrap_or_default())
            .number("share", 15, |attractor| attractor.fraction)
            .number("impact speed", 15, |attractor| attractor.impact_speed)
            .number(&format!("{} from", self.along), 15, |attractor| value(attractor.from))
            .column(Column::text("from label"), |attractor| label(attractor.from))
            .number(&format!("{} to", self.along), 15, |attractor| value(attractor.to))
            .column(Column::text("to label"), |attractor| label(attractor.to))
            .made()
    }

    /// Explanation of the last columns of the attractors' table.
    fn ends_explained(&self) -> String {
        let ends = self.attractors.iter().flat_map(|attractor| [attractor.from, attractor.to]);
        let labels: Vec<_> = ends.clone().flatten().filter_map(|end| end.label).collect();
        let meanings = [
            (BranchLabel::SaddleNode, "fold"),
            (BranchLabel::PeriodDoubling, "flip"),
            (BranchLabel::NeimarkSacker, "torus"),
            (BranchLabel::Graze, "graze"),
            (BranchLabel::Hopf, "Hopf point"),
        ];
        let met = meanings.iter().filter(|(label, _)| labels.contains(label));
        let mut words: Vec<String> =
            met.map(|(label, word)| format!("{} {word}", label.letters())).collect();
        if ends.clone().flatten().any(|end| end.label.is_none()) {
            words.push("below, above: followed to there without an end".to_owned());
        }
        if ends.clone().any(|end| end.is_none()) {
            words.push("-: not followed".to_owned());
        }
        if self.attractors.iter().any(|attractor| attractor.orbit.is_none()) {
            words.push("no period: chaos, or a transient of more than 1000 returns".to_owned());
        }
        match words.is_empty() {
            true => String::new(),
            false => format!("{}\n", words.join("; ")),
        }
    }

    /// Picture: a row for every parameter with the interval without contact and the tolerance, and
    /// a row for every attractor with the interval in which it exists, all relative to the scene's
    /// values.
    pub fn figure(&self) -> Figure {
        let along = self.intervals.iter().find(|interval| interval.parameter == self.along);
        let parameters = self.intervals.iter().map(|interval| symbol(&interval.parameter));
        let followed = |attractor: &&OtherAttractor| attractor.from.is_some();
        let attractors: Vec<&OtherAttractor> = self.attractors.iter().filter(followed).collect();
        let names = attractors.iter().map(|attractor| attractor.name());
        let rows: Vec<String> = parameters.chain(names).collect();
        let height = HEIGHT + ROW * rows.len() as u32;
        let axis = self.change_axis();
        let (low, high) = axis.range.unwrap_or((-1.0, 1.0));
        let mut figure = Figure::new(axis, Axis::of_rows(rows));
        figure.size.1 = height.clamp(160, 4000);
        figure.guides.push(Guide::Vertical { at: 0.0, label: "scene".to_owned() });
        let (mut clear, mut labels, mut allowed) = (Vec::new(), Vec::new(), Vec::new());
        for (row, interval) in self.intervals.iter().enumerate() {
            let at = |value: f64| [interval.percent(value), -(row as f64)];
            let ends = interval.ends();
            labels.extend(ends.into_iter().flatten().map(|(value, label)| (at(value), label)));
            let [below, above] = ends.map(|end| end.map(|(value, _)| at(value)));
            let open = |end: f64| [end, -(row as f64)];
            clear.push(below.unwrap_or(open(low)));
            clear.push(above.unwrap_or(open(high)));
            clear.push([f64::NAN; 2]);
            let tolerances = self.tolerance.iter().flat_map(|tolerance| &tolerance.tolerances.0);
            for (_, share) in tolerances.filter(|(name, _)| *name == interval.parameter) {
                let half = 100.0 * share * interval.value.abs() / interval.unit();
                let height = -(row as f64) - BELOW;
                allowed.extend([[-half, height], [half, height], [f64::NAN; 2]]);
            }
        }
        let heading = if self.clears { "without contact" } else { "between grazes" };
        figure.series.push(Series::line(heading, Stroke::Solid, clear));
        figure.series.push(Series::line_with_markers("tolerance", Marker::Diamond, allowed));
        let mut exists = Vec::new();
        for (number, attractor) in attractors.iter().enumerate() {
            let height = -((self.intervals.len() + number) as f64);
            let Some(along) = along else { continue };
            let ends = [attractor.from, attractor.to].into_iter().flatten();
            for end in ends {
                let at = [along.percent(end.value), height];
                exists.push(at);
                if let Some(label) = end.label {
                    let marker = Some(Marker::Ring);
                    let text = label.letters().to_owned();
                    figure.annotations.push(Annotation { at, text, marker });
                }
            }
            exists.push([f64::NAN; 2]);
            let text = attractor.share_words();
            figure.annotations.push(Annotation { at: [0.0, height], text, marker: None });
        }
        let name = format!("attractor, along {}", symbol(&self.along));
        figure.series.push(Series::line(name, Stroke::Solid, exists));
        let ring = |(at, label): ([f64; 2], BranchLabel)| Annotation::ring(at, label.letters());
        figure.annotations.extend(labels.into_iter().map(ring));
        figure
    }

    /// Axis of changes from the scene's values that shows all that is bounded.
    fn change_axis(&self) -> Axis {
        let tolerances = self.tolerance.iter().flat_map(|tolerance| &tolerance.tolerances.0);
        let tolerances = tolerances.flat_map(|(_, share)| [-100.0 * share, 100.0 * share]);
        let own = self.intervals.iter().flat_map(|interval| {
            interval.ends().into_iter().flatten().map(|(value, _)| interval.percent(value))
        });
        let along = self.intervals.iter().find(|interval| interval.parameter == self.along);
        let ends = self.attractors.iter().flat_map(|attractor| [attractor.from, attractor.to]);
        let ends = ends.flatten().filter_map(|end| Some(along?.percent(end.value)));
        let changes: Vec<f64> = tolerances.chain(own).chain(ends).collect();
        let sizes = || changes.iter().map(|change| change.abs()).filter(|size| *size > 0.0);
        let least = sizes().fold(f64::INFINITY, f64::min);
        let spread = sizes().fold(0.0, f64::max) > SPREAD * least;
        let scale = match spread {
            true => AxisScale::Symlog { threshold: 0.2 * least },
            false => AxisScale::Linear,
        };
        let axis = Axis { scale, ..Axis::linear("change from the scene’s value, %") };
        let side = |sign: f64| {
            let farthest = changes.iter().fold(0.0_f64, |most, change| most.max(sign * change));
            sign * 1.15 * farthest
        };
        match (side(-1.0), side(1.0)) {
            (below, above) if below == 0.0 && above == 0.0 => axis.with_range(-10.0, 10.0),
            (below, above) => {
                let least = 0.15 * (above - below);
                axis.with_range(below.min(-least), above.max(least))
            }
        }
    }

    /// Page: the verdict, the picture, intervals and attractors.
    pub fn page(&self, scene: &Scene) -> Page {
        let provenance = Provenance {
            scene: scene.identifier.clone(),
            source: scene.model.source.clone().unwrap_or_default(),
            digest: scene.digest.to_string(),
            version: format!("grazemap {}", env!("CARGO_PKG_VERSION")),
            ..Provenance::default()
        };
        let tolerance = self.tolerance.as_ref();
        let tolerance = tolerance.map_or_else(String::new, |allowed| allowed.words(&self.surface));
        let verdict = format!("{}{tolerance}", self.verdict(&scene.identifier));
        let words = "Intervals about the scene’s values, one row for each parameter: GR, a \
                     graze; an interval that reaches the edge has no known end. Below them the \
                     attractors, each with its share of the starts and its largest impact speed.";
        let section = Section::new("How far parameters may go")
            .figure(self.figure(), words)
            .table(
                self.table(),
                "The nearest graze on either side of each value; –: none was found \
                 along the branch of this orbit.",
            )
            .files(["safe.json", "safe.csv"]);
        let page = Page::new(format!("Is it safe: {}", scene.model.name), provenance)
            .summary(verdict.trim_end())
            .section(section);
        if self.attractors.is_empty() {
            return page;
        }
        let caption = format!(
            "Attractors at the scene’s values, by direct simulation from {} states. {}{}",
            self.starts,
            self.lost_words().replace('\n', ". "),
            self.ends_explained().trim_end()
        );
        page.section(
            Section::new("Attractors")
                .table(self.attractor_table(), caption)
                .files(["safe_attractors.csv"]),
        )
    }
}

impl ToleranceBox {
    /// Verdict on the box; `surface` is the stop where there is only one.
    fn words(&self, surface: &str) -> String {
        let surface = self.stops.first().map_or(surface, String::as_str);
        let pair =
            |(name, share): &(String, f64)| format!("{name} ± {} %", significant(100.0 * share, 3));
        let sizes: Vec<String> = self.tolerances.0.iter().map(pair).collect();
        let sizes = sizes.join(", ");
        let at = |values: &Named<f64>| {
            let values = values.0.iter();
            let pairs =
                values.map(|(name, value)| format!("{name} = {}", significant(*value, DIGITS)));
            pairs.collect::<Vec<_>>().join(", ")
        };
        let edges = self.edges;
        match (self.touched.first(), self.folds.first()) {
            (Some(first), _) => format!(
                "not clear in all of {sizes}: it touches `{surface}` at {}; on {} of {edges} edges \
                 of the box\n",
                at(first),
                self.touched.len(),
            ),
            (None, Some(first)) => format!(
                "not known to be clear in all of {sizes}: the orbit ends in a fold at {}, and the \
                 motion goes on to another one; on {} of {edges} edges of the box\n",
                at(first),
                self.folds.len(),
            ),
            (None, None) => {
                let edges = match edges {
                    1 => "the edge".to_owned(),
                    edges => format!("the {edges} edges"),
                };
                format!("clear in all of {sizes}: no graze on {edges} of the box\n")
            }
        }
    }
}
