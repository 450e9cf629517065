//! Scenes of the catalogue with changes that a user, a slip or an attacker could make.

use grazemap::model::catalogue;

use crate::random::Random;

/// Values that number parsers often mishandle, and values of other types.
pub(super) const VALUES: [&str; 32] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "0.5",
    "3",
    "7",
    "64",
    "1e-9",
    "1e9",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "9223372036854775808",
    "0x10",
    "1_000",
    "true",
    "\"\"",
    "\"x\"",
    "\"pi\"",
    "\"1/3\"",
    "[]",
    "{}",
    "[1, 2]",
    "1979-05-27",
];

/// Functions of the expression language.
const FUNCTIONS: [&str; 17] = [
    "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh",
    "abs", "sign", "min", "max", "atan2",
];

/// Tables that change the request of a scene.
const TABLES: [&str; 10] = [
    "[section]\nkind = \"stroboscopic\"\n",
    "[section]\nkind = \"any\"\n",
    "[section]\nkind = \"stroboscopic\"\nphase = 1.0\n",
    "[emit]\nshape = \"flown\"\n",
    "[emit]\nshape = \"composed\"\nprecision = \"f32\"\n",
    "[window]\ndepth = 1e300\n",
    "[expansion]\n",
    "[[chart]]\n",
    "[[diagram]]\n",
    "[[model.surface]]\n",
];

/// Scene of the catalogue with one to four changes.
pub(crate) fn scene(random: &mut Random) -> String {
    let names: Vec<&str> = catalogue::names().collect();
    let text = catalogue::text(random.of(&names)).unwrap_or_default();
    let mut text = text.to_owned();
    for _ in 0..=random.below(4) {
        text = mutated(&text, random);
    }
    text
}

fn mutated(text: &str, random: &mut Random) -> String {
    match random.below(12) {
        0..=3 => with_number(text, random),
        4 | 5 => with_expression(text, random),
        6 => with_lines(text, random),
        7 => with_word(text, random),
        8 => with_characters(text, random),
        9 => with_lets(text, random),
        10 => format!("{text}\n{}", random.of(&TABLES)),
        _ => with_list(text, random),
    }
}

/// Byte ranges of the longest runs of characters that a test accepts.
fn runs(text: &str, takes: impl Fn(char) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (place, character) in text.char_indices().filter(|&(_, character)| takes(character)) {
        match runs.last_mut() {
            Some((_, end)) if *end == place => *end = place + character.len_utf8(),
            _ => runs.push((place, place + character.len_utf8())),
        }
    }
    runs
}

fn replaced(text: &str, (start, end): (usize, usize), by: &str) -> String {
    format!("{}{by}{}", &text[..start], &text[end..])
}

/// Replaces a number: by an extreme one, another power of ten, or another last digit.
fn with_number(text: &str, random: &mut Random) -> String {
    let mut numbers = runs(text, |character| character.is_ascii_digit() || character == '.');
    numbers.retain(|&(start, _)| {
        let before = text[..start].chars().next_back();
        before.is_none_or(|before| !before.is_ascii_alphanumeric() && before != '_')
    });
    if numbers.is_empty() {
        return text.to_owned();
    }
    let place = random.of(&numbers);
    let old = &text[place.0..place.1];
    let power = random.below(13) as i32 - 6;
    let new = match random.below(4) {
        0 => random.of(&VALUES).to_owned(),
        1 => format!("{old}e{power}"),
        2 => format!("{old}{}", random.below(10)),
        _ => (random.below(4000) as f64 / 1000.0).to_string(),
    };
    replaced(text, place, &new)
}

/// Names and words of a text.
fn words(text: &str) -> Vec<&str> {
    let word = |character: char| character.is_ascii_alphanumeric() || character == '_';
    let all = text.split(|character| !word(character));
    all.filter(|word| word.starts_with(|first: char| first.is_ascii_alphabetic())).collect()
}

/// Random expression made of the words of a text.
fn expression(text: &str, depth: usize, random: &mut Random) -> String {
    let inner = |random: &mut Random| expression(text, depth.saturating_sub(1), random);
    if depth == 0 || random.one_in(4) {
        let words = words(text);
        return match random.below(3) {
            0 if !words.is_empty() => random.of(&words).to_owned(),
            1 => random.of(&VALUES[..16]).to_owned(),
            _ => random.of(&["x", "v", "theta", "q", "u", "pi", "free", "1.5"]).to_owned(),
        };
    }
    match random.below(4) {
        0 => {
            let function = random.of(&FUNCTIONS);
            match function {
                "min" | "max" | "atan2" => {
                    format!("{function}({}, {})", inner(random), inner(random))
                }
                _ => format!("{function}({})", inner(random)),
            }
        }
        1 => format!("-({})", inner(random)),
        _ => {
            let operation = random.of(&["+", "-", "*", "/", "^"]);
            format!("({} {operation} {})", inner(random), inner(random))
        }
    }
}

/// Replaces a quoted expression: by a random one, by the old one extended, or by one that is very
/// deep or very long.
fn with_expression(text: &str, random: &mut Random) -> String {
    let quotes: Vec<usize> = text.match_indices('"').map(|(place, _)| place).collect();
    let pairs: Vec<(usize, usize)> =
        quotes.chunks_exact(2).map(|pair| (pair[0] + 1, pair[1])).collect();
    if pairs.is_empty() {
        return text.to_owned();
    }
    let place = random.of(&pairs);
    let old = &text[place.0..place.1];
    let fresh = expression(text, 1 + random.below(5), random);
    let new = match random.below(8) {
        0 => fresh,
        1 => format!("{}{old}{}", "(".repeat(20_000), ")".repeat(20_000)),
        2 => format!("{}{old}", "-".repeat(1 + random.below(5_000))),
        3 => format!("{old}{}", " + 1e-9*x".repeat(1 + random.below(3_000))),
        4 => format!("{}{old}{}", "sin(".repeat(200), ")".repeat(200)),
        5 => format!("({old})^{}", random.of(&VALUES[..16])),
        _ => format!("({old}) + 0.001*({fresh})"),
    };
    replaced(text, place, &new)
}

/// Removes, duplicates or overwrites a line.
fn with_lines(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return text.to_owned();
    }
    let (line, other) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(4) {
        0 => lines.truncate(line),
        1 => lines.insert(other, lines[line]),
        2 => lines.swap(line, other),
        _ => drop(lines.remove(line)),
    }
    lines.join("\n")
}

/// Replaces a word by another.
fn with_word(text: &str, random: &mut Random) -> String {
    let word = |character: char| character.is_ascii_alphanumeric() || character == '_';
    let places = runs(text, word);
    if places.is_empty() {
        return text.to_owned();
    }
    let place = random.of(&places);
    let long = "a".repeat(100_000);
    let new = match random.below(8) {
        0 => long.as_str(),
        1 => "\u{e4}\u{202e}\u{1f600}",
        _ => {
            let other = random.of(&places);
            &text[other.0..other.1]
        }
    };
    replaced(text, place, new)
}

/// Inserts or removes a character.
fn with_characters(text: &str, random: &mut Random) -> String {
    let ends: Vec<usize> = text.char_indices().map(|(place, _)| place).collect();
    if ends.is_empty() {
        return text.to_owned();
    }
    let place = random.of(&ends);
    let next = text[place..].chars().next().map_or(place, |next| place + next.len_utf8());
    match random.below(3) {
        0 => replaced(text, (place, next), ""),
        1 => replaced(text, (place, place), random.of(&["\0", "\t", "\r", "\"", "[", "}", "="])),
        _ => replaced(text, (place, place), random.of(&["\u{301}", "\u{feff}", "\u{10ffff}", "'"])),
    }
}

/// Adds a chain of named expressions, the last of which enters the first flow.
fn with_lets(text: &str, random: &mut Random) -> String {
    let count = 1 + random.below(200);
    let step = random.of(&["sin(l@)", "l@ + 0.001*x*sin(l@)", "l@*l@", "exp(-l@)/(1 + l@^2)"]);
    let first = "l0 = \"x\"".to_owned();
    let rest = (1..count)
        .map(|number| format!("l{number} = \"{}\"", step.replace('@', &(number - 1).to_string())));
    let lets: Vec<String> = [first].into_iter().chain(rest).collect();
    let text = text.replace("v = \"", &format!("v = \"0.001*l{} + ", count - 1));
    let without = text.replace("let = ", "old = ");
    format!("{without}\n[model.let]\n{}\n", lets.join("\n"))
}

/// Changes the number of entries of a list or a table.
fn with_list(text: &str, random: &mut Random) -> String {
    let places: Vec<usize> = text.match_indices(['[', '{', ',']).map(|(place, _)| place).collect();
    if places.is_empty() {
        return text.to_owned();
    }
    let place = random.of(&places);
    let end = text[place + 1..].find([',', ']', '}']).map_or(text.len(), |end| place + 1 + end);
    match random.below(3) {
        0 => replaced(text, (place + 1, end), ""),
        1 => {
            let entry = text[place + 1..end].to_owned();
            replaced(text, (end, end), &format!(",{entry}").repeat(1 + random.below(300)))
        }
        _ => replaced(text, (place + 1, end), random.of(&VALUES)),
    }
}
