//! Shares of a number of grains.

/// How many of `count` go to each of these weights, which add up to a positive number: rounded down, and what is left to
/// the largest remainders.
pub fn apportioned(weights: &[f64], count: usize) -> Vec<usize> {
    let total: f64 = weights.iter().sum();
    let wanted: Vec<f64> = weights.iter().map(|weight| count as f64 * (weight / total)).collect();
    let mut counts: Vec<usize> = wanted.iter().map(|wanted| wanted.floor() as usize).collect();
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| wanted[b].fract().total_cmp(&wanted[a].fract()));
    let left = count.saturating_sub(counts.iter().sum());
    order.iter().cycle().take(left).for_each(|&k| counts[k] += 1);
    counts
}
