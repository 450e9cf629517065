//! From a scene and its grazing orbit to the local map.

use super::discontinuity::discontinuity;
use super::leg::LegExpansion;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{DEVIATION_WEIGHT, Variables};
use super::{
    ActiveParameter, ComposedMap, Contact, ExpansionError, Leg, LocalMap, MapOrders, MapSection,
    MapWindow, SectionKind, Stage, compose,
};
use crate::jet::Jet;
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Expands the map of one scene about one grazing orbit, at any orders.
#[derive(Clone, Debug)]
pub struct Expander<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    passage: Passage,
    variables: Variables,
}

impl<'a> Expander<'a> {
    /// Prepares the expansions.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::CompliantSurface`] or [`ExpansionError::SeveralPassages`] where the scene asks for
    /// what rigid single-passage expansions do not cover.
    pub fn new(scene: &'a Scene, orbit: &'a GrazingOrbit) -> Result<Self, ExpansionError> {
        if orbit.passages.len() != 1 {
            let passages = orbit.passages.len();
            return Err(ExpansionError::SeveralPassages {
                operation: "this expansion",
                passages,
            });
        }
        let surface = orbit.grazing_point().surface;
        let passage = Passage::new(
            &scene.model,
            surface,
            orbit.parameters(),
            &scene.expansion.active,
        )?;
        Ok(Self {
            scene,
            orbit,
            passage,
            variables: variables_of(scene, orbit),
        })
    }

    /// The variables (coordinates; active parameters) with their weights.
    pub fn variables(&self) -> &Variables {
        &self.variables
    }

    /// The local map at these orders.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`]: see [`discontinuity`] and [`LegExpansion::expand`].
    pub fn expand(&self, orders: MapOrders) -> Result<LocalMap, ExpansionError> {
        let contact = self.contact(orders.contact_weight)?;
        let legs = self.legs(orders.smooth_order)?;
        Ok(self.assemble(orders, legs, contact))
    }

    /// A map from parts expanded before: legs by [`legs`](Self::legs), the passage by [`contact`](Self::contact).
    pub fn assemble(&self, orders: MapOrders, legs: Legs, contact: Contact) -> LocalMap {
        let before = legs.before.map(Stage::Leg);
        let stages = before
            .into_iter()
            .chain([Stage::Contact(contact), Stage::Leg(legs.after)])
            .collect();
        LocalMap {
            scene: self.scene.identifier.clone(),
            digest: self.scene.digest,
            section: self.map_section(),
            parameters: self.active_parameters(),
            orders,
            stages,
            window: self.window(),
        }
    }

    /// The discontinuity mapping to a weighted degree, in double precision.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact(&self, weight: u32) -> Result<Contact, ExpansionError> {
        self.contact_in::<f64>(weight)
    }

    /// The discontinuity mapping over any scalar, rounded to `f64`.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact_in<S: Real>(&self, weight: u32) -> Result<Contact, ExpansionError> {
        let contact = discontinuity::<S>(
            &self.passage,
            &self.grazing_chart(),
            &self.variables,
            weight,
        )?
        .to_f64();
        let finite = contact
            .linear
            .iter()
            .chain(&contact.quadratic)
            .chain([&contact.depth])
            .all(Jet::is_finite);
        if finite {
            Ok(without_constant_depth(contact))
        } else {
            Err(ExpansionError::NotFinite { part: "D" })
        }
    }

    /// The legs to a degree.
    ///
    /// # Errors
    ///
    /// See [`LegExpansion::expand`].
    pub fn legs(&self, smooth_order: u32) -> Result<Legs, ExpansionError> {
        let legs = self.leg_expansion();
        let (start, graze) = (self.section_chart(), self.grazing_chart());
        let (advance, period) = (self.phase_advance(), self.orbit.period);
        let to_graze = self.advance_to_graze();
        if to_graze == Dd::from(0.0) {
            return Ok(Legs {
                before: None,
                after: legs.expand(&graze, &start, period, advance, smooth_order)?,
            });
        }
        let duration = period * to_graze / advance;
        let wrap = self.section_to_graze_wrap(to_graze);
        let before = legs.expand(&start, &graze, duration, wrap, smooth_order)?;
        let after = legs.expand(
            &graze,
            &start,
            period - duration,
            advance - wrap,
            smooth_order,
        )?;
        Ok(Legs {
            before: Some(before),
            after,
        })
    }

    /// `P_smooth` of the whole period, from section to section.
    ///
    /// # Errors
    ///
    /// See [`LegExpansion::expand`].
    pub fn smooth(&self, smooth_order: u32) -> Result<Leg, ExpansionError> {
        let chart = self.section_chart();
        self.leg_expansion().expand(
            &chart,
            &chart,
            self.orbit.period,
            self.phase_advance(),
            smooth_order,
        )
    }

    /// The composed form of a map.
    ///
    /// # Errors
    ///
    /// See [`compose`].
    pub fn compose(&self, map: &LocalMap) -> Result<ComposedMap, ExpansionError> {
        compose(map, &self.variables)
    }

    fn leg_expansion(&self) -> LegExpansion<'_> {
        let (model, active) = (&self.scene.model, &self.scene.expansion.active);
        LegExpansion::new(
            model,
            &self.passage,
            &self.variables,
            self.orbit.parameters(),
            active,
        )
    }

    /// The chart in which the contact happens: the section itself, at the phase of the graze.
    fn grazing_chart(&self) -> SectionChart {
        SectionChart {
            section: self.orbit.section.clone(),
            point: self.orbit.grazing_point().state.clone(),
        }
    }

    fn section_chart(&self) -> SectionChart {
        SectionChart {
            section: self.orbit.section.clone(),
            point: self.orbit.section_point.clone(),
        }
    }

    /// Advance of the phase over one period of the orbit; 0 for an autonomous system.
    fn phase_advance(&self) -> Dd {
        let periods = Dd::from(self.scene.grazing.periods as f64);
        self.scene
            .model
            .phase
            .as_ref()
            .map_or(Dd::from(0.0), |phase| phase.period * periods)
    }

    /// Advance of the phase from the section to the graze, in `[0, period)`; 0 on a tangency section.
    fn advance_to_graze(&self) -> Dd {
        let (PoincareSectionKind::Stroboscopic { phase }, Some(clock)) =
            (self.orbit.section.kind, &self.scene.model.phase)
        else {
            return Dd::from(0.0);
        };
        let graze = self.orbit.grazing_point().state[self.scene.model.dimension() - 1];
        let difference = graze - phase;
        if difference < Dd::from(0.0) {
            difference + clock.period
        } else {
            difference
        }
    }

    /// What remains of the advance to the graze once the difference of the charts' phases is taken off:
    /// 0, or one period where the graze lies across the phase's origin.
    fn section_to_graze_wrap(&self, to_graze: Dd) -> Dd {
        let phase = self.scene.model.dimension() - 1;
        to_graze - (self.orbit.grazing_point().state[phase] - self.orbit.section_point[phase])
    }

    fn map_section(&self) -> MapSection {
        let section = &self.orbit.section;
        let (kind, phase) = match section.kind {
            PoincareSectionKind::Tangency => (SectionKind::Tangency, None),
            PoincareSectionKind::Stroboscopic { phase } => (SectionKind::Stroboscopic, Some(phase)),
        };
        let coordinates = section
            .coordinate_names(&self.scene.model)
            .into_iter()
            .map(str::to_owned)
            .collect();
        let point = section
            .coordinates
            .iter()
            .map(|&component| self.orbit.section_point[component])
            .collect();
        MapSection {
            kind,
            coordinates,
            point,
            phase,
        }
    }

    fn active_parameters(&self) -> Vec<ActiveParameter> {
        let active = |&parameter: &usize| ActiveParameter {
            name: self.scene.model.parameters[parameter].name.clone(),
            value: self.orbit.parameters()[parameter],
        };
        self.scene.expansion.active.iter().map(active).collect()
    }

    fn window(&self) -> MapWindow {
        let window = &self.scene.window;
        MapWindow {
            depth: window.depth,
            state: self
                .orbit
                .section
                .coordinates
                .iter()
                .map(|&component| window.state[component])
                .collect(),
            parameter: self
                .scene
                .expansion
                .active
                .iter()
                .map(|&parameter| window.parameter[parameter])
                .collect(),
        }
    }
}

/// The legs of one period with one passage.
#[derive(Clone, Debug)]
pub struct Legs {
    /// From the section to the graze, where they differ.
    pub before: Option<Leg>,
    /// From the graze to the next section point.
    pub after: Leg,
}

/// The depth vanishes on the grazing orbit: its constant term is rounding.
fn without_constant_depth(mut contact: Contact) -> Contact {
    contact.depth.coefficients_mut()[0] = 0.0;
    contact
}

fn variables_of(scene: &Scene, orbit: &GrazingOrbit) -> Variables {
    let coordinates = orbit.section.coordinate_names(&scene.model);
    let parameters = scene
        .expansion
        .active
        .iter()
        .map(|&parameter| scene.model.parameters[parameter].name.as_str());
    let names: Vec<String> = coordinates
        .iter()
        .copied()
        .chain(parameters)
        .map(str::to_owned)
        .collect();
    let weight = |name: &String| {
        let given = scene
            .expansion
            .weights
            .iter()
            .find(|(other, _)| other == name);
        given.map_or(DEVIATION_WEIGHT, |(_, weight)| *weight)
    };
    Variables {
        weights: names.iter().map(weight).collect(),
        coordinates: coordinates.len(),
        names,
    }
}
