//! Tables of a system's affine flows at one parameter vector, and their working memory:
//! [`AffineTools`] for one orbit, [`LaneTools`] for several in lanes at one rigid surface.

use super::exact_step::{BackwardStep, StepBuffers, Stepper};
use super::extended::{AffineFlight, Extended, FlightBuffers};
use super::system::{AffineSurface, AffineSystem, SurfaceTables};
use crate::flow::{AffineFieldRows, AffineFlow, AffineRows, Batch, Single, SpanTables};
use crate::hybrid::lane_flow::{LaneAsked, LaneFlow, LaneLog, LaneStepEnd, LoggedFrom};
use crate::hybrid::motion::{Clearance, LaneMotion, Motion, Regime, Sense};
use crate::hybrid::passage::{Back, Goal, Heading, Landing, REDUCED, Stop, ends_before_turn};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Real, Scalar, Vectorised};

/// Exact flow of a simulator with affine free flight.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct AffineTools<'a, S: Real> {
    system: &'a AffineSystem,
    extended: Extended<Single<S>>,
    buffers: FlightBuffers<S>,
    /// Tables, computed when first needed after a change of parameters.
    tables: Option<Tables<S>>,
}

#[derive(Clone, Debug)]
struct Tables<S: Real> {
    /// Flow of free flight, computed when first needed; `Some(None)` if a series needs too many
    /// terms or overflows.
    free: Option<Option<AffineFlow<S>>>,
    phase_rate: S,
    rows: AffineRows<S>,
    /// Tables of exact steps with their working memory, computed when first needed.
    span: Option<Option<Span<S>>>,
    surfaces: Vec<SurfaceTables<S>>,
    /// Flow in contact with each surface, computed when first needed.
    contacts: Vec<Option<Option<AffineFlow<S>>>>,
}

/// Tables of exact steps, and their working memory.
type Span<S> = (SpanTables<Single<S>>, StepBuffers<Single<S>>);

impl<'a, S: Real> AffineTools<'a, S> {
    pub(in crate::hybrid) fn new(system: &'a AffineSystem) -> Self {
        let expressions = &system.expressions;
        let (states, phase) = (expressions.states(), expressions.phase());
        Self {
            system,
            extended: Extended::new(states, phase, expressions.harmonics()),
            buffers: FlightBuffers::new(expressions.columns()),
            tables: None,
        }
    }

    /// Drops the tables after a change of parameters.
    pub(in crate::hybrid) fn drop_tables(&mut self) {
        self.tables = None;
    }

    /// Forgets the harmonics when a state is placed, so that later results do not depend on earlier
    /// ones.
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

    /// Flight of a regime from the present state; `None` if the regime has no affine flow.
    pub(in crate::hybrid) fn flight(
        &mut self,
        regime: Regime,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<AffineFlight<'_, S>> {
        self.prepare(parameters);
        let (system, tables) = (self.system, self.tables.as_mut()?);
        let Tables { free, contacts, rows, .. } = &mut *tables;
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
        self.extended.take(&motion.state, true);
        let phase = self.system.expressions.phase();
        Some(AffineFlight::new(
            flow,
            &mut self.extended,
            &mut self.buffers,
            phase.map(|component| motion.state[component]),
        ))
    }

    /// Flies freely to the first event, at most for `longest`, and writes the state at the end.
    /// Returns the time flown and the end of the step; `None` if the field has no tables.
    ///
    /// `asked` gives the goal of the search at each surface. Minima at which the flight does not
    /// stop are appended to `misses`.
    #[inline(never)]
    pub(in crate::hybrid) fn exact_step(
        &mut self,
        motion: &mut Motion<S>,
        parameters: &[S],
        longest: S,
        asked: impl Fn(usize) -> Option<Goal<S>>,
        misses: &mut Vec<(S, usize, S)>,
    ) -> Option<(S, StepEnd<S>)> {
        let ((tables, buffers), extended) = self.span(motion, parameters)?;
        motion.last_step = tables.time_scale();
        for (surface, gap) in buffers.gaps.iter_mut().enumerate() {
            let goal = asked(surface);
            let heading = motion.headings[surface];
            gap.wanted = goal.is_some();
            if let Some(goal) = goal {
                (gap.ignoring, gap.stops, gap.near) = (goal.minima, goal.stopping, goal.near);
            }
            gap.leaving = motion.leaving[surface].is_some();
            gap.left_within = motion.leaving[surface].unwrap_or(S::zero());
            gap.rises = gap.wanted && heading == Heading::Rising;
            gap.falls = gap.wanted && heading == Heading::Falling;
        }
        misses.clear();
        let states = extended.states();
        let (time, end) = S::dispatch_loops(LandedStep {
            stepper: Stepper {
                tables,
                extended: &extended.values,
                buffers,
                going_on: true,
                longest,
                log: misses,
            },
            states: &mut motion.state[..states],
        });
        for (heading, gap) in motion.headings.iter_mut().zip(&buffers.gaps) {
            *heading = match (gap.rises, gap.falls) {
                (true, _) => Heading::Rising,
                (_, true) => Heading::Falling,
                _ => Heading::Unknown,
            };
        }
        if let Some(phase) = motion.state.get_mut(states) {
            *phase = tables.phase_rate().mul_add(time, *phase);
        }
        Some((time, end))
    }

    /// Moves the state back along the free flow to the zero or the minimum of the gap. Returns the
    /// time; `None` if it exceeds `longest`, or is not known from one series.
    #[inline(never)]
    pub(in crate::hybrid) fn retreat(
        &mut self,
        surface: usize,
        goal: Back,
        motion: &mut Motion<S>,
        parameters: &[S],
        longest: S,
    ) -> Option<S> {
        let ((tables, buffers), extended) = self.span(motion, parameters)?;
        motion.last_step = tables.time_scale();
        let states = extended.states();
        let (time, known) = S::dispatch_loops(BackwardStep {
            tables,
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
            *phase = tables.phase_rate().mul_add(-time, *phase);
        }
        Some(time)
    }

    /// Bound on the terms of a surface's gap along a span of the free flow; `None` if no tables for
    /// spans have been made yet.
    pub(in crate::hybrid) fn gap_size(
        &mut self,
        surface: usize,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<S> {
        self.prepare(parameters);
        let (tables, _) = self.tables.as_ref()?.span.as_ref()?.as_ref()?;
        self.extended.take(&motion.state, true);
        Some(S::from_f64(tables.size(surface, &self.extended.values)))
    }

    /// Tables of exact steps with their working memory, and the extended state.
    fn span(
        &mut self,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<(&mut Span<S>, &Extended<Single<S>>)> {
        self.prepare(parameters);
        let (system, tables) = (self.system, self.tables.as_mut()?);
        let Tables { span, rows, .. } = tables;
        let span = span.get_or_insert_with(|| {
            let tables = system.with_free_field(rows, SpanTables::new)?;
            let buffers = StepBuffers::new(&tables);
            Some((tables, buffers))
        });
        self.extended.take(&motion.state, true);
        Some((span.as_mut()?, &self.extended))
    }

    /// The gap of a surface, with its rounding.
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
        self.extended.take(&motion.state, true);
        Some(table.clearance(&self.extended.values))
    }

    /// Normal motion at a surface, along the free flow.
    pub(in crate::hybrid) fn sense(
        &mut self,
        surface: usize,
        motion: &Motion<S>,
        parameters: &[S],
    ) -> Option<Sense<S>> {
        self.prepare(parameters);
        self.extended.take(&motion.state, true);
        Some(self.tables.as_ref()?.surfaces[surface].sense(&self.extended.values))
    }

    /// Writes value and slope of the function that is zero at the end of a flight, and the rates of
    /// the free flow; `false` if there is no such function.
    #[inline(never)]
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
        self.extended.take(&motion.state, true);
        let known = 2 + self.extended.states();
        rows.multiply(&self.extended.values, &mut out[..known]);
        out[known..].fill(tables.phase_rate);
        true
    }

    /// Writes the state after an impact; `false` if the reset is not affine.
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
        self.extended.take(&motion.state, true);
        let states = self.system.expressions.states();
        reset.multiply(&self.extended.values, &mut motion.state[..states]);
        true
    }
}

impl AffineTools<'_, f64> {
    /// Tables of an orbit at one rigid surface; `None` without exact steps, or without an affine
    /// reset.
    pub(in crate::hybrid) fn orbit_tables(
        &mut self,
        motion: &mut Motion<f64>,
        parameters: &[f64],
    ) -> Option<OrbitTables> {
        let span = self.span(motion, parameters)?.0.0.clone();
        let tables = self.tables.as_ref()?;
        Some(OrbitTables {
            span,
            surface: tables.surfaces.first()?.clone(),
            multiples: tables.rows.multiples.clone(),
            phase: self.system.expressions.phase(),
            states: self.system.expressions.states(),
        })
    }
}

/// Tables of one orbit at its parameters.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct OrbitTables {
    span: SpanTables<Single<f64>>,
    surface: SurfaceTables<f64>,
    multiples: Vec<f64>,
    phase: Option<usize>,
    states: usize,
}

/// End of an exact step: `Some` with the event, if any; `None` if nothing happened so far and a
/// general search must follow.
pub(in crate::hybrid) type StepEnd<S> = Option<Option<Stop<S>>>;

/// Vectorised work of an exact step that also writes the states at its end.
struct LandedStep<'t, S: Real> {
    stepper: Stepper<'t, Single<S>, &'t mut Vec<(S, usize, S)>>,
    states: &'t mut [S],
}

impl<S: Real> Vectorised for LandedStep<'_, S> {
    type Output = (S, StepEnd<S>);

    /// NOTE: the masks remain in this function: truth values that are stored one by one and read
    /// together would make one orbit wait.
    #[inline(always)]
    fn run(mut self) -> (S, StepEnd<S>) {
        let step = self.stepper.fly();
        let Stepper { tables, extended, buffers, .. } = self.stepper;
        let visit = &mut buffers.visit;
        visit.states_at(step.time, true, tables, extended, self.states);
        (step.time, (!step.undecided).then(|| step.stop()))
    }
}

impl AffineSystem {
    /// Rows of a field with the harmonics of free flight.
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

    /// Flow in contact with a surface, if the contact is affine.
    fn contact_flow<S: Real>(&self, surface: usize, rows: &AffineRows<S>) -> Option<AffineFlow<S>> {
        let contact = self.surfaces[surface].contact.as_ref()?;
        let others = contact.others.iter().map(|&other| self.surfaces[other].event);
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
            (system.surfaces.iter().map(table).collect(), field.phase_rate)
        });
        Self {
            free: None,
            phase_rate,
            span: None,
            surfaces,
            contacts: vec![None; system.surfaces.len()],
            rows,
        }
    }
}

/// The surface at which lanes fly, the only one.
const SURFACE: usize = 0;

/// Tables of several orbits, and their working memory.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct LaneTools<const N: usize> {
    tables: SpanTables<Batch<N>>,
    buffers: StepBuffers<Batch<N>>,
    extended: Extended<Batch<N>>,
    surface: SurfaceTables<Lanes<N>>,
    phase: Option<usize>,
    /// States at another time.
    there: Vec<Lanes<N>>,
    /// Value and slope of the gap, and the rates of the states.
    landing: Vec<Lanes<N>>,
}

impl<const N: usize> LaneTools<N> {
    /// Combines the tables of all orbits; `None` if their shapes differ.
    pub(in crate::hybrid) fn new(alone: [OrbitTables; N]) -> Option<Self> {
        let tables = SpanTables::interleaved(alone.each_ref().map(|own| &own.span))?;
        let surface = SurfaceTables::interleaved(alone.each_ref().map(|own| &own.surface))?;
        let OrbitTables { phase, states, ref multiples, .. } = alone[0];
        let multiple = |place: usize| Lanes::from_fn(|lane| alone[lane].multiples[place]);
        let multiples: Vec<_> = (0..multiples.len()).map(multiple).collect();
        let mut extended = Extended::new(states, phase, multiples.len());
        extended.set_multiples(&multiples);
        let zero = Lanes::splat(0.0);
        Some(Self {
            buffers: StepBuffers::new(&tables),
            extended,
            surface,
            phase,
            there: vec![zero; states],
            landing: vec![zero; 2 + states],
            tables,
        })
    }

    /// Sets motions to the computed states, and advances their phases by a time.
    #[inline(always)]
    fn take_there(&self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>, time: Lanes<N>) {
        for (state, &there) in motion.state.iter_mut().zip(&self.there) {
            *state = Lanes::select(wanted, there, *state);
        }
        if let Some(phase) = self.phase {
            let phase = &mut motion.state[phase];
            let there = self.tables.phase_rate().mul_add(time, *phase);
            *phase = Lanes::select(wanted, there, *phase);
        }
    }
}

impl<const N: usize> LaneFlow<N> for LaneTools<N> {
    #[inline(always)]
    fn forget(&mut self) {
        self.extended.forget();
    }

    #[inline(always)]
    fn time_scale(&self, _: &LaneMotion<N>) -> Lanes<N> {
        self.tables.time_scale()
    }

    #[inline(always)]
    fn step(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneStepEnd<N> {
        self.extended.take(&motion.state, asked.wanted);
        let gap = &mut self.buffers.gaps[SURFACE];
        gap.wanted = asked.wanted & !asked.blind;
        (gap.ignoring, gap.stops) = (asked.ignoring, asked.stopping);
        // NOTE: lanes look for all minima.
        gap.near = Lanes::splat(f64::INFINITY);
        (gap.leaving, gap.left_within) = (motion.leaving, motion.rounding);
        gap.rises = motion.rises & !asked.blind;
        gap.falls = motion.falls & !asked.blind;
        let step = Stepper {
            tables: &self.tables,
            extended: &self.extended.values,
            buffers: &mut self.buffers,
            going_on: LaneMask::NONE,
            longest: asked.longest,
            log: LoggedFrom { start: motion.time, log },
        }
        .fly();
        let gap = &self.buffers.gaps[SURFACE];
        (motion.rises, motion.falls) = (gap.rises, gap.falls);
        let end = LaneStepEnd {
            time: step.time,
            contact: step.contact,
            minimum: step.minimum,
            rises_for: step.rises_for,
            undecided: step.undecided,
        };
        let flown = asked.wanted & !end.undecided;
        let at_end = end.time.is_equal(asked.longest) & !end.contact & !end.minimum;
        let of_use = !at_end | asked.landing;
        let useful = flown & of_use & !(end.minimum & asked.passing);
        if useful.any() {
            let visit = &mut self.buffers.visit;
            let (tables, extended) = (&self.tables, &self.extended.values);
            visit.states_at(end.time, useful, tables, extended, &mut self.there);
            self.take_there(motion, useful, end.time);
        }
        let time = Lanes::select(end.time.is_equal(asked.longest), horizon, motion.time + end.time);
        motion.time = Lanes::select(flown, time, motion.time);
        end
    }

    #[inline(always)]
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N> {
        self.extended.take(&motion.state, wanted);
        let (time, known) = BackwardStep {
            tables: &self.tables,
            extended: &self.extended.values,
            visit: &mut self.buffers.visit,
            surface: SURFACE,
            goal,
            longest,
            wanted,
            states: &mut self.there,
        }
        .run();
        let known = known & wanted;
        self.take_there(motion, known, -time);
        motion.time = Lanes::select(known, motion.time - time, motion.time);
        known
    }

    #[inline(always)]
    fn sense(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Sense<Lanes<N>> {
        self.extended.take(&motion.state, wanted);
        self.surface.sense(&self.extended.values)
    }

    #[inline(always)]
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        self.extended.take(&motion.state, wanted);
        if let Some(reset) = &self.surface.reset {
            reset.multiply(&self.extended.values, &mut self.there);
        }
        for (state, &there) in motion.state.iter_mut().zip(&self.there) {
            *state = Lanes::select(wanted, there, *state);
        }
    }

    #[inline(always)]
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N> {
        let zero = Lanes::splat(0.0);
        self.extended.take(&motion.state, wanted);
        self.surface.contact.multiply(&self.extended.values, &mut self.landing);
        let (value, slope) = (self.landing[0], self.landing[1]);
        let curvature = self.surface.sense(&self.extended.values).acceleration;
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero);
        let shift = -value / slope;
        let rates = self.landing[2..].iter().copied();
        let rates = rates.chain([self.tables.phase_rate()]);
        for (state, rate) in motion.state.iter_mut().zip(rates) {
            *state = Lanes::select(settles, rate.mul_add(shift, *state), *state);
        }
        let after = self.gap(motion, settles);
        let less = after.abs().is_at_most(value.abs() * Lanes::splat(REDUCED));
        motion.time = Lanes::select(settles, motion.time + shift, motion.time);
        settles & !(less & ends_before_turn(value, slope, curvature))
    }

    #[inline(always)]
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N> {
        if self.surface.moves() {
            self.extended.take(&motion.state, wanted);
            return self.surface.clearance(&self.extended.values).gap;
        }
        self.surface.clearance(&motion.state).gap
    }
}
