//! Maps in the crate of emitted code.

use grazemap_generated::CatalogueMap;

use super::discrete_map::{DiscreteMap, StepInfo};

/// An emitted map, compiled into the program.
#[derive(Clone, Copy, Debug)]
pub struct CompiledMap {
    map: &'static CatalogueMap,
}

impl CompiledMap {
    /// All compiled maps.
    pub fn all() -> impl Iterator<Item = Self> {
        grazemap_generated::CATALOGUE.iter().map(|map| Self { map })
    }

    /// Identifier of the scene.
    pub fn identifier(&self) -> &'static str {
        self.map.identifier
    }

    /// Digest of the scene's text when the map was emitted.
    pub fn digest(&self) -> u64 {
        self.map.digest
    }

    /// Half-widths of the window in the coordinates and in the parameters.
    pub fn window(&self) -> (&'static [f64], &'static [f64]) {
        (self.map.window_state, self.map.window_parameters)
    }

    /// Runs `call` with memory for the depths and returns the step data.
    fn run(
        &self,
        image: &mut [f64],
        call: impl FnOnce(&mut [f64], &mut [f64]) -> Option<u32>,
    ) -> StepInfo {
        const ON_STACK: usize = 8;
        let (mut few, mut many) = ([0.0; ON_STACK], Vec::new());
        let depths = match few.get_mut(..self.map.passages) {
            Some(depths) => depths,
            None => {
                many.resize(self.map.passages, 0.0);
                many.as_mut_slice()
            }
        };
        let made = call(image, depths);
        assert!(made.is_some(), "state, parameters and image have the map's lengths");
        let mut info = StepInfo::default();
        for (passage, &depth) in depths.iter().enumerate() {
            info.add_passage(passage, depth);
        }
        info.checked(image)
    }
}

impl DiscreteMap for CompiledMap {
    fn dimension(&self) -> usize {
        self.map.dimension
    }

    fn parameters(&self) -> usize {
        self.map.parameters
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        self.run(image, |image, depths| (self.map.step)(state, parameters, image, depths))
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        self.run(image, |image, depths| {
            (self.map.step_jacobian)(state, parameters, image, depths, jacobian)
        })
    }
}
