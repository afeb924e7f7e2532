//! What a run has read, kept beside its result, so that the folder has all that it takes to run it again.

use super::{
    files::{at, crc32, write},
    names::{GIVEN, INPUTS, SCENE},
    record::{Kept, Record, SMALL, is_folder},
};
use crate::{
    error::{Error, Result},
    scene::Scene,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::Write,
    path::Path,
    time::SystemTime,
};

/// Write the scene as it is run to `new`, the folder of a result that begins, and copies of what it reads. Large files
/// stay where they are, unless they are part of the `older` result in `folder`, whose place the new one will take.
pub fn keep(scene: &Scene, record: &mut Record, folder: &Path, older: Option<&Record>, new: &Path) -> Result<()> {
    let ours: BTreeSet<&str> =
        older.iter().flat_map(|older| older.files_in(folder)).map(|name| name.as_str()).collect();
    let root = folder.canonicalize().map_err(at(folder))?;
    let mut kept: BTreeMap<_, Kept> = BTreeMap::new();
    let mut taken = BTreeSet::new();
    // A name that nothing has that is not of packstone.
    let mut free = |name: &str| {
        let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
        let numbered =
            (1..).map(|k| if ending.is_empty() { format!("{stem}.{k}") } else { format!("{stem}.{k}.{ending}") });
        let is_free = |name: &String| {
            !taken.contains(name) && (ours.contains(name.as_str()) || fs::symlink_metadata(folder.join(name)).is_err())
        };
        let name = [name.to_owned()].into_iter().chain(numbered).find(is_free).expect("there is no end of numbers");
        taken.insert(name.clone());
        name
    };
    for input in scene.inputs() {
        let source = input.path.canonicalize().map_err(at(&input.path))?;
        let found = fs::metadata(&source).map_err(at(&source))?;
        if !found.is_file() {
            // A pipe has been read, and is no more.
            continue;
        }
        // Clocks of file servers may be ahead of this one.
        let changed = |modified| scene.made() < modified && modified <= SystemTime::now();
        if found.modified().is_ok_and(changed) {
            let message = "was changed after it had been read for the run; start that again";
            return Err(Error::Scene(format!("{}: {message}", input.path.display())));
        }
        if let Some(known) = kept.get(&source) {
            record.inputs.push(Kept { key: input.key, ..known.clone() });
            continue;
        }
        let inside = source.strip_prefix(&root).ok().and_then(Path::to_str).map(|name| name.replace('\\', "/"));
        let of_result = inside.is_some_and(|name| name.starts_with("partial/") || ours.contains(name.as_str()));
        let made = scene.start() == Some(&input.path);
        let (path, target) = if of_result || made || found.len() <= SMALL {
            let inputs = new.join(INPUTS);
            if !is_folder(&inputs) {
                fs::create_dir(&inputs).map_err(at(&inputs))?;
            }
            let there = folder.join(INPUTS);
            if fs::symlink_metadata(&there).is_ok() && !is_folder(&there) {
                return Err(Error::Folder(format!(
                    "{}: is no folder, and a run needs one; move it away",
                    there.display()
                )));
            }
            let name = source.file_name().map_or("file".into(), |name| name.to_string_lossy());
            let path = free(&format!("{INPUTS}/{name}"));
            let target = new.join(&path);
            fs::copy(&source, &target).map_err(at(&target))?;
            (path, target)
        } else {
            (source.to_string_lossy().into_owned(), source.clone())
        };
        let crc32 = crc32(&target).map_err(at(&target))?;
        let entry = Kept { key: input.key, path, bytes: found.len(), crc32 };
        record.inputs.push(entry.clone());
        kept.insert(source, entry);
    }
    let words: Vec<_> = record.inputs.iter().map(|kept| (kept.key.clone(), kept.path.clone())).collect();
    let name = free(SCENE);
    let text = scene.text(&words)?;
    write(&new.join(&name), |file| file.write_all(text.as_bytes()))?;
    record.scene_as_run = Some(name);
    let given = scene.given()?;
    if given != text {
        let name = free(GIVEN);
        write(&new.join(&name), |file| file.write_all(given.as_bytes()))?;
        record.scene_as_given = Some(name);
    }
    Ok(())
}
