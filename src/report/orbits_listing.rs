//! Periodic orbits by itinerary: fields of `orbits --json`, tables for people, and tables for
//! programs with a column per number.

use serde::Serialize;

use super::table::ByColumn;
use super::{Cell, Column, Named, SectionDocument, Table};
use crate::analysis::MOST_WORK;
use crate::analysis::orbits::{
    BifurcationKind, BifurcationLocus, DirectReach, FoundOrbit, LostOrbit, LostReason, Orbits,
    OrbitsRequest,
};
use crate::convergence::MeasuredWindow;
use crate::expansion::{LocalMap, WindowEdge};
use crate::iteration::Itinerary;

/// Periodic orbits in offsets, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitsListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return, for the digits of an itinerary.
    pub passages: Vec<String>,
    /// Window of the map, to which `inside` refers.
    pub window: MeasuredWindow,
    /// Share that truncation omits at the edge of the window, one per passage.
    pub window_edges: Vec<WindowEdge>,
    /// The orbits.
    pub orbits: Vec<OrbitRecord>,
    /// Folds and flips, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loci: Option<Vec<BifurcationsRecord>>,
    /// Orbits of the map that direct simulation does not have.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<LostRecord>,
    /// Itineraries whose branches direct simulation did not all follow.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<String>,
}

/// Periodic orbit.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitRecord {
    /// Itinerary, in digits.
    pub itinerary: String,
    /// Hits at each surface that grazes, and periods, as `(1,3)`.
    pub name: String,
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// Offsets of the first point.
    pub state: Named<f64>,
    /// Offsets of all points.
    pub states: Vec<Vec<f64>>,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers lie inside the unit circle.
    pub stable: bool,
    /// Contacts, in order.
    pub contacts: Vec<ContactRecord>,
    /// Whether the contacts made are those of the itinerary.
    pub physical: bool,
    /// Whether the orbit lies in the window.
    pub inside: bool,
    /// Number of contacts that belong to no passage, by direct simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extra_contacts: Option<usize>,
    /// Number of whole forcing periods beyond one per nominal return, by direct simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turns: Option<i32>,
    /// Closing error of the period, in half-widths of the window.
    pub residual: f64,
}

/// Contact of an orbit.
#[derive(Clone, Debug, Serialize)]
pub struct ContactRecord {
    /// Impact speed; negative on the other branch of the root, for virtual orbits.
    pub speed: f64,
    /// Name of the surface.
    pub surface: String,
    /// Index of the return, from 0.
    #[serde(rename = "return")]
    pub number: usize,
    /// Index of the passage in the return, from 0.
    pub passage: usize,
}

/// Folds or flips of one itinerary.
#[derive(Clone, Debug, Serialize)]
pub struct BifurcationsRecord {
    /// Fold or flip.
    pub kind: BifurcationKind,
    /// Itinerary, in digits.
    pub itinerary: String,
    /// Orbits at the bifurcations.
    pub points: Vec<OrbitRecord>,
}

/// Orbit of the map that direct simulation does not have.
#[derive(Clone, Debug, Serialize)]
pub struct LostRecord {
    /// Itinerary, in digits.
    pub itinerary: String,
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// Behaviour found by direct simulation instead.
    pub reason: String,
}

/// Names for the records of orbits.
struct Names<'a> {
    map: &'a LocalMap,
    itinerary: &'a Itinerary,
    direct: bool,
}

impl OrbitsListing {
    /// Listing of the orbits of a map, or of direct simulation.
    pub fn new(
        section: SectionDocument,
        (map, window, edges): (&LocalMap, &MeasuredWindow, &[WindowEdge]),
        itinerary: &Itinerary,
        found: &Orbits,
        direct: bool,
    ) -> Self {
        let names = Names { map, itinerary, direct };
        let values = map.parameters.iter();
        let loci = found.loci.as_ref();
        Self {
            using: if direct { "direct" } else { "map" },
            section,
            grazing_parameters: Named::new(
                values.map(|parameter| (parameter.name.clone(), parameter.value.to_f64())),
            ),
            passages: map.surfaces.clone(),
            window: window.clone(),
            window_edges: edges.to_vec(),
            orbits: found.orbits.iter().map(|orbit| names.orbit(orbit)).collect(),
            loci: loci.map(|loci| loci.iter().map(|locus| names.locus(locus)).collect()),
            lost: found.lost.iter().map(|lost| names.lost(lost)).collect(),
            unfinished: found.unfinished.iter().map(ToString::to_string).collect(),
        }
    }
}

impl Names<'_> {
    fn parameters(&self, offsets: &[f64]) -> Named<f64> {
        let names = self.map.parameters.iter();
        let names = names.map(|parameter| parameter.name.clone());
        Named::new(names.zip(offsets.iter().copied()))
    }

    fn orbit(&self, orbit: &FoundOrbit) -> OrbitRecord {
        let coordinates = self.map.section.coordinates.iter().cloned();
        let first = orbit.states.first().into_iter().flatten().copied();
        let returns = orbit.itinerary.returns().iter();
        let contacts = orbit.contacts.iter().map(|contact| ContactRecord {
            speed: contact.speed,
            surface: self.map.surfaces[contact.passage].clone(),
            number: contact.number,
            passage: contact.passage,
        });
        let returns = returns.map(|&made| self.itinerary.hits(made));
        let mut name = self.itinerary.name(returns, orbit.turns);
        if let Some(hits) = &orbit.hits {
            name.hits.clone_from(hits);
        }
        OrbitRecord {
            itinerary: orbit.itinerary.to_string(),
            name: name.to_string(),
            parameters: self.parameters(&orbit.parameters),
            state: Named::new(coordinates.zip(first)),
            states: orbit.states.clone(),
            multipliers: orbit.multipliers.clone(),
            stable: orbit.stable,
            contacts: contacts.collect(),
            physical: orbit.physical,
            inside: orbit.inside,
            extra_contacts: self.direct.then_some(orbit.extra_contacts),
            turns: self.direct.then_some(orbit.turns),
            residual: orbit.residual,
        }
    }

    fn locus(&self, locus: &BifurcationLocus) -> BifurcationsRecord {
        BifurcationsRecord {
            kind: locus.kind,
            itinerary: locus.itinerary.to_string(),
            points: locus.points.iter().map(|point| self.orbit(point)).collect(),
        }
    }

    fn lost(&self, lost: &LostOrbit) -> LostRecord {
        let reason = match &lost.reason {
            LostReason::OtherItinerary(made) => {
                format!("the orbit there has the itinerary {made}")
            }
            LostReason::NotConverged => "no orbit was found there".to_owned(),
        };
        LostRecord {
            itinerary: lost.itinerary.to_string(),
            parameters: self.parameters(&lost.parameters),
            reason,
        }
    }
}

/// Warning that the work limit was reached before all branches were followed.
pub(super) fn unfinished_remark(itineraries: &[String]) -> Option<String> {
    (!itineraries.is_empty()).then(|| {
        format!(
            "warning: the work for an itinerary is bounded ({MOST_WORK:e} products of series, some \
             20 s, at each value of other parameters; ten times as many for loci); it was at its \
             end before all was followed for {}: fewer itineraries or values take less",
            itineraries.join(", ")
        )
    })
}

/// Rows of a table.
#[derive(Clone, Copy)]
enum List {
    /// Physical orbits; all orbits if none is physical.
    Physical,
    /// All orbits.
    Orbits,
    /// Points of all loci.
    Loci,
}

/// Orbit of the list (`None`), or of a locus with its kind.
type OrbitRow<'a> = (Option<BifurcationKind>, &'a OrbitRecord);

impl OrbitsListing {
    /// Table of the orbits, for people: one row each, only physical ones if there are any.
    pub fn table(&self) -> Table {
        self.words(List::Physical)
    }

    /// Table of the points of all loci, for people: one row each.
    pub fn loci_table(&self) -> Table {
        self.words(List::Loci)
    }

    /// Table of the orbits with all digits, for programs: one column per number.
    pub fn data_table(&self) -> Table {
        self.numbers(List::Orbits)
    }

    /// Table of the points of all loci with all digits, for programs.
    pub fn loci_data_table(&self) -> Table {
        self.numbers(List::Loci)
    }

    /// Orbits as text.
    pub fn text(&self, scene: &str) -> String {
        let passages = self.passages.iter().map(|name| format!("`{name}`"));
        let mut text = format!(
            "periodic orbits of `{scene}` by {}; offsets on the {}\nitinerary: return by return, 1 \
                where the passage of {} makes contact, 0 where not\n\n{}",
            using_words(self.using),
            self.section.words(),
            passages.collect::<Vec<_>>().join(", then of "),
            self.table().to_text()
        );
        text.push_str(&self.virtual_words());
        if self.loci.is_some() {
            text.push_str(&format!("\nfolds and flips\n\n{}", self.loci_table().to_text()));
        }
        text
    }

    /// Note on virtual orbits.
    fn virtual_words(&self) -> String {
        let count = self.orbits.iter().filter(|orbit| !orbit.physical);
        match (count.count(), self.any_physical()) {
            _ if self.using == "direct" => String::new(),
            (0, _) => String::new(),
            (_, false) => {
                "\nvirtual: on a branch of the root that the map does not take; no orbit is \
                    physical\n"
                    .to_owned()
            }
            (count, true) => format!(
                "\nvirtual orbits, on a branch of the root that the map does not take: {count}; \
                    JSON and CSV have them\n"
            ),
        }
    }

    /// Warnings about orbits outside the window, and about those that direct simulation does not
    /// have.
    pub fn remarks(&self) -> Vec<String> {
        let points = self.loci.iter().flatten().flat_map(|locus| &locus.points);
        let physical = self.orbits.iter().chain(points);
        let physical: Vec<_> = physical.filter(|orbit| orbit.physical).collect();
        let outside = physical.iter().filter(|orbit| !orbit.inside).count();
        let mut remarks = Vec::new();
        if outside > 0 && self.using == "map" {
            remarks.push(format!(
                "warning: {outside} of {} orbits are outside the window, where the map has not \
                    been measured; the method `direct` simulates them",
                physical.len()
            ));
        }
        if !self.orbits.is_empty() && self.orbits.iter().all(|orbit| !orbit.physical) {
            remarks.push(
                "note: all orbits found are virtual: contacts are missing or in excess, and the \
                 oscillator has none of them; the method `direct` finds its own"
                    .to_owned(),
            );
        }
        let lost = self.lost.iter().map(|lost| {
            let parameters = lost.parameters.0.iter();
            let parameters: Vec<String> =
                parameters.map(|(name, value)| format!("{name} = {value:e}")).collect();
            format!(
                "warning: direct simulation has no orbit next to the map's of itinerary {} at {}: \
                    {}",
                lost.itinerary,
                parameters.join(", "),
                lost.reason
            )
        });
        remarks.extend(lost);
        remarks.extend(unfinished_remark(&self.unfinished));
        remarks
    }

    /// Whether any orbit is physical.
    pub fn any_physical(&self) -> bool {
        self.orbits.iter().any(|orbit| orbit.physical)
    }

    fn rows(&self, list: List) -> Vec<OrbitRow<'_>> {
        let loci = self.loci.iter().flatten();
        let points =
            loci.flat_map(|locus| locus.points.iter().map(|point| (Some(locus.kind), point)));
        match list {
            List::Physical => {
                let shown = self.orbits.iter();
                let shown = shown.filter(|orbit| orbit.physical || !self.any_physical());
                shown.map(|orbit| (None, orbit)).collect()
            }
            List::Orbits => self.orbits.iter().map(|orbit| (None, orbit)).collect(),
            List::Loci => points.collect(),
        }
    }

    fn parameter_names(&self) -> impl Iterator<Item = String> {
        self.grazing_parameters.0.iter().map(|(name, _)| name.clone())
    }

    /// Table with the names of the orbits.
    fn named(&self, list: List) -> ByColumn<OrbitRow<'_>> {
        let mut table = Table::of(self.rows(list));
        if matches!(list, List::Loci) {
            table = table.text("kind", |(kind, _)| kind.map_or("", BifurcationKind::word));
        }
        table
            .text("itinerary", |(_, orbit)| &orbit.itinerary)
            .text("name", |(_, orbit)| &orbit.name)
    }

    fn words(&self, list: List) -> Table {
        let located = self.parameter_names().chain(self.section.coordinates.clone());
        self.named(list)
            .numbers(located, 5, |(_, orbit), place| orbit.located(place))
            .text("multipliers", |(_, orbit)| multipliers(&orbit.multipliers))
            .text("orbit", |(kind, orbit)| orbit.kind_words(kind))
            .text("impact speeds", |(_, orbit)| orbit.speeds(4, ", "))
            .text("window", |(_, orbit)| if orbit.inside { "inside" } else { "outside" })
            .made()
    }

    fn numbers(&self, list: List) -> Table {
        let located = self.parameter_names().chain(self.section.coordinates.clone());
        let parts = (1..=self.section.coordinates.len())
            .flat_map(|n| [format!("multiplier_{n}_re"), format!("multiplier_{n}_im")]);
        self.named(list)
            .numbers(located, 12, |(_, orbit), place| orbit.located(place))
            .numbers(parts, 12, |(_, orbit), place| {
                orbit.multipliers.as_flattened().get(place).copied()
            })
            .flag("stable", |(_, orbit)| orbit.stable)
            .flag("physical", |(_, orbit)| orbit.physical)
            .flag("inside", |(_, orbit)| orbit.inside)
            .column(Column::number("extra_contacts"), |(_, orbit)| {
                let extra = orbit.extra_contacts;
                extra.map_or(Cell::Missing, |extra| Cell::Integer(extra as i64))
            })
            .text("speeds", |(_, orbit)| orbit.speeds(16, " "))
            .made()
    }
}

impl OrbitRecord {
    /// Parameter or coordinate, by its place among all.
    fn located(&self, place: usize) -> Option<f64> {
        self.parameters.0.iter().chain(&self.state.0).nth(place).map(|(_, value)| *value)
    }

    /// Impact speeds of the contacts, with this number of decimals.
    pub(super) fn speeds(&self, decimals: usize, between: &str) -> String {
        let speeds = self.contacts.iter();
        let speeds: Vec<_> =
            speeds.map(|contact| format!("{:.decimals$e}", contact.speed)).collect();
        speeds.join(between)
    }

    /// Stability of the orbit, and whether it is physical, as text.
    fn kind_words(&self, kind: Option<BifurcationKind>) -> String {
        let stable = if self.stable { "stable" } else { "unstable" };
        match (self.physical, self.extra_contacts, kind) {
            (true, _, None) => stable.to_owned(),
            (true, _, Some(_)) => "physical".to_owned(),
            (false, Some(extra), _) => format!("{stable}, {extra} more contacts"),
            (false, None, _) => "virtual".to_owned(),
        }
    }
}

/// Multipliers as text: `-2.31, 0.02`, `0.3 ± 0.2i`.
pub(super) fn multipliers(values: &[[f64; 2]]) -> String {
    let shown = |value: f64| Cell::number(value, 4).for_people();
    let pair = |[re, im]: &[f64; 2]| match *im {
        0.0 => Some(shown(*re)),
        im if im > 0.0 => Some(format!("{} ± {}i", shown(*re), shown(im))),
        _ => None,
    };
    values.iter().filter_map(pair).collect::<Vec<_>>().join(", ")
}

/// Method that found the orbits, as text.
pub(super) fn using_words(using: &str) -> &'static str {
    match using {
        "direct" => "direct simulation",
        _ => "the map",
    }
}

/// Description of the search for orbits; `stroboscopic_too` if orbits that do not return to a
/// tangency section can be found on a stroboscopic one.
pub fn orbits_searched(
    map: &LocalMap,
    request: &OrbitsRequest,
    found: &Orbits,
    stroboscopic_too: bool,
) -> String {
    let itineraries = request.itineraries.len();
    let (mut words, beside) = match map.has_contacts() {
        true => (
            format!(
                "the map (itineraries: {itineraries}; depth variables up to twice the window's, \
                 offsets up to a hundred half-widths)"
            ),
            "direct simulation next to the map's orbits, and by itself",
        ),
        false => (
            format!("no map, for there is none (itineraries: {itineraries})"),
            "direct simulation by itself",
        ),
    };
    if let Some(DirectReach { parameter, range: [from, to] }) = found.reach {
        let name = &map.parameters[parameter].name;
        words.push_str(&format!(
            "; {beside} along the branches in {name}, at offsets from {from:.3} to {to:.3}, that \
             begin at the graze or at what it settles on or nearly repeats"
        ));
        if stroboscopic_too {
            words.push_str(
                "; orbits that do not return to the tangency section once in `periods` of the \
                 forcing are found on a stroboscopic one",
            );
        }
    } else if !request.direct {
        words.push_str("; the method `direct` searches far beyond the window");
    }
    words
}
