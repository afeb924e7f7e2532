//! Files that somebody names, read as a whole. Pipes are read like files, as shells make them of `<(command)`; but none is
//! waited for without end, and no device is read.

use crate::{
    error::{Error, Result},
    memory,
};
use std::{
    fs::{self, File, Metadata},
    io::{self, Read},
    path::Path,
    sync::mpsc::{RecvTimeoutError, sync_channel},
    thread,
    time::Duration,
};

/// Nothing has come from a pipe for so long: nobody writes to it.
const PATIENCE: Duration = Duration::from_secs(10);
/// Bytes that come from a pipe at most; one may have no end.
const LONGEST: usize = 1 << 30;
/// Bytes that are read at a time.
const BLOCK: usize = 1 << 16;

/// The content of a file, or what is written to a pipe.
///
/// # Errors
/// [`Error::Io`] for what is not there, is neither file nor pipe, or a pipe that nobody writes to, [`Error::Lacking`] for
/// a file that is larger than the memory.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let io = |source| Error::Io { path: path.to_owned(), source };
    let found = fs::metadata(path).map_err(io)?;
    match () {
        () if found.is_file() => {
            memory::check_host(found.len())?;
            fs::read(path).map_err(io)
        }
        () if found.is_dir() => Err(io(io::Error::other("is a folder, not a file"))),
        () if is_pipe(&found) => from_pipe(path).map_err(io),
        () => Err(io(io::Error::other("is a device, not a file"))),
    }
}

#[cfg(unix)]
fn is_pipe(found: &Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&found.file_type())
}

#[cfg(not(unix))]
fn is_pipe(_: &Metadata) -> bool {
    false
}

/// To open one that nobody writes to takes for ever, as does to read from one whose writer sleeps; both are left to a
/// thread.
fn from_pipe(path: &Path) -> io::Result<Vec<u8>> {
    let (sender, receiver) = sync_channel::<io::Result<Vec<u8>>>(1);
    let path = path.to_owned();
    thread::spawn(move || {
        let read = || -> io::Result<()> {
            let mut file = File::open(path)?;
            let mut block = vec![0; BLOCK];
            loop {
                let length = file.read(&mut block)?;
                // Where nobody listens any more, this has become too long.
                if sender.send(Ok(block[..length].to_vec())).is_err() || length == 0 {
                    return Ok(());
                }
            }
        };
        if let Err(error) = read() {
            let _ = sender.send(Err(error));
        }
    });
    let mut content = Vec::new();
    loop {
        match receiver.recv_timeout(PATIENCE) {
            Ok(block) => {
                let block = block?;
                if block.is_empty() {
                    return Ok(content);
                }
                content.extend(block);
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(content),
            Err(RecvTimeoutError::Timeout) => {
                let seconds = PATIENCE.as_secs();
                return Err(io::Error::other(format!(
                    "is a pipe from which nothing has come for {seconds} s; give a file"
                )));
            }
        }
        if content.len() > LONGEST {
            return Err(io::Error::other(format!("is a pipe with more than {LONGEST} bytes; give a file")));
        }
    }
}

/// The folder in which a file looks up others: its own, but for what comes out of a pipe the current one.
pub fn folder(path: &Path) -> &Path {
    let piped = fs::metadata(path).is_ok_and(|found| is_pipe(&found));
    path.parent().filter(|_| !piped).unwrap_or(Path::new(""))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::{process::Command, time::Instant};

    #[test]
    fn pipes_are_read_but_not_waited_for() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("silent");
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let began = Instant::now();
        let silent = read(&path).unwrap_err().to_string();
        assert!(silent.ends_with("silent: is a pipe from which nothing has come for 10 s; give a file"), "{silent}");
        assert!(began.elapsed() < 3 * PATIENCE);
        assert_eq!(folder(&path), Path::new(""));

        let path = place.path().join("spoken");
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let content: Vec<u8> = (0..3 * BLOCK as u32).map(|k| k as u8).collect();
        let (to, written) = (path.clone(), content.clone());
        let writer = thread::spawn(move || fs::write(to, written));
        assert_eq!(read(&path).unwrap(), content);
        writer.join().unwrap().unwrap();
    }

    #[test]
    fn devices_and_folders_are_refused() {
        for (path, what) in [
            ("/dev/zero", "is a device"),
            ("/dev/null", "is a device"),
            ("/dev", "is a folder"),
            ("/nowhere", "No such"),
        ] {
            let error = read(Path::new(path)).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{path}: {what}")), "{error}");
        }
        assert_eq!(folder(Path::new("a/b")), Path::new("a"));
    }
}
