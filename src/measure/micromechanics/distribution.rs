//! How quantities of contacts and particles are distributed.

use super::{contact::Other, packing::Packing};
use serde::Serialize;

/// Numbers, by their moments, quantiles and counts in equal bins from the least to the most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Distribution {
    pub count: usize,
    pub mean: f64,
    pub standard_deviation: f64,
    pub least: f64,
    pub most: f64,
    /// As in [`PARTS`].
    pub quantiles: Vec<Quantile>,
    pub bins: Vec<Bin>,
}

/// What a part of the numbers does not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantile {
    pub part: f64,
    pub value: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    pub low: f64,
    pub high: f64,
    pub count: usize,
}

/// Parts of quantiles.
pub const PARTS: [f64; 9] = [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99];
const BINS: usize = 50;

impl Distribution {
    /// None of no numbers.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Distribution> {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let (&least, &most) = (values.first()?, values.last()?);
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64;
        // Rounding must not make a tenth of ten numbers two.
        let rank = |part: f64| ((part * count as f64 * (1.0 - 1e-12)).ceil() as usize).max(1) - 1;
        let quantiles = PARTS.iter().map(|&part| Quantile { part, value: values[rank(part)] }).collect();
        let edge = |k: usize| if k == BINS { most } else { least + (most - least) * (k as f64 / BINS as f64) };
        let up_to = |k: usize| if k == BINS { count } else { values.partition_point(|x| *x < edge(k)) };
        let bin = |k: usize| Bin { low: edge(k), high: edge(k + 1), count: up_to(k + 1) - up_to(k) };
        let bins =
            if least < most { (0..BINS).map(bin).collect() } else { vec![Bin { low: least, high: most, count }] };
        Some(Distribution { count, mean, standard_deviation: variance.sqrt(), least, most, quantiles, bins })
    }
}

/// Of the contacts of free grains; what no contact has is None.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfContacts {
    /// Compressive, N.
    pub normal_force: Option<Distribution>,
    /// Of contacts with friction, N.
    pub tangential_force: Option<Distribution>,
    /// Tangential force over its Coulomb limit.
    pub mobilised_friction: Option<Distribution>,
    /// m
    pub overlap: Option<Distribution>,
    /// Over the smaller radius.
    pub overlap_over_radius: Option<Distribution>,
    /// Of the contacts with friction, those at the Coulomb limit.
    pub sliding_fraction: Option<f64>,
}

impl OfContacts {
    pub fn of(packing: &Packing) -> OfContacts {
        let contacts = packing.contacts;
        let rough = || contacts.iter().filter(|contact| contact.friction > 0.0);
        let smaller = |grain: u32, other: Other| {
            let own = packing.grains[grain as usize].radius;
            if let Other::Grain(other) = other { own.min(packing.grains[other as usize].radius) } else { own }
        };
        OfContacts {
            normal_force: Distribution::of(contacts.iter().map(|contact| contact.normal_force())),
            tangential_force: Distribution::of(rough().map(|contact| contact.tangential_force().length())),
            mobilised_friction: Distribution::of(contacts.iter().filter_map(|contact| contact.mobilised_friction())),
            overlap: Distribution::of(contacts.iter().map(|contact| contact.overlap)),
            overlap_over_radius: Distribution::of(contacts.iter().map(|c| c.overlap / smaller(c.grain, c.other))),
            sliding_fraction: (rough().count() > 0)
                .then(|| rough().filter(|contact| contact.sliding).count() as f64 / rough().count() as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_counted() {
        assert_eq!(Distribution::of(std::iter::empty()), None);
        let found = Distribution::of((1..=100).rev().map(f64::from)).unwrap();
        assert_eq!((found.count, found.mean, found.least, found.most), (100, 50.5, 1.0, 100.0));
        assert!((found.standard_deviation - (9999.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        let values: Vec<f64> = found.quantiles.iter().map(|q| q.value).collect();
        assert_eq!(values, [1.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0]);
        assert_eq!(found.bins.iter().map(|bin| bin.count).sum::<usize>(), 100);
        assert_eq!(found.bins.last().unwrap().high, 100.0);
        assert!(found.bins.iter().all(|bin| (1..=3).contains(&bin.count)), "{found:?}");
        let same = Distribution::of([2.0, 2.0].into_iter()).unwrap();
        assert_eq!((same.bins.len(), same.bins[0].count, same.standard_deviation), (1, 2, 0.0));
    }
}
