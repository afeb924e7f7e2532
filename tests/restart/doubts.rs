//! What makes a result doubtful is told, once.

use crate::{
    SETTLE,
    place::{Place, engines},
};

/// What the run before has left is told as that, also of a run that was interrupted.
#[test]
fn inherited_doubts_are_told_as_such() {
    let soft = SETTLE.replace("normal_stiffness = 1e5", "normal_stiffness = 8000");
    let place = Place::new(&soft);
    place.packstone(&["run", "scene.toml", "--engine=cpu", "--out=first"], 0);
    assert!(place.summary("first")["doubts"][0].as_str().unwrap().contains("an overlap was"));
    // The lid goes up again, so that nothing is pressed deeper.
    place.write("next.toml", &soft.replace("[0, -0.1]", "[0, 0.5]"));
    let run = ["run", "next.toml", "--engine=cpu", "--steps=100", "--from=first", "--out=next"];
    let said = place.errors(&run, 0);
    let summary = place.summary("next");
    assert!(summary["deepest_overlap"]["over_radius"].as_f64().unwrap() > 0.1, "{}", summary["deepest_overlap"]);
    assert_eq!(summary["deepest_overlap"]["step"], 0);
    let inherited = |summary: &serde_json::Value| {
        let doubts = summary["doubts"].as_array().unwrap();
        assert_eq!(doubts.len(), 1, "{doubts:?}");
        doubts[0].as_str().unwrap().starts_with("the state that it began with had an overlap")
    };
    assert!(inherited(&summary) && said.contains("its scene.toml alone will begin without it"), "{said}");
    place.packstone(&["run", "--resume=next", "--steps=200"], 0);
    assert!(inherited(&place.summary("next")));
}

/// What makes a result doubtful is said, with the grain and the time.
#[test]
fn deep_overlaps_are_told_with_grain_and_time() {
    let place = Place::new(SETTLE);
    // Springs so soft that weight presses grains into each other.
    place.write("soft.toml", &SETTLE.replace("normal_stiffness = 1e5", "normal_stiffness = 5"));
    let said = place.errors(&["run", "soft.toml", "--engine=cpu", "--out=soft", "--strict"], 3);
    let summary = place.summary("soft");
    let deepest = &summary["deepest_overlap"];
    assert!(deepest["over_radius"].as_f64().unwrap() > 0.1 && deepest["grain"].is_u64(), "{deepest}");
    assert!(deepest["other_grain"].is_u64() != deepest["wall"].is_string(), "{deepest}");
    assert!(said.contains("warning: an overlap was"), "{said}");
    assert_eq!(summary["ended"], "last step");
}

/// Positions of single precision have more digits than anybody asks for, unless the scene is thousands of times as wide.
#[test]
fn coarse_positions_are_told() {
    let place = Place::new(SETTLE);
    if !engines().contains(&"gpu") {
        return;
    }
    let run = ["run", "scene.toml", "--engine=gpu", "--steps=10", "--out=out"];
    let near = place.errors(&run, 0);
    let quantum = place.summary("out")["position_quantum"].as_f64().unwrap();
    assert!(quantum < 1e-13 && !near.contains("warning:"), "{quantum}: {near}");
    let far = place.errors(&[&run[..], &["--set=wall.0.lower=[-2000, 0]"]].concat(), 0);
    assert!(far.contains("warning: so far from the origin positions"), "{far}");
}

/// An impact between two rows of the history, of spheres on soft springs: the deepest overlap is v √(m / 2 k).
#[test]
fn overlaps_between_rows_are_told() {
    let (radius, density, stiffness, speed) = (0.01_f64, 2500.0, 1e4, 6.0);
    let scene = format!(
        "dimension = 3\ngravity = [0, 0, 0]\n[material.soft]\ndensity = {density}\nnormal_stiffness = {stiffness}\nrestitution = 1.0\n\
         [[grain]]\nradius = {radius}\nmaterial = \"soft\"\nposition = [-0.02, 0, 0]\nvelocity = [{half}, 0, 0]\n\
         [[grain]]\nradius = {radius}\nmaterial = \"soft\"\nposition = [0.02, 0, 0]\nvelocity = [-{half}, 0, 0]\n\
         [stop]\ntime = 0.02\n[output]\nhistory = 0.02\n",
        half = 0.5 * speed
    );
    let place = Place::new(&scene);
    let mass = density * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let deepest = speed * (mass / (2.0 * stiffness)).sqrt() / radius;
    assert!((0.3..1.0).contains(&deepest), "{deepest}");
    for engine in engines() {
        let said = place.errors(&["run", "scene.toml", "--engine", engine, "--out=impact"], 0);
        let (summary, rows) = (place.summary("impact"), place.text("impact/history.csv"));
        assert_eq!((rows.lines().count(), summary["max_overlap_over_radius"].as_f64()), (3, Some(0.0)), "{rows}");
        let told = &summary["deepest_overlap"];
        let over_radius = told["over_radius"].as_f64().unwrap();
        assert!(over_radius <= deepest * 1.001 && deepest <= 1.25 * over_radius, "{over_radius} of {deepest}");
        let time = told["time"].as_f64().unwrap();
        assert!(0.02 / speed < time && time < 0.02 / speed + 0.01, "{told}");
        assert!([&told["grain"], &told["other_grain"]].iter().all(|id| id.as_u64().is_some_and(|id| id < 2)), "{told}");
        assert!(said.contains("warning: an overlap was"), "{said}");
    }
}

/// A grain that is thrown out of a floor by the step after the one that sees it there.
#[test]
fn overlaps_of_a_single_step_are_told() {
    let (height, speed, dt) = (2.1e-3, 24.0, 1.9e-5);
    let scene = format!(
        "dimension = 3\ngravity = [0, 0, 0]\n[material.hard]\ndensity = 2500\nnormal_stiffness = 1e5\n\
         [[wall]]\nkind = \"plane\"\nname = \"floor\"\nmaterial = \"hard\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
         [[grain]]\nposition = [0, 0, {height}]\nradius = 1e-3\nvelocity = [0, 0, -{speed}]\nmaterial = \"hard\"\n\
         [solver]\ndt = {dt:e}\nmargin = 2\n[stop]\nsteps = 20\n[output]\nhistory = 1\n"
    );
    let place = Place::new(&scene);
    let deepest = 1.0 - (height - 3.0 * speed * dt) / 1e-3;
    assert!((0.2..0.3).contains(&deepest), "{deepest}");
    for engine in engines() {
        let said = place.errors(&["run", "scene.toml", "--engine", engine, "--strict", "--out=bounce"], 3);
        let told = &place.summary("bounce")["deepest_overlap"];
        let over_radius = told["over_radius"].as_f64().unwrap();
        assert!((over_radius / deepest - 1.0).abs() < 1e-4 && told["wall"] == "floor", "{told} of {deepest}");
        assert!(said.contains("warning: an overlap was 0.27 radii deep"), "{said}");
    }
}
