//! Comparison of functions of [`Dd`] with digits computed elsewhere (mpmath 1.3, 60 digits).

use super::Dd;

/// Asserts that `function` maps each argument to its value within the relative tolerance.
pub(super) fn assert_agrees(function: impl Fn(Dd) -> Dd, digits: &[(&str, &str)], tolerance: f64) {
    for (argument, value) in digits {
        let exact = Dd::from_decimal(value).expect("digits of the test");
        let found = function(Dd::from_decimal(argument).expect("digits of the test"));
        let error = ((found - exact) / exact).abs().to_f64();
        assert!(
            error < tolerance,
            "at {argument}: {found}, not {exact}: {error:e}"
        );
    }
}
