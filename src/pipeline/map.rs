//! Local map of a scene, and the analyses that use it.

use std::sync::{Arc, OnceLock};

use super::graze::parameter_number;
use super::{Error, Graze, Settled, StudyRequest, refuse_memory};
use crate::analysis::basin::{Basin, BasinRequest, basin, basin_share};
use crate::analysis::branches::{
    AttractorBranch, BranchDiagram, BranchObservable, BranchRequest, Branches, attractor_branch,
    branch_diagram, branches, branches_share, observed,
};
use crate::analysis::chart::{Chart, chart, chart_share};
use crate::analysis::diagram::{Diagram, diagram, diagram_share};
use crate::analysis::fit::{Fit, FitRequest, fit};
use crate::analysis::loci::{Loci, LociRequest, loci};
use crate::analysis::noise::{NoiseRequest, NoisyOrbits, noise};
use crate::analysis::orbits::{Orbits, OrbitsRequest, orbits};
use crate::analysis::{
    ImageRecord, ImageRequest, MeasuredSide, NoProgress, Progress, SectionImage, Shard,
    SubProgress, basin_bytes, chart_bytes, diagram_bytes, direct_image, guarded, image_bytes,
    images, measure_graze, noise_bytes,
};
use crate::convergence::{
    Choice, ConvergenceError, ConvergenceStudy, ExactImages, MeasuredWindow, measure_window,
};
use crate::expansion::{
    ComposedMap, Contact, DepthSeries, Expander, LocalMap, RADIUS_ORDER, Stage, WindowEdge,
    check_orders, free_flight,
};
use crate::iteration::{DeviceMap, DiscreteMap, HornerMap, StepInfo};
use crate::model::{ChartRequest, DiagramRequest, MapOrders, Scene, Shape};
use crate::numeric::FloatFormat;
use crate::orbit::GrazingOrbit;
use crate::report::{ExpansionParts, MapListing, PassageParts, SectionDocument, depth_variables};

/// Settings of an expansion: orders, weights and shape.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) settled: Settled,
    /// Scene, with the weights and the shape chosen for it if it names a tolerance.
    pub(super) scene: Arc<Scene>,
    pub(super) orders: MapOrders,
    pub(super) choice: Option<Choice>,
}

impl Plan {
    pub(super) fn new(settled: Settled, orders: MapOrders, choice: Option<Choice>) -> Self {
        let scene = match &choice {
            None => Arc::new(settled.scene().clone()),
            Some(choice) => {
                let mut scene = choice.weighted(settled.scene());
                scene.emit.shape = choice.shape;
                Arc::new(scene)
            }
        };
        Self { settled, scene, orders, choice }
    }

    /// Choice of orders, if the scene names a tolerance.
    pub fn choice(&self) -> Option<&Choice> {
        self.choice.as_ref()
    }

    /// Expands the map of the plan and measures its window.
    ///
    /// # Errors
    ///
    /// [`Error::Expansion`], [`Error::Convergence`] if the scene cannot be expanded.
    pub fn expand(self) -> Result<Map, Error> {
        let (scene, orbit, orders) = (&*self.scene, self.settled.orbit(), self.orders);
        check_orders(scene)?;
        let expander = Expander::new(scene, orbit)?;
        let fitted = self.choice.as_ref().filter(|choice| choice.fitted_to.is_some());
        let mut local = match (scene.emit.shape, fitted) {
            (Shape::Flown, _) => expander.flown(orders)?,
            (_, Some(choice)) => choice.local_map(scene, orbit)?,
            (_, None) => expander.expand(orders)?,
        };
        let passages = local.stages.iter().filter(|stage| stage.is_passage()).enumerate();
        let series = passages.filter(|(_, stage)| matches!(stage, Stage::Contact(_)));
        let series = series
            .map(|(passage, _)| expander.depth_series(passage, RADIUS_ORDER))
            .collect::<Result<Vec<_>, _>>()?;
        let radii = series.iter().filter_map(DepthSeries::radius);
        let natural = expander.natural_window(&local, radii.reduce(f64::min).map(|r| r * r));
        let run = HornerMap::new(&local);
        let run_in = run.in_format(self.precision());
        let found = measure_window((scene, orbit), &local, &*run_in, &natural)?;
        local.window = found.window;
        // NOTE: flown contacts are not truncated by weight.
        let series = if local.is_flown() { Vec::new() } else { series };
        let depth = edge_depth(scene, &local);
        let edge = |series| WindowEdge::new(series, depth, orders.contact_weight);
        let window_edges = series.iter().filter_map(edge).collect();
        Ok(Map::new(Parts {
            window_edges,
            depth_series: series,
            images: OnceLock::from(found.images),
            run: OnceLock::from(run),
            ..Parts::new(self, local, found.measured)
        }))
    }

    /// Number format of the map: as chosen, or as the scene says.
    fn precision(&self) -> FloatFormat {
        let named = self.scene.emit.precision.first();
        self.choice.as_ref().map_or(named, |choice| choice.precision)
    }
}

impl Settled {
    /// Map of the free flight alone, with contacts [not expanded](LocalMap::has_contacts): enough
    /// for requests that are answered by direct simulation. It is computed at once, whatever the
    /// orders, even if contacts have no expansion.
    ///
    /// ```
    /// use grazemap::model::{Method, catalogue};
    /// use grazemap::prelude::*;
    ///
    /// let text = catalogue::text("linear").expect("in the catalogue");
    /// let text = text.replace("v = \"-r*v\"", "v = \"-r*v/(1 + v^0.25)\"");
    /// let settled = Scene::parse(&text, "viscoelastic.toml")?.graze()?.settle()?;
    /// assert!(settled.clone().plan()?.expand().is_err());
    /// let tables = "[[diagram]]\nparameter = \"alpha\"\nrange = [0.0, 1e-4]\npoints = 3\n\
    ///               with = [\"direct\"]\n";
    /// let map = settled.free_flight()?.asking(tables)?;
    /// let diagram = map.diagram(&map.scene().diagrams[0])?;
    /// assert_eq!(diagram.sweeps[0].method, Method::Direct);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Expansion`] if the free flight cannot be expanded.
    pub fn free_flight(&self) -> Result<Map, Error> {
        let (scene, orbit) = (self.scene(), self.orbit());
        let local = free_flight(scene, orbit)?;
        let window = MeasuredWindow::assumed(scene, orbit, &local);
        let plan = Plan::new(self.clone(), local.orders, None);
        Ok(Map::new(Parts::new(plan, local, window)))
    }
}

/// Depth of the window's edge: the scene's, even beyond the radius of the series, else the measured
/// one.
fn edge_depth(scene: &Scene, local: &LocalMap) -> f64 {
    if scene.window.depth.is_finite() { scene.window.depth } else { local.window.depth }
}

/// Local map of a scene near its grazing orbit.
///
/// Cheap to clone (reference counted). States and parameters are offsets from the grazing orbit.
///
/// ```
/// use grazemap::prelude::*;
///
/// let map = Scene::of_catalogue("linear")?.graze()?.map()?;
/// let text = map.to_json()?;
/// let read = Map::from_json(&text)?;
/// assert_eq!(map.step(&[1e-6, 0.0], &[0.0; 2])?, read.step(&[1e-6, 0.0], &[0.0; 2])?);
/// # Ok::<(), grazemap::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Map(pub(super) Arc<Parts>);

/// Contents of a map, shared by its clones.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    pub(super) plan: Plan,
    pub(super) local: LocalMap,
    pub(super) window: MeasuredWindow,
    pub(super) window_edges: Vec<WindowEdge>,
    /// Depth series, one per passage; empty if the map is flown or was read from a file.
    pub(super) depth_series: Vec<DepthSeries>,
    /// Sample points of the window with exact images; `None` if no point has an image.
    pub(super) images: OnceLock<Option<ExactImages>>,
    pub(super) composed: OnceLock<ComposedMap>,
    pub(super) listing: OnceLock<MapListing>,
    pub(super) run: OnceLock<HornerMap>,
    /// Device that iterates charts, unless that is the CPU.
    pub(super) device: Option<Arc<DeviceMap>>,
    /// Reason why the contacts could not be expanded, if that was tried.
    pub(super) missing: Option<String>,
}

impl Parts {
    /// Parts of a new map, without window edges; everything else is computed on demand.
    pub(super) fn new(plan: Plan, local: LocalMap, window: MeasuredWindow) -> Self {
        Self {
            plan,
            local,
            window,
            window_edges: Vec::new(),
            depth_series: Vec::new(),
            images: OnceLock::new(),
            composed: OnceLock::new(),
            listing: OnceLock::new(),
            run: OnceLock::new(),
            device: None,
            missing: None,
        }
    }
}

/// Image of a point by a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Offsets of the image.
    pub offsets: Vec<f64>,
    /// Events during the step.
    pub step: StepInfo,
}

impl Map {
    pub(super) fn new(parts: Parts) -> Self {
        Self(Arc::new(parts))
    }

    /// Copy of the map with another device for charts.
    pub(super) fn with_device(&self, device: Option<Arc<DeviceMap>>) -> Self {
        Self::new(Parts { device, ..Parts::clone(&self.0) })
    }

    /// Copy of the map with the reason why its contacts are not expanded.
    pub(super) fn missing_contacts(&self, reason: &Error) -> Self {
        Self::new(Parts { missing: Some(reason.to_string()), ..Parts::clone(&self.0) })
    }

    /// Device that iterates charts, unless that is the CPU.
    pub(super) fn device(&self) -> Option<&DeviceMap> {
        self.0.device.as_deref()
    }

    /// Scene, with the weights and the shape chosen for it if it names a tolerance.
    pub fn scene(&self) -> &Scene {
        &self.0.plan.scene
    }

    /// Grazing orbit.
    pub fn orbit(&self) -> &GrazingOrbit {
        self.settled().orbit()
    }

    /// Scene on the section of the map.
    pub fn settled(&self) -> &Settled {
        &self.0.plan.settled
    }

    /// Section, with the reason for its choice.
    pub fn section(&self) -> SectionDocument {
        self.settled().section()
    }

    /// Choice of orders, if the scene names a tolerance.
    pub fn choice(&self) -> Option<&Choice> {
        self.0.plan.choice()
    }

    /// Truncation orders.
    pub fn orders(&self) -> MapOrders {
        self.0.plan.orders
    }

    /// Polynomials of the map, stage by stage.
    pub fn local(&self) -> &LocalMap {
        &self.0.local
    }

    /// Window of the map: bounds stated by the scene, measured bounds, and the errors inside.
    pub fn window(&self) -> &MeasuredWindow {
        &self.0.window
    }

    /// Sample points of the window with their images by direct simulation in double-double; `None`
    /// if no point has an image.
    pub(super) fn exact_images(&self) -> Result<Option<&ExactImages>, Error> {
        if self.0.images.get().is_none() {
            let found = ExactImages::of_window(self.scene(), self.orbit(), self.local());
            let images = match found {
                Ok(images) => Some(images),
                Err(ConvergenceError::NoTruth { .. }) => None,
                Err(error) => return Err(error.into()),
            };
            self.0.images.get_or_init(|| images);
        }
        Ok(self.0.images.get().and_then(Option::as_ref))
    }

    /// Share that truncation omits at the edge of the window, one per passage; no entry for a
    /// passage whose series terminates or whose contact is flown.
    pub fn window_edges(&self) -> &[WindowEdge] {
        &self.0.window_edges
    }

    /// Number format of the map: as chosen, or as the scene says.
    pub fn precision(&self) -> FloatFormat {
        self.0.plan.precision()
    }

    /// Copy of the map for a scene with other diagrams, charts or basins, as in [`Scene::asking`].
    ///
    /// ```
    /// use grazemap::prelude::*;
    ///
    /// let map = Scene::of_catalogue("linear")?.graze()?.map()?;
    /// let tables = "[[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 1e-4]\npoints = 20\n";
    /// let map = map.asking(tables)?;
    /// assert_eq!(map.diagram(&map.scene().diagrams[0])?.sweeps[0].points.len(), 20);
    /// # Ok::<(), grazemap::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] for tables with a fault.
    pub fn asking(&self, tables: &str) -> Result<Self, Error> {
        let (settled, plan) = (self.settled(), &self.0.plan);
        let scene = settled.scene().asking(tables)?;
        let graze = Graze::new(scene, self.orbit().clone());
        let settled = Settled { graze, verdict: settled.verdict.clone() };
        let plan = Plan::new(settled, plan.orders, plan.choice.clone());
        Ok(Self::new(Parts { plan, ..(*self.0).clone() }))
    }

    /// Value of a parameter at which the orbit grazes.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchParameter`] for a name that is no parameter.
    pub fn parameter(&self, name: &str) -> Result<f64, Error> {
        let number = parameter_number(self.scene(), name)?;
        Ok(self.orbit().parameters()[number].to_f64())
    }

    /// Map as a [`DiscreteMap`] in double precision.
    pub fn discrete(&self) -> &HornerMap {
        self.0.run.get_or_init(|| HornerMap::new(self.local()))
    }

    /// Computes the image of a state; states and parameters are offsets.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] if there is not one offset per coordinate and active parameter.
    pub fn step(&self, state: &[f64], parameters: &[f64]) -> Result<Image, Error> {
        let mut images = self.iterate(state, parameters, 1)?;
        images.pop().ok_or(Error::Length {
            what: "coordinates",
            expected: self.local().dimension(),
            found: state.len(),
        })
    }

    /// Computes `count` successive images. They end early with the first image that is not
    /// [valid](StepInfo::valid).
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step).
    pub fn iterate(
        &self,
        state: &[f64],
        parameters: &[f64],
        count: usize,
    ) -> Result<Vec<Image>, Error> {
        iterate(self.discrete(), state, parameters, count)
    }

    /// Computes successive images by the map inside its window and by direct simulation of the same
    /// section outside; [`StepInfo::simulated`] tells them apart.
    ///
    /// # Errors
    ///
    /// As [`iterate`](Self::iterate); [`Error::Analysis`] if the simulator refuses the model.
    pub fn iterate_guarded(
        &self,
        state: &[f64],
        parameters: &[f64],
        count: usize,
    ) -> Result<Vec<Image>, Error> {
        let settled = self.settled();
        let (scene, orbit) = (settled.scene(), settled.orbit());
        let (map, window) = (self.discrete(), &self.local().window);
        guarded(scene, orbit, map, window, |map| iterate(map, state, parameters, count))?
    }

    /// Computes the image of a state by event-driven simulation, independently of the expansion.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the simulator refuses the offsets.
    pub fn simulate(&self, state: &[f64], parameters: &[f64]) -> Result<SectionImage<f64>, Error> {
        let settled = self.settled();
        Ok(direct_image(settled.scene(), settled.orbit(), state, parameters)?)
    }

    /// Computes images of many points by the map, its parts or direct simulation.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for offsets of wrong length and unavailable precisions.
    pub fn images(&self, request: &ImageRequest) -> Result<Vec<ImageRecord>, Error> {
        let settled = self.settled();
        refuse_memory(image_bytes(settled.scene(), request))?;
        Ok(images(settled.scene(), settled.orbit(), self.local(), request)?)
    }

    /// Computes a bifurcation diagram.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the parameter is no variable of the map.
    pub fn diagram(&self, request: &DiagramRequest) -> Result<Diagram, Error> {
        self.diagram_with(request, &NoProgress)
    }

    /// Computes a diagram and reports its progress.
    ///
    /// # Errors
    ///
    /// As [`diagram`](Self::diagram).
    pub fn diagram_with(
        &self,
        request: &DiagramRequest,
        progress: &dyn Progress,
    ) -> Result<Diagram, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        refuse_memory(diagram_bytes(scene, request))?;
        Ok(diagram(scene, orbit, self.local(), request, progress)?)
    }

    /// Computes all diagrams of the scene.
    ///
    /// # Errors
    ///
    /// As [`diagram`](Self::diagram).
    pub fn diagrams(&self, progress: &dyn Progress) -> Result<Vec<Diagram>, Error> {
        let requests = self.scene().diagrams.iter().enumerate();
        let diagram =
            |(number, request)| self.diagram_with(request, &SubProgress::new(progress, number));
        requests.map(diagram).collect()
    }

    /// Computes a share of the pieces of [`diagrams`](Self::diagrams).
    ///
    /// # Errors
    ///
    /// As [`diagram`](Self::diagram).
    pub fn share_diagrams(&self, shard: &Shard<'_>) -> Result<(), Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        self.scene().diagrams.iter().enumerate().try_for_each(|(number, request)| {
            let share =
                |shard: &Shard<'_>| diagram_share(scene, orbit, self.local(), request, shard);
            Ok(shard.part(number, share)?)
        })
    }

    /// Computes two-parameter charts, one for each method and start.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if a parameter is no variable of the map.
    pub fn chart(&self, request: &ChartRequest) -> Result<Vec<Chart>, Error> {
        self.chart_with(request, &NoProgress)
    }

    pub(super) fn chart_with(
        &self,
        request: &ChartRequest,
        progress: &dyn Progress,
    ) -> Result<Vec<Chart>, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        refuse_memory(chart_bytes(scene, request))?;
        Ok(chart(scene, orbit, self.local(), self.device(), request, progress)?)
    }

    /// Computes all charts of the scene.
    ///
    /// # Errors
    ///
    /// As [`chart`](Self::chart).
    pub fn charts(&self, progress: &dyn Progress) -> Result<Vec<Chart>, Error> {
        let requests = self.scene().charts.iter().enumerate();
        let charts = requests
            .map(|(number, request)| self.chart_with(request, &SubProgress::new(progress, number)));
        Ok(charts.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// Computes a share of the pieces of [`charts`](Self::charts).
    ///
    /// # Errors
    ///
    /// As [`chart`](Self::chart).
    pub fn share_charts(&self, shard: &Shard<'_>) -> Result<(), Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        self.scene().charts.iter().enumerate().try_for_each(|(number, request)| {
            let (map, device) = (self.local(), self.device());
            let share = |shard: &Shard<'_>| chart_share(scene, orbit, map, device, request, shard);
            Ok(shard.part(number, share)?)
        })
    }

    /// Settles orbits by guarded iteration near the graze, on both sides in one parameter.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the parameter is no variable of the map.
    pub fn measure_graze(&self, parameter: &str) -> Result<Vec<MeasuredSide>, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(measure_graze(scene, orbit, self.local(), parameter)?)
    }

    /// Computes basins of attraction in a plane of states.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for a plane or parameters that the map does not have.
    pub fn basin(&self, request: &BasinRequest, progress: &dyn Progress) -> Result<Basin, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        refuse_memory(basin_bytes(request))?;
        Ok(basin(scene, orbit, self.local(), request, progress)?)
    }

    /// Requests for all basins of the scene.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for a plane or parameters that the map does not have.
    pub fn basin_requests(&self) -> Result<Vec<BasinRequest>, Error> {
        let (scene, plans) = (self.scene(), self.scene().basins.iter());
        let requests = plans.map(|plan| BasinRequest::of_scene(scene, self.local(), plan));
        Ok(requests.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// Computes several basins. The pieces of each are kept under its own number.
    ///
    /// # Errors
    ///
    /// As [`basin`](Self::basin).
    pub fn basins(
        &self,
        requests: &[BasinRequest],
        progress: &dyn Progress,
    ) -> Result<Vec<Basin>, Error> {
        let requests = requests.iter().enumerate();
        let basins = requests
            .map(|(number, request)| self.basin(request, &SubProgress::new(progress, number)));
        basins.collect()
    }

    /// Computes a share of the pieces of [`basins`](Self::basins).
    ///
    /// # Errors
    ///
    /// As [`basin`](Self::basin).
    pub fn share_basins(&self, requests: &[BasinRequest], shard: &Shard<'_>) -> Result<(), Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        requests.iter().enumerate().try_for_each(|(number, request)| {
            let share = |shard: &Shard<'_>| basin_share(scene, orbit, self.local(), request, shard);
            Ok(shard.part(number, share)?)
        })
    }

    /// Finds periodic orbits by itinerary, with their folds and flips.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if an impact speed cannot be expanded, or the simulator refuses the
    /// parameters.
    pub fn orbits(
        &self,
        request: &OrbitsRequest,
        progress: &dyn Progress,
    ) -> Result<Orbits, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(orbits(scene, orbit, self.local(), request, progress)?)
    }

    /// Fits parameters to measured section points.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for series whose rows have the wrong length, or that are too short.
    pub fn fit(&self, request: &FitRequest, progress: &dyn Progress) -> Result<Fit, Error> {
        Ok(fit(self.settled().scene(), self.orbit(), self.local(), request, progress)?)
    }

    /// Iterates orbits whose parameters are drawn at random at every return.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for a wrong number of coordinates or parameters.
    pub fn noise(
        &self,
        request: &NoiseRequest,
        progress: &dyn Progress,
    ) -> Result<NoisyOrbits, Error> {
        refuse_memory(noise_bytes(self.scene(), request))?;
        Ok(noise(self.settled().scene(), self.orbit(), self.local(), request, progress)?)
    }

    /// Follows loci of periodic orbits in two parameters, with points of codimension two.
    ///
    /// ```
    /// use grazemap::analysis::NoProgress;
    /// use grazemap::analysis::loci::{LociRequest, LocusKind};
    /// use grazemap::analysis::periodic::ContactItinerary;
    /// use grazemap::prelude::*;
    ///
    /// let map = Scene::of_catalogue("mems_scenario3")?.graze()?.map()?;
    /// let request = LociRequest {
    ///     plane: [1, 0],
    ///     range: [-1e-6, 1e-6],
    ///     at: vec![0.0, 0.0],
    ///     kinds: vec![LocusKind::Graze, LocusKind::Fold],
    ///     itineraries: vec![ContactItinerary::parse("1", 1)?],
    ///     direct: false,
    /// };
    /// let found = map.loci(&request, &NoProgress)?;
    /// // The fold leaves the grazing curve downwards, with the square of the distance.
    /// let leaving = &found.tangencies[0];
    /// assert!(leaving.coefficient < 0.0 && leaving.slope > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the simulator refuses the parameters.
    pub fn loci(&self, request: &LociRequest, progress: &dyn Progress) -> Result<Loci, Error> {
        Ok(loci(self.settled().scene(), self.orbit(), self.local(), request, progress)?)
    }

    /// Follows branches of periodic orbits in one parameter, through folds, flips and grazes.
    ///
    /// ```
    /// use grazemap::analysis::NoProgress;
    /// use grazemap::analysis::branches::{BranchLabel, BranchRequest};
    /// use grazemap::analysis::periodic::ContactItinerary;
    /// use grazemap::prelude::*;
    ///
    /// let map = Scene::of_catalogue("foale")?.graze()?.map()?;
    /// let request = BranchRequest {
    ///     itineraries: vec![ContactItinerary::parse("1", 1)?],
    ///     longest: 2,
    ///     along: 0,
    ///     range: [-1e-3, 1e-3],
    ///     at: vec![0.0, 0.0],
    ///     direct: false,
    ///     starts: Vec::new(),
    /// };
    /// let found = map.branches(&request, &NoProgress)?;
    /// // Below omega = 2 the orbit with one impact goes back from the graze.
    /// let branch = found.branches.iter().find(|branch| branch.itinerary.contacts() == 1);
    /// let branch = branch.ok_or("no branch with an impact")?;
    /// let goes_back = |alpha: f64| alpha < 1e-12;
    /// let mut physical = branch.points.iter().filter(|point| point.orbit.physical);
    /// assert!(physical.all(|point| goes_back(point.orbit.parameters[0])));
    /// let special = branch.points.iter().filter_map(|point| point.special.as_ref());
    /// assert!(special.into_iter().any(|special| special.label == BranchLabel::Graze));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// As [`orbits`](Self::orbits).
    pub fn branches(
        &self,
        request: &BranchRequest,
        progress: &dyn Progress,
    ) -> Result<Branches, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(branches(scene, orbit, self.local(), request, progress)?)
    }

    /// Branch of direct simulation through the orbit on which a flight from a section point settles
    /// at the offsets `request.at`; `None` if there is none, or if it is not found.
    ///
    /// # Errors
    ///
    /// As [`orbits`](Self::orbits).
    pub fn attractor_branch(
        &self,
        request: &BranchRequest,
        start: &[f64],
        progress: &dyn Progress,
    ) -> Result<Option<AttractorBranch>, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(attractor_branch(scene, orbit, self.local(), request, start, progress)?)
    }

    /// Computes a share of the pieces of [`branches`](Self::branches).
    ///
    /// # Errors
    ///
    /// As [`orbits`](Self::orbits).
    pub fn share_branches(&self, request: &BranchRequest, shard: &Shard<'_>) -> Result<(), Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(branches_share(scene, orbit, self.local(), request, shard)?)
    }

    /// Values of an observable on the orbits of branches, by branch and point.
    ///
    /// # Errors
    ///
    /// As [`orbits`](Self::orbits).
    pub fn branch_observable(
        &self,
        found: &Branches,
        observable: BranchObservable,
    ) -> Result<Vec<Vec<f64>>, Error> {
        Ok(observed(self.settled().scene(), self.orbit(), found, observable)?)
    }

    /// Data that the scene's diagram in the same parameter shows, from these branches and from
    /// guarded iterates; `None` if the scene has no such diagram.
    ///
    /// # Errors
    ///
    /// As [`diagram`](Self::diagram).
    pub fn branch_diagram(
        &self,
        request: &BranchRequest,
        found: &Branches,
        progress: &dyn Progress,
    ) -> Result<Option<BranchDiagram>, Error> {
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        Ok(branch_diagram(scene, orbit, self.local(), request, found, progress)?)
    }

    /// Compares maps of all pairs of orders with direct simulation.
    ///
    /// # Errors
    ///
    /// As [`Settled::study`].
    pub fn study(&self) -> Result<ConvergenceStudy, Error> {
        let request = StudyRequest {
            fresh: StudyRequest::FRESH,
            sections: false,
            chosen: self.choice().cloned(),
        };
        self.settled().study(&request, &NoProgress)
    }

    /// Composed form of the map: one polynomial instead of stages.
    ///
    /// # Errors
    ///
    /// [`Error::Expansion`] for a map with flown contacts, or where its space is too large.
    pub fn composed(&self) -> Result<&ComposedMap, Error> {
        if let Some(composed) = self.0.composed.get() {
            return Ok(composed);
        }
        let composed = Expander::new(self.scene(), self.orbit())?.compose(self.local())?;
        Ok(self.0.composed.get_or_init(|| composed))
    }

    /// Coefficients of the Taylor series, by name, to the orders of the map.
    ///
    /// # Errors
    ///
    /// [`Error::DepthVariableName`], [`Error::Expansion`] if the scene cannot be expanded.
    pub fn listing(&self) -> Result<&MapListing, Error> {
        if let Some(listing) = self.0.listing.get() {
            return Ok(listing);
        }
        let listing = self.list()?;
        Ok(self.0.listing.get_or_init(|| listing))
    }

    fn list(&self) -> Result<MapListing, Error> {
        let (scene, orders) = (self.scene(), self.orders());
        let expander = Expander::new(scene, self.orbit())?;
        refuse_depth_variables(&expander)?;
        // NOTE: economised maps and maps with flown contacts do not hold the coefficients of the
        // series.
        let is_series = self.local().fitted_to.is_none() && !self.local().is_flown();
        let made = match is_series {
            true => None,
            false => Some(expander.expand(orders)?),
        };
        let series = made.as_ref().unwrap_or(self.local());
        let made = made.as_ref().map(|series| expander.compose(series));
        let made = made.transpose()?;
        let composed = match &made {
            Some(composed) => composed,
            None => self.composed()?,
        };
        let contacts = series.stages.iter().filter_map(|stage| match stage {
            Stage::Contact(contact) => Some(contact),
            Stage::Leg(_) | Stage::Flown(_) => None,
        });
        let passages = contacts.enumerate();
        let passages = passages.map(|(passage, contact)| self.passage(&expander, passage, contact));
        let parts = ExpansionParts {
            variables: expander.variables(),
            orders,
            smooth: &expander.smooth(orders.smooth_order)?,
            passages: &passages.collect::<Result<Vec<_>, _>>()?,
            composed,
            lost_digits: &expander.lost_digits(orders)?,
            choice: self.choice(),
            section: &self.section(),
            window: self.window(),
        };
        Ok(MapListing::new(scene, self.orbit(), parts))
    }

    fn passage<'a>(
        &'a self,
        expander: &'a Expander<'_>,
        passage: usize,
        contact: &'a Contact,
    ) -> Result<PassageParts<'a>, Error> {
        let depth_series = match self.0.depth_series.get(passage) {
            Some(series) => series.clone(),
            None => expander.depth_series(passage, RADIUS_ORDER)?,
        };
        let depth = edge_depth(self.scene(), self.local());
        let weight = self.orders().contact_weight;
        Ok(PassageParts {
            surface: &self.local().surfaces[passage],
            variables: expander.variables_at(passage),
            contact,
            window_edge: WindowEdge::new(&depth_series, depth, weight),
            depth_series,
        })
    }
}

/// Computes `count` successive images, up to the first that is not valid.
fn iterate(
    map: &impl DiscreteMap,
    state: &[f64],
    parameters: &[f64],
    count: usize,
) -> Result<Vec<Image>, Error> {
    check_length("coordinates", map.dimension(), state.len())?;
    check_length("parameters", map.parameters(), parameters.len())?;
    let image = (size_of::<Image>() + size_of_val(state)) as u64;
    refuse_memory(image.saturating_mul(count as u64))?;
    let (mut images, mut state) = (Vec::with_capacity(count), state.to_vec());
    for _ in 0..count {
        let mut offsets = vec![0.0; state.len()];
        let step = map.step(&state, parameters, &mut offsets);
        state.copy_from_slice(&offsets);
        images.push(Image { offsets, step });
        if !step.valid {
            break;
        }
    }
    Ok(images)
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    match expected == found {
        true => Ok(()),
        false => Err(Error::Length { what, expected, found }),
    }
}

/// Refuses a variable of the scene with the name of a depth variable.
pub(super) fn refuse_depth_variables(expander: &Expander<'_>) -> Result<(), Error> {
    let depths = depth_variables(expander.passages());
    for passage in 0..expander.passages() {
        let variables = expander.variables_at(passage);
        let mut named = variables.names.iter().enumerate();
        if let Some((place, name)) = named.find(|(_, name)| depths.contains(name)) {
            let is_state = place < variables.coordinates;
            return Err(Error::DepthVariableName {
                name: name.clone(),
                kind: if is_state { "state" } else { "parameter" },
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Graze, Settled};
    use super::Map;

    #[test]
    fn values_of_the_pipeline_are_shared_between_threads() {
        fn shared<T: Clone + Send + Sync + 'static>() {}
        shared::<Graze>();
        shared::<Settled>();
        shared::<Map>();
    }
}
