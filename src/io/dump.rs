//! Dumps of LAMMPS, as `dump custom` writes them, with orthogonal and with tilted cells.

use super::instant::{Instant, Lattice};
use std::io::{self, Write};

/// Grains in their order; numbers of atoms and types count from 1.
pub fn write(out: &mut impl Write, now: &Instant) -> io::Result<()> {
    let cell = Lattice::of(now.packing);
    writeln!(out, "ITEM: UNITS\nsi\nITEM: TIME\n{:?}\nITEM: TIMESTEP\n{}", now.time, now.step)?;
    writeln!(out, "ITEM: NUMBER OF ATOMS\n{}", now.packing.grains.len())?;
    bounds(out, &cell)?;
    writeln!(out, "ITEM: ATOMS id type x y z radius vx vy vz omegax omegay omegaz")?;
    for (k, g) in now.packing.grains.iter().enumerate() {
        let id = now.packing.assembly.numbers.of_grain(k);
        let (x, v, w) = (g.position, g.velocity, g.spin);
        writeln!(
            out,
            "{} {} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
            id + 1,
            g.material + 1,
            x.x,
            x.y,
            x.z,
            g.radius,
            v.x,
            v.y,
            v.z,
            w.x,
            w.y,
            w.z
        )?;
    }
    Ok(())
}

/// Those of the cell; of a tilted one those of the box around it, with the tilts.
fn bounds(out: &mut impl Write, &Lattice { origin, edges, periodic }: &Lattice) -> io::Result<()> {
    let ends = periodic.map(|periodic| if periodic { "pp" } else { "ff" }).join(" ");
    let (lower, upper) = (origin, origin + edges.x_axis.with_y(edges.y_axis.y).with_z(edges.z_axis.z));
    let (xy, xz, yz) = (edges.y_axis.x, edges.z_axis.x, edges.z_axis.y);
    if [xy, xz, yz] == [0.0; 3] {
        writeln!(out, "ITEM: BOX BOUNDS {ends}")?;
        (0..3).try_for_each(|axis| writeln!(out, "{:?} {:?}", lower[axis], upper[axis]))?;
    } else {
        // The bounds are those of the box around the tilted one.
        let along_x = [0.0, xy, xz, xy + xz];
        let least = |shifts: &[f64]| shifts.iter().copied().fold(0.0, f64::min);
        let most = |shifts: &[f64]| shifts.iter().copied().fold(0.0, f64::max);
        writeln!(out, "ITEM: BOX BOUNDS xy xz yz {ends}")?;
        writeln!(out, "{:?} {:?} {xy:?}", lower.x + least(&along_x), upper.x + most(&along_x))?;
        writeln!(out, "{:?} {:?} {xz:?}", lower.y + least(&[0.0, yz]), upper.y + most(&[0.0, yz]))?;
        writeln!(out, "{:?} {:?} {yz:?}", lower.z, upper.z)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// `https://docs.lammps.org/Howto_triclinic.html`: xlo + min(0, xy, xz, xy + xz) and so on.
    #[test]
    fn tilted_cells_have_the_bounds_of_lammps() {
        let text = |edges: DMat3| {
            let mut out = Vec::new();
            let lattice = Lattice { origin: DVec3::new(1.0, 2.0, 3.0), edges, periodic: [true, true, false] };
            bounds(&mut out, &lattice).unwrap();
            String::from_utf8(out).unwrap()
        };
        let straight = DMat3::from_diagonal(DVec3::new(4.0, 5.0, 6.0));
        assert_eq!(text(straight), "ITEM: BOX BOUNDS pp pp ff\n1.0 5.0\n2.0 7.0\n3.0 9.0\n");
        let tilted = DMat3::from_cols(straight.x_axis, DVec3::new(0.5, 5.0, 0.0), DVec3::new(-0.25, -1.5, 6.0));
        assert_eq!(text(tilted), "ITEM: BOX BOUNDS xy xz yz pp pp ff\n0.75 5.5 0.5\n0.5 7.0 -0.25\n3.0 9.0 -1.5\n");
    }
}
