//! Periodic orbits by itinerary as data: the fields of `orbits --json`.

use serde::Serialize;

use super::{Named, SectionDocument};
use crate::analysis::orbits::{FoundOrbit, Locus, LostOrbit, LostReason, Orbits};
use crate::analysis::periodic::BifurcationKind;
use crate::expansion::{LocalMap, WindowEdge};
use crate::iteration::Itinerary;

/// Periodic orbits, ready to be written as JSON; everything in offsets.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitsListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return: what the digits of an itinerary stand for.
    pub passages: Vec<String>,
    /// What the contacts of the map leave out at the edge of the window, by passage.
    pub window_edges: Vec<WindowEdge>,
    /// The orbits.
    pub orbits: Vec<OrbitRecord>,
    /// Folds and flips, where asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loci: Option<Vec<LocusRecord>>,
    /// Orbits of the map for which direct simulation has none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<LostRecord>,
}

/// A periodic orbit.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitRecord {
    /// Its itinerary, in digits.
    pub itinerary: String,
    /// Hits at each surface that grazes and periods, as `(1,3)`.
    pub name: String,
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// Offsets of its first point.
    pub state: Named<f64>,
    /// Offsets of all its points.
    pub states: Vec<Vec<f64>>,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all of them lie inside the unit circle.
    pub stable: bool,
    /// Its contacts, in order.
    pub contacts: Vec<ContactRecord>,
    /// Whether the contacts made are those of the itinerary.
    pub physical: bool,
    /// Whether it lies in the window.
    pub inside: bool,
    /// Contacts that no passage accounts for, by direct simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extra_contacts: Option<usize>,
    /// By how much the period does not close, in half-widths of the window.
    pub residual: f64,
}

/// A contact of an orbit.
#[derive(Clone, Debug, Serialize)]
pub struct ContactRecord {
    /// Speed at which the surface is met; negative on the other branch of the root, of virtual
    /// orbits.
    pub speed: f64,
    /// Name of the surface.
    pub surface: String,
    /// The return, from 0.
    #[serde(rename = "return")]
    pub number: usize,
    /// The passage of the return, from 0.
    pub passage: usize,
}

/// Folds or flips of one itinerary.
#[derive(Clone, Debug, Serialize)]
pub struct LocusRecord {
    /// Fold or flip.
    pub kind: BifurcationKind,
    /// The itinerary, in digits.
    pub itinerary: String,
    /// The orbits there.
    pub points: Vec<OrbitRecord>,
}

/// An orbit that direct simulation has not.
#[derive(Clone, Debug, Serialize)]
pub struct LostRecord {
    /// Its itinerary, in digits.
    pub itinerary: String,
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// What is there instead.
    pub reason: String,
}

/// What orbits are written with: the names of a map.
struct Names<'a> {
    map: &'a LocalMap,
    itinerary: &'a Itinerary,
    direct: bool,
}

impl OrbitsListing {
    /// The orbits of a map, or of direct simulation beside it.
    pub fn new(
        section: SectionDocument,
        (map, edges): (&LocalMap, &[WindowEdge]),
        itinerary: &Itinerary,
        found: &Orbits,
        direct: bool,
    ) -> Self {
        let names = Names {
            map,
            itinerary,
            direct,
        };
        let values = map.parameters.iter();
        let loci = found.loci.as_ref();
        Self {
            using: if direct { "direct" } else { "map" },
            section,
            grazing_parameters: Named::new(
                values.map(|parameter| (parameter.name.clone(), parameter.value.to_f64())),
            ),
            passages: map.surfaces.clone(),
            window_edges: edges.to_vec(),
            orbits: found
                .orbits
                .iter()
                .map(|orbit| names.orbit(orbit))
                .collect(),
            loci: loci.map(|loci| loci.iter().map(|locus| names.locus(locus)).collect()),
            lost: found.lost.iter().map(|lost| names.lost(lost)).collect(),
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
        OrbitRecord {
            itinerary: orbit.itinerary.to_string(),
            name: self
                .itinerary
                .name(returns.map(|&made| self.itinerary.hits(made)))
                .to_string(),
            parameters: self.parameters(&orbit.parameters),
            state: Named::new(coordinates.zip(first)),
            states: orbit.states.clone(),
            multipliers: orbit.multipliers.clone(),
            stable: orbit.stable,
            contacts: contacts.collect(),
            physical: orbit.physical,
            inside: orbit.inside,
            extra_contacts: self.direct.then_some(orbit.extra_contacts),
            residual: orbit.residual,
        }
    }

    fn locus(&self, locus: &Locus) -> LocusRecord {
        LocusRecord {
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
            LostReason::NotBracketed => {
                "it does not lie between the map's neighbours of it".to_owned()
            }
        };
        LostRecord {
            itinerary: lost.itinerary.to_string(),
            parameters: self.parameters(&lost.parameters),
            reason,
        }
    }
}
