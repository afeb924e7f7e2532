//! Which part comes next, and whether there is time for it.

use super::{Case, Outcome, PROCESSES, Part, PartRecord};

/// Seconds that a part may take of which nothing is known, one that takes longer hangs; and those that any part may take
/// beyond the time that is left.
const PATIENCE: f64 = 120.0;
/// Grains of the runs whose bits are compared, by whether they are soft.
const REPEATED: [(Case, usize); 3] = [(Case::Spheres, 10_000), (Case::Rods, 10_000), (Case::Rigid, 1000)];
/// Grains of the spheres beyond what the other scenes are measured with: three sizes to a decade, up to more than any
/// device holds.
const LARGE: [usize; 9] =
    [2_000_000, 5_000_000, 10_000_000, 20_000_000, 50_000_000, 100_000_000, 200_000_000, 500_000_000, 1_000_000_000];

/// All parts in the order in which they have their turn: first whether results are right, then small packings, and at the
/// end packings that take all the time that is left.
pub fn parts() -> Vec<Part> {
    let mut parts = vec![Part::Adapter, Part::Copies];
    parts.extend(Case::ALL.map(|case| Part::Check { case, double: false }));
    parts.push(Part::Check { case: Case::Spheres, double: true });
    let speed =
        |cases: &[Case], grains| cases.iter().map(|case| Part::Speed { case: *case, grains }).collect::<Vec<_>>();
    let spheres = |grains| Part::Speed { case: Case::Spheres, grains };
    parts.extend([1000, 10_000, 100_000].map(spheres));
    for process in PROCESSES {
        parts.extend(REPEATED.map(|(case, grains)| Part::Repeat { case, grains, process }));
    }
    parts.push(Part::Variants { grains: 100_000 });
    for grains in [1000, 10_000, 100_000] {
        parts.extend(speed(&[Case::Rods, Case::Disks], grains));
    }
    parts.extend([spheres(1_000_000), Part::Variants { grains: 1_000_000 }]);
    parts.extend(speed(&[Case::Rods, Case::Disks], 1_000_000));
    parts.extend(LARGE.map(spheres));
    parts
}

/// What becomes of a part.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// And after how many seconds it is killed.
    Run { limit: f64 },
    /// And why.
    Skip(String),
}

/// Whether a part is run after these ones, with so many seconds left.
pub fn decide(part: Part, before: &[PartRecord], left: f64) -> Decision {
    let failed = |p: &&PartRecord| matches!(p.outcome, Outcome::Failed(_));
    if before.iter().filter(failed).any(|p| p.part == Part::Adapter) {
        return Decision::Skip("no device can be opened".to_owned());
    }
    if part == Part::Adapter {
        return Decision::Run { limit: PATIENCE };
    }
    if left <= 0.0 {
        return Decision::Skip("the time is up".to_owned());
    }
    if let Part::Variants { grains } = part
        && expected(part, before).is_none()
    {
        return Decision::Skip(format!("spheres {grains} did not run"));
    }
    if let Part::Speed { case, .. } = part {
        let ran = before.iter().rev().filter(|p| !matches!(p.outcome, Outcome::NotRun(_)));
        let smaller = ran.filter(|p| matches!(p.part, Part::Speed { case: of, .. } if of == case));
        if smaller.clone().next().is_some_and(|p| matches!(p.outcome, Outcome::Lacking(_))) {
            return Decision::Skip("a smaller one did not fit".to_owned());
        }
        if smaller.take(2).filter(failed).count() == 2 {
            return Decision::Skip("two smaller ones failed".to_owned());
        }
    }
    let expected = expected(part, before);
    // Settings are not worth the larger packings that come after them.
    let own = if matches!(part, Part::Variants { .. }) { 0.5 * left } else { left };
    match expected {
        Some(seconds) if seconds > own => {
            Decision::Skip(format!("it would take about {seconds:.0} s, and there are {own:.0} s for it"))
        }
        _ => Decision::Run { limit: PATIENCE.max(3.0 * expected.unwrap_or(0.0)).min(left + PATIENCE) },
    }
}

/// Steps of all settings and of the default ones beside them, over those of a speed.
const VARIANTS: f64 = 8.0;

/// Seconds that a part takes, from those of smaller ones.
fn expected(part: Part, before: &[PartRecord]) -> Option<f64> {
    let done = || before.iter().filter(|p| p.outcome == Outcome::Done);
    let (case, grains) = match part {
        Part::Speed { case, grains } => (case, grains),
        Part::Variants { grains } => {
            let speed = Part::Speed { case: Case::Spheres, grains };
            return done().find(|p| p.part == speed).map(|p| VARIANTS * p.seconds);
        }
        _ => return None,
    };
    let size = |p: &PartRecord| match p.part {
        Part::Speed { case: other, grains } if other == case => Some(grains),
        _ => None,
    };
    let known: Vec<(f64, f64)> = done().filter_map(|p| Some((size(p)? as f64, p.seconds))).collect();
    let grains = grains as f64;
    match known[..] {
        [] => None,
        // Kernels have to be compiled, however few grains there are.
        [.., (n, a), (m, b)] => Some(b + (b - a).max(0.0) / (m - n) * (grains - m)),
        [(n, a)] => Some(a * if n < 10_000.0 { 1.0 } else { grains / n }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(part: Part, seconds: f64, outcome: Outcome) -> PartRecord {
        PartRecord { part, seconds, outcome, findings: Vec::new() }
    }

    fn spheres(grains: usize) -> Part {
        Part::Speed { case: Case::Spheres, grains }
    }

    #[test]
    fn every_part_has_one_turn() {
        let parts = parts();
        assert!((0..parts.len()).all(|k| !parts[..k].contains(&parts[k])));
        assert_eq!(parts[0], Part::Adapter);
    }

    #[test]
    fn time_grows_with_the_grains_beyond_what_it_takes_to_begin() {
        let mut before = vec![record(Part::Adapter, 1.0, Outcome::Done)];
        assert_eq!(decide(spheres(1000), &before, 100.0), Decision::Run { limit: PATIENCE });
        before.push(record(spheres(1000), 2.0, Outcome::Done));
        before.push(record(spheres(10_000), 2.9, Outcome::Done));
        // 1e-4 s per grain.
        let Decision::Skip(why) = decide(spheres(1_000_000), &before, 100.0) else { panic!("too large") };
        assert_eq!(why, "it would take about 102 s, and there are 100 s for it");
        assert_eq!(decide(spheres(1_000_000), &before, 110.0), Decision::Run { limit: 110.0 + PATIENCE });
        let Decision::Run { limit } = decide(spheres(1_000_000), &before, 1000.0) else { panic!("there is time") };
        assert!((limit - 3.0 * (2.9 + 99.0)).abs() < 1e-6, "{limit}");
        // Larger ones took no longer.
        before.push(record(spheres(100_000), 2.8, Outcome::Done));
        assert_eq!(decide(spheres(1_000_000), &before, 3.0), Decision::Run { limit: PATIENCE });
        assert_eq!(decide(spheres(1_000_000), &before, 0.0), Decision::Skip("the time is up".to_owned()));
    }

    #[test]
    fn what_does_not_fit_ends_a_series() {
        let lacking = record(spheres(10_000), 1.0, Outcome::Lacking("no memory".to_owned()));
        let before = [record(spheres(1000), 1.0, Outcome::Done), lacking];
        assert_eq!(decide(spheres(100_000), &before, 1e4), Decision::Skip("a smaller one did not fit".to_owned()));
        let disks = Part::Speed { case: Case::Disks, grains: 100_000 };
        assert!(matches!(decide(disks, &before, 1e4), Decision::Run { .. }));
    }

    #[test]
    fn failures_end_a_series_only_twice_in_a_row() {
        let failed = |part| record(part, 1.0, Outcome::Failed("lost".to_owned()));
        let mut before = vec![record(spheres(1000), 1.0, Outcome::Done), failed(spheres(10_000))];
        assert!(matches!(decide(spheres(100_000), &before, 1e4), Decision::Run { .. }));
        before.push(failed(spheres(100_000)));
        before.push(record(spheres(200_000), 0.0, Outcome::NotRun("no time".to_owned())));
        assert_eq!(decide(spheres(1_000_000), &before, 1e4), Decision::Skip("two smaller ones failed".to_owned()));
        let disks = Part::Speed { case: Case::Disks, grains: 1000 };
        assert!(matches!(decide(disks, &before, 1e4), Decision::Run { .. }));
        let none = Decision::Skip("spheres 10000 did not run".to_owned());
        assert_eq!(decide(Part::Variants { grains: 10_000 }, &before, 1e4), none);
        let variants = Part::Variants { grains: 1000 };
        assert!(matches!(decide(variants, &before, 2.0 * VARIANTS + 0.1), Decision::Run { .. }));
        assert!(matches!(decide(variants, &before, 2.0 * VARIANTS - 0.1), Decision::Skip(_)));
        before.push(failed(Part::Adapter));
        assert_eq!(decide(disks, &before, 1e4), Decision::Skip("no device can be opened".to_owned()));
    }
}
