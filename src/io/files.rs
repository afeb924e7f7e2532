//! Files that are complete or not there. Links are not followed: what is written takes the place of ordinary files only.

use crate::error::{Error, Result};
use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

/// What a file is called until it is complete.
pub fn part(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Whether there is a file, a link not being one. What stands there and is no file is an error.
pub fn is_file(path: &Path) -> io::Result<bool> {
    let kind = match fs::symlink_metadata(path) {
        Ok(found) => found.file_type(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(error),
    };
    let what = match kind {
        _ if kind.is_file() => return Ok(true),
        _ if kind.is_symlink() => "a link, which is not followed",
        _ if kind.is_dir() => "a folder",
        _ => "a device or pipe",
    };
    Err(io::Error::other(format!("is {what}, not a file; move it away")))
}

/// A new file; one that is there is removed first.
pub fn create(path: &Path) -> io::Result<File> {
    if is_file(path)? {
        fs::remove_file(path)?;
    }
    OpenOptions::new().read(true).write(true).create_new(true).open(path)
}

/// Let `make` write a file under another name, which is there and empty, and give it its own when it is complete.
pub fn replace(path: &Path, make: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let part = part(path);
    is_file(path).and_then(|_| create(&part)).map_err(at(path))?;
    let made = make(&part).and_then(|()| fs::rename(&part, path).map_err(at(path)));
    if made.is_err() {
        // The first error is the one to report.
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

/// The CRC-32 of a file, in hexadecimal digits.
pub fn crc32(path: &Path) -> io::Result<String> {
    let (mut file, mut hasher) = (File::open(path)?, crc32fast::Hasher::new());
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(format!("{:08x}", hasher.finalize())),
            count => hasher.update(&block[..count]),
        }
    }
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

    #[cfg(unix)]
    #[test]
    fn only_files_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("mine"), "mine").unwrap();
        for (link, what) in [(true, "a link"), (false, "a folder")] {
            for name in ["new", "new.part"] {
                match link {
                    true => std::os::unix::fs::symlink(path("mine"), path(name)).unwrap(),
                    false => fs::create_dir(path(name)).unwrap(),
                }
                let failed = write(&path("new"), |file| file.write_all(b"new")).unwrap_err().to_string();
                assert!(failed.contains(what), "{failed}");
                if link { fs::remove_file(path(name)) } else { fs::remove_dir(path(name)) }.unwrap();
            }
        }
        assert_eq!(fs::read_to_string(path("mine")).unwrap(), "mine");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(is_file(Path::new("/dev/null")).unwrap_err().to_string().contains("a device"));
    }
}
