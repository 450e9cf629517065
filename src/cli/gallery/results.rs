//! Numbers in the JSON that commands write.

use serde_json::Value;

use grazemap::iteration::OrbitName;

/// The value at a path: keys and places in lists, parted by `/`.
///
/// In a list, `key=value` takes the element whose `key` is the word `value` or the number nearest
/// to it, and `a=b&c=d` the one nearest to the last among those equal in all others; a key inside
/// a key is `outer.inner`. `count` is the length of a list, and `count(key=value)` the number of
/// its elements with that value. An object that names an orbit is its name in words.
pub(super) fn find(document: &Value, path: &str) -> Option<Value> {
    let mut value = document;
    for segment in path.split('/') {
        if let Some(counted) = count(value, segment) {
            return Some(counted.into());
        }
        value = match value {
            Value::Array(list) if segment.contains('=') => select(list, segment)?,
            Value::Array(list) => list.get(segment.parse::<usize>().ok()?)?,
            other => other.get(segment)?,
        };
    }
    let name: Result<OrbitName, _> = serde_json::from_value(value.clone());
    Some(name.map_or_else(|_| value.clone(), |name| name.to_string().into()))
}

fn count(value: &Value, segment: &str) -> Option<usize> {
    let list = value.as_array()?;
    let condition = segment.strip_prefix("count")?;
    if condition.is_empty() {
        return Some(list.len());
    }
    let (key, wanted) = condition.strip_prefix('(')?.strip_suffix(')')?.split_once('=')?;
    Some(list.iter().filter(|element| is_equal(element, key, wanted)).count())
}

fn select<'a>(list: &'a [Value], segment: &str) -> Option<&'a Value> {
    let (all, last) = segment.rsplit_once('&').unwrap_or(("", segment));
    let conditions = all.split('&').filter_map(|condition| condition.split_once('='));
    let mut candidates = list
        .iter()
        .filter(|element| conditions.clone().all(|(key, wanted)| is_equal(element, key, wanted)));
    let (key, wanted) = last.split_once('=')?;
    let Ok(number) = wanted.parse::<f64>() else {
        return candidates.find(|element| is_equal(element, key, wanted));
    };
    let distance = |element: &Value| {
        let value = inner(element, key).and_then(Value::as_f64);
        value.map_or(f64::INFINITY, |value| (value - number).abs())
    };
    candidates.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn is_equal(element: &Value, key: &str, wanted: &str) -> bool {
    let word = inner(element, key).map(|value| match value {
        Value::String(word) => word.clone(),
        other => other.to_string(),
    });
    word.as_deref() == Some(wanted)
}

fn inner<'a>(element: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(element, |value, key| match value {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        other => other.get(key),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_leads_by_keys_places_and_nearest_values() {
        let document = serde_json::json!({
            "list": [
                {"n": 1, "at": {"omega": 2.0}, "word": "a"},
                {"n": 2, "at": {"omega": 2.1}, "word": "b"},
                {"n": 2, "at": {"omega": 4.0}, "word": "c"},
            ],
            "orbit": {"hits": [1, 1], "periods": 3},
        });
        let found = |path| find(&document, path).map(|value| value.to_string());
        assert_eq!(found("list/1/at/omega").as_deref(), Some("2.1"));
        assert_eq!(found("list/at.omega=2.09/word").as_deref(), Some("\"b\""));
        assert_eq!(found("list/n=2&at.omega=1.0/word").as_deref(), Some("\"b\""));
        assert_eq!(found("list/word=c/n").as_deref(), Some("2"));
        assert_eq!(found("list/count").as_deref(), Some("3"));
        assert_eq!(found("list/count(n=2)").as_deref(), Some("2"));
        assert_eq!(found("orbit").as_deref(), Some("\"(1,1,3)\""));
        assert_eq!(found("list/7/n"), None);
        assert_eq!(found("list/word=d"), None);
    }
}
