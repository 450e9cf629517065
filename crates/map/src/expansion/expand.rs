//! Expansion of the local map of a scene about its grazing orbit, contact by contact and leg by
//! leg.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::approach::time_of_minimum;
use super::composition::{ComposedMap, compose};
use super::depth_series::{DepthSeries, LeadingLaw, WindowEdge};
use super::discontinuity::{ImpactSpeed, discontinuity, impact_speed};
use super::error::ExpansionError;
use super::flown::FlownContact;
use super::flown::{FlightWindow, flown_contact};
use super::local_map::{Contact, Leg, LocalMap, Stage, active_parameters, map_section, map_window};
use super::passage::ContactLaw;
use super::pruning::{Sizes, without_rounding};
use super::routes::{Graze, Route, Routes};
use super::variables::{DEVIATION_WEIGHT, Variables};
use crate::flow::{
    Field, FlowError, Program, bound_but, evaluate, jet_transport, jet_transport_taylor,
    local_series,
};
use crate::jet::{Jet, JetSpace};
use crate::model::{MapOrders, Scene};
use crate::numeric::{Dd, Real, Scalar};
use crate::orbit::{FlowEvent, GrazingOrbit, PiecewiseFlow, PoincareSectionKind};

/// Highest power of `y` at which a leading law is looked for.
const LEADING_ORDER: u32 = 8;
/// Highest power of `y` used to estimate [`Expander::depth_radius`].
pub const RADIUS_ORDER: u32 = 24;

/// Relative accuracy of the jets of the flow.
const TOLERANCE: f64 = 1e-15;
/// Largest offset by which an orbit may miss its own section point, relative to its size.
const LARGEST_DEFECT: f64 = 1e-9;

/// Expands the map of a scene about a grazing orbit, at any orders.
///
/// ```
/// use grazemap_map::expansion::{Expander, MapOrders};
/// use grazemap_map::model::Scene;
/// use grazemap_map::orbit::locate;
///
/// let scene = Scene::of_catalogue("linear")?;
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
    grazes: Vec<Graze>,
    routes: Routes,
    /// Rate of the model's phase, as a program over jets.
    rate: Option<Program>,
    /// Flow of an orbit with hits, its inactive parameters folded in.
    flow: Option<PiecewiseFlow>,
}

/// Legs of one period, as polynomials.
#[derive(Clone, Debug)]
pub struct Legs<S: Real = f64> {
    /// Leg from the section to the first graze; `None` if the section is at that graze.
    pub before: Option<Leg<S>>,
    /// Legs from each graze to the next, and from the last to the next section point.
    pub after: Vec<Leg<S>>,
}

impl<'a> Expander<'a> {
    /// Prepares the expansions.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::NotAnOrbit`] if the orbit passes through a surface;
    /// [`ExpansionError::ContactLaw`] if the law of a compliant stop is not analytic at its graze.
    pub fn new(scene: &'a Scene, orbit: &'a GrazingOrbit) -> Result<Self, ExpansionError> {
        orbit.physical(scene)?;
        Self::of_free_flow(scene, orbit)
    }

    /// Prepares the expansions for an orbit that may pass through a surface. Legs are those of the
    /// free flow; a map with contacts does not describe the oscillator.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::ContactLaw`] as [`new`](Self::new).
    pub fn of_free_flow(scene: &'a Scene, orbit: &'a GrazingOrbit) -> Result<Self, ExpansionError> {
        let routes = Routes::of(scene, orbit);
        let grazes = routes.passages.iter();
        let grazes = grazes.map(|&number| Graze::new(scene, orbit, number));
        let grazes: Vec<_> = grazes.collect::<Result<_, _>>()?;
        let clock = scene.model.phase.as_ref().zip(grazes.first());
        let rate =
            clock.map(|(phase, graze)| graze.passage.jet_program(&scene.model, &[phase.rate]));
        let kinds = bound_but(&scene.expansion.active, orbit.parameters());
        let hits = !orbit.hits.is_empty();
        let flow = hits.then(|| PiecewiseFlow::new(scene, &[], &kinds));
        Ok(Self { scene, orbit, grazes, routes, rate, flow })
    }

    /// Number of grazing passages in a period.
    pub fn passages(&self) -> usize {
        self.grazes.len()
    }

    /// Variables (coordinates of the section; active parameters) with their weights.
    pub fn variables(&self) -> &Variables {
        self.variables_at(self.section_passage())
    }

    /// Number, counted from the section, of the passage that the scene names first; a tangency
    /// section is at this passage.
    pub fn section_passage(&self) -> usize {
        self.routes.whole.from.passage
    }

    /// Variables (coordinates; active parameters) in which a passage is expanded.
    ///
    /// On a stroboscopic section they are the section's; on tangency sections each passage
    /// eliminates its own component.
    ///
    /// # Panics
    ///
    /// If `passage` is not below [`passages`](Self::passages); the same holds for every method that
    /// takes a passage.
    pub fn variables_at(&self, passage: usize) -> &Variables {
        &self.grazes[passage].variables
    }

    /// Size of each variable of a passage: for states their common size, or `h'' (T/2π)²` if that
    /// is larger; for a parameter its value; 1 for a phase and for a size of 0.
    pub(super) fn units(&self, passage: usize) -> Vec<f64> {
        let Graze { chart, .. } = &self.grazes[passage];
        let states = self.scene.model.states.len();
        let size = |value: f64| if value > 0.0 { value } else { 1.0 };
        let lengths = chart.point[..states].iter().map(|value| value.to_f64().abs());
        let length = size(lengths.fold(self.depth_unit(passage), f64::max));
        let coordinates = chart.section.coordinates.iter();
        let coordinates = coordinates.map(|&at| if at < states { length } else { 1.0 });
        let parameters = self.scene.expansion.active.iter();
        let parameters = parameters.map(|&at| size(self.orbit.parameters()[at].to_f64().abs()));
        coordinates.chain(parameters).collect()
    }

    /// Unit of the depth `y²` of a passage: `h'' (T/2π)²`.
    pub(super) fn depth_unit(&self, passage: usize) -> f64 {
        let acceleration = self.orbit.passages[self.routes.passages[passage]].normal_acceleration;
        let time = self.orbit.period.to_f64() / TAU;
        acceleration.to_f64() * time * time
    }

    /// Expands the local map at given orders.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`]: see [`discontinuity`] and [`legs`](Self::legs).
    pub fn expand(&self, orders: MapOrders) -> Result<LocalMap, ExpansionError> {
        let contacts = self.contacts(orders.contact_weight)?;
        let legs = self.legs(orders.smooth_order)?;
        Ok(self.assemble(orders, legs, contacts))
    }

    /// Expands the local map with every compliant contact flown exactly: uniform in stiffness and
    /// damping, and more expensive per step. Passages of rigid stops remain series.
    ///
    /// The error of a flown passage is of weight `contact_weight + 1`, with the constants of the
    /// free flow.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Flight`] if a law is not affine or a contact of the window is not flown to
    /// rounding; [`ExpansionError::NothingToFly`] without a compliant stop; otherwise as
    /// [`expand`](Self::expand).
    pub fn flown(&self, orders: MapOrders) -> Result<LocalMap, ExpansionError> {
        let passages = self.flown_passages(orders.contact_weight)?;
        Ok(self.assemble_stages(orders, self.legs(orders.smooth_order)?, passages))
    }

    /// Passages of [`flown`](Self::flown), as stages.
    ///
    /// # Errors
    ///
    /// As [`flown`](Self::flown).
    pub fn flown_passages(&self, weight: u32) -> Result<Vec<Stage>, ExpansionError> {
        let passages = 0..self.passages();
        let stages: Vec<_> = passages
            .map(|passage| match self.flown_contact(passage, weight)? {
                Some(flown) => Ok(Stage::Flown(Box::new(flown))),
                None => Ok(Stage::Contact(self.contact(passage, weight)?)),
            })
            .collect::<Result<_, ExpansionError>>()?;
        if stages.iter().any(|stage| matches!(stage, Stage::Flown(_))) {
            Ok(stages)
        } else {
            Err(ExpansionError::NothingToFly)
        }
    }

    /// Flown contact of a passage; `None` for a rigid stop.
    ///
    /// # Errors
    ///
    /// As [`flown`](Self::flown).
    pub fn flown_contact(
        &self,
        passage: usize,
        weight: u32,
    ) -> Result<Option<FlownContact>, ExpansionError> {
        flown_contact(&self.grazes[passage], weight, &self.flight_window(passage))
    }

    /// Window in the variables of a passage. For coordinates other than the section's it is not
    /// known; they are assumed to be as large as a contact makes them.
    fn flight_window(&self, passage: usize) -> FlightWindow {
        let window = map_window(self.scene, self.orbit);
        let reach = window.depth.sqrt();
        let finite = |width: f64| if width.is_finite() { width } else { reach };
        let own = passage == self.section_passage();
        let coordinates = window.state.iter();
        let coordinates = coordinates.map(|&width| if own { finite(width) } else { reach });
        let parameters = window.parameter.iter().map(|&width| finite(width));
        FlightWindow { depth: window.depth, half_widths: coordinates.chain(parameters).collect() }
    }

    /// Assembles a map from legs by [`legs`](Self::legs) and passages by
    /// [`contacts`](Self::contacts).
    pub fn assemble(&self, orders: MapOrders, legs: Legs, contacts: Vec<Contact>) -> LocalMap {
        let passages = contacts.into_iter().map(Stage::Contact);
        self.assemble_stages(orders, legs, passages.collect())
    }

    /// Assembles a map from legs and passages of either kind.
    pub fn assemble_stages(&self, orders: MapOrders, legs: Legs, passages: Vec<Stage>) -> LocalMap {
        let before = legs.before.map(Stage::Leg).into_iter();
        let rest = passages.into_iter().zip(legs.after);
        let rest = rest.flat_map(|(passage, leg)| [passage, Stage::Leg(leg)]);
        LocalMap {
            scene: self.scene.identifier.clone(),
            digest: self.scene.digest,
            section: map_section(self.scene, self.orbit),
            parameters: active_parameters(self.scene, self.orbit),
            orders,
            surfaces: self.surfaces(),
            stages: before.chain(rest).collect(),
            window: map_window(self.scene, self.orbit),
            fitted_to: None,
        }
    }

    /// Name of the surface of each passage, in the order in which the passages follow the section.
    pub fn surfaces(&self) -> Vec<String> {
        let names = self.grazes.iter().map(|graze| &graze.passage.surface);
        names.cloned().collect()
    }

    /// Discontinuity mappings of all passages to a weight, in double precision.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contacts(&self, weight: u32) -> Result<Vec<Contact>, ExpansionError> {
        (0..self.passages()).map(|passage| self.contact(passage, weight)).collect()
    }

    /// Discontinuity mapping of a passage to a weight, in double precision.
    ///
    /// For a compliant stop it is expanded in double-double and rounded, because coefficients are
    /// differences of terms that grow with the stiffness and lose up to eight digits at weight 16.
    /// Coefficients at the rounding of double-double are set to 0: less than 1e-28 of the largest
    /// coefficient of their monomial, or of that times one variable, in any correction, with all
    /// variables scaled by their sizes (that of the states, of each parameter, `h'' (T/2π)²` for
    /// the depth).
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact(&self, passage: usize, weight: u32) -> Result<Contact, ExpansionError> {
        match self.grazes[passage].passage.law {
            ContactLaw::Rigid { .. } => self.contact_in::<f64>(passage, weight),
            ContactLaw::Compliant { .. } | ContactLaw::Powers(_) => {
                let contact = self.contact_in::<Dd>(passage, weight)?;
                let sizes = Sizes {
                    depth: self.depth_unit(passage).sqrt(),
                    variables: self.units(passage),
                };
                Ok(without_rounding(contact, &sizes).to_f64())
            }
        }
    }

    /// Discontinuity mapping of a passage over any scalar.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn contact_in<S: Real>(
        &self,
        passage: usize,
        weight: u32,
    ) -> Result<Contact<S>, ExpansionError> {
        let contact = discontinuity::<S>(&self.grazes[passage], weight)?;
        if !contact.is_finite() {
            return Err(ExpansionError::NotFinite { part: "D" });
        }
        Ok(contact)
    }

    /// Discontinuity mapping of a passage along the depth only, up to a power of `y`; it gives
    /// leading laws and the radius of convergence.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn depth_series(&self, passage: usize, order: u32) -> Result<DepthSeries, ExpansionError> {
        DepthSeries::new(&self.grazes[passage], order)
    }

    /// Leading law of each coordinate's correction in a passage; `None` if it begins above `y^8`.
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn leading_laws(&self, passage: usize) -> Result<Vec<Option<LeadingLaw>>, ExpansionError> {
        let series = self.depth_series(passage, LEADING_ORDER)?;
        let coordinates = 0..self.variables_at(passage).coordinates;
        Ok(coordinates.map(|coordinate| series.leading_law(coordinate)).collect())
    }

    /// Radius of convergence of a passage's mapping in `y`, estimated; see [`DepthSeries::radius`].
    ///
    /// # Errors
    ///
    /// See [`discontinuity`].
    pub fn depth_radius(&self, passage: usize) -> Result<Option<f64>, ExpansionError> {
        Ok(self.depth_series(passage, RADIUS_ORDER)?.radius())
    }

    /// Speed at which the surface of a passage is met, to a weight.
    ///
    /// # Errors
    ///
    /// See [`impact_speed`].
    pub fn impact_speed(&self, passage: usize, weight: u32) -> Result<ImpactSpeed, ExpansionError> {
        impact_speed(&self.grazes[passage], weight)
    }

    /// Expands the legs to an order; jets of the flow come from collocation, order by order.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] if the flow fails, a space is too large, or the orbit misses the section
    /// at the far end of a leg.
    pub fn legs(&self, smooth_order: u32) -> Result<Legs, ExpansionError> {
        self.each_leg(smooth_order, |leg| leg.by_collocation())
    }

    /// Expands the legs over any scalar with jets from Taylor's method: slower than
    /// [`legs`](Self::legs), and independent of it.
    ///
    /// # Errors
    ///
    /// As [`legs`](Self::legs).
    pub fn legs_by_taylor<S: Real>(&self, smooth_order: u32) -> Result<Legs<S>, ExpansionError> {
        self.each_leg(smooth_order, |leg| leg.by_taylor())
    }

    /// Products of series in a step of the free field.
    pub(super) fn products_of_step(&self) -> usize {
        self.grazes[0].passage.field.time_program().products()
    }

    /// Map `P_smooth` of the whole period, from section to section.
    ///
    /// # Errors
    ///
    /// As [`legs`](Self::legs).
    pub fn smooth(&self, smooth_order: u32) -> Result<Leg, ExpansionError> {
        self.flight(&self.routes.whole, smooth_order)?.by_collocation()
    }

    fn each_leg<S: Real>(
        &self,
        smooth_order: u32,
        expand: impl Fn(&LegFlight<'_>) -> Result<Leg<S>, ExpansionError>,
    ) -> Result<Legs<S>, ExpansionError> {
        let leg = |route| expand(&self.flight(route, smooth_order)?);
        Ok(Legs {
            before: self.routes.before.as_ref().map(leg).transpose()?,
            after: self.routes.after.iter().map(leg).collect::<Result<_, _>>()?,
        })
    }

    fn flight<'f>(
        &'f self,
        route: &'f Route,
        smooth_order: u32,
    ) -> Result<LegFlight<'f>, ExpansionError> {
        let variables = &self.grazes[route.from.passage].variables;
        let start = &route.from.chart.point;
        let through = self.flow.as_ref().map(|flow| -> Result<_, ExpansionError> {
            Ok((flow, flow.events(start, self.orbit.parameters(), route.duration)?))
        });
        let through = through.transpose()?.filter(|(_, events)| !events.is_empty());
        Ok(LegFlight {
            expander: self,
            route,
            through,
            space: variables.smooth_space(DEVIATION_WEIGHT * smooth_order)?,
        })
    }

    /// Part of the contact of a passage that truncation at a weight omits at the edge of the
    /// scene's window; see [`WindowEdge::new`].
    ///
    /// # Errors
    ///
    /// As [`depth_series`](Self::depth_series), from which it is estimated.
    pub fn window_edge(
        &self,
        passage: usize,
        contact_weight: u32,
    ) -> Result<Option<WindowEdge>, ExpansionError> {
        let series = self.depth_series(passage, RADIUS_ORDER)?;
        Ok(WindowEdge::new(&series, self.scene.window.assumed_depth(), contact_weight))
    }

    /// Composed form of a map.
    ///
    /// # Errors
    ///
    /// See [`compose`].
    pub fn compose(&self, map: &LocalMap) -> Result<ComposedMap, ExpansionError> {
        compose(map, self.variables())
    }
}

/// Expansion of one leg.
struct LegFlight<'a> {
    expander: &'a Expander<'a>,
    route: &'a Route,
    /// Flow through the hits on the way, with these and the ends of contacts; `None` without a hit.
    through: Option<(&'a PiecewiseFlow, Vec<FlowEvent<Dd>>)>,
    /// Space of (coordinates; parameters) at the near end.
    space: Arc<JetSpace>,
}

impl LegFlight<'_> {
    /// The leg with jets from collocation, order by order.
    fn by_collocation(&self) -> Result<Leg, ExpansionError> {
        self.expand(|field, start, parameters, duration| {
            Ok(jet_transport(field, start, parameters, duration, TOLERANCE)?.image)
        })
    }

    /// The leg over any scalar, with jets from Taylor's method.
    fn by_taylor<S: Real>(&self) -> Result<Leg<S>, ExpansionError> {
        self.expand(jet_transport_taylor)
    }

    fn expand<S: Real>(
        &self,
        fly: impl Fn(&Field, &[Jet<S>], &[Jet<S>], S) -> Result<Vec<Jet<S>>, FlowError>,
    ) -> Result<Leg<S>, ExpansionError> {
        let Graze { passage, variables, .. } = &self.expander.grazes[self.route.from.passage];
        let start = self.route.from.chart.embed(passage, &self.space, 0)?;
        let parameters = passage.parameter_jets(&self.space, variables.coordinates);
        let duration = S::from_dd(self.route.duration);
        let flown = match &self.through {
            None => fly(self.field(), &start, &parameters, duration)?,
            Some((flow, events)) => {
                let events: Vec<_> = events.iter().map(FlowEvent::converted).collect();
                let fly = |field: &Field, jets: &[Jet<S>], time| -> Result<_, ExpansionError> {
                    Ok(fly(field, jets, &parameters, time)?)
                };
                flow.jets(&start, &parameters, duration, &events, fly)?.state
            }
        };
        let origin = self.origin();
        let state = self.reach(&flown, &parameters, &origin)?;
        let image = self.route.to.chart.offsets(&state, &origin).into_iter();
        let image = image.zip(self.sizes(&origin));
        Ok(Leg {
            image: image
                .map(|(jet, size)| without_constant(jet, size))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Scale of a defect in each coordinate: the size of the states at the far end if it exceeds 1,
    /// otherwise 1.
    fn sizes(&self, origin: &[Dd]) -> Vec<f64> {
        let states = self.expander.scene.model.states.len();
        let length = origin[..states].iter().map(|value| value.magnitude());
        let length = length.fold(1.0, f64::max);
        let coordinates = self.route.to.chart.section.coordinates.iter();
        coordinates.map(|&component| if component < states { length } else { 1.0 }).collect()
    }

    /// Free field that watches the event function at the far end.
    fn field(&self) -> &Field {
        &self.expander.grazes[self.route.to.passage].passage.field
    }

    /// Point of the far chart, with its phase advanced.
    fn origin(&self) -> Vec<Dd> {
        let mut origin = self.route.to.chart.point.clone();
        if self.expander.scene.model.phase.is_some()
            && let Some(phase) = origin.last_mut()
        {
            *phase += self.route.phase_advance;
        }
        origin
    }

    /// Flies the remaining short time to the far section.
    fn reach<S: Real>(
        &self,
        state: &[Jet<S>],
        parameters: &[Jet<S>],
        origin: &[Dd],
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let order = (self.space.order() + 1).max(2);
        let series = local_series(self.field(), state, parameters, order);
        let time = match (self.route.to.chart.section.kind, &self.expander.rate) {
            (PoincareSectionKind::Stroboscopic { .. }, Some(rate)) => {
                let inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
                let rate = &evaluate(rate, &self.space, &inputs)[0];
                let phase = state.len() - 1;
                &(-&state[phase].add_constant(-S::from_dd(origin[phase]))) / rate
            }
            _ => time_of_minimum(series.watched(0), &Jet::zero(&self.space))?,
        };
        let time = time.add_constant(-time.head());
        Ok(series.state_at(&time))
    }
}

/// Drops the constant term, which is the rounding defect of the orbit.
fn without_constant<S: Real>(mut jet: Jet<S>, size: f64) -> Result<Jet<S>, ExpansionError> {
    if !jet.is_finite() {
        return Err(ExpansionError::NotFinite { part: "P_smooth" });
    }
    let defect = jet.head().magnitude();
    if defect > LARGEST_DEFECT * size {
        return Err(ExpansionError::NotPeriodic { defect });
    }
    jet.coefficients_mut()[0] = S::zero();
    Ok(jet)
}
