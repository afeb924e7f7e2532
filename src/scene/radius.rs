//! Radii of a population.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, LogNormal, Normal, Uniform};

use super::check::{Check, show};
use super::schema::{Moments, Radius, RadiusLaw};
use crate::{Error, Result};

/// Draws per radius before the limits count as out of reach.
const ATTEMPTS: usize = 10_000;

/// What is wrong with a distribution that double precision cannot hold.
const TOO_WIDE: &str = "must be a range of radii that double precision can hold; take sizes of real grains";

/// Draws `count` radii, m.
pub fn draw(law: &Radius, key: &str, count: usize, rng: &mut ChaCha8Rng, check: &Check) -> Result<Vec<f64>> {
    match law {
        Radius::Constant(radius) => Ok(vec![check.positive(key, *radius, " of m")?; count]),
        Radius::Law(RadiusLaw::Uniform([min, max])) => {
            let key = format!("{key}.uniform");
            check.positive(&key, *min, " of m")?;
            if min > max {
                let value = format!("[{}, {}]", show(*min), show(*max));
                return Err(check.origin.bad(&key, value, "must be [min, max] with min <= max"));
            }
            let law = Uniform::new_inclusive(*min, *max).map_err(|_| {
                let value = format!("[{}, {}]", show(*min), show(*max));
                check.origin.bad(&key, value, TOO_WIDE)
            })?;
            Ok((0..count).map(|_| law.sample(rng)).collect())
        }
        Radius::Law(RadiusLaw::List(list)) => {
            let key = format!("{key}.list");
            for radius in list {
                check.positive(&key, *radius, " of m")?;
            }
            if list.is_empty() {
                return Err(check.origin.bad(&key, "[]", "must hold at least one radius"));
            }
            Ok((0..count).map(|_| list[rng.random_range(0..list.len())]).collect())
        }
        Radius::Law(RadiusLaw::Normal(moments)) => {
            let key = format!("{key}.normal");
            let limits = limits(moments, &key, check)?;
            let law = Normal::new(moments.mean, moments.std).map_err(|_| too_wide(moments, &key, check))?;
            truncated(law, limits, &key, count, rng, check)
        }
        Radius::Law(RadiusLaw::LogNormal(moments)) => {
            let key = format!("{key}.log_normal");
            let limits = limits(moments, &key, check)?;
            // Moments of the radius itself, not of its logarithm.
            let variance = (moments.std / moments.mean).powi(2).ln_1p();
            let law = LogNormal::new(moments.mean.ln() - 0.5 * variance, variance.sqrt())
                .map_err(|_| too_wide(moments, &key, check))?;
            truncated(law, limits, &key, count, rng, check)
        }
    }
}

/// Where the distribution is cut: three standard deviations around the mean unless the scene says otherwise.
fn limits(moments: &Moments, key: &str, check: &Check) -> Result<(f64, f64)> {
    let mean = check.positive(&format!("{key}.mean"), moments.mean, " of m")?;
    let std = check.not_negative(&format!("{key}.std"), moments.std, " of m")?;
    let min = moments.min.unwrap_or((mean - 3.0 * std).max(0.1 * mean));
    let max = moments.max.unwrap_or(mean + 3.0 * std);
    check.positive(&format!("{key}.min"), min, " of m")?;
    if min > max {
        let rule = format!("must not be below min = {}", show(min));
        return Err(check.origin.bad(&format!("{key}.max"), show(max), rule));
    }
    if !max.is_finite() {
        return Err(too_wide(moments, key, check));
    }
    // A zero spread may miss its own limits by a rounding error.
    let slack = 1e-12 * mean;
    Ok((min - slack, max + slack))
}

fn too_wide(moments: &Moments, key: &str, check: &Check) -> Error {
    let value = format!("{{ mean = {}, std = {} }}", show(moments.mean), show(moments.std));
    check.origin.bad(key, value, TOO_WIDE)
}

fn truncated(
    law: impl Distribution<f64>,
    (min, max): (f64, f64),
    key: &str,
    count: usize,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<Vec<f64>> {
    let mut draw = || (0..ATTEMPTS).map(|_| law.sample(rng)).find(|radius| (min..=max).contains(radius));
    let out_of_reach = || {
        let message =
            format!("hardly any radius falls between min = {} and max = {}; widen them", show(min), show(max));
        check.origin.wrong(key, message)
    };
    (0..count).map(|_| draw().ok_or_else(out_of_reach)).collect()
}
