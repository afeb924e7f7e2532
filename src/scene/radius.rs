//! Radii of a population.

mod bell;
mod curve;

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Uniform};

use super::apportion::apportioned;
use super::check::{Check, TOO_WIDE, show, show_list};
use super::schema::{Distribution, Moments, Radius, Weighting};
use crate::{Error, Result, memory};
use bell::{Bell, Kind};

/// Radii, m, and what a user should know of them.
pub struct Drawn {
    pub radii: Vec<f64>,
    pub notices: Vec<String>,
}

impl From<Vec<f64>> for Drawn {
    fn from(radii: Vec<f64>) -> Drawn {
        Drawn { radii, notices: Vec::new() }
    }
}

/// Draws `count` radii, m.
pub fn draw(law: &Radius, key: &str, count: usize, rng: &mut ChaCha8Rng, check: &Check) -> Result<Drawn> {
    let law = match law {
        Radius::Constant(radius) => return Ok(memory::filled(check.positive(key, *radius, " of m")?, count)?.into()),
        Radius::Distribution(law) => law,
    };
    // Of shares of the volume, a radius has this power of itself less in shares of the number.
    let power = match law.by {
        Weighting::Number => 0,
        Weighting::Volume => check.dimension as i32,
    };
    if law.shares.is_some() && law.list.is_none() {
        return Err(check.origin.wrong(&format!("{key}.shares"), "goes with `list` only"));
    }
    let key_of = |kind: &str| format!("{key}.{kind}");
    match law.as_ref() {
        Distribution { uniform: Some(ends), normal: None, log_normal: None, list: None, sieve: None, .. } => {
            uniform(*ends, power, &key_of("uniform"), count, rng, check).map(Drawn::from)
        }
        Distribution { uniform: None, normal: Some(moments), log_normal: None, list: None, sieve: None, .. } => {
            bell(Kind::Normal, moments, power, &key_of("normal"), count, rng, check)
        }
        Distribution { uniform: None, normal: None, log_normal: Some(moments), list: None, sieve: None, .. } => {
            bell(Kind::LogNormal, moments, power, &key_of("log_normal"), count, rng, check)
        }
        Distribution {
            uniform: None, normal: None, log_normal: None, list: Some(list), shares, sieve: None, ..
        } => listed(list, shares.as_deref(), power, key, count, rng, check),
        Distribution { uniform: None, normal: None, log_normal: None, list: None, sieve: Some(sieve), .. } => {
            Ok(curve::of(sieve, &key_of("sieve"), check)?.draw(power, count, rng).into())
        }
        _ => Err(check.origin.wrong(key, "needs one of uniform, normal, log_normal, list, sieve, and only one")),
    }
}

fn uniform(
    [min, max]: [f64; 2],
    power: i32,
    key: &str,
    count: usize,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<Vec<f64>> {
    check.positive(key, min, " of m")?;
    let bad = |rule: &str| check.origin.bad(key, show_list(&[min, max]), rule);
    if min > max {
        return Err(bad("must be [min, max] with min <= max"));
    }
    let law = Uniform::new_inclusive(min, max).map_err(|_| bad(TOO_WIDE))?;
    if power == 0 {
        return Ok((0..count).map(|_| law.sample(rng)).collect());
    }
    Ok((0..count).map(|_| curve::between(min, max, power, rng)).collect())
}

/// Every radius as often as its share says, the rounded numbers of largest remainder first.
fn listed(
    list: &[f64],
    shares: Option<&[f64]>,
    power: i32,
    key: &str,
    count: usize,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<Drawn> {
    let list_key = format!("{key}.list");
    for radius in list {
        check.positive(&list_key, *radius, " of m")?;
    }
    let Some(first) = list.first() else {
        return Err(check.origin.bad(&list_key, "[]", "must hold at least one radius"));
    };
    let shares = shares.map_or_else(|| vec![1.0; list.len()], <[f64]>::to_vec);
    let shares_key = format!("{key}.shares");
    if shares.len() != list.len() {
        let rule = format!("must have as many numbers as list, {}", list.len());
        return Err(check.origin.bad(&shares_key, show_list(&shares), rule));
    }
    shares.iter().try_for_each(|share| check.not_negative(&shares_key, *share, "").map(|_| ()))?;
    let weights: Vec<f64> = shares.iter().zip(list).map(|(share, r)| share * (r / first).powi(-power)).collect();
    let total: f64 = weights.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return Err(check.origin.bad(&shares_key, show_list(&shares), "must add up to a positive number"));
    }
    let counts = apportioned(&weights, count);
    let mut radii: Vec<f64> =
        list.iter().zip(&counts).flat_map(|(radius, n)| std::iter::repeat_n(*radius, *n)).collect();
    radii.shuffle(rng);
    let absent = (0..list.len()).filter(|&k| counts[k] == 0 && shares[k] > 0.0);
    let notice = |k: usize| {
        let (radius, wanted) = (show(list[k]), show(count as f64 * (weights[k] / total)));
        format!("{list_key}: no grain has the radius {radius} m, as its share of {count} grains is {wanted}")
    };
    Ok(Drawn { radii, notices: absent.map(notice).collect() })
}

/// A normal or log-normal distribution whose mean and standard deviation are as asked, after its cut.
fn bell(
    kind: Kind,
    moments: &Moments,
    power: i32,
    key: &str,
    count: usize,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<Drawn> {
    let mean = check.positive(&format!("{key}.mean"), moments.mean, " of m")?;
    let std = check.not_negative(&format!("{key}.std"), moments.std, " of m")?;
    let (min, max) = limits(kind, moments, key, check)?;
    if std == 0.0 {
        return Ok(memory::filled(mean, count)?.into());
    }
    let relative = std / mean;
    let (low, high) = Bell::ends(kind, relative, power, min.map(|min| min / mean), max.map(|max| max / mean));
    if !(low < high && low.is_finite() && high.is_finite() && (mean * mean).is_normal() && (std * std).is_normal()) {
        return Err(too_wide(moments, key, check));
    }
    let uncut = min.is_none() && max.is_none();
    let asked = Bell::uncut(kind, relative, low, high);
    let found = if uncut { Some(asked) } else { Bell::with_moments(kind, relative, low, high) };
    let radii: Vec<f64> = found.unwrap_or(asked).draw(power, count, rng).into_iter().map(|r| mean * r).collect();
    if radii.iter().any(|radius| !radius.is_normal()) {
        return Err(too_wide(moments, key, check));
    }
    let notices = if found.is_some() {
        vec![]
    } else {
        vec![effect_of_cut(kind, moments, (min, max), power, &radii, key, check)]
    };
    Ok(Drawn { radii, notices })
}

/// What comes of moments that no distribution between the limits has.
fn effect_of_cut(
    kind: Kind,
    moments: &Moments,
    (min, max): (Option<f64>, Option<f64>),
    power: i32,
    radii: &[f64],
    key: &str,
    check: &Check,
) -> String {
    let Moments { mean, std, .. } = *moments;
    let weights: f64 = radii.iter().map(|r| (r / mean).powi(power)).sum();
    let average =
        |of: &dyn Fn(f64) -> f64| radii.iter().map(|r| (r / mean).powi(power) * of(r / mean)).sum::<f64>() / weights;
    let delivered = average(&|r| r);
    let spread = average(&|r| (r - delivered).powi(2)).sqrt();
    let dimension = check.dimension as i32;
    let share = average(&|r| r.powi(dimension)) / kind.mean_power(std / mean, dimension);
    let limit = |limit: Option<f64>, none: &str| limit.map_or(none.to_owned(), show);
    format!(
        "{key}: no {} distribution between {} and {} m has the mean {} and the standard deviation {}; the one without limits was cut \
         there, which gives {} and {}, and a mean R^{dimension} of {} of that asked for",
        kind.name(),
        limit(min, "0"),
        limit(max, "infinity"),
        show(mean),
        show(std),
        show(mean * delivered),
        show(mean * spread),
        show(share)
    )
}

/// Where the distribution is cut: a normal one three standard deviations from the mean, but above 0, unless the scene
/// says otherwise.
fn limits(kind: Kind, moments: &Moments, key: &str, check: &Check) -> Result<(Option<f64>, Option<f64>)> {
    let Moments { mean, std, .. } = *moments;
    let (mut min, mut max) = (moments.min, moments.max);
    if kind == Kind::Normal {
        min = min.or(Some((mean - 3.0 * std).max(0.1 * mean)));
        max = max.or(Some(mean + 3.0 * std));
    }
    if let Some(min) = min {
        check.positive(&format!("{key}.min"), min, " of m")?;
        if max.is_some_and(|max| min > max) {
            let rule = format!("must not be below min = {}", show(min));
            return Err(check.origin.bad(&format!("{key}.max"), show(max.unwrap_or(min)), rule));
        }
    }
    if max.is_some_and(|max| !max.is_finite()) {
        return Err(too_wide(moments, key, check));
    }
    let within = min.is_none_or(|min| min <= mean) && max.is_none_or(|max| mean <= max);
    let inside = min.is_none_or(|min| min < mean) && max.is_none_or(|max| mean < max);
    if !(inside || within && std == 0.0) {
        let rule = "must lie between min and max";
        return Err(check.origin.bad(&format!("{key}.mean"), show(mean), rule));
    }
    Ok((min, max))
}

fn too_wide(moments: &Moments, key: &str, check: &Check) -> Error {
    let value = format!("{{ mean = {}, std = {} }}", show(moments.mean), show(moments.std));
    check.origin.bad(key, value, TOO_WIDE)
}
