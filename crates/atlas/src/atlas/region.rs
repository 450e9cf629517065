//! Regions of a stroboscopic section: ranges of its coordinates and of parameters.

use crate::model::Model;

/// Quantity along an axis of a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisInput {
    /// Component of the state.
    State(usize),
    /// Parameter of the model.
    Parameter(usize),
}

/// Axis of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the state or the parameter.
    pub name: String,
    /// Quantity along the axis.
    pub input: AxisInput,
    /// Lowest and highest value.
    pub range: [f64; 2],
}

/// Region of a stroboscopic section: all states first, in the model's order, then parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Phase of the section.
    pub phase: f64,
    /// Forcing periods of one return.
    pub periods: usize,
    /// Axes: one per state, then one per active parameter.
    pub axes: Vec<Axis>,
}

/// A region that a model cannot have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// The model has no forcing phase.
    #[error("an atlas of a stroboscopic section needs a model with a forcing phase")]
    NoPhase,
    /// A return of no periods.
    #[error("a return takes at least one forcing period; 0 were given")]
    NoPeriods,
    /// The phase is not finite.
    #[error("the phase of the section must be finite; {found} was given")]
    Phase {
        /// Phase given.
        found: f64,
    },
    /// A name that is no state and no parameter.
    #[error("`{name}` is neither a state nor a parameter of the model")]
    UnknownName {
        /// Name given.
        name: String,
    },
    /// A state without a range.
    #[error("the region needs a range of the state `{name}`")]
    MissingState {
        /// Name of the state.
        name: String,
    },
    /// Two ranges of one quantity.
    #[error("the region has two ranges of `{name}`")]
    Repeated {
        /// Name of the state or the parameter.
        name: String,
    },
    /// A range without an inside.
    #[error(
        "the range of `{name}` must go from a lower to a higher number; {low} to {high} was given"
    )]
    EmptyRange {
        /// Name of the state or the parameter.
        name: String,
        /// First value.
        low: f64,
        /// Second value.
        high: f64,
    },
}

impl Region {
    /// A region from ranges by name, in any order.
    ///
    /// # Errors
    ///
    /// [`RegionError`].
    pub fn new(
        model: &Model,
        phase: f64,
        periods: usize,
        ranges: &[(&str, [f64; 2])],
    ) -> Result<Self, RegionError> {
        if model.phase.is_none() {
            return Err(RegionError::NoPhase);
        }
        if periods == 0 {
            return Err(RegionError::NoPeriods);
        }
        if !phase.is_finite() {
            return Err(RegionError::Phase { found: phase });
        }
        let axis = |&(name, range): &(&str, [f64; 2])| {
            let [low, high] = range;
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(RegionError::EmptyRange { name: name.to_owned(), low, high });
            }
            let state = model.states.iter().position(|state| state == name);
            let parameter = || model.parameters.iter().position(|known| known.name == name);
            let input = match state.map(AxisInput::State) {
                Some(state) => Some(state),
                None => parameter().map(AxisInput::Parameter),
            };
            let input = input.ok_or_else(|| RegionError::UnknownName { name: name.to_owned() })?;
            Ok(Axis { name: name.to_owned(), input, range })
        };
        let mut axes = ranges.iter().map(axis).collect::<Result<Vec<_>, _>>()?;
        axes.sort_by_key(|axis| match axis.input {
            AxisInput::State(state) => (0, state),
            AxisInput::Parameter(parameter) => (1, parameter),
        });
        if let Some(pair) = axes.windows(2).find(|pair| pair[0].input == pair[1].input) {
            return Err(RegionError::Repeated { name: pair[0].name.clone() });
        }
        let has = |state| axes.iter().any(|axis| axis.input == AxisInput::State(state));
        match (0..model.states.len()).find(|&state| !has(state)) {
            Some(state) => Err(RegionError::MissingState { name: model.states[state].clone() }),
            None => Ok(Self { phase, periods, axes }),
        }
    }

    /// Parameters along the axes, in the order of the axes.
    pub(super) fn active(&self) -> Vec<usize> {
        let parameter = |axis: &Axis| match axis.input {
            AxisInput::Parameter(parameter) => Some(parameter),
            AxisInput::State(_) => None,
        };
        self.axes.iter().filter_map(parameter).collect()
    }
}
