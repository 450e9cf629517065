//! Reproducible random numbers, and maps with such coefficients, for tests and benches.
#![allow(dead_code, reason = "each test or bench uses a part of it")]

use grazemap::expansion::{
    ActiveParameter, ComposedMap, Contact, DepthPolynomial, DepthTerm, Leg, LocalMap, MapOrders,
    MapSection, MapWindow, PowerCorrections, SectionKind, Stage,
};
use grazemap::jet::{Jet, JetSpace};
use grazemap::numeric::{Dd, Scalar};

/// Reproducible random numbers in `[-1, 1)` (xorshift).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A jet in four variables without constant term.
    fn jet(&mut self, weights: &[u32], order: usize, constant: f64) -> Jet<f64> {
        let space = JetSpace::new(weights, order).expect("a small space");
        let mut coefficients: Vec<f64> = (0..space.len()).map(|_| self.next()).collect();
        coefficients[0] = constant;
        Jet::from_coefficients(&space, coefficients)
    }
}

/// Half-widths of the window of a synthetic map.
pub(crate) const WINDOW: f64 = 0.2;

/// Map with two coordinates, two parameters, a contact of this weight, and a leg of this order; a
/// stroboscopic map has a leg before the contact too.
pub(crate) fn map(smooth_order: u32, contact_weight: u32, kind: SectionKind) -> LocalMap {
    let mut numbers = Numbers::new(7);
    let leg = |numbers: &mut Numbers| {
        Stage::Leg(Leg {
            image: (0..2)
                .map(|_| numbers.jet(&[1; 4], smooth_order as usize, 0.0).scale(0.5))
                .collect(),
        })
    };
    let weight = contact_weight as usize;
    let mut three = |order: usize, constant: f64| {
        vec![numbers.jet(&[2; 4], order, constant), numbers.jet(&[2; 4], order, 0.1)]
    };
    let depth = three(weight.max(2), 0.0).remove(0);
    let contact = Contact {
        depth,
        linear: three(weight.saturating_sub(1), 0.3),
        quadratic: three(weight.saturating_sub(2), 0.2),
        powers: PowerCorrections::default(),
        depth_form: None,
    };
    let stages = match kind {
        SectionKind::Tangency => vec![Stage::Contact(contact), leg(&mut numbers)],
        SectionKind::Stroboscopic => {
            vec![leg(&mut numbers), Stage::Contact(contact), leg(&mut numbers)]
        }
    };
    of_stages(stages, MapOrders { smooth_order, contact_weight }, kind)
}

/// Map without contact: two full polynomials of this order in three variables, one of them a
/// parameter. Other programs were measured on its step.
pub(crate) fn two_polynomials(order: u32) -> LocalMap {
    let mut numbers = Numbers::new(3);
    let mut polynomial = || {
        let full = numbers.jet(&[1; 4], order as usize, 0.0).scale(0.5);
        let within = |powers: &[u8]| powers[3] == 0;
        let terms: Vec<f64> =
            full.terms().map(|(powers, value)| if within(powers) { value } else { 0.0 }).collect();
        Jet::from_coefficients(full.space(), terms)
    };
    let stages = vec![Stage::Leg(Leg { image: vec![polynomial(), polynomial()] })];
    let orders = MapOrders { smooth_order: order, contact_weight: 1 };
    of_stages(stages, orders, SectionKind::Tangency)
}

pub(crate) fn of_stages(stages: Vec<Stage>, orders: MapOrders, kind: SectionKind) -> LocalMap {
    let parameter =
        |name: &str, value: f64| ActiveParameter { name: name.into(), value: Dd::from_f64(value) };
    let contacts = stages.iter().filter(|stage| matches!(stage, Stage::Contact(_)));
    let surfaces = contacts.map(|_| "stop".to_owned()).collect();
    LocalMap {
        scene: "synthetic".into(),
        digest: grazemap::model::Digest(0x0123_4567_89ab_cdef),
        section: MapSection {
            kind,
            coordinates: vec!["x".into(), "theta".into()],
            point: vec![Dd::from_f64(0.5), Dd::from_f64(0.25)],
            phase: None,
        },
        parameters: vec![parameter("alpha", 2.0), parameter("omega", 1.8)],
        orders,
        surfaces,
        stages,
        window: MapWindow { depth: 0.1, state: vec![WINDOW; 2], parameter: vec![WINDOW; 2] },
        fitted_to: None,
    }
}

/// A composed form in two coordinates and two parameters.
pub(crate) fn composed(order: usize) -> ComposedMap {
    let mut numbers = Numbers::new(11);
    let mut pair =
        |order: usize| vec![numbers.jet(&[2; 4], order, 0.0), numbers.jet(&[2; 4], order, 0.1)];
    let polynomial = |parts: [&Jet<f64>; 3]| DepthPolynomial {
        terms: (0..)
            .zip(parts)
            .map(|(power, part)| DepthTerm { powers: vec![power], coefficient: part.clone() })
            .collect(),
    };
    let depth = DepthPolynomial {
        terms: vec![DepthTerm { powers: vec![0], coefficient: pair(order).remove(0) }],
    };
    let (smooth, linear, quadratic) = (pair(order), pair(order - 1), pair(order - 2));
    ComposedMap {
        depths: vec![depth],
        image: (0..2).map(|i| polynomial([&smooth[i], &linear[i], &quadratic[i]])).collect(),
        powers: Vec::new(),
    }
}

/// A point of the window: a state and parameters.
pub(crate) fn point(numbers: &mut Numbers) -> ([f64; 2], [f64; 2]) {
    let mut pair = || [WINDOW * numbers.next(), WINDOW * numbers.next()];
    (pair(), pair())
}
