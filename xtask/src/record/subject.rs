//! Scenes of the catalogue on different sections.

use std::cell::OnceCell;

use grazemap::analysis::SectionFrame;
use grazemap::model::{Model, Response, Scene, catalogue};
use grazemap::numeric::Real;
use grazemap::orbit::{GrazingOrbit, locate};
use grazemap::{FindGraze, Map};

use super::hash::Scatter;

/// Sizes of offsets, in half-widths of the window.
const SCALES: [f64; 16] = [
    1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3,
];

/// Section of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum On {
    /// Section that the scene names.
    Own,
    Tangency,
    /// Forcing phase of the graze.
    GrazingPhase,
    OtherPhase,
}

/// Sections that are selected here, not by the scene.
pub(crate) const SECTIONS: [On; 3] = [On::Tangency, On::GrazingPhase, On::OtherPhase];

impl On {
    /// Name in the record.
    pub(crate) fn name(self) -> &'static str {
        match self {
            On::Own => "own",
            On::Tangency => "tangency",
            On::GrazingPhase => "grazing-phase",
            On::OtherPhase => "other-phase",
        }
    }

    fn overrides(self) -> &'static [(&'static str, &'static str)] {
        match self {
            On::Own => &[],
            On::Tangency => &[("section.kind", "tangency")],
            On::GrazingPhase => &[("section.kind", "stroboscopic")],
            On::OtherPhase => &[("section.kind", "stroboscopic"), ("section.phase", "1")],
        }
    }
}

/// Scene on a section, with its grazing orbit.
#[derive(Debug)]
pub(crate) struct Subject {
    pub(crate) scene: Scene,
    pub(crate) orbit: GrazingOrbit,
}

/// Scene of the catalogue on all sections, each located on first use.
#[derive(Debug)]
pub(crate) struct Subjects {
    pub(crate) name: &'static str,
    located: [OnceCell<Option<Subject>>; 4],
    map: OnceCell<Option<Map>>,
}

impl Subjects {
    /// Scene with a name.
    pub(crate) fn new(name: &'static str) -> Self {
        Self { name, located: Default::default(), map: OnceCell::new() }
    }

    /// Scene on a section; `None` if it has no such section or does not graze.
    pub(crate) fn on(&self, section: On) -> Option<&Subject> {
        let locate = || Subject::new(self.name, section.overrides());
        self.located[section as usize].get_or_init(locate).as_ref()
    }

    /// Map of the scene, expanded on first use; `None` if there is none.
    pub(crate) fn map(&self) -> Option<&Map> {
        let expand = || scene(self.name, &[])?.graze().and_then(|graze| graze.map()).ok();
        self.map.get_or_init(expand).as_ref()
    }
}

impl Subject {
    fn new(name: &str, overrides: &[(&str, &str)]) -> Option<Self> {
        let scene = scene(name, overrides)?;
        let orbit = locate(&scene).ok()?.into_result().ok()?;
        Some(Self { scene, orbit })
    }

    /// Model of a scene with overrides.
    pub(crate) fn model(name: &str, overrides: &[(&str, &str)]) -> Option<Model> {
        scene(name, overrides).map(|scene| scene.model)
    }

    /// Whether the system has exactly one surface, which is rigid: lanes need that.
    pub(crate) fn is_for_lanes(&self) -> bool {
        let surfaces = &self.scene.model.surfaces[..];
        matches!(surfaces, [surface] if matches!(surface.response, Response::Impact { .. }))
    }

    /// Half-widths of the window: coordinates of the section, then active parameters.
    pub(crate) fn widths(&self) -> [Vec<f64>; 2] {
        let window = &self.scene.window;
        let finite = |width: f64| match width.is_finite() {
            true => width,
            false => window.depth.sqrt(),
        };
        let coordinates = self.orbit.section.coordinates.iter();
        let active = self.scene.expansion.active.iter();
        [
            coordinates.map(|&at| finite(window.state[at])).collect(),
            active.map(|&at| finite(window.parameter[at])).collect(),
        ]
    }

    /// Offsets of states and parameters near the graze and away from it, reproducible.
    pub(crate) fn offsets<S: Real>(&self, seed: &str, count: usize) -> Vec<[Vec<S>; 2]> {
        let mut scatter = Scatter::of(seed);
        let widths = self.widths();
        let offsets = |number: usize| {
            let scale = SCALES[number % SCALES.len()];
            widths.each_ref().map(|widths| {
                let offset = |&width: &f64| S::from_f64(scale * width * scatter.next());
                widths.iter().map(offset).collect()
            })
        };
        (0..count).map(offsets).collect()
    }

    /// Frame of the section.
    pub(crate) fn frame<S: Real>(&self) -> SectionFrame<S> {
        SectionFrame::new(&self.scene, &self.orbit)
    }
}

/// Scene of the catalogue with overrides.
fn scene(name: &str, overrides: &[(&str, &str)]) -> Option<Scene> {
    let overrides: Vec<(String, String)> =
        overrides.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    Scene::parse_with(catalogue::text(name)?, name, &overrides).ok()
}
