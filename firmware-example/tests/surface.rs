//! The gate reaches every public function of the core: the core's sources against those of `surface`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every source file below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// The identifier that a text starts with.
fn identifier(text: &str) -> &str {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default()
}

/// The type of an inherent `impl`; `None` where it is of a trait.
fn implemented(line: &str) -> Option<&str> {
    let mut rest = line.strip_prefix("impl")?;
    if rest.starts_with('<') {
        let mut depth = 0;
        let end = rest.find(|c| {
            depth += i32::from(c == '<') - i32::from(c == '>');
            depth == 0
        })?;
        rest = &rest[end + 1..];
    }
    (!rest.contains(" for ")).then(|| identifier(rest.trim_start()))
}

/// The public functions of a formatted source, `Type::name` or `name`; its tests are left out.
fn public_functions(source: &str) -> Vec<String> {
    let (mut found, mut of) = (Vec::new(), None);
    for line in source.lines().take_while(|line| *line != "mod tests {" && *line != "mod tests;") {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        if text.starts_with("impl") {
            of = implemented(text).map(|name| (name, indent));
        } else if text == "}" && of.is_some_and(|(_, from)| from == indent) {
            of = None;
        }
        let after = ["pub fn ", "pub const fn "].iter().find_map(|start| text.strip_prefix(start));
        match (after.map(identifier), of) {
            (Some(name), Some((of, _))) => found.push(format!("{of}::{name}")),
            (Some(name), None) if indent == 0 => found.push(name.to_owned()),
            (Some(name), None) => panic!("`{name}` is public and of no type: {line}"),
            (None, _) => {}
        }
    }
    found
}

/// The first module below the core's root that a source belongs to: `link` for `link/frame.rs`.
fn module(core: &Path, source: &Path) -> String {
    let below = source.strip_prefix(core).expect("a source of the core");
    identifier(&below.to_string_lossy()).to_owned()
}

/// What `reach!` is given in a source, with the first module of its path: `link Key::new`, `link encode`.
fn reached(source: &str) -> Vec<String> {
    let paths = source.split("reach!(").skip(1).filter_map(|call| call.split('(').next());
    paths
        .filter_map(|path| {
            let parts: Vec<&str> = path.split("::").collect();
            let [module, .., of, name] = parts[..] else {
                let [module, name] = parts[..] else { return None };
                return Some(format!("{module} {name}"));
            };
            let typed = of.starts_with(char::is_uppercase);
            Some(if typed { format!("{module} {of}::{name}") } else { format!("{module} {name}") })
        })
        .collect()
}

#[test]
fn the_gate_reaches_every_public_function_of_the_core() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let core = here.join("../imucal-core/src");
    let read = |path: &Path| fs::read_to_string(path).expect("a source");
    let mut public = BTreeSet::new();
    for file in sources(&core) {
        let module = module(&core, &file);
        public.extend(public_functions(&read(&file)).iter().map(|name| format!("{module} {name}")));
    }
    let reached: BTreeSet<String> =
        sources(&here.join("src/surface")).iter().flat_map(|file| reached(&read(file))).collect();
    assert!(
        public.len() > 100,
        "{} public functions: the sources are not read as they should be",
        public.len()
    );
    let forgotten: Vec<_> = public.difference(&reached).collect();
    assert!(forgotten.is_empty(), "call these in firmware-example/src/surface: {forgotten:?}");
}

#[test]
fn public_functions_are_distinguished_from_private_and_from_tests() {
    let source = "pub fn free<T>() {\n}\nfn own() {\n}\nimpl<T: Into<f32>> Shell<T> {\n    pub const fn new() {\n    }\n    \
                  fn own() {}\n}\nmod inner {\n    impl Key {\n        pub const fn of() {\n        }\n    }\n}\n\
                  impl Shown for Shell<f32> {\n    fn show() {}\n}\nmod tests {\npub fn tested() {}\n";
    assert_eq!(public_functions(source), ["free", "Shell::new", "Key::of"]);
    assert_eq!(
        reached(
            "reach!(a::free(1)); reach!(a::b::free(1)); reach!(a::b::Shell::new()); reach!(c::Key::of());"
        ),
        ["a free", "a free", "a Shell::new", "c Key::of"]
    );
}
