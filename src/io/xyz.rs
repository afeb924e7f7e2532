//! Extended XYZ, which OVITO, ASE and packstone read.

use super::instant::{Instant, Lattice};
use std::io::{self, Write};

/// Grains in their order; the species is the material.
pub fn write(out: &mut impl Write, now: &Instant) -> io::Result<()> {
    let (assembly, grains) = (now.packing.assembly, now.packing.grains);
    let Lattice { origin, edges, periodic } = Lattice::of(now.packing);
    let edges = edges.to_cols_array().map(|x| format!("{x:?}")).join(" ");
    let flags = periodic.map(|periodic| if periodic { "T" } else { "F" }).join(" ");
    writeln!(out, "{}", grains.len())?;
    writeln!(
        out,
        "Lattice=\"{edges}\" Origin=\"{:?} {:?} {:?}\" pbc=\"{flags}\" Time={:?} Step={} \
         Properties=id:I:1:species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3",
        origin.x, origin.y, origin.z, now.time, now.step
    )?;
    // Blanks would be taken for the end of a name.
    let names: Vec<String> = assembly.materials.iter().map(|m| m.name.replace(char::is_whitespace, "_")).collect();
    for (k, g) in grains.iter().enumerate() {
        let id = assembly.numbers.of_grain(k);
        write!(out, "{id} {}", names[g.material as usize])?;
        let numbers = g.position.to_array().into_iter().chain([g.radius]);
        let numbers = numbers.chain(g.velocity.to_array()).chain(g.spin.to_array());
        numbers.into_iter().try_for_each(|x| write!(out, " {x:?}"))?;
        writeln!(out)?;
    }
    Ok(())
}
