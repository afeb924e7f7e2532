//! Formats of text files with a sphere or disk in every row, and how each is known.

mod csv;
mod lammps_data;
mod lammps_dump;
mod xyz;

use super::sheet::{Found, Sheet};

/// What a file may be.
struct Format {
    /// By how it begins.
    is: fn(&str) -> bool,
    parse: fn(&str) -> Found<Sheet<'_>>,
}

const FORMATS: [Format; 4] = [
    Format { is: lammps_dump::is, parse: lammps_dump::parse },
    Format { is: lammps_data::is, parse: lammps_data::parse },
    Format { is: xyz::is, parse: xyz::parse },
    Format { is: |_| true, parse: csv::parse },
];

/// The parts of a text.
pub fn parse(text: &str) -> Found<Sheet<'_>> {
    let format = FORMATS.iter().find(|format| (format.is)(text)).expect("the last one takes all");
    (format.parse)(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_their_beginning() {
        let format = |text: &str| FORMATS.iter().position(|format| (format.is)(text)).unwrap();
        assert_eq!(format("ITEM: UNITS\nsi\nITEM: TIMESTEP\n0\n"), 0);
        assert_eq!(format("LAMMPS data file\n\n   20 atoms # all\n"), 1);
        assert_eq!(format("\n20 atoms\n"), 1);
        assert_eq!(format("  2  \nsand\nSi 0 0 0\n"), 2);
        assert_eq!(format("# 20 atoms\nx,y,z,radius\n"), 3);
        assert_eq!(format(""), 3);
    }
}
