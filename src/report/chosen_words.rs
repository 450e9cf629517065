//! Which map was chosen, how far it holds and where it is the more accurate, in words.

use super::convergence_page::shape_word;
use super::number::significant;
use super::section_document::SectionCost;
use crate::convergence::{
    Choice, ConvergenceStudy, DepthAccuracy, LeastOrders, Limit, Monomials, Polynomials,
    SectionChoice, Validity,
};
use crate::numeric::FloatFormat;

/// Which map was chosen, in words.
pub fn chosen_words(study: &ConvergenceStudy) -> String {
    let chosen = &study.chosen;
    let orders = format!("{}, {}", chosen.orders, shape_word(chosen.shape));
    let weights = chosen.weights.iter();
    let weights: String =
        weights.map(|(name, weight)| format!(", weight {weight} of {name}")).collect();
    let dropped = match chosen.monomials {
        Monomials::All => "",
        Monomials::Needed => ", without the monomials the tolerance does not need",
    };
    let fitted = match chosen.polynomials {
        Polynomials::Taylor => "",
        Polynomials::Economised => ", its coefficients fitted to a map of higher orders",
    };
    let numbers = match chosen.precision {
        FloatFormat::F32 => ", in single precision",
        FloatFormat::F64 => "",
    };
    let map = format!(
        "(N, W) = {orders}{weights}{fitted}{dropped}{numbers} ({} coefficients)",
        chosen.coefficients
    );
    let error = |value: Option<f64>| {
        value.map_or("no finite error".to_owned(), |value| format!("{value:.2e}"))
    };
    let sample = error(chosen.error);
    let fresh = match chosen.fresh_points {
        0 => String::new(),
        points => format!(", {} on {points} fresh points", error(chosen.fresh_error)),
    };
    let tolerance = chosen.tolerance;
    if chosen.met {
        format!(
            "The cheapest map within {tolerance:.0e} has the orders {map}: largest error {sample} \
                on the sample{fresh}.{}{}",
            least_orders_words(chosen),
            single_precision_words(chosen)
        )
    } else {
        format!(
            "No map tried stays within {tolerance:.0e} of direct simulation on the window{}; the \
                most accurate has the orders {map}: largest error {sample} on the sample{fresh}.",
            chosen.limit.map_or(String::new(), |limit| format!(
                " ({})",
                limit_words(limit, chosen.precision)
            ))
        )
    }
}

/// What maps of other sections cost for the same tolerance, in words; nothing where none were
/// chosen.
pub fn sections_words(study: &ConvergenceStudy) -> String {
    if study.sections.is_empty() {
        return String::new();
    }
    let others = study.sections.iter();
    let others: Vec<String> = others.map(|other| SectionCost::of(other).words()).collect();
    let own = Some(&study.chosen).filter(|chosen| chosen.met);
    let own = own.map_or(usize::MAX, |chosen| chosen.operations);
    let cheapest = study.sections.iter().filter_map(SectionChoice::operations);
    let verdict = match cheapest.min() {
        Some(least) if least < own => "another section is cheaper",
        _ => "no other section is cheaper",
    };
    format!(
        "Operations of a step on other sections for the same tolerance on the same orbits, beside \
            {}: {}; {verdict}.",
        study.chosen.operations,
        others.join("; ")
    )
}

/// Orders that no choice goes below, and why, in words; nothing where there are none.
pub fn least_orders_words(chosen: &Choice) -> String {
    let because = |least: LeastOrders| {
        format!(
            " The least orders are {} because xi_1 is near 0 on the window: a contact of depth \
                y^2 moves the next depth by {:.1e} y (to within {:.1e} over the parameters) and \
                {:.1e} y^2, y being at most {:.1e}; a choice has that to a hundredth near the \
                graze, to a tenth at the window's edge.",
            least.orders, least.linear, least.spread, least.quadratic, least.largest
        )
    };
    chosen.least_orders.map_or(String::new(), because)
}

/// Whether single precision would do, in words; nothing where it was not measured.
fn single_precision_words(chosen: &Choice) -> String {
    let Some(error) = chosen.single_precision_error else {
        return String::new();
    };
    let would = if error <= chosen.tolerance { "would" } else { "would not" };
    format!(" In single precision its largest error is {error:.2e}: f32 {would} do.")
}

/// What keeps maps from meeting a tolerance, in words.
pub fn limit_words(limit: Limit, precision: FloatFormat) -> &'static str {
    match (limit, precision) {
        (Limit::Orders, _) => "the highest orders expanded leave out more",
        (Limit::Radius, _) => "the window reaches to where the series cease to converge",
        (Limit::Rounding, FloatFormat::F64) => "rounding in double precision is more",
        (Limit::Rounding, FloatFormat::F32) => "rounding in single precision is more",
    }
}

/// How far the chosen map holds, in words.
pub fn validity_words(validity: &Validity) -> String {
    let tolerance = validity.tolerance;
    match (validity.scale, validity.depth) {
        (Some(scale), Some(depth)) => format!(
            "It stays within {tolerance:.0e} on {} times the scene's window; with the half-widths \
                of that, to the depth {depth:.2e}.",
            significant(scale, 3)
        ),
        _ => format!("It stays within {tolerance:.0e} on no window, however small."),
    }
}

/// Where the chosen map is more accurate than direct simulation in double precision, in words.
pub fn accuracy_words(accuracy: &DepthAccuracy) -> String {
    match accuracy.crossing {
        Some(depth) => format!(
            "In windows of a depth below {depth:.1e} it is more accurate than direct simulation \
                in double precision."
        ),
        None => {
            "In no window measured is it more accurate than direct simulation in double precision."
                .to_owned()
        }
    }
}
