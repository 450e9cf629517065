//! What an orbit hands to the lanes in which it is flown with others, and takes back.

use super::AffineTools;
use crate::hybrid::affine::extended::Harmonic;
use crate::hybrid::affine::lane_tools::OrbitTables;
use crate::hybrid::motion::Motion;

impl AffineTools<'_, f64> {
    /// The harmonic of a system with one force.
    pub(in crate::hybrid) fn harmonic(&self) -> Harmonic {
        self.extended.harmonic()
    }

    /// Puts it.
    pub(in crate::hybrid) fn put_harmonic(&mut self, harmonic: Harmonic) {
        self.extended.put_harmonic(harmonic);
    }

    /// What an orbit at one rigid surface flies by; `None` without leaps, or without an affine
    /// reset.
    pub(in crate::hybrid) fn orbit_tables(
        &mut self,
        motion: &mut Motion<f64>,
        parameters: &[f64],
    ) -> Option<OrbitTables> {
        let leaps = self.leaps(motion, parameters)?.0.clone();
        let tables = self.tables.as_ref()?;
        Some(OrbitTables {
            leaps,
            surface: tables.surfaces.first()?.clone(),
            multiples: tables.rows.multiples.clone(),
            phase: self.system.expressions.phase(),
            states: self.system.expressions.states(),
        })
    }
}
