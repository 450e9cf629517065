//! A local map lowered to the straight-line kernel that is run in process and printed as code.

use super::composition::{ComposedMap, DepthPolynomial, DepthTerm};
use super::flown::Arithmetic;
use super::local_map::{Contact, Leg, LocalMap, Stage};
use super::power_law::power_of_depth;
use crate::jet::Jet;
use crate::jet::kernel::{HornerPlan, Kernel, KernelBuilder, Value};

/// A map as a kernel. Inputs are the coordinates, then the parameters; outputs are the image, then
/// the depth of every passage (`−h_min`, negative without contact).
#[derive(Clone, Debug, PartialEq)]
pub struct MapKernel {
    /// Number of coordinates.
    pub dimension: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// Number of grazing passages.
    pub passages: usize,
    /// The operations, in order.
    pub kernel: Kernel,
}

impl MapKernel {
    /// Lowers the map stage by stage: `P_smooth ∘ D`.
    pub fn factored(map: &LocalMap) -> Self {
        let (mut builder, mut state, parameters) = start(map);
        let mut depths = Vec::new();
        for stage in &map.stages {
            let point = [state.as_slice(), &parameters].concat();
            state = match stage {
                Stage::Leg(Leg { image }) => lower_all(&mut builder, image, &point),
                Stage::Contact(contact) => {
                    let depth = HornerPlan::of_jet(&contact.depth).lower(&mut builder, &point);
                    depths.push(depth);
                    lower_contact(&mut builder, contact, depth, &point)
                }
                Stage::Flown(flown) => {
                    let (image, depth) = flown.act(&mut builder, &point);
                    depths.push(depth);
                    image
                }
            };
        }
        Self::new(map, builder, state, depths)
    }

    /// Lowers the map in one polynomial pass: with one passage, `P_smooth + y B̂ + y² Ĉ` or
    /// `P_smooth + Σ_k y^k P_k`.
    pub fn composed(map: &LocalMap, composed: &ComposedMap) -> Self {
        let (mut builder, state, parameters) = start(map);
        let point = [state, parameters].concat();
        let (mut depths, mut roots, mut last_root) = (Vec::new(), Vec::new(), None);
        for (passage, exponent) in composed.depth_variables() {
            if let (Some(exponent), Some(&y)) = (exponent, last_root.as_ref()) {
                roots.push(power_of_depth(&mut builder, &y, exponent));
                continue;
            }
            let polynomial = terms(&composed.depths[passage]);
            let depth = lower_depths(&mut builder, &polynomial, &roots, &point);
            let y = builder.root_of_positive_part(depth);
            last_root = Some(y);
            roots.push(y);
            depths.push(depth);
        }
        let image = composed.image.iter();
        let image = image
            .map(|polynomial| lower_depths(&mut builder, &terms(polynomial), &roots, &point))
            .collect();
        Self::new(map, builder, image, depths)
    }

    fn new(map: &LocalMap, builder: KernelBuilder, image: Vec<Value>, depths: Vec<Value>) -> Self {
        let passages = depths.len();
        let kernel = builder.finish([image, depths].concat()).without_dead_operations();
        Self { dimension: map.dimension(), parameters: map.parameters.len(), passages, kernel }
    }

    /// The kernel with the Jacobian `∂x⁺_i/∂x_j`, row by row, after its other outputs.
    ///
    /// At and below depth 0 the contact is the identity, and so is its derivative.
    pub fn with_jacobian(&self) -> Kernel {
        self.kernel.with_jacobian(self.dimension, self.dimension)
    }

    /// The kernel with the Jacobian and, after every row, the derivative along a tangent vector,
    /// whose components are inputs between the coordinates and the parameters.
    pub fn with_tangent(&self) -> Kernel {
        self.kernel.with_tangent(self.dimension, self.dimension)
    }

    /// The kernel with the derivatives of the image by the coordinates and then by the parameters,
    /// row by row, after its other outputs.
    pub fn with_derivatives(&self) -> Kernel {
        self.kernel.with_jacobian(self.dimension, self.dimension + self.parameters)
    }
}

/// Appends operations to a kernel, for a flown contact.
impl Arithmetic for KernelBuilder {
    type Scalar = f64;
    type Value = Value;

    fn constant(&mut self, value: f64) -> Value {
        Self::constant(self, value)
    }

    fn add(&mut self, a: &Value, b: &Value) -> Value {
        Self::add(self, *a, *b)
    }

    fn multiply(&mut self, a: &Value, b: &Value) -> Value {
        Self::multiply(self, *a, *b)
    }

    fn multiply_add(&mut self, a: &Value, b: &Value, c: &Value) -> Value {
        Self::multiply_add(self, *a, *b, *c)
    }

    fn root_of_positive_part(&mut self, a: &Value) -> Value {
        Self::root_of_positive_part(self, *a)
    }

    fn half_reciprocal(&mut self, a: &Value) -> Value {
        Self::half_reciprocal(self, *a)
    }

    fn held(&mut self, a: &Value) -> Value {
        Self::held(self, *a)
    }

    fn polynomial(&mut self, jet: &Jet<f64>, point: &[Value]) -> Value {
        HornerPlan::of_jet(jet).lower(self, point)
    }
}

/// An empty kernel, its coordinates and its parameters.
fn start(map: &LocalMap) -> (KernelBuilder, Vec<Value>, Vec<Value>) {
    let (dimension, inputs) = (map.dimension(), map.dimension() + map.parameters.len());
    let builder = KernelBuilder::new(inputs);
    let state = (0..dimension).map(|position| builder.input(position)).collect();
    let parameters = (dimension..inputs).map(|position| builder.input(position)).collect();
    (builder, state, parameters)
}

fn lower_all(builder: &mut KernelBuilder, jets: &[Jet<f64>], point: &[Value]) -> Vec<Value> {
    jets.iter().map(|jet| HornerPlan::of_jet(jet).lower(builder, point)).collect()
}

fn terms(polynomial: &DepthPolynomial) -> Vec<&DepthTerm> {
    polynomial.terms.iter().collect()
}

/// Horner's rule in the last depth variable, with coefficients in the others; `roots` are the depth
/// variables that may occur.
fn lower_depths(
    builder: &mut KernelBuilder,
    terms: &[&DepthTerm],
    roots: &[Value],
    point: &[Value],
) -> Value {
    let Some((&y, earlier)) = roots.split_last() else {
        return match terms.first() {
            Some(term) => HornerPlan::of_jet(&term.coefficient).lower(builder, point),
            None => builder.constant(0.0),
        };
    };
    let power_of = |term: &DepthTerm| term.powers[earlier.len()];
    let highest = terms.iter().map(|term| power_of(term)).max().unwrap_or(0);
    let coefficient = |builder: &mut KernelBuilder, power: u8| {
        let with_power = terms.iter().filter(|term| power_of(term) == power);
        let terms: Vec<_> = with_power.copied().collect();
        lower_depths(builder, &terms, earlier, point)
    };
    let mut sum = coefficient(builder, highest);
    for power in (0..highest).rev() {
        let next = coefficient(builder, power);
        sum = builder.multiply_add(y, sum, next);
    }
    sum
}

/// Contact `x + y linear + y² quadratic` with `y = √max(0, depth)`, and its terms with powers of
/// `y` that are not whole.
fn lower_contact(
    builder: &mut KernelBuilder,
    contact: &Contact,
    depth: Value,
    point: &[Value],
) -> Vec<Value> {
    let y = builder.root_of_positive_part(depth);
    let linear = lower_all(builder, &contact.linear, point);
    let quadratic = lower_all(builder, &contact.quadratic, point);
    let coordinates = point.iter().zip(linear.iter().zip(&quadratic));
    let mut image: Vec<Value> = coordinates
        .map(|(&base, (&linear, &quadratic))| {
            let slope = builder.multiply_add(y, quadratic, linear);
            builder.multiply_add(y, slope, base)
        })
        .collect();
    contact.powers.add_to(builder, &y, point, &mut image);
    image
}
