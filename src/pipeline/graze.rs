//! Scene with its grazing orbit, and the section of its map.

use std::sync::Arc;

use super::{Error, Map, Plan};
use crate::analysis::Progress;
use crate::convergence::{
    Choice, ConvergenceOptions, ConvergenceStudy, SectionVerdict, choose_orders, converge,
    settle_section,
};
use crate::expansion::{Expander, WindowEdge, lacks_release};
use crate::model::{Orders, Scene, SectionRule, nearest};
use crate::orbit::{GrazeTheory, GrazingOrbit, graze_theory, locate};
use crate::report::SectionDocument;

/// First step of the pipeline: from a scene to its grazing orbit.
pub trait FindGraze {
    /// Finds the grazing orbit of the scene.
    ///
    /// The orbit is one of the free flow. An orbit that passes through a surface
    /// ([`GrazingOrbit::physical`]) has no theory and no map; it is only the origin of offsets for
    /// direct simulation.
    ///
    /// # Errors
    ///
    /// [`Error::Orbit`] for a scene that contradicts itself, [`Error::NotLocated`] if the search
    /// finds no orbit.
    fn graze(self) -> Result<Graze, Error>;
}

impl FindGraze for Scene {
    fn graze(self) -> Result<Graze, Error> {
        let orbit = locate(&self)?.into_result()?;
        Ok(Graze::new(self, orbit))
    }
}

/// Scene with its grazing orbit.
#[derive(Clone, Debug)]
pub struct Graze {
    scene: Arc<Scene>,
    orbit: Arc<GrazingOrbit>,
}

impl Graze {
    /// Scene and the orbit located for it.
    pub(super) fn new(scene: Scene, orbit: GrazingOrbit) -> Self {
        Self { scene: Arc::new(scene), orbit: Arc::new(orbit) }
    }

    /// Scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Grazing orbit of the scene.
    pub fn orbit(&self) -> &GrazingOrbit {
        &self.orbit
    }

    /// Theory of the graze: multipliers, `xi_n`, and the bifurcation that they predict.
    ///
    /// # Errors
    ///
    /// [`Error::NotLocated`] if the orbit passes through a surface; [`Error::Orbit`] if its flow
    /// cannot be computed.
    pub fn theory(&self) -> Result<GrazeTheory, Error> {
        self.orbit.physical(&self.scene)?;
        let theory = graze_theory(&self.scene, &self.orbit)?;
        Ok(match lacks_release(&self.scene, &self.orbit) {
            true => theory.without_release(),
            false => theory,
        })
    }

    /// Value of a parameter at which the orbit grazes.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchParameter`] for a name that is no parameter.
    pub fn parameter(&self, name: &str) -> Result<f64, Error> {
        let number = parameter_number(&self.scene, name)?;
        Ok(self.orbit.parameters()[number].to_f64())
    }

    /// Chooses the section of the map: the one that the scene names or, if any is allowed, the one
    /// whose map meets the tolerance at the lowest cost. An orbit that passes through a surface has
    /// no map; if any section is allowed, it stays on its tangency section.
    ///
    /// # Errors
    ///
    /// [`Error::Convergence`] if the scene cannot be expanded, or its window has no points.
    pub fn settle(&self) -> Result<Settled, Error> {
        if self.orbit.physical(&self.scene).is_err() {
            let mut scene = (*self.scene).clone();
            scene.section_rule = SectionRule::Named;
            let graze = Self { scene: Arc::new(scene), orbit: self.orbit.clone() };
            return Ok(Settled { graze, verdict: None });
        }
        let settled = settle_section(&self.scene, &self.orbit)?;
        Ok(Settled {
            graze: Graze::new(settled.scene, settled.orbit),
            verdict: settled.verdict.map(Arc::new),
        })
    }

    /// Local map. Section, orders and shape are those that the scene names, or the cheapest that
    /// meet its tolerance.
    ///
    /// # Errors
    ///
    /// As [`settle`](Self::settle), [`Settled::plan`] and [`Plan::expand`].
    pub fn map(&self) -> Result<Map, Error> {
        self.settle()?.plan()?.expand()
    }
}

/// Index of a parameter of the scene, by name.
///
/// # Errors
///
/// [`Error::NoSuchParameter`] for a name that is no parameter.
pub fn parameter_number(scene: &Scene, name: &str) -> Result<usize, Error> {
    let names = scene.model.parameters.iter();
    let mut names = names.map(|parameter| parameter.name.as_str());
    let found = names.clone().position(|known| known == name);
    found.ok_or_else(|| Error::NoSuchParameter {
        name: name.to_owned(),
        nearest: nearest(name, &mut names),
    })
}

/// Scene with its grazing orbit, on the section of its map.
#[derive(Clone, Debug)]
pub struct Settled {
    pub(super) graze: Graze,
    pub(super) verdict: Option<Arc<SectionVerdict>>,
}

/// Settings of a convergence study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyRequest {
    /// Number of new points at which the chosen map is compared with direct simulation.
    pub fresh: usize,
    /// Whether maps on other sections are chosen too.
    pub sections: bool,
    /// Map chosen for the scene's tolerance with this number of new points, if known.
    pub chosen: Option<Choice>,
}

impl StudyRequest {
    /// Default number of new points.
    pub const FRESH: usize = 1000;
}

impl Settled {
    /// Scene with its section named and its window stated on that section.
    pub fn scene(&self) -> &Scene {
        self.graze.scene()
    }

    /// Grazing orbit on that section.
    pub fn orbit(&self) -> &GrazingOrbit {
        self.graze.orbit()
    }

    /// Scene with its orbit.
    pub fn graze(&self) -> &Graze {
        &self.graze
    }

    /// Section, with the reason for its choice.
    pub fn section(&self) -> SectionDocument {
        let verdict = self.verdict.as_deref();
        SectionDocument::new(self.scene(), self.orbit(), verdict)
    }

    /// Plan of the map: the orders that the scene names, or the cheapest orders that meet its
    /// tolerance.
    ///
    /// # Errors
    ///
    /// [`Error::ToleranceNotMet`]; [`Error::Convergence`] if the scene cannot be expanded.
    pub fn plan(self) -> Result<Plan, Error> {
        let tolerance = match self.scene().expansion.orders {
            Orders::Fixed(orders) => return Ok(Plan::new(self, orders, None)),
            Orders::Tolerance(tolerance) => tolerance,
        };
        let taken = self.verdict.as_ref();
        let choice = match taken.and_then(|verdict| verdict.taken.choice.as_ref()) {
            Some(choice) => choice.clone(),
            None => choose_orders(self.scene(), self.orbit(), tolerance)?,
        };
        if !choice.met {
            return Err(Error::ToleranceNotMet {
                tolerance,
                orders: choice.orders,
                error: choice.fresh_error.or(choice.error),
                precision: choice.precision,
                limit: choice.limit,
            });
        }
        Ok(Plan::new(self, choice.orders, Some(choice)))
    }

    /// Compares maps of all pairs of orders with direct simulation.
    ///
    /// # Errors
    ///
    /// [`Error::Convergence`] if the scene cannot be expanded, or its window has no point to
    /// compare at.
    pub fn study(
        &self,
        request: &StudyRequest,
        progress: &dyn Progress,
    ) -> Result<ConvergenceStudy, Error> {
        let options = ConvergenceOptions {
            fresh: request.fresh,
            sections: request.sections && self.verdict.is_none(),
            chosen: request.chosen.clone(),
            ..ConvergenceOptions::of(self.scene())
        };
        let mut study = converge(self.scene(), self.orbit(), &options, progress)?;
        if let Some(verdict) = self.verdict.as_ref().filter(|_| request.sections) {
            study.sections = verdict.others.clone();
        }
        Ok(study)
    }

    /// Share that truncation at a contact weight omits at the edge of the window, one per passage;
    /// no entry for a passage whose series terminates.
    ///
    /// # Errors
    ///
    /// [`Error::Expansion`] if a contact cannot be expanded.
    pub fn window_edges(&self, contact_weight: u32) -> Result<Vec<WindowEdge>, Error> {
        let expander = Expander::new(self.scene(), self.orbit())?;
        let edges = (0..expander.passages())
            .map(|passage| expander.window_edge(passage, contact_weight))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(edges.into_iter().flatten().collect())
    }
}
