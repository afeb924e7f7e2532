//! The house rules that a compiler does not check.

use std::{
    collections::{HashMap, HashSet},
    fs,
    path::{Path, PathBuf},
};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    found
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/")
}

/// Each layer may import those before it. `gpu` and `solve` know no simulation.
const LAYERS: &[(&str, u32)] = &[
    ("error", 0),
    ("shaders", 0),
    ("units", 0),
    ("record", 1),
    ("memory", 1),
    ("container", 1),
    ("gpu", 1),
    ("input", 2),
    ("solve", 2),
    ("scene", 3),
    ("model", 4),
    ("state", 5),
    ("stage", 6),
    ("plan", 7),
    ("space", 8),
    ("body", 9),
    ("contact", 10),
    ("time_step", 11),
    ("neighbours", 11),
    ("dem", 12),
    ("nscd", 13),
    ("measure", 14),
    ("plans", 15),
    ("engine", 16),
    ("simulation", 17),
    ("render", 17),
    ("check", 18),
    ("protocol", 18),
    ("io", 19),
    ("bench", 20),
    ("prelude", 21),
];

/// Where the WGSL of several files is one in Rust, or has its place in another file.
const ELSEWHERE: &[(&str, &str)] = &[
    ("neighbours/scan_reduce.wgsl", "src/neighbours/scan.rs"),
    ("neighbours/scan_top.wgsl", "src/neighbours/scan.rs"),
    ("neighbours/scan_down.wgsl", "src/neighbours/scan.rs"),
    ("solve/relaxation.wgsl", "src/solve/jacobi.rs"),
    ("solve/disc_pass.wgsl", "src/solve/jacobi.rs"),
    ("solve/apply_delassus.wgsl", "src/solve/jacobi.rs"),
    ("solve/sums.wgsl", "src/solve/jacobi.rs"),
    ("solve/momentum_restart.wgsl", "src/solve/jacobi.rs"),
];

#[test]
fn imports_point_downward() {
    let rank = |module: &str| LAYERS.iter().find(|(m, _)| *m == module).map(|(_, rank)| *rank);
    let mut imports = 0;
    for path in files("src", "rs") {
        let name = relative(&path);
        let module = name.strip_prefix("src/").unwrap().split(['/', '.']).next().unwrap().to_owned();
        if ["lib", "main", "cli"].contains(&module.as_str()) {
            continue;
        }
        let own = rank(&module).unwrap_or_else(|| panic!("{name}: give `{module}` a place in LAYERS"));
        let text = fs::read_to_string(&path).unwrap();
        let code = code(&text);
        for used in imported(&code) {
            if used == module {
                continue;
            }
            imports += 1;
            let Some(other) = rank(&used) else { continue };
            assert!(other < own, "{name} imports `{used}`, which is not below `{module}`");
        }
        if module == "gpu" || (module == "solve" && name != "src/solve/device.rs") {
            let own_errors_only = imported(&code)
                .iter()
                .all(|used| [module.as_str(), "error", "Error", "record"].contains(&used.as_str()));
            assert!(own_errors_only, "{name}: {module} is a leaf");
        }
    }
    assert!(imports > 40, "only {imports} imports were found: the search is broken");
}

/// First path segments after `crate::`, nested groups included.
fn imported(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        paths(&code[at + 7..], &[], &mut found);
    }
    found.into_iter().filter_map(|path| path.into_iter().next()).collect()
}

#[test]
fn every_shader_is_embedded_and_names_its_twin() {
    let embedded: Vec<&str> = packstone::shaders::FILES.iter().map(|(name, _)| *name).collect();
    for path in files("shaders", "wgsl") {
        let name = relative(&path);
        let short = name.strip_prefix("shaders/").unwrap();
        if short == "render.wgsl" {
            continue; // drawing has no twin
        }
        assert!(embedded.contains(&short), "{name} is not in src/shaders.rs");
        let text = fs::read_to_string(&path).unwrap();
        let first = text.lines().next().unwrap();
        if short.starts_with("space/precision/") || short.starts_with("space/scalar/") {
            continue; // the twin is always f64
        }
        let twin = first.strip_prefix("// twin: ").unwrap_or_else(|| panic!("{name} does not name its twin"));
        let twin = twin.split_whitespace().next().unwrap();
        assert!(root().join(twin).is_file(), "{name} names {twin}, which does not exist");
        let elsewhere = ELSEWHERE.contains(&(short, twin));
        let place = short.rsplit_once('/').map_or("", |(place, _)| place);
        let slot = place.contains('/') && twin == format!("src/{place}.rs");
        let mirrored = twin == format!("src/{}.rs", short.strip_suffix(".wgsl").unwrap()) || slot;
        assert!(mirrored || elsewhere, "{name} has its twin in {twin}");
        let text = fs::read_to_string(root().join(twin)).unwrap();
        let head: String = text.lines().take_while(|line| line.starts_with("//!")).collect();
        let file = short.rsplit('/').next().unwrap();
        let known = [format!("`{name}`"), format!("`{file}`"), format!("`shaders/{place}/`")];
        let known = &known[..if slot { 3 } else { 2 }];
        assert!(known.iter().any(|k| head.contains(k.as_str())), "{twin} does not name {name}");
    }
}

#[test]
fn every_kernel_twin_has_its_shader() {
    let mut twins = 0;
    for path in files("src", "rs") {
        let text = fs::read_to_string(&path).unwrap();
        // A slot's twin names the folder of its alternatives.
        let Some(rest) = text.strip_prefix("//! Twin of `shaders/") else { continue };
        let (shader, _) = rest.split_once('`').unwrap();
        assert!(root().join("shaders").join(shader).exists(), "{}: no shaders/{shader}", relative(&path));
        twins += 1;
    }
    assert!(twins > 40, "only {twins} twins were found: the search is broken");
}

/// Without comments and tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap();
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// All paths of a tree of imports, as segments: `a::{b, c::d}` has a::b and a::c::d.
fn paths(tree: &str, before: &[String], found: &mut Vec<Vec<String>>) {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut at = before.to_vec();
    let mut rest = tree;
    loop {
        let segment = word(rest);
        rest = &rest[segment.len()..];
        if !segment.is_empty() {
            at.push(segment);
        }
        match rest.strip_prefix("::") {
            Some(more) => rest = more,
            None => break,
        }
    }
    let Some(group) = rest.strip_prefix('{') else { return found.push(at) };
    let (mut depth, mut start) = (0, 0);
    for (k, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' | ',' if depth == 0 => {
                let part = group[start..k].trim();
                if !part.is_empty() {
                    paths(part, &at, found);
                }
                start = k + 1;
                if c == '}' {
                    break;
                }
            }
            '}' => depth -= 1,
            _ => {}
        }
    }
}

/// The text of a file, less what it only hands on, and the names that it hands on with the paths they have.
struct Source {
    code: String,
    exports: HashMap<String, Vec<String>>,
}

impl Source {
    /// `pub use` of a file of its own makes a path shorter; it is no import, unless the file uses the name itself.
    fn new(module: &[String], text: &str) -> Source {
        let all = code(text);
        let (mut code, mut exports) = (String::new(), HashMap::new());
        for statement in all.split_inclusive(';') {
            let Some((before, tree)) = ["pub use ", "pub(crate) use "].iter().find_map(|k| statement.split_once(k))
            else {
                code.push_str(statement);
                continue;
            };
            code.push_str(before);
            assert!(!tree.contains('*'), "{}: list what is handed on", module.join("/"));
            let mut found = Vec::new();
            match tree.strip_prefix("crate::") {
                Some(tree) => paths(tree, &[], &mut found),
                None => paths(tree, module, &mut found),
            }
            exports.extend(found.into_iter().map(|path| (path.last().unwrap().clone(), path)));
        }
        Source { code, exports }
    }

    /// Whether a word stands in the code.
    fn has(&self, word: &str) -> bool {
        let part = |c: char| c.is_alphanumeric() || c == '_';
        self.code
            .match_indices(word)
            .any(|(at, _)| !self.code[..at].ends_with(part) && !self.code[at + word.len()..].starts_with(part))
    }
}

/// The modules that a file imports from: by `crate::`, by `super::` and, if it does more than hand on, from its own.
fn imported_modules(module: &[String], sources: &HashMap<Vec<String>, Source>) -> HashSet<Vec<String>> {
    let source = &sources[module];
    let code = &source.code;
    let mut found: Vec<Vec<String>> =
        source.exports.iter().filter(|(name, _)| source.has(name)).map(|(_, path)| path.clone()).collect();
    for (at, _) in code.match_indices("crate::") {
        paths(&code[at + 7..], &[], &mut found);
    }
    for (at, _) in code.match_indices("super::").filter(|(at, _)| !code[..*at].ends_with("super::")) {
        let rest = code[at..].trim_start_matches("super::");
        let levels = (code.len() - at - rest.len()) / "super::".len();
        paths(rest, &module[..module.len().saturating_sub(levels)], &mut found);
    }
    let children = sources.keys().filter(|path| path.len() == module.len() + 1 && path.starts_with(module));
    for child in children {
        let path = format!("{}::", child.last().unwrap());
        let starts = |at: usize| !code[..at].ends_with(|c: char| c.is_alphanumeric() || "_:".contains(c));
        for (at, _) in code.match_indices(&path).filter(|(at, _)| starts(*at)) {
            paths(&code[at..], module, &mut found);
        }
    }
    found.into_iter().map(|path| module_of(path, sources)).filter(|m| !m.is_empty() && m != module).collect()
}

/// The module where the end of a path stands.
fn module_of(path: Vec<String>, sources: &HashMap<Vec<String>, Source>) -> Vec<String> {
    let known = (0..=path.len()).rev().find(|k| sources.contains_key(&path[..*k])).unwrap_or(0);
    let (module, rest) = path.split_at(known);
    let exported = rest.first().and_then(|name| sources.get(module)?.exports.get(name));
    match exported {
        Some(longer) if longer != &path => module_of([longer, &rest[1..]].concat(), sources),
        _ => module.to_vec(),
    }
}

/// Everywhere else the compiler refuses it.
#[test]
fn one_module_may_have_unsafe_code() {
    let allows = |path: &PathBuf| fs::read_to_string(path).unwrap().contains("allow(unsafe_code");
    let found: Vec<_> = files("src", "rs").into_iter().filter(allows).map(|path| relative(&path)).collect();
    assert_eq!(found, ["src/gpu/checks.rs"]);
}

#[test]
fn imports_do_not_run_in_circles() {
    let module = |path: &Path| -> Vec<String> {
        let name = relative(path);
        name.strip_prefix("src/").unwrap().strip_suffix(".rs").unwrap().split('/').map(str::to_owned).collect()
    };
    let source = |path: PathBuf| {
        let module = module(&path);
        let source = Source::new(&module, &fs::read_to_string(path).unwrap());
        (module, source)
    };
    let sources: HashMap<_, _> = files("src", "rs").into_iter().map(source).collect();
    let imports: HashMap<_, _> = sources.keys().map(|module| (module, imported_modules(module, &sources))).collect();
    assert!(imports.values().map(HashSet::len).sum::<usize>() > 600, "the search is broken");
    let reach = |from: &Vec<String>| {
        let (mut seen, mut open) = (HashSet::new(), vec![from]);
        while let Some(here) = open.pop() {
            open.extend(imports[here].iter().filter(|next| seen.insert((*next).clone())));
        }
        seen
    };
    let reached: HashMap<_, _> = sources.keys().map(|module| (module, reach(module))).collect();
    let mut circles: Vec<String> = Vec::new();
    for (module, reach) in &reached {
        let others =
            reach.iter().filter(|other| imports[*module].contains(*other) && reached[*other].contains(*module));
        circles.extend(others.map(|other| format!("{} -> {}", module.join("/"), other.join("/"))));
    }
    circles.sort();
    assert!(circles.is_empty(), "imports run in circles:\n{}", circles.join("\n"));
}

/// Every crate that is named in Cargo.toml, with the features that bring it.
#[test]
fn every_dependency_has_its_reason() {
    let cargo: toml::Table = fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    let features = |name: &str, optional: bool| {
        let brings = |of: &toml::Value| of.as_array().unwrap().contains(&format!("dep:{name}").into());
        let of = cargo["features"].as_table().unwrap().iter().filter(|(_, of)| brings(of));
        let named: Vec<String> = of.map(|(feature, _)| format!("`{feature}`")).collect();
        if optional { named.join(", ") } else { "always".to_owned() }
    };
    let optional = |of: &toml::Value| of.get("optional").and_then(toml::Value::as_bool).unwrap_or(false);
    let dependencies = cargo["dependencies"].as_table().unwrap().iter();
    let mut expected: Vec<_> = dependencies.map(|(name, of)| (name.clone(), features(name, optional(of)))).collect();
    expected.sort();
    let text = fs::read_to_string(root().join("docs/dependencies.md")).unwrap();
    let rows = text.split("## ").next().unwrap().lines().filter_map(|line| line.strip_prefix("| `"));
    let mut found = Vec::new();
    for row in rows {
        let (name, rest) = row.split_once("` | ").unwrap();
        let (features, reason) = rest.split_once(" | ").unwrap();
        assert!(reason.len() > 10, "{name} has no reason");
        found.push((name.to_owned(), features.to_owned()));
    }
    found.sort();
    assert_eq!(found, expected, "docs/dependencies.md and Cargo.toml");
    let of_tests = cargo.get("dev-dependencies").and_then(toml::Value::as_table);
    for name in of_tests.into_iter().flat_map(toml::Table::keys) {
        assert!(found.iter().any(|(known, _)| known == name), "{name} has no row");
    }
}
