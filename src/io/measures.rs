//! Measures of a packing as files.

use super::{
    contacts,
    files::{at, write},
};
use crate::{
    error::Result,
    measure::{
        Measures, Packing,
        micromechanics::{distribution::Distribution, profile::Part, stress::stress_of_particles},
    },
};
use serde_json::{Map, Value, json};
use std::{
    fs,
    io::{self, Write},
    path::Path,
};

/// Measures and what they are of.
pub struct MeasureFiles<'a> {
    pub packing: &'a Packing<'a>,
    pub measures: &'a Measures,
    pub step: u64,
    /// s
    pub time: f64,
}

impl MeasureFiles<'_> {
    /// All measures.
    pub fn json(&self) -> Value {
        let mut all = Map::new();
        all.insert("step".to_owned(), json!(self.step));
        all.insert("time".to_owned(), json!(self.time));
        if let Ok(Value::Object(measures)) = serde_json::to_value(self.measures) {
            all.extend(measures);
        }
        Value::Object(all)
    }

    /// Single numbers, by their names: what there are many of is in tables.
    pub fn numbers(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        flatten(&self.json(), "", &mut rows);
        rows
    }

    /// The same, a line each.
    ///
    /// # Errors
    /// Whatever goes wrong in writing to memory.
    pub fn csv(&self) -> io::Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(["measure", "value"])?;
        for (name, value) in self.numbers() {
            writer.write_record([name, value])?;
        }
        let bytes = writer.into_inner().map_err(|e| io::Error::other(e.to_string()))?;
        String::from_utf8(bytes).map_err(io::Error::other)
    }

    /// Into a folder, which is made if it is not there.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io)
    pub fn write(&self, folder: &Path) -> Result<()> {
        fs::create_dir_all(folder).map_err(at(folder))?;
        write(&folder.join("measures.json"), |file| {
            serde_json::to_writer_pretty(&mut *file, &self.json())?;
            writeln!(file)
        })?;
        write(&folder.join("measures.csv"), |file| file.write_all(self.csv()?.as_bytes()))?;
        write(&folder.join("grains.csv"), |file| self.grains(file))?;
        write(&folder.join("contacts.csv"), |file| contacts::write_table(file, self.packing))?;
        write(&folder.join("distributions.csv"), |file| self.distributions(file))?;
        write(&folder.join("profile.csv"), |file| self.profile(file))?;
        write(&folder.join("radial_distribution.csv"), |file| {
            writeln!(file, "low,high,g")?;
            let shells = &self.measures.radial_distribution;
            shells.iter().try_for_each(|shell| writeln!(file, "{:?},{:?},{:?}", shell.low, shell.high, shell.g))
        })
    }

    /// What acts on every particle, and the stress in it.
    fn grains(&self, file: &mut impl Write) -> io::Result<()> {
        let packing = self.packing;
        let mut contacts = vec![0_u32; packing.particles()];
        packing.all_actions().for_each(|action| contacts[action.particle] += 1);
        writeln!(
            file,
            "id,x,y,z,radius,free,contacts,net_force_x,net_force_y,net_force_z,moment_x,moment_y,moment_z,\
             stress_xx,stress_xy,stress_xz,stress_yx,stress_yy,stress_yz,stress_zx,stress_zy,stress_zz"
        )?;
        let (loads, stresses) = (packing.loads(), stress_of_particles(packing));
        for (k, (load, stress)) in loads.iter().zip(stresses).enumerate() {
            let weight = packing.mass(k) * packing.assembly.gravity;
            let net = if packing.is_free(k) { load.force + weight } else { load.force };
            let x = packing.center(k);
            write!(
                file,
                "{},{:?},{:?},{:?},{:?},{},{}",
                packing.number(k),
                x.x,
                x.y,
                x.z,
                packing.radius(k),
                packing.is_free(k),
                contacts[k]
            )?;
            let numbers = net.to_array().into_iter().chain(load.moment.to_array()).chain(stress.into_iter().flatten());
            numbers.into_iter().try_for_each(|x| write!(file, ",{x:?}"))?;
            writeln!(file)?;
        }
        Ok(())
    }

    /// Histograms.
    fn distributions(&self, file: &mut impl Write) -> io::Result<()> {
        let of = &self.measures.distributions;
        let all: [(&str, &Option<Distribution>); 5] = [
            ("normal_force", &of.normal_force),
            ("tangential_force", &of.tangential_force),
            ("mobilised_friction", &of.mobilised_friction),
            ("overlap", &of.overlap),
            ("overlap_over_radius", &of.overlap_over_radius),
        ];
        writeln!(file, "quantity,low,high,count")?;
        for (name, distribution) in all {
            for bin in distribution.iter().flat_map(|distribution| &distribution.bins) {
                writeln!(file, "{name},{:?},{:?},{}", bin.low, bin.high, bin.count)?;
            }
        }
        Ok(())
    }

    fn profile(&self, file: &mut impl Write) -> io::Result<()> {
        let axis = self.measures.profile_axis;
        let index = ["x", "y", "z"].iter().position(|name| *name == axis).unwrap_or(0);
        writeln!(
            file,
            "{axis}_low,{axis}_high,volume,solid_fraction,vx,vy,vz,stress_xx,stress_xy,stress_xz,stress_yx,stress_yy,\
             stress_yz,stress_zx,stress_zy,stress_zz"
        )?;
        for Part { lower, upper, volume, solid_fraction, velocity, stress, .. } in &self.measures.profile {
            let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:?}"));
            let velocity = [0, 1, 2].map(|k| number(velocity.map(|v| v[k]))).join(",");
            let stress = stress.total.iter().flatten().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(",");
            let (low, high) = (number(lower[index]), number(upper[index]));
            writeln!(file, "{low},{high},{volume:?},{solid_fraction:?},{velocity},{stress}")?;
        }
        Ok(())
    }
}

/// Numbers by the keys that lead to them; lists of tables are left out.
fn flatten(value: &Value, name: &str, rows: &mut Vec<(String, String)>) {
    let inside = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    match value {
        Value::Object(members) => members.iter().for_each(|(key, value)| flatten(value, &inside(key), rows)),
        Value::Array(items) => {
            for (k, item) in items.iter().enumerate() {
                let named = item.get("name").and_then(Value::as_str);
                match item {
                    Value::Object(members) if named.is_some() => {
                        let rest = members.iter().filter(|(key, _)| *key != "name");
                        let name = inside(named.unwrap_or_default());
                        rest.for_each(|(key, value)| flatten(value, &format!("{name}.{key}"), rows));
                    }
                    Value::Object(_) => {}
                    _ => flatten(item, &inside(["x", "y", "z"].get(k).copied().unwrap_or("more")), rows),
                }
            }
        }
        Value::Null => rows.push((name.to_owned(), String::new())),
        Value::String(text) => rows.push((name.to_owned(), text.clone())),
        other => rows.push((name.to_owned(), other.to_string())),
    }
}
