//! Branches over the iterates of a diagram.

use super::data::{BranchRequest, Branches};
use crate::analysis::diagram::{Diagram, Observer, diagram};
use crate::analysis::direct_map::DirectMap;
use crate::analysis::error::AnalysisError;
use crate::analysis::progress::Progress;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::{DiagramRequest, Method, Scene, Spacing};
use crate::orbit::GrazingOrbit;

/// Most values of the parameter at which iterates are drawn under branches.
const MOST_VALUES: usize = 400;

/// What a diagram draws, of the orbits of branches and of iterates over the same range.
#[derive(Clone, Debug, PartialEq)]
pub struct BranchDiagram {
    /// The guarded iterates over the range of the branches.
    pub diagram: Diagram,
    /// The observable: by branch, point and return.
    pub values: Vec<Vec<Vec<f64>>>,
}

/// The first diagram of a scene over the parameter of the branches, over their range; `None` where
/// there is none, or other parameters are not at the graze.
///
/// # Errors
///
/// [`AnalysisError::Expansion`] if an impact speed cannot be expanded, [`AnalysisError::Hybrid`] if
/// the simulator refuses the parameters.
pub fn branch_diagram(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    found: &Branches,
    progress: &dyn Progress,
) -> Result<Option<BranchDiagram>, AnalysisError> {
    let along = scene.expansion.active[request.along];
    let asked = scene.diagrams.iter().find(|diagram| diagram.parameter == along);
    let others = request.at.iter().enumerate().filter(|(place, _)| *place != request.along);
    let (Some(asked), true) = (asked, { others }.all(|(_, &offset)| offset == 0.0)) else {
        return Ok(None);
    };
    let observer = Observer::new(scene, orbit, map, &asked.observe)?;
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let value = |state: &Vec<f64>, parameters: &[f64]| match request.direct {
        true => observer.by_simulation(&direct, state, parameters),
        false => observer.by_map(state, parameters),
    };
    let values = found.branches.iter().map(|branch| {
        let points = branch.points.iter().map(|point| {
            let states = point.orbit.states.iter();
            states.map(|state| value(state, &point.orbit.parameters)).collect()
        });
        points.collect()
    });
    let [a, b] = request.range;
    let over = DiagramRequest {
        range: [a.min(b), a.max(b)],
        points: asked.points.min(MOST_VALUES),
        spacing: Spacing::Even,
        with: vec![Method::Guarded],
        ..asked.clone()
    };
    let diagram = diagram(scene, orbit, map, &over, progress)?;
    Ok(Some(BranchDiagram { diagram, values: values.collect() }))
}
