//! Prints the table of `docs/hard-cases.md`: every hard case of `tests/hard`, on every engine there is. With a name, only
//! that case; with `--short`, the long ones a twentieth as long, as the tests run them. The last column says what is out of its
//! limits.
//!
//! `cargo run --release --example hard_cases [NAME] [--short]`

#[path = "../tests/common/mod.rs"]
mod common;

#[path = "../tests/hard/cases/mod.rs"]
mod cases;

use cases::{ALL, Case, Figure, Length};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let name = args.iter().find(|arg| !arg.starts_with('-'));
    let length = if args.iter().any(|arg| arg == "--short") { Length::Short } else { Length::Full };
    println!(
        "| case | figure | expected | cpu f64 | gpu f32 | gpu f64 | |\n| --- | --- | --- | --- | --- | --- | --- |"
    );
    for case in ALL.iter().filter(|case| name.is_none_or(|name| name == case.name)) {
        print(case, length);
    }
}

fn print(case: &Case, length: Length) {
    let measured: Vec<(&str, Vec<Figure>)> =
        case.benches().into_iter().map(|bench| (bench.name, (case.run)(bench, length))).collect();
    for (row, figure) in measured[0].1.iter().enumerate() {
        let of = |name: &str| measured.iter().find(|(n, _)| *n == name).and_then(|(_, figures)| figures.get(row));
        let columns = ["cpu", "gpu single", "gpu double"].map(of);
        let cell =
            |f: Option<&Figure>| f.map_or(String::new(), |f| format!("{} (± {})", number(f.found), number(f.allowed)));
        let missed = columns.iter().flatten().filter(|f| !f.holds()).count();
        let head = match row {
            0 => format!("`{}`: {}", case.name, case.source),
            1 if !case.scenes.is_empty() => format!("{}.toml", case.scenes.join(".toml, ")),
            _ => String::new(),
        };
        println!(
            "| {head} | {} | {} | {} | {} | {} | {} |",
            figure.what,
            number(figure.expected),
            cell(columns[0]),
            cell(columns[1]),
            cell(columns[2]),
            if missed > 0 { "**missed**" } else { "" }
        );
    }
}

/// Five digits, or two for an error.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if x.fract() == 0.0 && size < 1e7 {
        format!("{x}")
    } else if (1e-2..1e5).contains(&size) {
        let digits = (4 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.1e}")
    }
}
