//! Files that are complete or not there.

use crate::error::{Error, Result};
use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

/// What a file is called until it is complete.
pub fn part(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Let `make` write a file under another name, and give it its own when it is complete.
pub fn replace(path: &Path, make: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let part = part(path);
    let made = make(&part).and_then(|()| fs::rename(&part, path).map_err(at(path)));
    if made.is_err() {
        // The first error is the one to report; the file may not even exist.
        let _ = fs::remove_file(&part);
    }
    made
}

pub fn write(path: &Path, content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    replace(path, |part| {
        let fill = || {
            let mut file = BufWriter::new(File::create(part)?);
            content(&mut file)?;
            file.flush()
        };
        fill().map_err(at(path))
    })
}

/// Adds the path to an error of the system.
pub fn at(path: &Path) -> impl Fn(io::Error) -> Error {
    move |source| Error::Io { path: path.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        let failed = write(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.unwrap_err().to_string().contains("disk full"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
