//! The house rules that a compiler does not check.

use std::{
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

/// Each layer may import those before it. `gpu` knows no physics.
const LAYERS: &[(&str, u32)] = &[
    ("error", 0),
    ("shaders", 0),
    ("memory", 1),
    ("gpu", 1),
    ("cd", 2),
    ("scene", 3),
    ("model", 4),
    ("state", 5),
    ("laws", 6),
    ("time_step", 7),
    ("kernels", 7),
    ("plan", 8),
    ("measure", 8),
    ("engine", 9),
    ("simulation", 10),
    ("render", 10),
    ("check", 11),
    ("io", 11),
    ("bench", 12),
    ("prelude", 12),
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
        let code: String = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
        for used in imported(&code) {
            if used == module {
                continue;
            }
            imports += 1;
            let Some(other) = rank(&used) else { continue };
            assert!(other < own, "{name} imports `{used}`, which is not below `{module}`");
        }
        if module == "gpu" || (module == "cd" && name != "src/cd/device.rs") {
            let own_errors_only =
                imported(&code).iter().all(|used| [module.as_str(), "error", "Error"].contains(&used.as_str()));
            assert!(own_errors_only, "{name}: {module} is a leaf");
        }
    }
    assert!(imports > 40, "only {imports} imports were found: the search is broken");
}

/// First path segments after `crate::`, nested groups included.
fn imported(code: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + 7..];
        let Some(group) = rest.strip_prefix('{') else {
            found.push(word(rest));
            continue;
        };
        let mut depth = 0;
        let mut start = true;
        for (k, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => start = true,
                c if start && !c.is_whitespace() => {
                    found.push(word(&group[k..]));
                    start = false;
                }
                _ => {}
            }
        }
    }
    found
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
        if short.starts_with("precision/") || short.starts_with("scalar/") {
            continue; // the twin is always f64
        }
        let twin = first.strip_prefix("// twin: ").unwrap_or_else(|| panic!("{name} does not name its twin"));
        let twin = twin.split_whitespace().next().unwrap();
        assert!(root().join(twin).is_file(), "{name} names {twin}, which does not exist");
        let head: String = fs::read_to_string(root().join(twin)).unwrap().lines().take(6).collect();
        let folder = short.split('/').next().unwrap();
        let known = [short.to_owned(), format!("shaders/{folder}"), "WGSL".to_owned()];
        assert!(known.iter().any(|k| head.contains(k.as_str())), "{twin} does not name {name}");
    }
}

#[test]
fn every_kernel_twin_has_its_shader() {
    for path in files("src/kernels", "rs") {
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let shaders = files("shaders", "wgsl");
        let has = |p: &PathBuf| {
            let s = p.file_stem().unwrap().to_str().unwrap();
            s == stem || s.starts_with(&format!("{stem}_"))
        };
        assert!(shaders.iter().any(has), "src/kernels/{stem}.rs has no shader");
    }
}
