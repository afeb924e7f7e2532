//! Frictional contact problems of others, described in `docs/contact-problems.md`: the text format of Siconos and the
//! HDF5 format of FCLIB, both with the matrix of contacts (local form) or those of bodies (global form).

#[cfg(feature = "fclib")]
mod fclib;
mod text;

use crate::{
    error::{Error, Result},
    input,
    solve::Problem,
};
use std::path::Path;

/// The eight bytes that every HDF5 file begins with.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Read a problem, of the format that its first bytes say.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, [`Error::Problem`] with file and place where it makes no sense.
pub fn read(path: &Path) -> Result<Problem> {
    let bytes = input::read(path)?;
    let problem = if bytes.starts_with(HDF5) { hdf5(bytes) } else { text::parse(&String::from_utf8_lossy(&bytes)) };
    problem.map_err(|error| match error {
        Error::Problem(reason) => Error::Problem(format!("{}: {reason}", path.display())),
        other => other,
    })
}

#[cfg(feature = "fclib")]
fn hdf5(bytes: Vec<u8>) -> Result<Problem> {
    fclib::parse(bytes)
}

#[cfg(not(feature = "fclib"))]
fn hdf5(_: Vec<u8>) -> Result<Problem> {
    Err(Error::Problem("this is an HDF5 file, but packstone was built without its feature `fclib`".to_owned()))
}
