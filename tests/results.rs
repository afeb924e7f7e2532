//! Results that are written piece by piece, and gone on with.

use packstone::{
    io::{
        Record, Results, Resumed, folder,
        names::{CHECKPOINT, HISTORY, PREVIOUS, RUN},
    },
    prelude::*,
    scene::{Numbers, grain_file::Moment},
};
use std::{fs, path::Path};

fn scene() -> (Scene, Assembly) {
    let glass = MaterialBuilder::new(2500.0).normal_stiffness(2e3).friction(0.5);
    let grain = GrainBuilder::new("glass", [0.0, 0.0, 1.2], 1e-3);
    let scene = Scene::builder(3).material("glass", glass).grain(grain).stop_time(1e-3).build().unwrap();
    let assembly = scene.assemble().unwrap();
    (scene, assembly)
}

/// Rows and snapshots at every step up to `end`.
fn go_on(results: &mut Results, simulation: &mut Simulation, end: u64) {
    loop {
        results.history(&simulation.sample().unwrap(), 1.0, &[], &[]).unwrap();
        let grains = simulation.grains().unwrap();
        let (step, time) = (simulation.step(), simulation.time());
        results
            .snapshot(
                &Moment { step, time, grains: &grains, clumps: &[], owners: &[], numbers: &Numbers::default() },
                None,
            )
            .unwrap();
        if step == end {
            return;
        }
        simulation.advance(1).unwrap();
    }
}

/// With their content, but for the record.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let file = |path: std::path::PathBuf| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(path));
    let mut files: Vec<_> = entries.map(file).filter_map(|(name, bytes)| Some((name, bytes.ok()?))).collect();
    files.retain(|(name, _)| name != RUN);
    files.sort();
    files
}

/// A result that goes on after a step is what it would have been, wherever it was: killed, or in its place.
#[test]
fn a_result_goes_on_where_it_was() {
    let (scene, assembly) = scene();
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let temporary = tempfile::tempdir().unwrap();
    let create = |name: &str| {
        let simulation = Simulation::new(assembly.clone(), options).unwrap();
        let record = Record::new(&scene, &simulation, vec!["run".to_owned()]);
        (Results::create(&temporary.path().join(name), None, &scene, &assembly, record).unwrap(), simulation)
    };
    let (mut whole, mut simulation) = create("whole");
    go_on(&mut whole, &mut simulation, 5);
    let whole = whole.close("last step", true).unwrap();

    for closed in [false, true] {
        let name = format!("cut {closed}");
        let folder = temporary.path().join(&name);
        let (mut cut, mut simulation) = create(&name);
        go_on(&mut cut, &mut simulation, 4);
        if closed {
            assert_eq!(cut.close("interrupted", false).unwrap(), folder);
        } else {
            // As a kill may leave it: with half a row.
            let history = cut.place().join(HISTORY);
            drop(cut);
            let text = fs::read(&history).unwrap();
            fs::write(&history, &text[..text.len() - 7]).unwrap();
        }
        let before = files(&folder);
        let from = folder::resumable(&folder).unwrap();
        assert_eq!(from, [if closed { folder.clone() } else { folder.join("partial") }]);
        let mut simulation = Simulation::new(assembly.clone(), options).unwrap();
        simulation.advance(2).unwrap();
        let snapshots: Vec<_> = (0..=2).map(|step| (step, step as f64 * simulation.dt())).collect();
        let rows = (0..=2).collect();
        let resumed = Resumed { start: "now".to_owned(), command: Vec::new(), step: 2 };
        let mut results = Results::resume(&folder, &from[0], &assembly, resumed, rows, snapshots).unwrap();
        assert_eq!(files(&folder), before, "what is in place stays until the new result is whole");
        assert_eq!(results.snapshots().len(), 3);
        simulation.advance(1).unwrap();
        go_on(&mut results, &mut simulation, 5);
        let place = results.close("last step", true).unwrap();
        assert_eq!(place, folder);
        assert_eq!(files(&place), files(&whole));
        assert_eq!(Record::read(&place).unwrap().resumed.len(), 1);
    }
}

#[test]
fn the_checkpoint_before_is_kept() {
    let (scene, assembly) = scene();
    let simulation =
        Simulation::new(assembly.clone(), Options { engine: EngineChoice::Cpu, ..Options::default() }).unwrap();
    let temporary = tempfile::tempdir().unwrap();
    let record = Record::new(&scene, &simulation, Vec::new());
    let mut results = Results::create(temporary.path(), None, &scene, &assembly, record).unwrap();
    let place = results.place().to_owned();
    let both = || [CHECKPOINT, PREVIOUS].map(|name| fs::read_to_string(place.join(name)).ok());
    let mut write = |text: &str| {
        results.checkpoint(|path| {
            fs::write(path, text).unwrap();
            Ok(())
        })
    };
    write("1").unwrap();
    assert_eq!(both(), [Some("1".to_owned()), None]);
    write("2").unwrap();
    assert_eq!(both(), [Some("2".to_owned()), Some("1".to_owned())]);
    results.checkpoint(|_| Err(Error::Lacking("disk full".to_owned()))).unwrap_err();
    assert_eq!(both(), [Some("2".to_owned()), Some("1".to_owned())]);
    results.close("interrupted", false).unwrap();
    assert_eq!(fs::read_to_string(temporary.path().join(CHECKPOINT)).unwrap(), "2");
}

/// The copy beside a result is what was read, or there is no run.
#[test]
fn inputs_that_were_changed_are_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let bed = temporary.path().join("bed.csv");
    let write = || fs::write(&bed, "x,y,z,radius\n0,0,1e-3,1e-3\n").unwrap();
    write();
    // File systems keep time in ticks of the kernel.
    std::thread::sleep(std::time::Duration::from_millis(50));
    let text = "dimension = 3\nsolver = { dt = 1e-6 }\n[material.glass]\ndensity = 2500\nnormal_stiffness = 1e3\n\
                friction = 0\n[[population]]\nmaterial = \"glass\"\nfile = \"bed.csv\"\n[stop]\nsteps = 1\n";
    let scene = Scene::parse(text, "scene", temporary.path(), &[]).unwrap();
    let assembly = scene.assemble().unwrap();
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let simulation = Simulation::new(assembly.clone(), options).unwrap();
    let folder = temporary.path().join("out");
    let create = || Results::create(&folder, None, &scene, &assembly, Record::new(&scene, &simulation, Vec::new()));
    drop(create().unwrap());
    std::thread::sleep(std::time::Duration::from_millis(50));
    write();
    let refused = create().err().unwrap().to_string();
    assert!(refused.contains("bed.csv: was changed after it had been read"), "{refused}");
    assert_eq!(folder::resumable(&folder).unwrap(), [folder.join("partial")], "the one before is where it was");
    assert!(!folder.join(".packstone/new").exists());
}
