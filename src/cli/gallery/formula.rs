//! Expressions of numbers, in the language of scenes.

use grazemap::Scene;
use grazemap::model::catalogue;

/// The value of an expression in which names stand for numbers; `None` where it is no expression.
///
/// A scene reads an expression of numbers as the value of a parameter.
pub(super) fn evaluate(expression: &str, named: &[(&str, f64)]) -> Option<f64> {
    const SCENE: &str = "linear";
    const PARAMETER: &str = "omega";
    let value = format!("\"{}\"", inserted(expression, named));
    let overrides = [(PARAMETER.to_owned(), value)];
    let scene = Scene::parse_with(catalogue::text(SCENE)?, SCENE, &overrides).ok()?;
    let mut parameters = scene.model.parameters.iter();
    Some(parameters.find(|parameter| parameter.name == PARAMETER)?.value.to_f64())
}

/// The expression with the numbers in the places of their names.
fn inserted(expression: &str, named: &[(&str, f64)]) -> String {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let (mut text, mut word) = (String::new(), String::new());
    for letter in expression.chars().chain([' ']) {
        if is_part(letter) {
            word.push(letter);
            continue;
        }
        match named.iter().find(|(name, _)| *name == word) {
            Some((_, value)) => text.push_str(&format!("({value:e})")),
            None => text.push_str(&word),
        }
        word.clear();
        text.push(letter);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_for_their_numbers() {
        let value = evaluate("2*sqrt(a) + ab^2 - 1.5e-1", &[("a", 9.0), ("ab", -0.5)]);
        assert_eq!(value, Some(6.1));
        assert_eq!(evaluate("2*c", &[("a", 9.0)]), None);
    }
}
