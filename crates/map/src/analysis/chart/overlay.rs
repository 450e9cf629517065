//! Curves laid over a chart: where the orbit of the scene grazes, and loci of periodic orbits.

use super::data::{ChartAxis, Overlay};
use crate::analysis::error::AnalysisError;
use crate::analysis::loci::{
    LociRequest, Locus, LocusEnd, LocusKind, PlaneCurve, PlanePoint, loci,
};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::NoProgress;
use crate::expansion::LocalMap;
use crate::iteration::PassageSet;
use crate::model::{ChartOverlay, ChartRequest, Method, Scene};
use crate::orbit::{self, CurveEnd, CurveOptions, CurveOutcome, CurvePoint, GrazingOrbit};

/// Passages of the longest period whose loci are looked for where no itinerary is named.
const DEFAULT_PASSAGES: usize = 2;

/// What the curves of a chart are of.
pub(super) struct Plane<'a> {
    pub(super) scene: &'a Scene,
    pub(super) orbit: &'a GrazingOrbit,
    pub(super) map: &'a LocalMap,
    pub(super) request: &'a ChartRequest,
    pub(super) axes: &'a [ChartAxis; 2],
    /// Positions of the axes' parameters among the map's.
    pub(super) places: [usize; 2],
}

impl Plane<'_> {
    /// The curves that are asked for, those of direct simulation over a chart of direct simulation
    /// and those of the map inside its window over others.
    pub(super) fn overlays(&self, method: Method) -> Result<Vec<Overlay>, AnalysisError> {
        let overlay = |&what: &ChartOverlay| {
            let curves = match what {
                ChartOverlay::Graze => self.grazing_curve().into_iter().collect(),
                ChartOverlay::Loci => self.loci(method == Method::Direct)?,
            };
            Ok(Overlay { what, curves })
        };
        self.request.overlay.iter().map(overlay).collect()
    }

    /// The grazing curve through the orbit of the scene, as far as it can be followed over the
    /// chart; `None` where there is none in its plane.
    fn grazing_curve(&self) -> Option<PlaneCurve> {
        let mut scene = self.scene.clone();
        for (parameter, &value) in scene.model.parameters.iter_mut().zip(self.orbit.parameters()) {
            parameter.value = value;
        }
        let [horizontal, vertical] = self.request.parameters;
        let turned = scene.grazing.solve_for == [horizontal];
        let (with, adjusted) = if turned { (1, horizontal) } else { (0, vertical) };
        if scene.grazing.solve_for.len() > 1 {
            return None;
        }
        scene.grazing.solve_for = vec![adjusted];
        let ends = self.request.ranges[with];
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let center = self.axes[with].grazing_value;
        let parameter = self.request.parameters[with];
        let follow = |end: f64| {
            let options = CurveOptions { xi_count: 0, ..CurveOptions::default() };
            let curve = orbit::curve(&scene, parameter, center, center + end, &options);
            match curve.ok()? {
                CurveOutcome::Traced(curve) | CurveOutcome::StartNotReached(curve) => {
                    let is_whole = curve.end == CurveEnd::Reached;
                    Some((curve.points.iter().map(|p| self.point(p)).collect(), is_whole))
                }
                CurveOutcome::NotLocated(_) => None,
            }
        };
        let before = if ends[0] < 0.0 { follow(ends[0])? } else { (Vec::new(), true) };
        let after = if ends[1] > 0.0 { follow(ends[1])? } else { (Vec::new(), true) };
        let (mut points, rest): (Vec<PlanePoint>, Vec<PlanePoint>) = (before.0, after.0);
        points.reverse();
        points.extend(rest);
        let passages = self.map.passages();
        Some(PlaneCurve {
            kind: LocusKind::Graze,
            itinerary: ContactItinerary::new(passages, vec![PassageSet::NONE]).to_string(),
            points,
            whole: before.1 && after.1,
        })
    }

    fn point(&self, point: &CurvePoint) -> PlanePoint {
        let offset = |axis: usize| {
            point.parameters[self.request.parameters[axis]] - self.axes[axis].grazing_value
        };
        PlanePoint {
            at: [offset(0), offset(1)],
            stable: point.multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0),
            physical: point.is_physical(),
            label: None,
        }
    }

    /// The physical parts of loci, by the map inside its window only.
    fn loci(&self, direct: bool) -> Result<Vec<PlaneCurve>, AnalysisError> {
        let passages = self.map.passages();
        let named = &self.request.itineraries;
        let itineraries = match named.is_empty() {
            true => ContactItinerary::all(passages, (DEFAULT_PASSAGES / passages.max(1)).max(1)),
            false => named.iter().map(|one| ContactItinerary::parse(one, passages)).collect(),
        };
        let mut itineraries = itineraries?;
        itineraries.retain(|itinerary| itinerary.contacts() > 0);
        let request = LociRequest {
            plane: self.places,
            range: self.request.ranges[0],
            at: vec![0.0; self.map.parameters.len()],
            kinds: LocusKind::LOCAL.to_vec(),
            itineraries,
            direct,
        };
        let found = loci(self.scene, self.orbit, self.map, &request, &NoProgress)?.loci;
        let own = self.request.overlay.contains(&ChartOverlay::Graze);
        let is_own =
            |locus: &Locus| locus.kind == LocusKind::Graze && locus.itinerary.contacts() == 0;
        let others = found.iter().filter(|locus| !(own && is_own(locus)));
        Ok(others.flat_map(|locus| self.stretches(locus, direct)).collect())
    }

    /// The stretches of a locus that are drawn.
    fn stretches(&self, locus: &Locus, direct: bool) -> Vec<PlaneCurve> {
        let mut stretches = Vec::new();
        let drawn = |point: &&[_]| point.len() > 1;
        let parts = locus.points.split(|point| !(point.physical && (direct || point.inside)));
        for part in parts.filter(drawn) {
            let points = part.iter().map(|point| PlanePoint {
                at: self.places.map(|place| point.parameters[place]),
                stable: point.stable,
                physical: point.physical,
                label: point.label.map(|label| label.label()),
            });
            stretches.push(PlaneCurve {
                kind: locus.kind,
                itinerary: locus.itinerary.to_string(),
                points: points.collect(),
                whole: !locus.ends.contains(&LocusEnd::Lost)
                    && !locus.ends.contains(&LocusEnd::StepLimit),
            });
        }
        stretches
    }
}
