//! Results that a later run of the same study need not compute again.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::analysis::Progress;

/// The result at a place: as an earlier run kept it, or computed and kept.
pub(super) fn resumed<T: Serialize + DeserializeOwned, E>(
    progress: &dyn Progress,
    place: &[u64],
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let kept = progress.recall(place);
    if let Some(value) = kept.and_then(|piece| serde_json::from_slice(&piece).ok()) {
        return Ok(value);
    }
    let value = compute()?;
    if let Ok(piece) = serde_json::to_vec(&value) {
        progress.keep(place, &piece);
    }
    Ok(value)
}
