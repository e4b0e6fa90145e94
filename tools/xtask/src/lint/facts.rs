//! What a Rust file says about names, test code left out: what it defines, imports and mentions, and how long its functions are.

use std::collections::BTreeSet;

use proc_macro2::{Delimiter, Ident, Span, TokenStream, TokenTree};
use quote::ToTokens;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Block, Item, UseTree, Visibility};

/// A file's facts.
#[derive(Default)]
pub struct Facts {
    /// The file itself, then its inline modules.
    pub scopes: Vec<Scope>,
    /// Functions outside tests.
    pub functions: Vec<Function>,
    /// Macros that the crate's root gets by `#[macro_export]`.
    pub exported_macros: BTreeSet<String>,
}

/// A module in a file.
#[derive(Default)]
pub struct Scope {
    /// Its name below the file's own module; empty for the file itself.
    pub path: Vec<String>,
    /// Names of its items, without modules.
    pub defined: BTreeSet<String>,
    /// Modules in files of their own, and where `#[path]` says they are.
    pub children: Vec<(String, Option<String>)>,
    pub imports: Vec<Import>,
    /// Paths of two names or more, with their lines.
    pub mentions: Vec<(Vec<String>, usize)>,
    /// Every identifier outside `use` items.
    pub words: BTreeSet<String>,
}

/// One name that a `use` brings in.
pub struct Import {
    pub path: Vec<String>,
    /// What it is called here; `*` for a glob.
    pub name: String,
    pub is_public: bool,
    pub line: usize,
}

/// A function and its length.
pub struct Function {
    pub name: String,
    pub line: usize,
    pub lines: usize,
}

impl Facts {
    /// Reads a file.
    pub fn read(text: &str) -> syn::Result<Self> {
        let file = syn::parse_file(text)?;
        let mut facts = Self::default();
        facts.add_scope(Vec::new(), &file.items);
        facts.visit_file(&file);
        Ok(facts)
    }

    fn add_scope(&mut self, path: Vec<String>, items: &[Item]) {
        let index = self.scopes.len();
        self.scopes.push(Scope { path: path.clone(), ..Scope::default() });
        let mut tokens = TokenStream::new();
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            match item {
                Item::Mod(module) => {
                    let name = module.ident.to_string();
                    match &module.content {
                        Some((_, items)) => self.add_scope([path.clone(), vec![name]].concat(), items),
                        None => {
                            let file = module.attrs.iter().find_map(path_attribute);
                            self.scopes[index].children.push((name, file));
                        }
                    }
                }
                Item::Use(item) => {
                    let is_public = !matches!(item.vis, Visibility::Inherited);
                    let line = item.span().start().line;
                    let mut add = |path, name| {
                        self.scopes[index].imports.push(Import { path, name, is_public, line });
                    };
                    flatten(&item.tree, &mut Vec::new(), &mut add);
                }
                item => {
                    self.scopes[index].defined.extend(defined_name(item));
                    if let Item::Macro(item) = item
                        && item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export"))
                    {
                        self.exported_macros.extend(item.ident.as_ref().map(Ident::to_string));
                    }
                    item.to_tokens(&mut tokens);
                }
            }
        }
        mentions(tokens, &mut self.scopes[index]);
    }
}

impl<'a> Visit<'a> for Facts {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_test(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        self.add_function(&item.sig, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if !is_test(&item.attrs) {
            self.add_function(&item.sig, &item.block);
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_trait_item_fn(&mut self, item: &'a syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.add_function(&item.sig, block);
        }
        visit::visit_trait_item_fn(self, item);
    }
}

impl Facts {
    fn add_function(&mut self, signature: &syn::Signature, block: &Block) {
        let line = signature.span().start().line;
        let lines = block.brace_token.span.close().end().line - line + 1;
        self.functions.push(Function { name: signature.ident.to_string(), line, lines });
    }
}

/// True for `#[test]`, `#[tokio::test]` and any `#[cfg(…)]` that names `test` and is not `not(test)`.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = attribute.meta.to_token_stream().to_string();
        let is_cfg = attribute.path().is_ident("cfg");
        let is_marker = attribute.path().segments.last().is_some_and(|last| last.ident == "test");
        is_marker || is_cfg && text.contains("test") && !text.contains("not") && !text.contains("\"test")
    })
}

fn path_attribute(attribute: &Attribute) -> Option<String> {
    let value = &attribute.meta.require_name_value().ok().filter(|meta| meta.path.is_ident("path"))?.value;
    let syn::Expr::Lit(literal) = value else { return None };
    let syn::Lit::Str(text) = &literal.lit else { return None };
    Some(text.value())
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::ExternCrate(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn defined_name(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}

/// Calls `add` with the path and the name of each leaf of a `use`.
fn flatten(tree: &UseTree, prefix: &mut Vec<String>, add: &mut impl FnMut(Vec<String>, String)) {
    let mut leaf = |name: &Ident, alias: &Ident| match name.to_string().as_str() {
        "self" => add(
            prefix.clone(),
            if alias == "self" { prefix.last().cloned().unwrap_or_default() } else { alias.to_string() },
        ),
        name => add([prefix.as_slice(), &[name.to_owned()]].concat(), alias.to_string()),
    };
    match tree {
        UseTree::Name(name) => leaf(&name.ident, &name.ident),
        UseTree::Rename(rename) => leaf(&rename.ident, &rename.rename),
        UseTree::Glob(_) => add(prefix.clone(), "*".to_owned()),
        UseTree::Group(group) => group.items.iter().for_each(|tree| flatten(tree, prefix, add)),
        UseTree::Path(path) => {
            prefix.push(path.ident.to_string());
            flatten(&path.tree, prefix, add);
            prefix.pop();
        }
    }
}

/// Collects the identifiers and paths of code, also inside macros, which no parser reads.
fn mentions(tokens: TokenStream, scope: &mut Scope) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut i = 0;
    while i < tokens.len() {
        if is_test_attribute(&tokens[i..]) {
            // What it is on ends with its braces or its semicolon.
            i += 2;
            while i < tokens.len() && !ends_item(&tokens[i]) {
                i += 1;
            }
            i += 1;
            continue;
        }
        match &tokens[i] {
            TokenTree::Group(group) => mentions(group.stream(), scope),
            TokenTree::Ident(first) if !is_field(&tokens, i) => {
                i = path(&tokens, i, Vec::new(), first.span(), scope);
                continue;
            }
            _ => {}
        }
        i += 1;
    }
}

/// Reads the path that starts at `i` and, in a `use` inside a function, the paths in its braces; returns where it ends.
fn path(tokens: &[TokenTree], mut i: usize, mut names: Vec<String>, span: Span, scope: &mut Scope) -> usize {
    let before = names.len();
    while let Some(TokenTree::Ident(name)) = tokens.get(i) {
        names.push(name.to_string());
        scope.words.insert(name.to_string());
        i += 1;
        if !(is_colon(tokens.get(i)) && is_colon(tokens.get(i + 1))) {
            break;
        }
        match tokens.get(i + 2) {
            Some(TokenTree::Ident(_)) => i += 2,
            Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                let mut k = 0;
                while k < inner.len() {
                    k = path(&inner, k, names.clone(), span, scope).max(k + 1);
                }
                return i + 3;
            }
            _ => break,
        }
    }
    // Between the names in braces stand commas.
    if names.len() > before.max(1) {
        scope.mentions.push((names, span.start().line));
    }
    i
}

fn is_colon(token: Option<&TokenTree>) -> bool {
    matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == ':')
}

/// A name behind a dot is a field or a method.
fn is_field(tokens: &[TokenTree], i: usize) -> bool {
    let is_dot = |k: usize| matches!(&tokens[k], TokenTree::Punct(punct) if punct.as_char() == '.');
    // Two dots are a range or the rest of a struct.
    i > 0 && is_dot(i - 1) && !(i > 1 && is_dot(i - 2))
}

fn is_test_attribute(tokens: &[TokenTree]) -> bool {
    let [TokenTree::Punct(hash), TokenTree::Group(group), ..] = tokens else { return false };
    hash.as_char() == '#' && group.stream().to_string().replace(' ', "") == "cfg(test)"
}

fn ends_item(token: &TokenTree) -> bool {
    match token {
        TokenTree::Punct(punct) => punct.as_char() == ';',
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scope(text: &str) -> Scope {
        Facts::read(text).expect("Rust").scopes.swap_remove(0)
    }

    #[test]
    fn imports_are_flattened() {
        let imports = scope("use a::{self, b::{c as d, e::*}}; pub use f::g;").imports;
        let flat: Vec<_> =
            imports.iter().map(|i| (i.path.join("::"), i.name.as_str(), i.is_public)).collect();
        assert_eq!(
            flat,
            [
                ("a".to_owned(), "a", false),
                ("a::b::c".to_owned(), "d", false),
                ("a::b::e".to_owned(), "*", false),
                ("f::g".to_owned(), "g", true)
            ]
        );
    }

    #[test]
    fn paths_in_macros_count_and_those_in_tests_and_fields_do_not() {
        let text = "fn f() { m!(a::b(x.c::<u8>(), ..d::e)); use k::{l, m::n}; }\n\
                    impl A { #[cfg(test)] fn g() { t::u() } fn h() -> v::W {} }\n\
                    #[cfg(test)] mod tests { fn g() { t::u() } }";
        let found: BTreeSet<String> = scope(text).mentions.iter().map(|(path, _)| path.join("::")).collect();
        assert_eq!(found, ["a::b", "d::e", "k::l", "k::m::n", "v::W"].map(str::to_owned).into());
    }

    #[test]
    fn a_function_s_length_runs_from_its_signature_to_its_brace() {
        let text = "/// Doc.\npub fn f(\n    a: u8,\n) {\n}\n#[test]\nfn g() {}\n";
        let functions = Facts::read(text).expect("Rust").functions;
        let lengths: Vec<_> = functions.iter().map(|f| (f.name.as_str(), f.line, f.lines)).collect();
        assert_eq!(lengths, [("f", 2, 4)]);
    }
}
