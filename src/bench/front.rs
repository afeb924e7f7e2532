//! Pareto fronts: the settings to which no other one is at least as good in both speed and error.

use super::results::Point;

/// Mark the front of every group: suite, case and quantity.
pub fn mark(points: &mut [Point]) {
    let marks: Vec<bool> = points.iter().map(|p| on_front(p, points)).collect();
    points.iter_mut().zip(marks).for_each(|(point, mark)| point.pareto = mark);
}

fn on_front(point: &Point, points: &[Point]) -> bool {
    let Some(own) = coordinates(point) else { return false };
    let rivals = points.iter().filter(|p| p.group() == point.group()).filter_map(coordinates);
    !rivals.into_iter().any(|rival| better(rival, own))
}

/// Wall seconds per simulated second, and error.
fn coordinates(point: &Point) -> Option<(f64, f64)> {
    let (wall, error) = (point.wall_per_simulated?, point.error?);
    (wall.is_finite() && error.is_finite()).then_some((wall, error))
}

/// As good in both, and better in one.
fn better(a: (f64, f64), b: (f64, f64)) -> bool {
    a.0 <= b.0 && a.1 <= b.1 && a != b
}

#[cfg(test)]
mod tests {
    use super::better;

    #[test]
    fn nothing_beats_the_front() {
        let settings = [(1.0, 1e-2), (2.0, 1e-3), (3.0, 1e-3), (4.0, 1e-5), (1.5, 2e-2)];
        let front = settings.map(|own| !settings.iter().any(|rival| better(*rival, own)));
        assert_eq!(front, [true, true, false, true, false]);
    }
}
