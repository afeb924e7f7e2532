//! What is added up over all contacts of a packing, so that nobody needs to have them all at once.

use glam::{DMat3, DVec3};

/// Sum of forces, N, and their moment, N m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    pub force: DVec3,
    pub moment: DVec3,
}

/// Sums over contacts, and the particles that they join. In which order contacts are added does not show.
#[derive(Clone, Debug, Default)]
pub struct Totals {
    /// The particles of every contact; walls come after all of them.
    pub(super) ends: Vec<(u32, u32)>,
    /// Of every contact, whether it has friction, and this is not at its limit.
    pub(super) rough: Vec<bool>,
    /// Of the contacts with one free particle, their places among all and their normals.
    pub(super) outside: Vec<(u32, DVec3)>,
    /// Whether any contact has friction.
    pub(super) frictional: bool,
    /// - Σ f ⊗ l, column by column, J.
    pub(super) virial: [Sum; 3],
    pub(super) walls: Vec<OnWall>,
}

/// What a wall gets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OnWall {
    pub force: Sum,
    pub moment: Sum,
    /// Its x is.
    pub normal_force: Sum,
    pub contacts: usize,
}

impl Totals {
    pub fn contacts(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn virial(&self) -> DMat3 {
        let [x, y, z] = self.virial.map(|column| column.total());
        DMat3::from_cols(x, y, z)
    }
}

/// A sum with twice the digits of its parts: what adding rounds off is added up as well (Knuth's two-sum).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    value: DVec3,
    rest: DVec3,
}

impl Sum {
    pub fn add(&mut self, part: DVec3) {
        let sum = self.value + part;
        let added = sum - self.value;
        self.rest += (self.value - (sum - added)) + (part - added);
        self.value = sum;
    }

    pub fn total(&self) -> DVec3 {
        self.value + self.rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of 1 to 1e16 that cancel but for a little are the same in any order.
    #[test]
    fn order_does_not_show() {
        let part =
            |k: i32| DVec3::new(f64::from(k % 17 - 8).exp2(), 1.0 / f64::from(k + 1), 1e16_f64.powf(f64::from(k % 2)));
        let parts: Vec<DVec3> = (0..1000).flat_map(|k| [part(k), 0.9 * part(k + 1), -part(k)]).collect();
        let sum = |parts: &mut dyn Iterator<Item = &DVec3>| {
            let mut sum = Sum::default();
            parts.for_each(|part| sum.add(*part));
            sum.total()
        };
        let plain = |parts: &mut dyn Iterator<Item = &DVec3>| parts.fold(DVec3::ZERO, |sum, part| sum + *part);
        let (found, other) = (sum(&mut parts.iter()), sum(&mut parts.iter().rev()));
        assert_eq!(found, other);
        assert_ne!(plain(&mut parts.iter()), plain(&mut parts.iter().rev()));
    }
}
