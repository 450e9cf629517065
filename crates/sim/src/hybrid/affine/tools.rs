//! Tables of a system's affine flows at one parameter vector, and what they work on.

use super::alone_impacts::Alone;
use super::extended::Extended;
use super::flight::AffineFlight;
use super::leap::{Asked, Leap, LeapBuffers, Leaper};
use super::retreat::Retreat;
use super::surface::SurfaceTables;
use super::{AffineSurface, AffineSystem};
use crate::flow::{AffineFieldRows, AffineFlow, AffineLeaps, AffineRows};
use crate::hybrid::backward::Back;
use crate::hybrid::landing::Landing;
use crate::hybrid::motion::Motion;
use crate::hybrid::passage::Goal;
use crate::hybrid::sensing::{Clearance, Sense};
use crate::hybrid::simulator::Stop;
use crate::hybrid::system::Regime;
use crate::hybrid::trajectory::Event;
use crate::numeric::Real;

/// The affine side of a simulator.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct AffineTools<'a, S: Real> {
    system: &'a AffineSystem,
    extended: Extended<S>,
    buffers: Buffers<S>,
    /// Computed when first needed after a change of parameters.
    tables: Option<Tables<S>>,
}

/// Polynomials of one watched function, and the extended state after a step.
#[derive(Clone, Debug)]
pub(super) struct Buffers<S> {
    pub(super) value: Vec<S>,
    pub(super) slope: Vec<S>,
    pub(super) next: Vec<S>,
    pub(super) control: Vec<f64>,
    pub(super) rounded: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Tables<S: Real> {
    /// Of free flight, computed when first needed; `None` where a series does not end within the
    /// numbers of the type.
    free: Option<Option<AffineFlow<S>>>,
    phase_rate: S,
    rows: AffineRows<S>,
    /// Of free flight, and what they work on; likewise.
    leaps: Option<Option<(AffineLeaps<S>, LeapBuffers<S>)>>,
    surfaces: Vec<SurfaceTables<S>>,
    /// Per surface the flow in contact with it; likewise.
    contacts: Vec<Option<Option<AffineFlow<S>>>>,
}

impl<'a, S: Real> AffineTools<'a, S> {
    pub(in crate::hybrid) fn new(system: &'a AffineSystem) -> Self {
        let expressions = &system.expressions;
        let (states, phase) = (expressions.states(), expressions.phase());
        Self {
            system,
            extended: Extended::new(states, phase, expressions.harmonics()),
            buffers: Buffers {
                value: Vec::new(),
                slope: Vec::new(),
                next: vec![S::zero(); expressions.columns()],
                control: Vec::new(),
                rounded: vec![0.0; expressions.columns()],
            },
            tables: None,
        }
    }

    /// To be called where the parameters change.
    pub(in crate::hybrid) fn drop_tables(&mut self) {
        self.tables = None;
    }

    /// To be called where a state is placed: what follows must not depend on what was before.
    pub(in crate::hybrid) fn forget(&mut self) {
        self.extended.forget();
    }

    #[inline(always)]
    fn prepare(&mut self, parameters: &[S]) {
        if self.tables.is_none() {
            self.form_tables(parameters);
        }
    }

    #[cold]
    fn form_tables(&mut self, parameters: &[S]) {
        let rows = self.system.expressions.at(parameters);
        self.extended.set_multiples(&rows.multiples);
        self.tables = Some(Tables::new(self.system, rows));
    }

    /// The flight of a regime from the present state; `None` where it has no affine flow.
    pub(in crate::hybrid) fn flight(
        &mut self,
        regime: Regime,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<AffineFlight<'_, S>> {
        self.prepare(parameters);
        let (system, tables) = (self.system, self.tables.as_mut()?);
        let Tables {
            free,
            contacts,
            rows,
            ..
        } = &mut *tables;
        let flow = match regime {
            Regime::Free => {
                let flow = || system.with_free_field(rows, AffineFlow::new);
                free.get_or_insert_with(flow).as_ref()
            }
            Regime::Contact { surface } => {
                let flow = || system.contact_flow(surface, rows);
                contacts[surface].get_or_insert_with(flow).as_ref()
            }
            Regime::Stick { .. } => None,
        }?;
        self.extended.take(&motion.state, motion.reference_phase);
        let phase = self.system.expressions.phase();
        Some(AffineFlight::new(
            flow,
            &mut self.extended,
            &mut self.buffers,
            phase.map(|component| motion.state[component]),
        ))
    }

    /// Flies freely to the first event, for a time at most, and writes the state where that ends;
    /// `None` where the field has no tables for it.
    ///
    /// `asked` says of each surface what is looked for, and whether the flight stops at its minima;
    /// others are put to `misses`.
    pub(in crate::hybrid) fn leap(
        &mut self,
        motion: &mut Motion<S>,
        parameters: &[S],
        longest: S,
        asked: impl Fn(usize) -> (Option<Goal<S>>, bool),
        misses: &mut Vec<(S, usize, S)>,
    ) -> Option<Leap<S>> {
        let (leaps, extended, buffers) = self.leaps(motion, parameters)?;
        for surface in 0..motion.leaving.len() {
            let (goal, stops) = asked(surface);
            let start = motion.start(surface);
            buffers.asked[surface] = Asked { goal, start, stops };
        }
        misses.clear();
        let states = extended.states();
        let leap = S::dispatch_loops(Leaper {
            leaps,
            extended: &extended.values,
            buffers,
            longest,
            headings: &mut motion.headings,
            misses,
            states: &mut motion.state[..states],
        });
        if let Some(phase) = motion.state.get_mut(states) {
            *phase = leaps.phase_rate().mul_add(leap.time, *phase);
        }
        Some(leap)
    }

    /// Flies freely from impact to impact at one rigid surface at rest, where leaps and impacts are
    /// of the common kind and contacts alone are asked for; `None` where that ends before the
    /// horizon.
    pub(in crate::hybrid) fn fly_through_impacts(
        &mut self,
        motion: &mut Motion<S>,
        horizon: S,
        period: S,
        record: &mut dyn FnMut(Event<S>),
    ) -> Option<Stop<S>> {
        let tables = self.tables.as_ref()?;
        let (leaps, _) = tables.leaps.as_ref()?.as_ref()?;
        let surface = tables.surfaces.first()?;
        if tables.surfaces.len() > 1 || surface.moves() {
            return None;
        }
        motion.last_step = S::from_f64(leaps.time_scale());
        let alone = Alone {
            extended: &mut self.extended,
            record,
        };
        alone.fly(leaps, surface, motion, horizon, period)
    }

    /// Takes the state back along the free flow to where the gap was zero, or least; the time that
    /// took, `None` where it is longer than asked for or not known from one series.
    pub(in crate::hybrid) fn retreat(
        &mut self,
        surface: usize,
        goal: Back,
        motion: &mut Motion<S>,
        parameters: &[S],
        longest: S,
    ) -> Option<S> {
        let (leaps, extended, buffers) = self.leaps(motion, parameters)?;
        let states = extended.states();
        let (time, known) = S::dispatch_loops(Retreat {
            leaps,
            extended: &extended.values,
            visit: &mut buffers.visit,
            surface,
            goal,
            longest,
            wanted: true,
            states: &mut motion.state[..states],
        });
        if !known {
            return None;
        }
        if let Some(phase) = motion.state.get_mut(states) {
            *phase = leaps.phase_rate().mul_add(-time, *phase);
        }
        Some(time)
    }

    /// The tables of leaps, the extended state, and what leaps work on.
    fn leaps(
        &mut self,
        motion: &mut Motion<S>,
        parameters: &[S],
    ) -> Option<(&AffineLeaps<S>, &Extended<S>, &mut LeapBuffers<S>)> {
        self.prepare(parameters);
        let (system, tables) = (self.system, self.tables.as_mut()?);
        let Tables { leaps, rows, .. } = tables;
        let leaps = leaps.get_or_insert_with(|| {
            let leaps = system.with_free_field(rows, AffineLeaps::new)?;
            let buffers =
                LeapBuffers::new(&leaps, system.expressions.columns(), system.surfaces.len());
            Some((leaps, buffers))
        });
        let (leaps, buffers) = leaps.as_mut()?;
        motion.last_step = S::from_f64(leaps.time_scale());
        self.extended.take(&motion.state, motion.reference_phase);
        Some((leaps, &self.extended, buffers))
    }

    /// The gap of a surface.
    #[inline(always)]
    pub(in crate::hybrid) fn clearance(
        &mut self,
        surface: usize,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<Clearance<S>> {
        self.prepare(parameters);
        let table = &self.tables.as_ref()?.surfaces[surface];
        if !table.moves() {
            return Some(table.clearance(&motion.state));
        }
        self.extended.take(&motion.state, motion.reference_phase);
        Some(table.clearance(&self.extended.values))
    }

    /// The normal motion at a surface, along the free flow.
    pub(in crate::hybrid) fn sense(
        &mut self,
        surface: usize,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<Sense<S>> {
        self.prepare(parameters);
        self.extended.take(&motion.state, motion.reference_phase);
        Some(self.tables.as_ref()?.surfaces[surface].sense(&self.extended.values))
    }

    /// Writes value and slope of the function that is zero where a flight has landed, and the rates
    /// of the free flow; `false` where there is none.
    pub(in crate::hybrid) fn read_landing(
        &mut self,
        landing: Landing,
        motion: &Motion<S>,
        parameters: &[S],
        out: &mut [S],
    ) -> bool {
        self.prepare(parameters);
        let (Landing::Contact { surface } | Landing::Release { surface }) = landing;
        let Some(tables) = &self.tables else {
            return false;
        };
        let Some(rows) = tables.surfaces[surface].landing(landing) else {
            return false;
        };
        self.extended.take(&motion.state, motion.reference_phase);
        let known = 2 + self.extended.states();
        rows.multiply(&self.extended.values, &mut out[..known]);
        out[known..].fill(tables.phase_rate);
        true
    }

    /// Writes the state after an impact; `false` where the reset is not affine.
    pub(in crate::hybrid) fn reset(
        &mut self,
        surface: usize,
        motion: &mut Motion<S>,
        parameters: &[S],
    ) -> bool {
        self.prepare(parameters);
        let tables = self.tables.as_ref();
        let Some(reset) = tables.and_then(|tables| tables.surfaces[surface].reset.as_ref()) else {
            return false;
        };
        self.extended.take(&motion.state, motion.reference_phase);
        let states = self.system.expressions.states();
        reset.multiply(&self.extended.values, &mut motion.state[..states]);
        true
    }
}

impl AffineSystem {
    /// A field with the harmonics of free flight.
    fn field<'r, S: Real>(
        &self,
        rows: &'r AffineRows<S>,
        derivatives: &'r [&'r [S]],
        watched: &'r [&'r [S]],
    ) -> AffineFieldRows<'r, S> {
        let one = self.expressions.columns() - 1;
        let rate = self.phase_rate.map(|rate| rows.row(rate)[one]);
        AffineFieldRows {
            derivatives,
            watched,
            phase_rate: rate.unwrap_or(S::zero()),
            multiples: &rows.multiples,
        }
    }

    fn with_free_field<S: Real, R>(
        &self,
        rows: &AffineRows<S>,
        tables: impl FnOnce(&AffineFieldRows<'_, S>) -> R,
    ) -> R {
        let events: Vec<&[S]> = self.surfaces.iter().map(|s| rows.row(s.event)).collect();
        let free: Vec<&[S]> = self.free.iter().map(|&place| rows.row(place)).collect();
        tables(&self.field(rows, &free, &events))
    }

    /// The flow in contact with a surface, where that is affine.
    fn contact_flow<S: Real>(&self, surface: usize, rows: &AffineRows<S>) -> Option<AffineFlow<S>> {
        let contact = self.surfaces[surface].contact.as_ref()?;
        let others = contact
            .others
            .iter()
            .map(|&other| self.surfaces[other].event);
        let watched = [contact.release].into_iter().chain(others);
        let watched: Vec<&[S]> = watched.map(|place| rows.row(place)).collect();
        let derivatives = contact.derivatives.iter();
        let derivatives: Vec<&[S]> = derivatives.map(|&place| rows.row(place)).collect();
        AffineFlow::new(&self.field(rows, &derivatives, &watched))
    }
}

impl<S: Real> Tables<S> {
    fn new(system: &AffineSystem, rows: AffineRows<S>) -> Self {
        let (surfaces, phase_rate) = system.with_free_field(&rows, |field| {
            let table = |surface: &AffineSurface| SurfaceTables::new(surface, &rows, field);
            (
                system.surfaces.iter().map(table).collect(),
                field.phase_rate,
            )
        });
        Self {
            free: None,
            phase_rate,
            leaps: None,
            surfaces,
            contacts: vec![None; system.surfaces.len()],
            rows,
        }
    }
}

mod orbit;
