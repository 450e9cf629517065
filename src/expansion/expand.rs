//! From a scene and its grazing orbit to the local map.

use super::contact_law::ContactLaw;
use super::description::{active_parameters, map_section, map_window, variables};
use super::discontinuity::discontinuity;
use super::impact_speed::{ImpactSpeed, impact_speed};
use super::leg::{LegExpansion, Route};
use super::passage::Passage;
use super::routes::{Routes, grazing_chart};
use super::variables::Variables;
use super::{
    ComposedMap, Contact, DepthSeries, ExpansionError, LeadingLaw, Leg, LocalMap, MapOrders, Stage,
    compose,
};
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// Powers of `y` among which leading laws are looked for.
const LEADING_ORDER: u32 = 8;
/// Powers of `y` from which [`Expander::depth_radius`] is estimated.
pub const RADIUS_ORDER: u32 = 24;

/// Expands the map of one scene about one grazing orbit, at any orders.
///
/// ```
/// use grazemap::expansion::{Expander, MapOrders};
/// use grazemap::model::{Scene, catalogue};
/// use grazemap::orbit::locate;
///
/// let text = catalogue::text("linear").expect("in the catalogue");
/// let scene = Scene::parse(text, "linear.toml")?;
/// let orbit = locate(&scene)?.into_result()?;
/// let expander = Expander::new(&scene, &orbit)?;
/// let map = expander.expand(MapOrders { smooth_order: 3, contact_weight: 4 })?;
/// assert_eq!(map.section.coordinates, ["x", "theta"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Expander<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    passage: Passage,
    variables: Variables,
    routes: Routes,
}

/// The legs of one period with one passage.
#[derive(Clone, Debug)]
pub struct Legs<S: Real = f64> {
    /// From the section to the graze, where they differ.
    pub before: Option<Leg<S>>,
    /// From the graze to the next section point.
    pub after: Leg<S>,
}

impl<'a> Expander<'a> {
    /// Prepares the expansions.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::SeveralPassages`] where the orbit grazes more than once, and
    /// [`ExpansionError::ContactLaw`] where the law of a compliant stop is not analytic at the graze.
    pub fn new(scene: &'a Scene, orbit: &'a GrazingOrbit) -> Result<Self, ExpansionError> {
        if orbit.passages.len() != 1 {
            let passages = orbit.passages.len();
            return Err(ExpansionError::SeveralPassages {
                operation: "this expansion",
                passages,
            });
        }
        let surface = orbit.grazing_point().surface;
        let active = &scene.expansion.active;
        let state = &orbit.grazing_point().state;
        let passage = Passage::new(&scene.model, surface, state, orbit.parameters(), active)?;
        Ok(Self {
            scene,
            orbit,
            passage,
            variables: variables(scene, orbit),
            routes: Routes::of(scene, orbit),
        })
    }

    /// The variables (coordinates; active parameters) with their weights.
    pub fn variables(&self) -> &Variables {
        &self.variables
    }

    /// Largest `y²` of the scene's window.
    pub(super) fn depth_limit(&self) -> f64 {
        self.scene.window.depth
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

    /// A map from parts expanded before: legs by [`legs`](Self::legs), the passage by
    /// [`contact`](Self::contact).
    pub fn assemble(&self, orders: MapOrders, legs: Legs, contact: Contact) -> LocalMap {
        let before = legs.before.map(Stage::Leg).into_iter();
        let rest = [Stage::Contact(contact), Stage::Leg(legs.after)];
        LocalMap {
            scene: self.scene.identifier.clone(),
            digest: self.scene.digest,
            section: map_section(self.scene, self.orbit),
            parameters: active_parameters(self.scene, self.orbit),
            orders,
            stages: before.chain(rest).collect(),
            window: map_window(self.scene, self.orbit),
        }
    }

    /// The discontinuity mapping to a weighted degree, in double precision.
    ///
    /// That of a compliant stop is expanded in double-double and rounded: its coefficients are differences
    /// of terms that grow with the stiffness, and lose up to eight digits at weight 16.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact(&self, weight: u32) -> Result<Contact, ExpansionError> {
        match self.passage.law {
            ContactLaw::Rigid { .. } => self.contact_in::<f64>(weight),
            ContactLaw::Compliant { .. } => Ok(self.contact_in::<Dd>(weight)?.to_f64()),
        }
    }

    /// The discontinuity mapping over any scalar.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact_in<S: Real>(&self, weight: u32) -> Result<Contact<S>, ExpansionError> {
        let chart = grazing_chart(self.orbit);
        let mut contact = discontinuity::<S>(&self.passage, &chart, &self.variables, weight)?;
        if !contact.is_finite() {
            return Err(ExpansionError::NotFinite { part: "D" });
        }
        // The depth vanishes on the grazing orbit: its constant term is rounding.
        contact.depth.coefficients_mut()[0] = S::zero();
        Ok(contact)
    }

    /// The discontinuity mapping along the depth alone, up to a power of `y`: its leading laws and its radius of
    /// convergence.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn depth_series(&self, order: u32) -> Result<DepthSeries, ExpansionError> {
        let chart = grazing_chart(self.orbit);
        DepthSeries::new(&self.passage, &chart, &self.variables, order)
    }

    /// The leading law of each coordinate's correction; `None` where it begins above `y^8`.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn leading_laws(&self) -> Result<Vec<Option<LeadingLaw>>, ExpansionError> {
        let series = self.depth_series(LEADING_ORDER)?;
        let coordinates = 0..self.variables.coordinates;
        Ok(coordinates
            .map(|coordinate| series.leading_law(coordinate))
            .collect())
    }

    /// Estimates the radius of convergence of the discontinuity mapping in `y`; see [`DepthSeries::radius`].
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn depth_radius(&self) -> Result<Option<f64>, ExpansionError> {
        Ok(self.depth_series(RADIUS_ORDER)?.radius())
    }

    /// The speed at which the surface is met, to a weighted degree.
    ///
    /// # Errors
    ///
    /// See [`impact_speed`].
    pub fn impact_speed(&self, weight: u32) -> Result<ImpactSpeed, ExpansionError> {
        impact_speed(
            &self.passage,
            &grazing_chart(self.orbit),
            &self.variables,
            weight,
        )
    }

    /// The legs to a degree.
    ///
    /// # Errors
    ///
    /// See [`LegExpansion::expand`].
    pub fn legs(&self, smooth_order: u32) -> Result<Legs, ExpansionError> {
        let legs = self.leg_expansion();
        self.each_leg(|route| legs.expand(route, smooth_order))
    }

    /// The legs over any scalar, their jets from Taylor's method: slower, and independent of
    /// [`legs`](Self::legs).
    ///
    /// # Errors
    ///
    /// See [`LegExpansion::expand_by_taylor`].
    pub fn legs_by_taylor<S: Real>(&self, smooth_order: u32) -> Result<Legs<S>, ExpansionError> {
        let legs = self.leg_expansion();
        self.each_leg(|route| legs.expand_by_taylor(route, smooth_order))
    }

    fn each_leg<S: Real>(
        &self,
        expand: impl Fn(&Route) -> Result<Leg<S>, ExpansionError>,
    ) -> Result<Legs<S>, ExpansionError> {
        Ok(Legs {
            before: self.routes.before.as_ref().map(&expand).transpose()?,
            after: expand(&self.routes.after)?,
        })
    }

    /// `P_smooth` of the whole period, from section to section.
    ///
    /// # Errors
    ///
    /// See [`LegExpansion::expand`].
    pub fn smooth(&self, smooth_order: u32) -> Result<Leg, ExpansionError> {
        self.leg_expansion()
            .expand(&self.routes.whole, smooth_order)
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
        LegExpansion::new(&self.scene.model, &self.passage, &self.variables)
    }
}
