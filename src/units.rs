//! Units of a scene: what a device computes in, so that whatever units a scene is in, numbers there are of order 1 and
//! neither they nor their squares leave the range of single precision.
//!
//! Units are powers of two: to convert a number is exact, and no result depends on them as long as nothing leaves the
//! range. The host has SI units everywhere.

/// What a number measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A ratio, a count, a flag.
    Number,
    Length,
    InverseLength,
    Time,
    /// Of a process, of a rotation.
    Rate,
    Velocity,
    VelocitySquared,
    Acceleration,
    InverseMass,
    InverseInertia,
    Force,
    Torque,
    Impulse,
    Energy,
    Power,
    Stiffness,
    Modulus,
    /// Of disks of unit thickness, N/m and N s/m.
    Stress,
    Viscosity,
    /// k_N, or E* of the Hertz law.
    NormalStiffness,
    /// k_T, or G* of Mindlin's law.
    TangentialStiffness,
    /// Damping ratio, or a rate.
    Dashpot,
    /// Force, or impulse of contact dynamics, and its moment.
    Load,
    LoadTorque,
}

impl Quantity {
    /// The SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Number => "1",
            Quantity::Length => "m",
            Quantity::InverseLength => "1/m",
            Quantity::Time => "s",
            Quantity::Rate => "1/s",
            Quantity::Velocity => "m/s",
            Quantity::VelocitySquared => "m²/s²",
            Quantity::Acceleration => "m/s²",
            Quantity::InverseMass => "1/kg",
            Quantity::InverseInertia => "1/(kg m²)",
            Quantity::Force => "N",
            Quantity::Torque => "N m",
            Quantity::Impulse => "N s",
            Quantity::Energy => "J",
            Quantity::Power => "W",
            Quantity::Stiffness => "N/m",
            Quantity::Modulus | Quantity::Stress => "Pa",
            Quantity::NormalStiffness | Quantity::TangentialStiffness => "N/m or Pa",
            Quantity::Viscosity => "Pa s",
            Quantity::Dashpot => "1 or 1/s",
            Quantity::Load => "N or N s",
            Quantity::LoadTorque => "N m or N m s",
        }
    }
}

/// The units of a scene, in SI units, and what quantities its laws of contact have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// m, kg and s: powers of two.
    pub length: f64,
    pub mass: f64,
    pub time: f64,
    /// Whether grains are disks of unit thickness.
    pub flat: bool,
    /// Whether stiffnesses are moduli.
    pub elastic: bool,
    /// Whether dashpots are rates.
    pub rates: bool,
    /// Whether contacts hand on impulses.
    pub rigid: bool,
}

impl Default for Units {
    /// SI units.
    fn default() -> Units {
        Units { length: 1.0, mass: 1.0, time: 1.0, flat: false, elastic: false, rates: false, rigid: false }
    }
}

impl Units {
    /// The unit of a quantity, in SI units: a power of two.
    pub fn of(&self, quantity: Quantity) -> f64 {
        let Units { length, mass, time, flat, elastic, rates, rigid } = *self;
        let velocity = length / time;
        let force = mass * velocity / time;
        match quantity {
            Quantity::Number => 1.0,
            Quantity::Length => length,
            Quantity::InverseLength => 1.0 / length,
            Quantity::Time => time,
            Quantity::Rate => 1.0 / time,
            Quantity::Velocity => velocity,
            Quantity::VelocitySquared => velocity * velocity,
            Quantity::Acceleration => velocity / time,
            Quantity::InverseMass => 1.0 / mass,
            Quantity::InverseInertia => 1.0 / (mass * length * length),
            Quantity::Force => force,
            Quantity::Torque | Quantity::Energy => force * length,
            Quantity::Impulse => force * time,
            Quantity::Power => force * velocity,
            Quantity::Stiffness => force / length,
            Quantity::Modulus => force / (length * length),
            Quantity::Stress if flat => force / length,
            Quantity::Stress => force / (length * length),
            Quantity::Viscosity => time * self.of(Quantity::Stress),
            Quantity::NormalStiffness | Quantity::TangentialStiffness => {
                self.of(if elastic { Quantity::Modulus } else { Quantity::Stiffness })
            }
            Quantity::Dashpot => self.of(if rates { Quantity::Rate } else { Quantity::Number }),
            Quantity::Load => self.of(if rigid { Quantity::Impulse } else { Quantity::Force }),
            Quantity::LoadTorque => length * self.of(Quantity::Load),
        }
    }

    /// A number as a device in single precision has it, in SI units.
    pub fn rounded(&self, quantity: Quantity, x: f64) -> f64 {
        let unit = self.of(quantity);
        unit * f64::from((x / unit) as f32)
    }
}

/// The power of two nearest to a number, by its logarithm.
pub fn power_of_two(x: f64) -> f64 {
    2.0_f64.powi(x.log2().round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_consistent() {
        let units = Units { length: 0.25, mass: 8.0, time: 2.0, ..Units::default() };
        let of = |q| units.of(q);
        assert_eq!(of(Quantity::Force), 8.0 * of(Quantity::Acceleration));
        assert_eq!(of(Quantity::Stiffness) * of(Quantity::Length), of(Quantity::Force));
        assert_eq!(of(Quantity::Modulus) * 0.0625, of(Quantity::Force));
        assert_eq!(of(Quantity::Energy), 8.0 * of(Quantity::VelocitySquared));
        assert_eq!(of(Quantity::Power) * 2.0, of(Quantity::Energy));
        assert_eq!(of(Quantity::Torque) * of(Quantity::InverseInertia), of(Quantity::Rate) / 2.0);
    }
}
