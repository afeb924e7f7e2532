//! Materials and the contact parameters of their pairs.

use super::check::Check;
use super::law::{Hertz, Rolling, check_deformable, check_space};
use super::schema::{Compliance, File, Material, Method, Pair as Override};
use super::{Dashpot, Pair};
use crate::Result;

/// Contact parameters of every pair of materials, row-major.
pub fn pairs(file: &File, check: &Check) -> Result<Vec<Pair>> {
    let springs = springs(file, check)?;
    let own: Vec<Pair> = file
        .material
        .iter()
        .map(|(name, material)| material_pair(name, material, springs, check))
        .collect::<Result<_>>()?;
    let overrides = overrides(file, check)?;
    let stiff: Vec<bool> = file.material.values().map(|material| material.rolling_stiffness.is_some()).collect();
    let count = own.len();
    let mut pairs = Vec::with_capacity(count * count);
    for a in 0..count {
        for b in 0..count {
            let over = overrides.get(&(a.min(b), a.max(b)));
            pairs.push(pair(a, b, &own, over.copied(), stiff[a] || stiff[b], check)?);
        }
    }
    one_kind(&mut pairs, check)?;
    let of_all = |pair: &mut Pair, normal_stiffness: f64| {
        let tangential_stiffness = TANGENTIAL_PART * normal_stiffness;
        *pair = Pair { normal_stiffness, tangential_stiffness, dashpot: Dashpot::None, ..*pair };
    };
    match springs {
        Springs::OfMaterials => {
            // Contact dynamics divides by the tangential one.
            let slippery = pairs.iter_mut().filter(|pair| check.rigid && pair.tangential_stiffness == 0.0);
            slippery.for_each(|pair| (pair.friction, pair.tangential_stiffness) = (0.0, pair.normal_stiffness));
        }
        // Rigid grains have none, and no rebound.
        Springs::None => pairs.iter_mut().for_each(|pair| of_all(pair, 0.0)),
        Springs::OfAll(stiffness) => pairs.iter_mut().for_each(|pair| of_all(pair, stiffness)),
    }
    Ok(pairs)
}

/// k_T over k_N where there is nothing to say otherwise: the period of both springs of a sphere is the same.
const TANGENTIAL_PART: f64 = 2.0 / 7.0;

/// Where the springs of contacts come from.
#[derive(Clone, Copy, PartialEq)]
enum Springs {
    OfMaterials,
    /// N/m
    OfAll(f64),
    /// Contacts are rigid.
    None,
}

/// Those that the method and its compliance ask for.
fn springs(file: &File, check: &Check) -> Result<Springs> {
    let key = "solver.compliance";
    Ok(match &file.solver.compliance {
        _ if file.solver.method == Method::Dem => Springs::OfMaterials,
        None => Springs::None,
        Some(compliance) if compliance.is_none() => Springs::None,
        Some(Compliance::Word(word)) if word == "stiffness" => Springs::OfMaterials,
        Some(Compliance::Word(word)) => {
            let rule = "must be \"none\", \"stiffness\", or 0 or a positive number of m/N";
            return Err(check.origin.bad(key, format!("\"{word}\""), rule));
        }
        Some(Compliance::Constant(compliance)) => {
            Springs::OfAll(1.0 / check.positive(key, *compliance, " of m/N, \"none\" or \"stiffness\"")?)
        }
    })
}

/// Tables of grains hold the names of materials as they are, so that a name must not look like two values or two rows.
fn check_name(name: &str, check: &Check) -> Result<()> {
    let foreign = |c: char| c == ',' || c == '"' || c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    if !name.is_empty() && name.trim() == name && !name.contains(foreign) {
        return Ok(());
    }
    let message = "the name of a material must have at least one character and may have any but commas, double quotes, line breaks and other control characters, with no space at either end";
    Err(check.origin.wrong(&format!("material.{}", name.escape_debug()), message))
}

/// A material against itself.
fn material_pair(name: &str, material: &Material, springs: Springs, check: &Check) -> Result<Pair> {
    check_name(name, check)?;
    let key = |field: &str| format!("material.{name}.{field}");
    check.positive(&key("density"), material.density, " of kg/m³")?;
    let hertz = hertz(name, material, check)?;
    let normal_stiffness = match (material.normal_stiffness, hertz) {
        (Some(stiffness), _) => check.positive(&key("normal_stiffness"), stiffness, " of N/m")?,
        (None, Some(_)) => 0.0,
        (None, None) if springs != Springs::OfMaterials => 1.0, // forgotten below
        (None, None) => {
            let message = match check.rigid {
                false => {
                    "missing key `normal_stiffness`, or youngs_modulus and poissons_ratio, which method = \"dem\" needs"
                }
                true => {
                    "missing key `normal_stiffness`, which compliance = \"stiffness\" needs; youngs_modulus is for method = \"dem\" only"
                }
            };
            return Err(check.origin.wrong(&format!("material.{name}"), message));
        }
    };
    let tangential_stiffness = material.tangential_stiffness.unwrap_or(TANGENTIAL_PART * normal_stiffness);
    Ok(Pair {
        normal_stiffness,
        tangential_stiffness: check.not_negative(&key("tangential_stiffness"), tangential_stiffness, " of N/m")?,
        friction: check.not_negative(&key("friction"), material.friction, "")?,
        dashpot: dashpot(&format!("material.{name}"), material.restitution, material.normal_damping, check)?
            .unwrap_or(Dashpot::None),
        hertz,
        rolling: rolling(&format!("material.{name}"), Resistance::of_material(material), None, false, check)?,
    })
}

/// The keys of rolling resistance.
#[derive(Clone, Copy)]
struct Resistance {
    friction: Option<f64>,
    stiffness: Option<f64>,
    damping: Option<f64>,
}

impl Resistance {
    fn of_material(m: &Material) -> Resistance {
        Resistance { friction: m.rolling_friction, stiffness: m.rolling_stiffness, damping: m.rolling_damping }
    }

    fn of_pair(p: &Override) -> Resistance {
        Resistance { friction: p.rolling_friction, stiffness: p.rolling_stiffness, damping: p.rolling_damping }
    }
}

/// The rolling resistance that keys ask for in place of what there is without them, whose stiffness was `given` or
/// follows from μ_r. None if it is none.
fn rolling(key: &str, keys: Resistance, mixed: Option<Rolling>, given: bool, check: &Check) -> Result<Option<Rolling>> {
    let at = |field: &str| format!("{key}.{field}");
    let friction = match (keys.friction, mixed) {
        (Some(mu), _) => check.not_negative(&at("rolling_friction"), mu, "")?,
        (None, Some(mixed)) => mixed.friction,
        (None, None) => match (keys.stiffness, keys.damping) {
            (None, None) => return Ok(None),
            (stiffness, _) => {
                let field = if stiffness.is_some() { "rolling_stiffness" } else { "rolling_damping" };
                return Err(check.origin.wrong(&at(field), "needs rolling_friction, without which grains roll freely"));
            }
        },
    };
    check_deformable(&at("rolling_friction"), friction, check)?;
    // Ai et al. 2011, eq. 20 and 21: of spheres and of disks. Where no material says otherwise it follows a pair's own
    // μ_r.
    let usual = if check.dimension == 2 { 3.0 } else { 2.25 } * friction * friction;
    let stiffness = keys.stiffness.or(mixed.filter(|_| given || keys.friction.is_none()).map(|m| m.stiffness));
    let stiffness = stiffness.unwrap_or(usual);
    if friction > 0.0 {
        check.positive(&at("rolling_stiffness"), stiffness, "")?;
    }
    let damping = keys.damping.or(mixed.map(|m| m.damping)).unwrap_or(0.0);
    let damping = check.not_negative(&at("rolling_damping"), damping, "")?;
    Ok((friction > 0.0).then_some(Rolling { friction, stiffness, damping }))
}

/// The weaker of the two decides, as of friction; springs are in series, dampings averaged.
fn mix_rolling(a: &Pair, b: &Pair) -> Option<Rolling> {
    let (a, b) = (a.rolling?, b.rolling?);
    Some(Rolling {
        friction: a.friction.min(b.friction),
        stiffness: in_series(a.stiffness, b.stiffness),
        damping: 0.5 * (a.damping + b.damping),
    })
}

/// The moduli of a material against itself, if it is elastic.
fn hertz(name: &str, material: &Material, check: &Check) -> Result<Option<Hertz>> {
    let key = |field: &str| format!("material.{name}.{field}");
    let (e, nu) = match (material.youngs_modulus, material.poissons_ratio) {
        (None, None) => return Ok(None),
        (Some(e), Some(nu)) => (check.positive(&key("youngs_modulus"), e, " of Pa")?, nu),
        (e, _) => {
            let missing = if e.is_none() { "youngs_modulus" } else { "poissons_ratio" };
            let message = format!("missing key `{missing}`: elastic spheres need youngs_modulus and poissons_ratio");
            return Err(check.origin.wrong(&format!("material.{name}"), message));
        }
    };
    if !(nu > -1.0 && nu <= 0.5) {
        return Err(check.origin.bad(&key("poissons_ratio"), nu, "must be above -1 and at most 0.5"));
    }
    if check.rigid {
        return Ok(None);
    }
    check_space(&key("youngs_modulus"), check)?;
    if material.normal_stiffness.is_some() || material.tangential_stiffness.is_some() {
        let message =
            "has youngs_modulus and a stiffness; elastic spheres get theirs from the modulus, so only one is allowed";
        return Err(check.origin.wrong(&format!("material.{name}"), message));
    }
    Ok(Some(Hertz::of_material(e, nu)))
}

/// The dashpot that the two keys ask for. One that damps nothing is `Dashpot::None`.
fn dashpot(key: &str, restitution: Option<f64>, normal_damping: Option<f64>, check: &Check) -> Result<Option<Dashpot>> {
    let dashpot = match (restitution, normal_damping) {
        (None, None) => return Ok(None),
        (Some(_), Some(_)) => {
            let message = "has both restitution and normal_damping; only one is allowed";
            return Err(check.origin.wrong(key, message));
        }
        (Some(e), None) => Dashpot::Restitution(check.fraction(&format!("{key}.restitution"), e)?),
        (None, Some(eta)) => {
            let key = format!("{key}.normal_damping");
            Dashpot::MassScaled(check.not_negative(&key, eta, " of 1/s")?)
        }
    };
    Ok(Some(match dashpot {
        Dashpot::Restitution(1.0) | Dashpot::MassScaled(0.0) => Dashpot::None,
        other => other,
    }))
}

type Overrides<'a> = std::collections::HashMap<(usize, usize), (usize, &'a Override)>;

/// The `[[pair]]` tables by sorted material indices, with their place in the file.
fn overrides<'a>(file: &'a File, check: &Check) -> Result<Overrides<'a>> {
    let mut overrides = Overrides::new();
    for (number, pair) in file.pair.iter().enumerate() {
        let key = format!("pair.{number}.materials");
        let [a, b] = pair.materials.as_slice() else {
            let value = format!("{:?}", pair.materials);
            return Err(check.origin.bad(&key, value, "must be two material names"));
        };
        let a = check.material(&key, a)? as usize;
        let b = check.material(&key, b)? as usize;
        if let Some((first, _)) = overrides.insert((a.min(b), a.max(b)), (number, pair)) {
            let value = format!("{:?}", pair.materials);
            let rule = format!("pair.{first} already names this pair");
            return Err(check.origin.bad(&key, value, rule));
        }
    }
    Ok(overrides)
}

/// The mixing rule, then the override.
fn pair(
    a: usize,
    b: usize,
    own: &[Pair],
    over: Option<(usize, &Override)>,
    given: bool,
    check: &Check,
) -> Result<Pair> {
    let (first, second) = (&own[a], &own[b]);
    let mixed = Pair {
        normal_stiffness: in_series(first.normal_stiffness, second.normal_stiffness),
        tangential_stiffness: in_series(first.tangential_stiffness, second.tangential_stiffness),
        friction: first.friction.min(second.friction),
        dashpot: Dashpot::None,
        rolling: mix_rolling(first, second),
        hertz: mix_moduli(first, second).map_err(|()| {
            let (a, b) = (check.materials[a], check.materials[b]);
            let (a, b) = if first.hertz.is_some() { (a, b) } else { (b, a) };
            let message = format!(
                "\"{a}\" has youngs_modulus and \"{b}\" normal_stiffness; give all materials of a scene the same one"
            );
            check.origin.wrong("material", message)
        })?,
    };
    let mixed_dashpot = || {
        mix_dashpots(first.dashpot, second.dashpot).ok_or_else(|| {
            let (a, b) = (check.materials[a], check.materials[b]);
            let (a, b) = match first.dashpot {
                Dashpot::Restitution(_) => (a, b),
                _ => (b, a),
            };
            check.origin.wrong("material", format!(
                "\"{a}\" has restitution and \"{b}\" has normal_damping, which do not mix; give both the same key, in [material.NAME] or in [[pair]] tables"
            ))
        })
    };
    let Some((number, over)) = over else {
        return Ok(Pair { dashpot: mixed_dashpot()?, ..mixed });
    };
    let key = |field: &str| format!("pair.{number}.{field}");
    let normal = over.normal_stiffness.unwrap_or(mixed.normal_stiffness);
    let tangential = over.tangential_stiffness.unwrap_or(mixed.tangential_stiffness);
    let friction = over.friction.unwrap_or(mixed.friction);
    let own_dashpot = dashpot(&format!("pair.{number}"), over.restitution, over.normal_damping, check)?;
    let stiffness = over.normal_stiffness.or(over.tangential_stiffness);
    if let (Some(_), Some(stiffness)) = (mixed.hertz, stiffness) {
        let field = if over.normal_stiffness.is_some() { "normal_stiffness" } else { "tangential_stiffness" };
        let rule = "elastic spheres get their stiffness from the moduli of the two materials";
        return Err(check.origin.bad(&key(field), stiffness, rule));
    }
    let normal_stiffness =
        if mixed.hertz.is_some() { 0.0 } else { check.positive(&key("normal_stiffness"), normal, " of N/m")? };
    Ok(Pair {
        normal_stiffness,
        hertz: mixed.hertz,
        rolling: rolling(&format!("pair.{number}"), Resistance::of_pair(over), mixed.rolling, given, check)?,
        tangential_stiffness: check.not_negative(&key("tangential_stiffness"), tangential, " of N/m")?,
        friction: check.not_negative(&key("friction"), friction, "")?,
        dashpot: own_dashpot.map_or_else(mixed_dashpot, Ok)?,
    })
}

/// Harmonic mean: two springs in series, scaled so that equal springs give their own value.
fn in_series(a: f64, b: f64) -> f64 {
    if a == b { a } else { 2.0 * a * b / (a + b) }
}

/// Compliances of the two add up, so moduli of equal materials give their own. An error if only one of the two is
/// elastic.
fn mix_moduli(a: &Pair, b: &Pair) -> std::result::Result<Option<Hertz>, ()> {
    match (a.hertz, b.hertz) {
        (None, None) => Ok(None),
        (Some(a), Some(b)) => Ok(Some(Hertz {
            youngs_modulus: in_series(a.youngs_modulus, b.youngs_modulus),
            shear_modulus: in_series(a.shear_modulus, b.shear_modulus),
        })),
        _ => Err(()),
    }
}

/// Geometric mean of restitutions, arithmetic mean of dampings. None if the kinds differ.
fn mix_dashpots(a: Dashpot, b: Dashpot) -> Option<Dashpot> {
    use Dashpot::{MassScaled, None as Undamped, Restitution};
    match (a, b) {
        (Undamped, Undamped) => Some(Undamped),
        (Restitution(a), Restitution(b)) => Some(Restitution(if a == b { a } else { (a * b).sqrt() })),
        (Restitution(e), Undamped) | (Undamped, Restitution(e)) => Some(Restitution(e.sqrt())),
        (MassScaled(a), MassScaled(b)) => Some(MassScaled(0.5 * (a + b))),
        (MassScaled(eta), Undamped) | (Undamped, MassScaled(eta)) => Some(MassScaled(0.5 * eta)),
        _ => None,
    }
}

/// Gives all pairs the same kind of dashpot, so that a run needs one force law only.
fn one_kind(pairs: &mut [Pair], check: &Check) -> Result<()> {
    let count = check.materials.len();
    let find = |wanted: fn(&Dashpot) -> bool| pairs.iter().position(|pair| wanted(&pair.dashpot));
    let restitution = find(|dashpot| matches!(dashpot, Dashpot::Restitution(_)));
    let damping = find(|dashpot| matches!(dashpot, Dashpot::MassScaled(_)));
    let undamped = match (restitution, damping) {
        (None, None) => return Ok(()),
        (Some(_), None) => Dashpot::Restitution(1.0),
        (None, Some(_)) => Dashpot::MassScaled(0.0),
        (Some(e), Some(eta)) => {
            let names = |at: usize| {
                let (a, b) = (check.materials[at / count], check.materials[at % count]);
                format!("\"{a}\"-\"{b}\"")
            };
            let message = format!(
                "the pair {} has restitution and the pair {} has normal_damping; all pairs of a scene must use the same one",
                names(e),
                names(eta)
            );
            return Err(check.origin.wrong("material", message));
        }
    };
    for pair in pairs {
        if pair.dashpot == Dashpot::None {
            pair.dashpot = undamped;
        }
    }
    Ok(())
}
