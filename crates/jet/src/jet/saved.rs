//! Jets in files: the weights and the order of their space, and all coefficients in its order.
//!
//! Jets that were read share one space where their spaces are equal, as operators ask for it.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Jet, JetError, JetSpace};
use crate::numeric::Scalar;

/// Spaces of jets that were read and still live.
static READ: Mutex<Vec<Weak<JetSpace>>> = Mutex::new(Vec::new());

/// The space with these weights and this order: the one that other jets were read into, while it
/// lives.
fn shared_space(weights: &[u32], order: usize) -> Result<Arc<JetSpace>, JetError> {
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    read.retain(|space| space.strong_count() > 0);
    let mut living = read.iter().filter_map(Weak::upgrade);
    if let Some(space) = living.find(|space| space.order() == order && space.weights() == weights) {
        return Ok(space);
    }
    let space = JetSpace::new(weights, order)?;
    read.push(Arc::downgrade(&space));
    Ok(space)
}

/// A jet as it is written.
#[derive(Serialize, Deserialize)]
struct Saved<W, C> {
    weights: W,
    order: usize,
    coefficients: C,
}

impl<S: Scalar + Serialize> Serialize for Jet<S> {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        let saved = Saved {
            weights: self.space().weights(),
            order: self.space().order(),
            coefficients: self.coefficients(),
        };
        saved.serialize(serializer)
    }
}

impl<'de, S: Scalar + Deserialize<'de>> Deserialize<'de> for Jet<S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved: Saved<Vec<u32>, Vec<S>> = Deserialize::deserialize(deserializer)?;
        let space = shared_space(&saved.weights, saved.order).map_err(D::Error::custom)?;
        let (expected, found) = (space.len(), saved.coefficients.len());
        if expected != found {
            let message = format!("a jet has {found} coefficients where its space has {expected}");
            return Err(D::Error::custom(message));
        }
        Ok(Self::from_coefficients(&space, saved.coefficients))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jets_that_were_read_have_their_bits_and_share_their_space() {
        let space = JetSpace::new(&[1, 2], 3).expect("small");
        let jet = Jet::variable(&space, 0, 0.1_f64).exp();
        let text = serde_json::to_string(&[&jet, &jet]).expect("numbers");
        let [a, b]: [Jet<f64>; 2] = serde_json::from_str(&text).expect("two jets");
        let bits = |jet: &Jet<f64>| -> Vec<u64> {
            jet.coefficients().iter().map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&a), bits(&jet));
        assert!(a.is_in(b.space()) && a.space().weights() == [1, 2]);
        let short = r#"{"weights": [1], "order": 1, "coefficients": [1.0]}"#;
        assert!(serde_json::from_str::<Jet<f64>>(short).is_err());
        let zero = r#"{"weights": [0], "order": 1, "coefficients": [1.0]}"#;
        assert!(serde_json::from_str::<Jet<f64>>(zero).is_err());
    }
}
