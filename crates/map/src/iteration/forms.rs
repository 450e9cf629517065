//! The kernels of one map: whole, and split for freezing.

use std::sync::OnceLock;

use crate::expansion::MapKernel;
use crate::jet::kernel::{Interpreter, Kernel, LaneInterpreter, Number, OperationCount, Unset};
use crate::numeric::Lanes;

/// Everything that a map's kernel is lowered to, shared by the map and by all that is frozen from
/// it.
///
/// What not every user of a map needs is made when first asked for.
#[derive(Debug)]
pub(super) struct Forms {
    pub(super) lowered: MapKernel,
    pub(super) frozen_step: Freezer,
    step: OnceLock<Interpreter>,
    jacobian: OnceLock<Interpreter>,
    derivatives: OnceLock<Interpreter>,
    frozen_jacobian: OnceLock<Freezer>,
    frozen_depth: OnceLock<Freezer>,
    batch: [OnceLock<Freezer>; 4],
}

impl Forms {
    pub(super) fn new(lowered: MapKernel) -> Self {
        Self {
            frozen_step: Freezer::new(&lowered.kernel, lowered.dimension),
            step: OnceLock::new(),
            jacobian: OnceLock::new(),
            derivatives: OnceLock::new(),
            frozen_jacobian: OnceLock::new(),
            frozen_depth: OnceLock::new(),
            batch: Default::default(),
            lowered,
        }
    }

    /// Image, depths.
    pub(super) fn step(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.kernel);
        self.step.get_or_init(make)
    }

    /// Image, depths, Jacobian.
    pub(super) fn jacobian(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.with_jacobian());
        self.jacobian.get_or_init(make)
    }

    /// Image, depths, derivatives of the image by coordinates and parameters.
    pub(super) fn derivatives(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.with_derivatives());
        self.derivatives.get_or_init(make)
    }

    /// Image, depths, Jacobian, for freezing.
    pub(super) fn frozen_jacobian(&self) -> &Freezer {
        let make = || Freezer::new(&self.lowered.with_jacobian(), self.lowered.dimension);
        self.frozen_jacobian.get_or_init(make)
    }

    /// Image, depths and, if asked for, the derivatives of the image by coordinates and parameters;
    /// for freezing, or with parameters of its own for each point.
    pub(super) fn batch(&self, derivatives: bool, each: bool) -> &Freezer {
        let MapKernel { dimension, parameters, kernel, .. } = &self.lowered;
        let free = if each { dimension + parameters } else { *dimension };
        let make = || match derivatives {
            true => Freezer::new(&self.lowered.with_derivatives(), free),
            false => Freezer::new(kernel, free),
        };
        self.batch[2 * usize::from(derivatives) + usize::from(each)].get_or_init(make)
    }

    /// The depth of the first passage alone; for freezing.
    pub(super) fn frozen_depth(&self) -> &Freezer {
        let make = || Freezer::new(&first_depth(&self.lowered), self.lowered.dimension);
        self.frozen_depth.get_or_init(make)
    }
}

fn first_depth(map: &MapKernel) -> Kernel {
    let mut kernel = map.kernel.clone();
    kernel.outputs = kernel.outputs[map.dimension..].to_vec();
    kernel.outputs.truncate(1);
    kernel.without_dead_operations()
}

/// A kernel split into what is computed when freezing and what is left to each step.
#[derive(Debug)]
pub(super) struct Freezer {
    prepare: Interpreter,
    run: Unset,
    pub(super) count: OperationCount,
}

impl Freezer {
    fn new(kernel: &Kernel, free: usize) -> Self {
        let split = kernel.split(free);
        Self {
            prepare: Interpreter::new(&split.prepare),
            run: Unset::new(&split.run, free),
            count: split.run.count(),
        }
    }

    /// Number of outputs.
    pub(super) fn outputs(&self) -> usize {
        self.run.outputs()
    }

    /// The coefficients at some parameters.
    pub(super) fn coefficients(&self, parameters: &[f64]) -> Vec<f64> {
        self.prepare.evaluate(parameters)
    }

    pub(super) fn freeze(&self, parameters: &[f64]) -> Interpreter {
        self.run.set(&self.coefficients(parameters))
    }

    /// The kernel with the coefficients of every lane; lanes beyond those given have those of the
    /// first.
    pub(super) fn in_lanes<const N: usize, T: Number<Known = Lanes<N>>>(
        &self,
        coefficients: &[Vec<f64>],
    ) -> LaneInterpreter<T> {
        self.run.set_lanes(coefficients)
    }
}
