//! What there is to draw: grains and contacts of a state, or of a table.

use super::color::Color;
use glam::DVec3;
use packstone::{
    container::{self, Column, Container},
    io::{contacts::ends, csv::GrainRow, summary::Surroundings, write},
    measure::{Packing, micromechanics::stress::stress_of_particles},
    simulation::Simulation,
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, path::Path};

pub struct View {
    pub surroundings: Surroundings,
    /// m, and so are the radii.
    pub centers: Vec<DVec3>,
    pub radii: Vec<f64>,
    /// What the colours of grains show.
    pub values: Vec<f64>,
    /// Ends, m, and normal forces, N, of contacts, if they are drawn.
    pub rods: Vec<([DVec3; 2], f64)>,
}

/// What a file of a view says of it.
#[derive(Serialize, Deserialize)]
struct About {
    kind: String,
    step: u64,
    surroundings: Surroundings,
}

const KIND: &str = "view";

impl View {
    /// Of a table, which has no contacts.
    pub fn of_rows(rows: &[GrainRow], surroundings: Surroundings, color: Color) -> View {
        let names: BTreeSet<&str> = rows.iter().map(|grain| grain.material.as_str()).collect();
        let value = |(row, grain): (usize, &GrainRow)| match color {
            Color::Speed => grain.velocity().length(),
            Color::Id => grain.id.unwrap_or(row as u64) as f64,
            Color::Material => names.range(..grain.material.as_str()).count() as f64,
            Color::Radius | Color::Force | Color::Stress | Color::Coordination => grain.radius,
        };
        View {
            centers: rows.iter().map(GrainRow::position).collect(),
            radii: rows.iter().map(|grain| grain.radius).collect(),
            values: rows.iter().enumerate().map(value).collect(),
            surroundings,
            rods: Vec::new(),
        }
    }

    /// Of a state, with the contacts that colours take, or that are drawn as rods.
    ///
    /// # Errors
    /// If the device that has it is lost.
    pub fn of_state(simulation: &mut Simulation, color: Color, chains: bool) -> packstone::Result<View> {
        let (grains, walls, domain) = (simulation.grains()?, simulation.walls()?, simulation.domain()?);
        let (mut clumps, mut contacts) = (Vec::new(), Vec::new());
        let has_contacts = chains || color.has_contacts();
        if has_contacts {
            (clumps, contacts) = (simulation.clumps()?, simulation.contacts()?);
        }
        let assembly = simulation.assembly_in(domain);
        let each = || grains.iter().enumerate();
        let packing = has_contacts.then(|| Packing::new(&assembly, &grains, &clumps, &walls, &contacts));
        let of_contacts = |packing: &Packing| {
            let values = of_particles(packing, color);
            (0..grains.len()).map(|grain| values[packing.particle_of(grain as u32)]).collect()
        };
        let values = match (color, &packing) {
            (Color::Force | Color::Stress | Color::Coordination, Some(packing)) => of_contacts(packing),
            (Color::Speed, _) => each().map(|(_, grain)| grain.velocity.length()).collect(),
            (Color::Id, _) => each().map(|(k, _)| f64::from(assembly.numbers.of_grain(k))).collect(),
            (Color::Material, _) => each().map(|(_, grain)| f64::from(grain.material)).collect(),
            _ => each().map(|(_, grain)| grain.radius).collect(),
        };
        let rod = |packing: &Packing| contacts.iter().map(|c| (ends(packing, c), c.normal_force())).collect();
        Ok(View {
            surroundings: Surroundings::new(&assembly, &walls),
            centers: each().map(|(_, grain)| grain.position).collect(),
            radii: each().map(|(_, grain)| grain.radius).collect(),
            values,
            rods: packing.as_ref().filter(|_| chains).map(rod).unwrap_or_default(),
        })
    }

    /// Write it to a file, to be drawn later.
    pub fn write(&self, path: &Path, step: u64) -> packstone::Result<()> {
        let about = About { kind: KIND.to_owned(), step, surroundings: self.surroundings.clone() };
        write(path, |file| {
            let columns = [
                Column::new("position", "m", &self.centers, |x: &DVec3| x.to_array()),
                Column::new("radius", "m", &self.radii, |radius| [*radius]),
                Column::new("value", "", &self.values, |value| [*value]),
                Column::new("rod_from", "m", &self.rods, |(ends, _)| ends[0].to_array()),
                Column::new("rod_to", "m", &self.rods, |(ends, _)| ends[1].to_array()),
                Column::new("rod_force", "N", &self.rods, |(_, force)| [*force]),
            ];
            container::write(file, &about, &columns)
        })
    }

    /// From such a file, with the number of its step.
    ///
    /// # Errors
    /// If it cannot be read, or is none of a view.
    pub fn read(path: &Path) -> packstone::Result<(u64, View)> {
        let mut file = Container::<About>::open(path)?;
        let (step, surroundings) = (file.about.step, file.about.surroundings.clone());
        let mut numbers = |name: &str| {
            let mut found = Vec::new();
            file.read(name, |_, [x]: [f64; 1]| found.push(x)).map(|()| found)
        };
        let (radii, values, forces) = (numbers("radius")?, numbers("value")?, numbers("rod_force")?);
        let mut vectors = |name: &str| {
            let mut found = Vec::new();
            file.read(name, |_, x: [f64; 3]| found.push(DVec3::from_array(x))).map(|()| found)
        };
        let (centers, from, to) = (vectors("position")?, vectors("rod_from")?, vectors("rod_to")?);
        let rods = from.into_iter().zip(to).zip(forces).map(|((from, to), force)| ([from, to], force)).collect();
        Ok((step, View { surroundings, centers, radii, values, rods }))
    }
}

/// What contacts do to every particle.
fn of_particles(packing: &Packing, color: Color) -> Vec<f64> {
    let dims = packing.dims();
    if color == Color::Stress {
        let pressure = |s: [[f64; 3]; 3]| (0..dims).map(|k| s[k][k]).sum::<f64>() / dims as f64;
        return stress_of_particles(packing).into_iter().map(pressure).collect();
    }
    let mut values = vec![0.0; packing.particles()];
    packing.all_actions().for_each(|action| {
        values[action.particle] += if color == Color::Force { action.force.length() } else { 1.0 };
    });
    values
}
