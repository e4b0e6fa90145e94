//! A crate's modules and the file that defines each name, through `use` and re-exports.

use std::collections::{BTreeMap, BTreeSet};

use super::facts::{Facts, Scope};

/// Names that lead to one another must end somewhere.
const MOST_STEPS: usize = 32;

/// One crate.
pub struct Crate<'a> {
    /// By the path below the crate's root: the module's file and its contents.
    modules: BTreeMap<Vec<String>, Module<'a>>,
    exported_macros: BTreeMap<&'a str, &'a str>,
}

/// A module.
#[derive(Clone, Copy)]
pub struct Module<'a> {
    pub file: &'a str,
    pub scope: &'a Scope,
}

/// What a path leads to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Target<'a> {
    Module(Vec<String>),
    /// An item, or something in it, by the name it has in its file.
    Item {
        file: &'a str,
        name: String,
    },
}

impl<'a> Crate<'a> {
    /// The crate whose root is the file `root`; None if there is no such file.
    pub fn read(root: &'a str, files: &'a BTreeMap<String, Facts>) -> Option<Self> {
        let mut new = Self { modules: BTreeMap::new(), exported_macros: BTreeMap::new() };
        let (root, facts) = files.get_key_value(root)?;
        let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
        new.add_file(root, facts, &[], folder, files);
        Some(new)
    }

    fn add_file(
        &mut self,
        file: &'a str,
        facts: &'a Facts,
        path: &[String],
        folder: &str,
        files: &'a BTreeMap<String, Facts>,
    ) {
        self.exported_macros.extend(facts.exported_macros.iter().map(|name| (name.as_str(), file)));
        for scope in &facts.scopes {
            let here = [path, &scope.path].concat();
            for (name, at) in &scope.children {
                let below = [&[folder.to_owned()], scope.path.as_slice(), std::slice::from_ref(name)]
                    .concat()
                    .join("/");
                let own = file.rsplit_once('/').map_or("", |(own, _)| own);
                let places = match at {
                    Some(at) => vec![format!("{own}/{at}")],
                    None => vec![format!("{below}.rs"), format!("{below}/mod.rs")],
                };
                if let Some((child, facts)) = places.iter().find_map(|place| files.get_key_value(place)) {
                    self.add_file(
                        child,
                        facts,
                        &[here.as_slice(), std::slice::from_ref(name)].concat(),
                        &below,
                        files,
                    );
                }
            }
            self.modules.insert(here, Module { file, scope });
        }
    }

    /// Every module with its path.
    pub fn modules(&self) -> impl Iterator<Item = (&[String], Module<'a>)> {
        self.modules.iter().map(|(path, module)| (path.as_slice(), *module))
    }

    /// What `path` means in the module at `from`; None for other crates and for what is no module's.
    pub fn resolve(&self, from: &[String], path: &[String]) -> Option<Target<'a>> {
        self.resolve_within(from, path, MOST_STEPS)
    }

    fn resolve_within(&self, from: &[String], path: &[String], steps: usize) -> Option<Target<'a>> {
        let steps = steps.checked_sub(1)?;
        let (mut at, mut rest) = (from.to_vec(), path);
        let mut is_ours = false;
        while let Some((first, tail)) = rest.split_first() {
            match first.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ => break,
            }
            (rest, is_ours) = (tail, true);
        }
        while let Some((name, tail)) = rest.split_first() {
            match self.lookup(&at, name, tail.is_empty(), steps) {
                Some(Target::Module(module)) => at = module,
                Some(item) => return Some(item),
                // What a macro defines stands where the macro is called.
                None if is_ours => {
                    let file = self.modules.get(&at)?.file;
                    return Some(Target::Item { file, name: name.clone() });
                }
                None => return None,
            }
            (rest, is_ours) = (tail, true);
        }
        Some(Target::Module(at))
    }

    /// A name in a module. A module and an item may share one: at a path's end the item is meant.
    pub fn lookup(&self, at: &[String], name: &str, is_last: bool, steps: usize) -> Option<Target<'a>> {
        let module = *self.modules.get(at)?;
        let child = [at, &[name.to_owned()]].concat();
        let child = self.modules.contains_key(&child).then_some(Target::Module(child));
        if !is_last && child.is_some() {
            return child;
        }
        if module.scope.defined.contains(name) {
            return Some(Target::Item { file: module.file, name: name.to_owned() });
        }
        if at.is_empty()
            && let Some(file) = self.exported_macros.get(name)
        {
            return Some(Target::Item { file, name: name.to_owned() });
        }
        let imports = module.scope.imports.iter();
        let named = imports.clone().filter(|import| import.name == name);
        // `use a::a` in the module that has `mod a` must not look for itself.
        let named = named
            .filter(|import| import.path.len() > 1 || import.path.first().is_some_and(|first| first != name));
        for import in named {
            if let Some(target) = self.resolve_within(at, &import.path, steps) {
                return Some(target);
            }
        }
        if child.is_some() {
            return child;
        }
        let steps = steps.checked_sub(1)?;
        imports.filter(|import| import.name == "*").find_map(|import| {
            match self.resolve_within(at, &import.path, steps)? {
                Target::Module(module) if module != at => self.lookup(&module, name, is_last, steps),
                _ => None,
            }
        })
    }

    /// Which files each file takes names from, and the names.
    ///
    /// A module that names its own children (declares them, lists them in a table, calls them) makes no edge: a table of models
    /// stands beside the type that every model fills in.
    pub fn edges(&self) -> BTreeMap<(&'a str, &'a str), BTreeSet<String>> {
        let mut edges: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
        for (path, module) in self.modules() {
            let children: BTreeSet<&str> = self
                .modules()
                .filter(|(below, _)| below.starts_with(path))
                .map(|(_, child)| child.file)
                .collect();
            let mut add = |target: Option<Target<'a>>| {
                if let Some(Target::Item { file, name }) = target
                    && !children.contains(file)
                {
                    edges.entry((module.file, file)).or_default().insert(name);
                }
            };
            for import in &module.scope.imports {
                // To pass a name on is not to take it, unless it is used here as well.
                if import.is_public && !module.scope.words.contains(&import.name) {
                    continue;
                }
                let target = self.resolve(path, &import.path);
                match target {
                    Some(Target::Module(from)) if import.name == "*" && !import.is_public => {
                        for word in &module.scope.words {
                            add(self.lookup(&from, word, true, MOST_STEPS));
                        }
                    }
                    target => add(target),
                }
            }
            for (mention, _) in &module.scope.mentions {
                add(self.resolve(path, mention));
            }
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The edges of a crate of these files, as `from -> to: names`.
    fn edges(files: &[(&str, &str)]) -> Vec<String> {
        let facts = files.iter().map(|(path, text)| ((*path).to_owned(), Facts::read(text).expect(path)));
        let facts = facts.collect();
        let edges = Crate::read("src/lib.rs", &facts).expect("a root").edges();
        let names = |names: &BTreeSet<String>| names.iter().cloned().collect::<Vec<_>>().join(", ");
        edges.iter().map(|((from, to), taken)| format!("{from} -> {to}: {}", names(taken))).collect()
    }

    #[test]
    fn a_re_exported_name_counts_as_the_file_s_that_defines_it() {
        let files = [
            ("src/lib.rs", "mod a; mod b; pub use b::B;"),
            ("src/a.rs", "use crate::{B, b::{self, C as D}}; fn f() { b::deep::e(); self::f() }"),
            ("src/b/mod.rs", "mod own; pub mod deep; pub use self::own::*; pub use own::C;"),
            ("src/b/own.rs", "pub struct B; pub struct C;"),
            ("src/b/deep.rs", "pub fn e() { super::C }"),
        ];
        assert_eq!(
            edges(&files),
            [
                "src/a.rs -> src/b/deep.rs: e",
                "src/a.rs -> src/b/own.rs: B, C",
                "src/b/deep.rs -> src/b/own.rs: C"
            ]
        );
    }

    #[test]
    fn naming_a_child_is_no_edge_and_using_a_parent_s_item_is_one() {
        let files = [
            ("src/lib.rs", "mod a; use a::A; struct Own(A);"),
            ("src/a.rs", "pub struct A(super::Own, std::net::TcpStream);"),
        ];
        assert_eq!(edges(&files), ["src/a.rs -> src/lib.rs: Own"]);
        assert!(edges(&[("src/lib.rs", "mod a;"), ("src/a.rs", "mod b;"), ("src/a/b.rs", "")]).is_empty());
    }

    #[test]
    fn globs_macros_and_names_that_are_modules_too() {
        let files = [
            ("src/lib.rs", "mod a; mod b; mod row;"),
            ("src/a.rs", "use crate::b::*; use crate::row::row; fn f(x: B) { crate::m!() }"),
            ("src/b.rs", "pub struct B; pub struct Unused; #[macro_export] macro_rules! m { () => {} }"),
            ("src/row.rs", "pub fn row() {}"),
        ];
        assert_eq!(edges(&files), ["src/a.rs -> src/b.rs: B, m", "src/a.rs -> src/row.rs: row"]);
    }
}
