//! Normal and log-normal distributions between two ends, with the mean and the standard deviation asked for.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Cells in which a density counts as constant.
const CELLS: usize = 2048;
/// A density is looked at as far as it is above e^-DEPTH of its largest value, so that a cell is never wide.
const DEPTH: f64 = 36.0;
/// Standard deviations in which all is that double precision can draw.
const ALL: f64 = 8.5;

/// What is normally distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The radius.
    Normal,
    /// Its logarithm.
    LogNormal,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Kind::Normal => "normal",
            Kind::LogNormal => "log-normal",
        }
    }

    /// The mean of r², r³ of the distribution without ends with mean 1 and this standard deviation.
    pub fn mean_power(self, std: f64, power: i32) -> f64 {
        let (variance, n) = (std * std, f64::from(power));
        match self {
            Kind::Normal => 1.0 + 0.5 * n * (n - 1.0) * variance,
            Kind::LogNormal => (0.5 * n * (n - 1.0) * variance.ln_1p()).exp(),
        }
    }

    fn of(self, radius: f64) -> f64 {
        match self {
            Kind::Normal => radius,
            Kind::LogNormal => radius.ln(),
        }
    }

    fn radius(self, z: f64) -> f64 {
        match self {
            Kind::Normal => z,
            Kind::LogNormal => z.exp(),
        }
    }

    /// Mean and variance of z without ends, those of the radius being 1 and std².
    fn parameters(self, std: f64) -> (f64, f64) {
        match self {
            Kind::Normal => (1.0, std * std),
            Kind::LogNormal => {
                let variance = (std * std).ln_1p();
                (-0.5 * variance, variance)
            }
        }
    }
}

/// The density exp(tilt z - curvature z²/2) from low to high, z being the radius over its mean or the logarithm of
/// that. Of these, one has a mean and a standard deviation, if they can be had at all: with no curvature it is
/// exponential (a power law of the radius), which is as wide as such distributions get.
#[derive(Clone, Copy, Debug)]
pub struct Bell {
    kind: Kind,
    low: f64,
    high: f64,
    tilt: f64,
    curvature: f64,
}

/// The cells of a density, all equally wide.
struct Cells {
    start: f64,
    width: f64,
    weights: Vec<f64>,
}

impl Bell {
    /// The ends in z, from those in radii over the mean. Where there are none, those that no draw comes to, of the
    /// distribution and of what it is by number if it is one of volume; none is further away than any distribution of these
    /// moments reaches.
    pub fn ends(kind: Kind, std: f64, power: i32, min: Option<f64>, max: Option<f64>) -> (f64, f64) {
        let (middle, variance) = kind.parameters(std);
        let (far, beyond_all) = (ALL * variance.sqrt(), DEPTH * variance.sqrt());
        let below = f64::from(power) * variance;
        let low = min.map_or(middle - below - far, |min| kind.of(min).max(middle - below - beyond_all));
        (low, max.map_or(middle + far, |max| kind.of(max).min(middle + beyond_all)))
    }

    /// The one that has mean 1 and this standard deviation without ends.
    pub fn uncut(kind: Kind, std: f64, low: f64, high: f64) -> Bell {
        let (middle, variance) = kind.parameters(std);
        Bell { kind, low, high, tilt: middle / variance, curvature: 1.0 / variance }
    }

    /// The one that has them between the ends; None if none has.
    pub fn with_moments(kind: Kind, std: f64, low: f64, high: f64) -> Option<Bell> {
        let uncut = Bell::uncut(kind, std, low, high);
        let narrower = |curvature: f64| uncut.with_mean(curvature).map_or(f64::NAN, |bell| std - bell.moments().1);
        if !(narrower(0.0) <= 0.0) {
            return None;
        }
        let most = doublings(uncut.curvature).find(|most| narrower(*most) >= 0.0)?;
        uncut.with_mean(root(0.0, most, narrower))
    }

    /// With this curvature, so tilted that the mean is 1; None if the ends leave no room for that.
    fn with_mean(self, curvature: f64) -> Option<Bell> {
        let off = |tilt: f64| Bell { tilt, curvature, ..self }.moments().0 - 1.0;
        let middle = curvature * self.kind.of(1.0);
        let holds = |reach: &f64| off(middle - reach) <= 0.0 && off(middle + reach) >= 0.0;
        let reach = doublings(1.0 / (self.high - self.low)).find(holds)?;
        Some(Bell { tilt: root(middle - reach, middle + reach, off), curvature, ..self })
    }

    /// Mean and standard deviation of the radius.
    fn moments(&self) -> (f64, f64) {
        let cells = self.cells(0);
        let total: f64 = cells.weights.iter().sum();
        let radii: Vec<f64> = (0..CELLS).map(|k| self.kind.radius(cells.at(k as f64 + 0.5))).collect();
        let mean = radii.iter().zip(&cells.weights).map(|(r, w)| w * r).sum::<f64>() / total;
        let variance = radii.iter().zip(&cells.weights).map(|(r, w)| w * (r - mean).powi(2)).sum::<f64>() / total;
        (mean, variance.sqrt())
    }

    /// The density over this power of the radius.
    fn cells(&self, power: i32) -> Cells {
        let Bell { kind, low, high, curvature, .. } = *self;
        // Of a logarithm, a power is a tilt.
        let tilt = self.tilt - if kind == Kind::LogNormal { f64::from(power) } else { 0.0 };
        let top = if curvature > 0.0 {
            (tilt / curvature).clamp(low, high)
        } else if tilt > 0.0 {
            high
        } else {
            low
        };
        let slope = tilt - curvature * top;
        // Where slope d + curvature d²/2 is DEPTH.
        let depth = 2.0 * DEPTH / (slope.abs() + (slope * slope + 2.0 * DEPTH * curvature).sqrt());
        let (start, end) = (low.max(top - depth), high.min(top + depth));
        let width = (end - start) / CELLS as f64;
        let weight = |k: usize| {
            let z = start + (k as f64 + 0.5) * width;
            let density = (slope * (z - top) - 0.5 * curvature * (z - top).powi(2)).exp();
            if kind == Kind::Normal { density / z.powi(power) } else { density }
        };
        Cells { start, width, weights: (0..CELLS).map(weight).collect() }
    }

    /// Radii over the mean.
    pub fn draw(&self, power: i32, count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let cells = self.cells(power);
        let sums: Vec<f64> = cells
            .weights
            .iter()
            .scan(0.0, |sum, w| {
                *sum += w;
                Some(*sum)
            })
            .collect();
        let draw = |_| {
            let share = sums[CELLS - 1] * rng.random::<f64>();
            let k = sums.partition_point(|sum| *sum <= share).min(CELLS - 1);
            let part = 1.0 - (sums[k] - share) / cells.weights[k];
            let radius = self.kind.radius(cells.at(k as f64 + part));
            radius.clamp(self.kind.radius(self.low), self.kind.radius(self.high))
        };
        (0..count).map(draw).collect()
    }
}

impl Cells {
    fn at(&self, k: f64) -> f64 {
        self.start + k * self.width
    }
}

/// Ever larger numbers.
fn doublings(first: f64) -> impl Iterator<Item = f64> {
    (0..100).map(move |k| first * 2.0_f64.powi(k))
}

/// Where a function that rises through 0 does so.
fn root(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) || high - low <= 1e-12 * high.abs().max(low.abs()) {
            return middle;
        }
        if of(middle) < 0.0 { low = middle } else { high = middle }
    }
}
