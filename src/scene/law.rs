//! Contact parameters: the keys of materials and of their pairs, in files and in builders, and what becomes of them. A
//! law's own parameters are added here; how those of two materials mix stands in `materials.rs`.

use super::check::Check;
use super::setters::setters;
use crate::Result;
use serde::{Deserialize, Serialize};

/// How a pair of materials damps the normal motion of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Dashpot {
    /// No dashpot.
    #[default]
    None,
    /// Coefficient of restitution, in (0, 1].
    Restitution(f64),
    /// Mass-scaled coefficient η in 1/s: the force is `η m* v_n`.
    MassScaled(f64),
}

/// Contact parameters of a pair of materials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair {
    /// k_N, N/m.
    pub normal_stiffness: f64,
    /// k_T, N/m.
    pub tangential_stiffness: f64,
    /// μ = tan φ.
    pub friction: f64,
    pub dashpot: Dashpot,
    /// Elastic spheres in place of linear springs, whose stiffnesses are then 0.
    pub hertz: Option<Hertz>,
    /// None: grains roll freely.
    pub rolling: Option<Rolling>,
}

/// Rolling resistance with history (Iwashita & Oda 1998; type C of Ai et al. 2011).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rolling {
    /// μ_r: the couple is at most μ_r R* F_n.
    pub friction: f64,
    /// k_r / (k_n R*²), of the rolling spring, whose couple is k_r per radian.
    pub stiffness: f64,
    /// η_r: damping ratio of the rolling spring below its limit.
    pub damping: f64,
}

/// Effective moduli of a contact of elastic spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hertz {
    /// E*, Pa: 1/E* = (1 - ν_i²)/E_i + (1 - ν_j²)/E_j.
    pub youngs_modulus: f64,
    /// G*, Pa: 1/G* = 2 (2 - ν_i)(1 + ν_i)/E_i + 2 (2 - ν_j)(1 + ν_j)/E_j.
    pub shear_modulus: f64,
}

impl Hertz {
    /// Of a material against itself, from its Young's modulus, Pa, and Poisson's ratio.
    pub fn of_material(youngs_modulus: f64, poissons_ratio: f64) -> Hertz {
        let (e, nu) = (youngs_modulus, poissons_ratio);
        Hertz { youngs_modulus: e / (2.0 * (1.0 - nu * nu)), shear_modulus: e / (4.0 * (2.0 - nu) * (1.0 + nu)) }
    }
}

impl Pair {
    /// What a pair of an assembly must be, the k-th of them; `compliant`: in contact dynamics, which divides by stiffnesses.
    pub(super) fn check(&self, k: usize, compliant: bool, check: &Check) -> Result<()> {
        let at = |field: &str| format!("pair.{k}.{field}");
        let springs = if check.rigid { compliant } else { self.hertz.is_none() };
        let at_least = |least: bool| if least { Check::positive } else { Check::not_negative };
        at_least(springs)(check, &at("normal_stiffness"), self.normal_stiffness, " of N/m")?;
        at_least(compliant)(check, &at("tangential_stiffness"), self.tangential_stiffness, " of N/m")?;
        check.not_negative(&at("friction"), self.friction, "")?;
        if let Some(hertz) = &self.hertz {
            check.positive(&at("hertz.youngs_modulus"), hertz.youngs_modulus, " of Pa")?;
            check.positive(&at("hertz.shear_modulus"), hertz.shear_modulus, " of Pa")?;
            check_space(&at("hertz"), check)?;
        }
        match self.dashpot {
            Dashpot::None => 0.0,
            Dashpot::Restitution(e) => check.fraction(&at("restitution"), e)?,
            Dashpot::MassScaled(eta) => check.not_negative(&at("normal_damping"), eta, " of 1/s")?,
        };
        if let Some(rolling) = &self.rolling {
            check.not_negative(&at("rolling_friction"), rolling.friction, "")?;
            check.positive(&at("rolling_stiffness"), rolling.stiffness, "")?;
            check.not_negative(&at("rolling_damping"), rolling.damping, "")?;
            check_deformable(&at("rolling_friction"), rolling.friction, check)?;
        }
        Ok(())
    }
}

/// Contacts of elastic spheres are of spheres.
pub(super) fn check_space(key: &str, check: &Check) -> Result<()> {
    if check.dimension == 2 {
        let message = "the contact of elastic spheres needs dimension = 3; disks have linear springs, normal_stiffness";
        return Err(check.origin.wrong(key, message));
    }
    Ok(())
}

/// Rigid grains roll freely.
pub(super) fn check_deformable(key: &str, friction: f64, check: &Check) -> Result<()> {
    if friction > 0.0 && check.rigid {
        let rule = "rolling resistance needs method = \"dem\"; rigid grains roll freely";
        return Err(check.origin.bad(key, friction, rule));
    }
    Ok(())
}

/// Keys of `[material.NAME]`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialKeys {
    pub density: f64,
    pub normal_stiffness: Option<f64>,
    pub tangential_stiffness: Option<f64>,
    pub youngs_modulus: Option<f64>,
    pub poissons_ratio: Option<f64>,
    #[serde(default)]
    pub friction: f64,
    pub rolling_friction: Option<f64>,
    pub rolling_stiffness: Option<f64>,
    pub rolling_damping: Option<f64>,
    pub restitution: Option<f64>,
    pub normal_damping: Option<f64>,
}

/// Keys of `[[pair]]`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PairKeys {
    pub materials: Vec<String>,
    pub normal_stiffness: Option<f64>,
    pub tangential_stiffness: Option<f64>,
    pub friction: Option<f64>,
    pub rolling_friction: Option<f64>,
    pub rolling_stiffness: Option<f64>,
    pub rolling_damping: Option<f64>,
    pub restitution: Option<f64>,
    pub normal_damping: Option<f64>,
}

/// A material.
#[derive(Clone, Debug)]
pub struct MaterialBuilder(pub(super) MaterialKeys);

impl MaterialBuilder {
    /// Of this density, kg/m³; in two dimensions at unit thickness.
    pub fn new(density: f64) -> MaterialBuilder {
        MaterialBuilder(MaterialKeys { density, ..MaterialKeys::default() })
    }

    setters! {
        /// k_N of a contact of the material with itself, N/m. The discrete element method needs it, or both of the next
        /// two.
        normal_stiffness: f64;
        /// k_T, N/m. Default: 2/7 of the normal stiffness.
        tangential_stiffness: f64;
        /// E, Pa: elastic spheres (Hertz, Mindlin) in place of linear springs. In three dimensions.
        youngs_modulus: f64;
        /// ν, of elastic spheres.
        poissons_ratio: f64;
        /// μ = tan φ. Default: 0.
        friction: f64;
        /// μ_r: contacts resist rolling by a couple of up to μ_r R* F_n. Default: 0.
        rolling_friction: f64;
        /// Stiffness of the rolling spring over k_n R*². Default: 2.25 μ_r² (disks 3 μ_r²).
        rolling_stiffness: f64;
        /// Damping ratio of the rolling spring. Default: 0.
        rolling_damping: f64;
        /// Normal coefficient of restitution, in (0, 1]. Default: no dashpot.
        restitution: f64;
        /// Mass-scaled damping η of the normal motion, 1/s, in place of a restitution. Default: no dashpot.
        normal_damping: f64;
    }
}

/// What replaces single parameters of the mixing rule for a pair of materials.
#[derive(Clone, Debug)]
pub struct PairBuilder(pub(super) PairKeys);

impl PairBuilder {
    /// For two materials, in any order, or for one against itself.
    pub fn new(a: &str, b: &str) -> PairBuilder {
        PairBuilder(PairKeys { materials: vec![a.to_owned(), b.to_owned()], ..PairKeys::default() })
    }

    setters! {
        /// k_N, N/m.
        normal_stiffness: f64;
        /// k_T, N/m.
        tangential_stiffness: f64;
        /// μ = tan φ.
        friction: f64;
        /// μ_r: contacts resist rolling by a couple of up to μ_r R* F_n.
        rolling_friction: f64;
        /// Stiffness of the rolling spring over k_n R*².
        rolling_stiffness: f64;
        /// Damping ratio of the rolling spring.
        rolling_damping: f64;
        /// Normal coefficient of restitution, in (0, 1].
        restitution: f64;
        /// Mass-scaled damping η, 1/s.
        normal_damping: f64;
    }
}
