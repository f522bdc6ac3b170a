//! The modules of a crate as its source files have them, and which file takes a name from which.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A path of modules, outermost first: `["detect", "fit"]`.
pub type ModulePath = Vec<String>;

/// One module, and what its file says.
struct Module {
    file: PathBuf,
    /// Names of the items defined in it.
    items: BTreeSet<String>,
    /// Imports: the name bound (`*` for all), the path that it stands for, whether it is
    /// re-exported.
    imports: Vec<Import>,
    /// Paths of two or more segments in its code.
    paths: Vec<Vec<String>>,
}

struct Import {
    name: String,
    path: Vec<String>,
    is_reexport: bool,
}

/// The source of one crate.
pub struct Crate {
    modules: BTreeMap<ModulePath, Module>,
}

impl Crate {
    /// Reads the files under `root`. Tests, and modules declared inside a file, are left out.
    pub fn read(root: &Path) -> Self {
        let mut modules = BTreeMap::new();
        for file in rust_files(root) {
            let Some(path) = module_path(root, &file) else {
                continue;
            };
            modules.insert(path, Module::read(&file));
        }
        Self { modules }
    }

    /// All modules with their files.
    pub fn files(&self) -> impl Iterator<Item = (&ModulePath, &Path)> {
        self.modules
            .iter()
            .map(|(path, module)| (path, module.file.as_path()))
    }

    /// For each module, the other modules in whose files the names that it uses are defined. A
    /// re-export is no use.
    pub fn uses(&self) -> BTreeMap<&ModulePath, BTreeSet<&ModulePath>> {
        self.modules
            .iter()
            .map(|(path, module)| (path, self.uses_of(path, module)))
            .collect()
    }

    fn uses_of(&self, here: &ModulePath, module: &Module) -> BTreeSet<&ModulePath> {
        let imported = module.imports.iter().filter(|import| !import.is_reexport);
        let paths = imported.map(|import| &import.path).chain(&module.paths);
        paths
            .filter_map(|path| self.definition(here, path, 0))
            .filter(|found| *found != here)
            .collect()
    }

    /// The module in whose file the item at `path`, as it is written in the module `here`, is
    /// defined.
    fn definition(&self, here: &ModulePath, path: &[String], depth: usize) -> Option<&ModulePath> {
        let (first, mut rest) = path.split_first()?;
        let mut module = match first.as_str() {
            "crate" => Vec::new(),
            "self" => here.clone(),
            "super" => here[..here.len().checked_sub(1)?].to_vec(),
            _ => return self.below(here, path, depth),
        };
        while rest.first().is_some_and(|name| name == "super") {
            module.pop()?;
            rest = &rest[1..];
        }
        self.below(&module, rest, depth)
    }

    /// The same for a path that starts in the module `start`.
    fn below(&self, start: &ModulePath, path: &[String], depth: usize) -> Option<&ModulePath> {
        const DEEPEST: usize = 8;
        let (name, rest) = path.split_first()?;
        let (known, module) = self.modules.get_key_value(start)?;
        let child: ModulePath = start.iter().chain([name]).cloned().collect();
        if self.modules.contains_key(&child) {
            return self.below(&child, rest, depth);
        }
        if module.items.contains(name) {
            return Some(known);
        }
        if depth == DEEPEST {
            return None;
        }
        let bound = module
            .imports
            .iter()
            .filter(|import| import.name == *name || import.name == "*");
        bound
            .map(|import| {
                let all = (import.name == "*").then_some(name);
                import.path.iter().chain(all).chain(rest).cloned().collect()
            })
            .find_map(|path: Vec<String>| self.definition(start, &path, depth + 1))
    }
}

impl Module {
    fn read(file: &Path) -> Self {
        let code = code(&fs::read_to_string(file).unwrap());
        let mut imports = Vec::new();
        let mut body = String::new();
        let mut at = 0;
        while let Some(start) = next_use(&code, at) {
            let end = code[start..].find(';').map_or(code.len(), |n| start + n);
            let line_start = code[..start].rfind('\n').map_or(0, |n| n + 1);
            let is_reexport = code[line_start..start].contains("pub");
            body.push_str(&code[at..line_start]);
            import_tree(
                &code[start + "use ".len()..end],
                &[],
                is_reexport,
                &mut imports,
            );
            at = end;
        }
        body.push_str(&code[at..]);
        Self {
            file: file.to_owned(),
            items: items(&body),
            imports,
            paths: paths(&body),
        }
    }
}

/// Where the next `use` at the beginning of an item stands.
fn next_use(code: &str, from: usize) -> Option<usize> {
    let found = code[from..].match_indices("use ").map(|(n, _)| from + n);
    found.into_iter().find(|&at| {
        let line_start = code[..at].rfind('\n').map_or(0, |n| n + 1);
        let before = code[line_start..at].trim();
        before.is_empty() || before.starts_with("pub") && !before.contains(['=', '{', ';'])
    })
}

/// Adds the names that `tree` (`a::{b, c as d, e::*}`) binds.
fn import_tree(tree: &str, prefix: &[String], is_reexport: bool, imports: &mut Vec<Import>) {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let outer: Vec<String> = prefix
            .iter()
            .cloned()
            .chain(segments(&tree[..open]))
            .collect();
        let inner = tree[open + 1..].trim_end().trim_end_matches('}');
        for part in parts(inner) {
            import_tree(part, &outer, is_reexport, imports);
        }
        return;
    }
    let (path, alias) = match tree.split_once(" as ") {
        Some((path, alias)) => (path, Some(alias.trim().to_owned())),
        None => (tree, None),
    };
    let mut path: Vec<String> = prefix.iter().cloned().chain(segments(path)).collect();
    if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
        path.pop();
    }
    let Some(last) = path.last().cloned() else {
        return;
    };
    if last == "*" {
        path.pop();
    }
    imports.push(Import {
        name: alias.unwrap_or(last),
        path,
        is_reexport,
    });
}

fn segments(path: &str) -> impl Iterator<Item = String> {
    let names = path.split("::").map(str::trim);
    names.filter(|name| !name.is_empty()).map(str::to_owned)
}

/// The parts of a list between commas, braces kept together.
fn parts(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                found.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    found.push(&list[start..]);
    found.retain(|part| !part.trim().is_empty());
    found
}

/// Names of the items that `code` defines.
fn items(code: &str) -> BTreeSet<String> {
    const KEYWORDS: [&str; 8] = [
        "fn",
        "struct",
        "enum",
        "trait",
        "type",
        "const",
        "static",
        "macro_rules!",
    ];
    let words: Vec<&str> = code.split_whitespace().collect();
    words
        .windows(2)
        .filter(|pair| KEYWORDS.contains(&pair[0]))
        .map(|pair| identifier(pair[1]).to_owned())
        .filter(|name| !name.is_empty())
        .collect()
}

/// The identifier at the beginning of `text`.
fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    &text[..end.unwrap_or(text.len())]
}

/// Paths of two or more segments.
fn paths(code: &str) -> Vec<Vec<String>> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    code.split(|c| !is_part(c))
        .filter(|word| word.contains("::"))
        .map(|word| segments(word).collect::<Vec<_>>())
        .filter(|path| path.len() > 1)
        .collect()
}

/// `text` without comments, strings and unit tests.
fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let mut code = String::new();
    for line in text[..tests].lines() {
        let line = line.split("//").next().unwrap_or("");
        let outside = line.split('"').step_by(2);
        code.extend(outside);
        code.push('\n');
    }
    code
}

/// The module that `file` is, under the crate's `root`; `None` for files of unit tests and for
/// another crate's.
fn module_path(root: &Path, file: &Path) -> Option<ModulePath> {
    let relative = file.strip_prefix(root).ok()?.with_extension("");
    let mut path: ModulePath = relative
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if path.last().is_some_and(|last| last == "mod") || path == ["lib"] {
        path.pop();
    }
    (path.last().is_none_or(|last| last != "tests")).then_some(path)
}

/// The Rust files under `folder`.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .flat_map(|path| {
            if path.is_dir() {
                rust_files(&path)
            } else {
                vec![path]
            }
        })
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crate_of(files: &[(&str, &str)]) -> (tempfile::TempDir, Crate) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let read = Crate::read(folder.path());
        (folder, read)
    }

    fn uses(read: &Crate, of: &str) -> Vec<String> {
        let all = read.uses();
        let (_, found) = all.iter().find(|(path, _)| path.join("::") == of).unwrap();
        found.iter().map(|path| path.join("::")).collect()
    }

    #[test]
    fn a_name_is_followed_through_re_exports_to_the_file_that_defines_it() {
        let (_folder, read) = crate_of(&[
            ("lib.rs", "pub mod a; pub mod b;"),
            (
                "a/mod.rs",
                "mod inner;\npub use inner::{Deep, other as Other};\n",
            ),
            ("a/inner.rs", "pub struct Deep;\npub fn other() {}\n"),
            (
                "b.rs",
                "use crate::a::Deep;\n// crate::c::D\nfn f() { crate::a::Other() }\n",
            ),
        ]);
        assert_eq!(uses(&read, "b"), ["a::inner"]);
        assert!(uses(&read, "a").is_empty(), "a re-export is no use");
    }

    #[test]
    fn paths_through_imported_modules_and_super_are_followed() {
        let (_folder, read) = crate_of(&[
            ("lib.rs", "pub mod a; pub mod b;"),
            ("a.rs", "pub fn f() {}"),
            (
                "b/mod.rs",
                "mod c;\nuse crate::a;\npub const N: u8 = 1;\nfn g() { a::f(); c::h() }\n",
            ),
            (
                "b/c.rs",
                "use super::N;\npub fn h() {}\n#[cfg(test)]\nmod tests {\n use crate::a::f;\n}",
            ),
        ]);
        assert_eq!(uses(&read, "b"), ["a", "b::c"]);
        assert_eq!(uses(&read, "b::c"), ["b"]);
    }
}
