//! NumPy's `.npz`: a ZIP archive of `.npy` arrays, stored as they are.

use super::instant::{Instant, Lattice};
use crate::{
    measure::{Other, micromechanics::packing::rows},
    scene::Surface,
};
use glam::{DMat3, DVec3};
use std::io::{self, Write};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions, write::StreamWriter};

/// NumPy's name of a type.
trait Number: Copy {
    const TYPE: &'static str;
    fn put(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ty = $name:literal),*) => {
        $(impl Number for $type {
            const TYPE: &'static str = $name;
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        })*
    };
}

number!(f64 = "<f8", i64 = "<i8", u32 = "<u4", u8 = "|b1");

struct Archive<W: Write>(ZipWriter<StreamWriter<W>>);

impl<W: Write> Archive<W> {
    fn add<T: Number, const N: usize>(&mut self, name: &str, rows: &[[T; N]]) -> io::Result<()> {
        let shape = if N == 1 { format!("({},)", rows.len()) } else { format!("({}, {N})", rows.len()) };
        self.array(name, T::TYPE, &shape, |bytes| rows.iter().flatten().for_each(|number| number.put(bytes)))
    }

    fn vectors<T>(&mut self, name: &str, of: &[T], vector: impl Fn(&T) -> DVec3) -> io::Result<()> {
        self.add(name, &of.iter().map(|x| vector(x).to_array()).collect::<Vec<_>>())
    }

    fn numbers<T, N: Number>(&mut self, name: &str, of: &[T], number: impl Fn(&T) -> N) -> io::Result<()> {
        self.add(name, &of.iter().map(|x| [number(x)]).collect::<Vec<_>>())
    }

    fn scalar<T: Number>(&mut self, name: &str, number: T) -> io::Result<()> {
        self.array(name, T::TYPE, "()", |bytes| number.put(bytes))
    }

    fn names<'n>(&mut self, name: &str, names: impl Iterator<Item = &'n str>) -> io::Result<()> {
        let names: Vec<Vec<char>> = names.map(|name| name.chars().collect()).collect();
        let longest = names.iter().map(Vec::len).max().unwrap_or(0).max(1);
        self.array(name, &format!("<U{longest}"), &format!("({},)", names.len()), |bytes| {
            for name in &names {
                (0..longest).for_each(|k| u32::from(name.get(k).copied().unwrap_or('\0')).put(bytes));
            }
        })
    }

    fn array(&mut self, name: &str, kind: &str, shape: &str, fill: impl FnOnce(&mut Vec<u8>)) -> io::Result<()> {
        // Dates would make every file another one.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default())
            .large_file(true);
        self.0.start_file(format!("{name}.npy"), options)?;
        let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        // Magic, version, length and header are a multiple of 64 bytes, of which the last is a new line.
        let length = (header.len() + 11).next_multiple_of(64) - 10;
        header.extend(std::iter::repeat_n(' ', length - header.len() - 1));
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        fill(&mut bytes);
        self.0.write_all(&bytes)
    }
}

/// Grains, contacts, cell and walls.
pub fn write(out: &mut impl Write, now: &Instant) -> io::Result<()> {
    let packing = now.packing;
    let (assembly, grains, clumps, walls, contacts) =
        (packing.assembly, packing.grains, packing.clumps, packing.walls, packing.contacts);
    let mut file = Archive(ZipWriter::new_stream(out));
    file.scalar("step", now.step as i64)?;
    file.scalar("time", now.time)?;
    file.scalar("dimension", assembly.dimension as i64)?;
    file.add("gravity", &assembly.gravity.to_array().map(|x| [x]))?;
    file.vectors("position", grains, |g| g.position)?;
    file.vectors("velocity", grains, |g| g.velocity)?;
    file.vectors("angular_velocity", grains, |g| g.spin)?;
    file.numbers("radius", grains, |g| g.radius)?;
    file.numbers("material", grains, |g| g.material)?;
    file.numbers("fixed", grains, |g| u8::from(g.fixed))?;
    // Contacts and clumps count the rows here, whatever grains are called.
    if !assembly.numbers.grains.is_empty() {
        file.numbers("id", &assembly.numbers.grains, |id| *id)?;
    }
    file.names("material_name", assembly.materials.iter().map(|material| material.name.as_str()))?;
    if !clumps.is_empty() {
        let owners: Vec<[u32; 1]> = (0..grains.len()).map(|g| [packing.particle_of(g as u32) as u32]).collect();
        file.add("clump", &owners)?;
        file.vectors("clump_position", clumps, |c| c.position)?;
        file.vectors("clump_velocity", clumps, |c| c.velocity)?;
        file.vectors("clump_angular_velocity", clumps, |c| c.spin)?;
        file.add("clump_orientation", &clumps.iter().map(|c| c.orientation.to_array()).collect::<Vec<_>>())?;
        file.numbers("clump_radius", clumps, |c| c.radius)?;
        file.numbers("clump_shape", clumps, |c| c.shape)?;
        file.names("shape_name", assembly.shapes.iter().map(|shape| shape.name.as_str()))?;
    }
    let Lattice { origin, edges, periodic } = Lattice::of(packing);
    file.add("cell_origin", &origin.to_array().map(|x| [x]))?;
    // A row for each edge.
    file.add("cell", &rows(DMat3::transpose(&edges)))?;
    file.add("periodic", &periodic.map(|periodic| [u8::from(periodic)]))?;
    file.numbers("contact_grain", contacts, |c| i64::from(c.grain))?;
    let other = |c: &crate::measure::Contact| if let Other::Grain(id) = c.other { i64::from(id) } else { -1 };
    let wall = |c: &crate::measure::Contact| if let Other::Wall(wall) = c.other { i64::from(wall) } else { -1 };
    file.numbers("contact_other", contacts, other)?;
    file.numbers("contact_wall", contacts, wall)?;
    file.vectors("contact_point", contacts, |c| packing.point(c))?;
    file.vectors("contact_normal", contacts, |c| c.normal)?;
    file.numbers("contact_overlap", contacts, |c| c.overlap)?;
    file.vectors("contact_force", contacts, |c| c.force)?;
    file.vectors("contact_tangential_force", contacts, |c| c.tangential_force())?;
    file.vectors("contact_rolling_moment", contacts, |c| c.couple)?;
    file.numbers("contact_dashpot", contacts, |c| c.dashpot)?;
    file.numbers("contact_friction", contacts, |c| c.friction)?;
    file.numbers("contact_sliding", contacts, |c| u8::from(c.sliding))?;
    let loads = packing.loads_on_walls();
    let shape = |surface: &Surface| match *surface {
        Surface::Plane { normal, .. } => (normal, 0.0),
        Surface::Cylinder { radius, .. } => (DVec3::ZERO, radius),
    };
    file.names("wall_name", walls.iter().map(|wall| wall.name.as_str()))?;
    file.vectors("wall_point", walls, |w| w.surface.reference())?;
    file.vectors("wall_normal", walls, |w| shape(&w.surface).0)?;
    file.numbers("wall_radius", walls, |w| shape(&w.surface).1)?;
    file.vectors("wall_velocity", walls, |w| w.velocity)?;
    file.numbers("wall_spin", walls, |w| w.spin)?;
    file.vectors("wall_force", &loads, |load| load.force)?;
    file.vectors("wall_moment", &loads, |load| load.moment)?;
    file.0.finish()?;
    Ok(())
}
