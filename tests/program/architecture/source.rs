//! Reader of source files, as far as the architecture rules need it: code without comments, strings
//! and unit tests; modules declared, items defined and imported, paths named.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the root of a package: `["analysis", "periodic"]`.
pub(super) type ModulePath = Vec<String>;

/// Module by its package and its path in the package.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    pub(super) package: usize,
    pub(super) path: ModulePath,
}

/// Result of resolving a path.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Module found, or the module whose file defines the item.
    pub(super) place: Place,
    pub(super) is_module: bool,
    /// All modules on the way, including those that only re-export the item.
    pub(super) way: Vec<Place>,
}

/// `use path as name`.
#[derive(Clone, Debug)]
struct Import {
    path: Vec<String>,
    name: String,
    is_glob: bool,
    /// Whether the name is re-exported: `pub use`.
    is_public: bool,
}

/// Contents of a file, from its tokens.
#[derive(Debug, Default)]
pub(super) struct Module {
    pub(super) file: PathBuf,
    /// Modules declared in the file.
    pub(super) children: Vec<String>,
    imports: Vec<Import>,
    /// Paths of two or more segments outside of imports.
    paths: Vec<Vec<String>>,
    /// Single words outside of imports.
    words: BTreeSet<String>,
    defined: BTreeSet<String>,
    /// Names of the types defined, each with whether it is `pub`.
    pub(super) types: Vec<(String, bool)>,
}

/// Package of the workspace to which the rules apply.
#[derive(Debug)]
pub(super) struct Package {
    /// Name of the package in other packages.
    name: String,
    pub(super) modules: BTreeMap<ModulePath, Module>,
}

/// Packages of the workspace.
#[derive(Debug)]
pub(super) struct House {
    pub(super) packages: Vec<Package>,
}

impl House {
    /// Reads the package in a folder and those in `crates/`.
    pub(super) fn read(folder: &Path) -> Self {
        let mut folders = vec![folder.to_owned()];
        if let Ok(entries) = fs::read_dir(folder.join("crates")) {
            folders.extend(entries.map(|entry| entry.expect("a readable entry").path()));
        }
        folders.retain(|folder| folder.join("Cargo.toml").exists());
        folders.sort();
        Self { packages: folders.iter().map(|folder| Package::read(folder)).collect() }
    }

    pub(super) fn module(&self, place: &Place) -> &Module {
        &self.packages[place.package].modules[&place.path]
    }

    /// All modules.
    pub(super) fn places(&self) -> Vec<Place> {
        let packages = self.packages.iter().enumerate();
        let of = |(package, all): (usize, &Package)| {
            let place = move |path: &ModulePath| Place { package, path: path.clone() };
            all.modules.keys().map(place).collect::<Vec<_>>()
        };
        packages.flat_map(of).collect()
    }

    /// Resolves a path in a module; `None` if it leads outside the workspace.
    pub(super) fn find(&self, from: &Place, path: &[String]) -> Option<Found> {
        self.find_within(from, path, 16)
    }

    fn find_within(&self, from: &Place, path: &[String], depth: usize) -> Option<Found> {
        let (first, rest) = path.split_first()?;
        let depth = depth.checked_sub(1)?;
        let root = |package| Place { package, path: Vec::new() };
        let named = |package: &Package| package.name == *first;
        let start = match first.as_str() {
            "crate" => root(from.package),
            "self" => from.clone(),
            "super" => {
                let mut place = from.clone();
                place.path.pop()?;
                return self.walk(place, rest, depth);
            }
            _ => {
                // A name of the file itself, or a package.
                if let Some(found) = self.step(from, first, depth) {
                    return self.go_on(found, rest, depth);
                }
                root(self.packages.iter().position(named)?)
            }
        };
        self.walk(start, rest, depth)
    }

    /// Follows the rest of a path from a module.
    fn walk(&self, place: Place, rest: &[String], depth: usize) -> Option<Found> {
        let found = Found { way: vec![place.clone()], place, is_module: true };
        self.go_on(found, rest, depth)
    }

    fn go_on(&self, found: Found, rest: &[String], depth: usize) -> Option<Found> {
        let Some((next, rest)) = rest.split_first() else {
            return Some(found);
        };
        if !found.is_module {
            return Some(found);
        }
        if next == "super" {
            let mut place = found.place;
            place.path.pop()?;
            return self.walk(place, rest, depth);
        }
        let mut ahead = self.step(&found.place, next, depth).unwrap_or(Found {
            place: found.place.clone(),
            is_module: false,
            way: Vec::new(),
        });
        ahead.way = [found.way, ahead.way].concat();
        self.go_on(ahead, rest, depth)
    }

    /// Resolves a name in a module: a child, an item, or an import.
    fn step(&self, place: &Place, name: &String, depth: usize) -> Option<Found> {
        let module = self.module(place);
        if module.children.contains(name) {
            let mut child = place.clone();
            child.path.push(name.clone());
            return Some(Found { way: vec![child.clone()], place: child, is_module: true });
        }
        if module.defined.contains(name) {
            return Some(Found { place: place.clone(), is_module: false, way: Vec::new() });
        }
        let depth = depth.checked_sub(1)?;
        let by_name = |import: &&Import| !import.is_glob && import.name == *name;
        // NOTE: an import whose first word is its own name (`use name;`) would lead back here.
        let mut imports = module.imports.iter().filter(by_name);
        if let Some(import) = imports.find(|import| import.path.len() > 1) {
            return self.find_within(place, &import.path, depth);
        }
        let globs = module.imports.iter().filter(|import| import.is_glob);
        let mut inside = globs.filter_map(|glob| {
            let found = self.find_within(place, &glob.path, depth)?;
            let found = found.is_module.then_some(found)?;
            let ahead = self.step(&found.place, name, depth)?;
            Some(Found { way: [found.way, ahead.way].concat(), ..ahead })
        });
        inside.next()
    }

    /// Everything in the workspace that a module names, with its paths.
    pub(super) fn named(&self, from: &Place) -> Vec<(String, Found)> {
        let find = |path: &Vec<String>| Some((path.join("::"), self.find(from, path)?));
        self.module(from).all_paths().filter_map(find).collect()
    }

    /// Modules whose items a module uses; re-exports do not count.
    pub(super) fn used(&self, from: &Place) -> BTreeSet<Place> {
        let module = self.module(from);
        let mut used = BTreeSet::new();
        for import in &module.imports {
            if import.is_public && !module.words.contains(&import.name) {
                continue;
            }
            let found = self.find(from, &import.path);
            // NOTE: paths that begin with the name of a module show which of its items are used.
            let found = found.filter(|found| !found.is_module || import.is_glob);
            used.extend(found.map(|found| found.place));
        }
        let found = module.paths.iter().filter_map(|path| self.find(from, path));
        used.extend(found.filter(|found| !found.is_module).map(|found| found.place));
        used.remove(from);
        used
    }
}

impl Package {
    fn read(folder: &Path) -> Self {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = "));
        let name = name.expect("a name").trim_matches('"').replace('-', "_");
        let mut modules = BTreeMap::new();
        let source = folder.join("src");
        let mut root = Module { file: source.clone(), ..Module::default() };
        for file in ["lib.rs", "main.rs"].map(|file| source.join(file)) {
            if file.exists() {
                let read = Module::read(&file);
                add_children(&read, &source, &[], &mut modules);
                root.children.extend(read.children);
                root.imports.extend(read.imports);
                root.paths.extend(read.paths);
                root.words.extend(read.words);
                root.defined.extend(read.defined);
                root.types.extend(read.types);
            }
        }
        modules.insert(Vec::new(), root);
        Self { name, modules }
    }
}

/// Reads the modules that a module declares, with files in a folder.
fn add_children(
    module: &Module,
    folder: &Path,
    path: &[String],
    modules: &mut BTreeMap<ModulePath, Module>,
) {
    for child in &module.children {
        let inside = folder.join(child);
        let file = [folder.join(format!("{child}.rs")), inside.join("mod.rs")]
            .into_iter()
            .find(|file| file.exists())
            .unwrap_or_else(|| panic!("{} declares `{child}`", module.file.display()));
        let read = Module::read(&file);
        let path = [path, std::slice::from_ref(child)].concat();
        add_children(&read, &inside, &path, modules);
        modules.insert(path, read);
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Token {
    Word(String),
    /// `::`
    Into,
    Sign(char),
}

impl Module {
    fn read(file: &Path) -> Self {
        let text = fs::read_to_string(file).expect("a readable source file");
        Self { file: file.to_owned(), ..Self::parse(&text) }
    }

    pub(super) fn parse(text: &str) -> Self {
        let tokens = without_unit_tests(tokens(text));
        let word = |at: usize| match tokens.get(at) {
            Some(Token::Word(word)) => Some(word.as_str()),
            _ => None,
        };
        let sign = |at: usize, sign: char| tokens.get(at) == Some(&Token::Sign(sign));
        let mut module = Self::default();
        let (mut at, mut depth) = (0, 0);
        while at < tokens.len() {
            let Some(first) = word(at) else {
                depth += i32::from(sign(at, '{')) - i32::from(sign(at, '}'));
                at += 1;
                continue;
            };
            match first {
                "use" if !sign(at + 1, '<') => {
                    let is_public = at > 0 && (word(at - 1) == Some("pub") || sign(at - 1, ')'));
                    at = module.import(&tokens, at + 1, &[], is_public);
                    continue;
                }
                "mod" if sign(at + 2, ';') => {
                    module.children.extend(word(at + 1).map(str::to_owned));
                    at += 2;
                    continue;
                }
                "struct" | "enum" | "trait" | "type" if depth == 0 => {
                    let is_public = at > 0 && word(at - 1) == Some("pub");
                    let name = word(at + 1).map(str::to_owned);
                    module.types.extend(name.clone().map(|name| (name, is_public)));
                    module.defined.extend(name);
                }
                "fn" | "const" | "static" if depth == 0 => {
                    module.defined.extend(word(at + 1).map(str::to_owned));
                }
                "macro_rules" => module.defined.extend(word(at + 2).map(str::to_owned)),
                _ => {}
            }
            let mut path = vec![first.to_owned()];
            while tokens.get(at + 1) == Some(&Token::Into) {
                let Some(next) = word(at + 2) else { break };
                path.push(next.to_owned());
                at += 2;
            }
            module.words.insert(path[0].clone());
            if path.len() > 1 {
                module.paths.push(path);
            }
            at += 1;
        }
        module
    }

    /// Paths of imports, then other paths.
    pub(super) fn all_paths(&self) -> impl Iterator<Item = &Vec<String>> {
        let imports = self.imports.iter().map(|import| &import.path);
        imports.chain(&self.paths)
    }

    /// Reads one tree of an import; returns the place after it.
    fn import(
        &mut self,
        tokens: &[Token],
        mut at: usize,
        prefix: &[String],
        is_public: bool,
    ) -> usize {
        let mut path = prefix.to_vec();
        let mut name = None;
        let mut is_glob = false;
        while let Some(token) = tokens.get(at) {
            match token {
                Token::Word(word) if word == "as" => {
                    if let Some(Token::Word(alias)) = tokens.get(at + 1) {
                        name = Some(alias.clone());
                    }
                    at += 1;
                }
                Token::Word(word) => path.push(word.clone()),
                Token::Into => {}
                Token::Sign('*') => is_glob = true,
                Token::Sign('{') => {
                    at += 1;
                    while tokens.get(at).is_some_and(|token| *token != Token::Sign('}')) {
                        at = self.import(tokens, at, &path, is_public);
                        if tokens.get(at) == Some(&Token::Sign(',')) {
                            at += 1;
                        }
                    }
                    return at + 1;
                }
                Token::Sign(_) => break,
            }
            at += 1;
        }
        // `use a::{self, b}` imports `a`.
        if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let name = name.or_else(|| path.last().cloned());
        self.imports.push(Import { name: name.unwrap_or_default(), path, is_glob, is_public });
        at
    }
}

/// Words and signs of a source text, without comments, strings and characters.
fn tokens(text: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = length_of_text(rest) {
            length
        } else if first.is_alphabetic() || first == '_' {
            let is_end = |c: char| !(c.is_alphanumeric() || c == '_');
            let length = rest.find(is_end).unwrap_or(rest.len());
            tokens.push(Token::Word(rest[..length].to_owned()));
            length
        } else if rest.starts_with("::") {
            tokens.push(Token::Into);
            2
        } else {
            if !first.is_whitespace() && !first.is_numeric() {
                tokens.push(Token::Sign(first));
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// Length of the string, character or lifetime at the start of a text.
fn length_of_text(text: &str) -> Option<usize> {
    let raw = text.strip_prefix('b').unwrap_or(text).strip_prefix('r');
    if let Some(raw) = raw {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        if raw[hashes..].starts_with('"') {
            let close = format!("\"{}", "#".repeat(hashes));
            let start = text.len() - raw.len() + hashes + 1;
            return Some(
                text[start..].find(&close).map_or(text.len(), |end| start + end + close.len()),
            );
        }
    }
    let start = text.len() - text.strip_prefix('b').unwrap_or(text).len();
    let quote = text[start..].chars().next().filter(|c| ['"', '\''].contains(c))?;
    let inside = &text[start + 1..];
    if quote == '\'' && !inside.starts_with('\\') && inside.chars().nth(1) != Some('\'') {
        let is_end = |c: char| !(c.is_alphanumeric() || c == '_');
        return Some(start + 1 + inside.find(is_end).unwrap_or(inside.len()));
    }
    let mut escaped = false;
    let end = inside.find(|c| {
        let is_end = c == quote && !escaped;
        escaped = c == '\\' && !escaped;
        is_end
    });
    Some(end.map_or(text.len(), |end| start + end + 2))
}

/// Removes test-only code: the item after `#[cfg(test)]`, to its end.
fn without_unit_tests(tokens: Vec<Token>) -> Vec<Token> {
    let word = |word: &str| Token::Word(word.to_owned());
    let [hash, open, close] = ['#', '[', ']'].map(Token::Sign);
    let [left, right] = ['(', ')'].map(Token::Sign);
    let attribute = [hash, open, word("cfg"), left, word("test"), right, close];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if !tokens[at..].starts_with(&attribute) {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        let mut depth = 0;
        while at < tokens.len() {
            let token = &tokens[at];
            at += 1;
            match token {
                Token::Sign('{') => depth += 1,
                Token::Sign('}') => depth -= 1,
                _ => {}
            }
            let is_end = matches!(token, Token::Sign(';' | '}')) && depth == 0;
            if is_end {
                break;
            }
        }
    }
    kept
}
