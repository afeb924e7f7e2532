//! Packings for other programs: contacts as a table and as lines, and all of it for NumPy, OVITO and LAMMPS.

use super::{contacts, dump, files::write, instant::Instant, names, npz, xyz};
use crate::{
    error::{Error, Result},
    measure::Packing,
    scene::Output,
};
use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

/// What a file may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Contacts in a table.
    ContactsCsv,
    /// Contacts as lines from centre to centre.
    ContactsVtp,
    /// Everything, for NumPy.
    Npz,
    /// Grains in extended XYZ.
    Xyz,
    /// Grains in a dump of LAMMPS.
    Dump,
}

impl Kind {
    pub const ALL: [Kind; 5] = [Kind::ContactsCsv, Kind::ContactsVtp, Kind::Npz, Kind::Xyz, Kind::Dump];

    /// The end of a file's name.
    pub fn ending(self) -> &'static str {
        match self {
            Kind::ContactsCsv => "csv",
            Kind::ContactsVtp => "vtp",
            Kind::Npz => "npz",
            Kind::Xyz => "xyz",
            Kind::Dump => "dump",
        }
    }

    /// Those that a run writes.
    pub fn wanted(output: &Output) -> impl Iterator<Item = Kind> + use<> {
        let Output { contacts_csv, contacts_vtp, npz, xyz, dump, .. } = *output;
        Kind::ALL
            .into_iter()
            .zip([contacts_csv, contacts_vtp, npz, xyz, dump])
            .filter(|(_, on)| *on)
            .map(|(kind, _)| kind)
    }

    /// What the file of a snapshot is called, or that of the last state.
    pub fn name(self, snapshot: Option<usize>) -> String {
        let ending = self.ending();
        match (self, snapshot) {
            (Kind::ContactsCsv | Kind::ContactsVtp, None) => names::contacts(ending),
            (Kind::ContactsCsv | Kind::ContactsVtp, Some(number)) => names::contacts_of_snapshot(number, ending),
            (_, None) => names::last(ending),
            (_, Some(number)) => names::snapshot(number, ending),
        }
    }

    pub fn put(self, out: &mut impl Write, now: &Instant) -> io::Result<()> {
        match self {
            Kind::ContactsCsv => contacts::write_table(out, now.packing),
            Kind::ContactsVtp => contacts::write_lines(out, now),
            Kind::Npz => npz::write(out, now),
            Kind::Xyz => xyz::write(out, now),
            Kind::Dump => dump::write(out, now),
        }
    }
}

/// A file to be written.
pub struct Export {
    path: PathBuf,
    kind: Kind,
}

impl Export {
    /// By the end of its name.
    ///
    /// # Errors
    /// [`Error::Scene`] if that says nothing.
    pub fn of(path: &Path) -> Result<Export> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let kind = Kind::ALL.into_iter().find(|kind| kind.ending() == ending).ok_or_else(|| {
            let endings = Kind::ALL.map(|kind| format!(".{}", kind.ending())).join(", ");
            Error::Scene(format!("{}: the end of its name must be one of {endings}", path.display()))
        })?;
        Ok(Export { path: path.to_owned(), kind })
    }

    /// # Errors
    /// [`Error::Io`]
    pub fn write(&self, packing: &Packing, step: u64, time: f64) -> Result<()> {
        write(&self.path, |file| self.kind.put(file, &Instant { packing, step, time }))
    }
}
