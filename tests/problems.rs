//! Frictional contact problems from the field, see `tests/problems/README.md`: every solver on every problem, against
//! references made by other programs, and what is said of files that make no sense.

use glam::DVec3;
use packstone::{
    io::problem::read,
    solve::{
        Matrix, Operator, Options, Order, Problem, Solution, Solver,
        device::Jacobi,
        gauss_seidel::colors,
        residual::{associated, contacts, relative, residual},
        solve, velocities,
    },
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const NE_SPHERES: &str = "NESpheres_10_1.dat";
const BOX_STACKS: &str = "Box_Stacks-i0122-82-5.hdf5";
const SPHERES: &str = "Spheres-i099-356-679.hdf5";
const BOXES_STACK: &str = "BoxesStack1-i100000-32.hdf5.dat";
const PERIO_BOX: &str = "LMGC_100_PR_PerioBox-i00361-60-03000.hdf5";
const KAPLAS: &str = "KaplasTower-i1061-4.hdf5.dat";
const PLANE_69: &str = "gfc2d_granularflowonwall_00069_00350.dat";
const PLANE_230: &str = "gfc2d_granularflowonwall_00230_00206.dat";
const PLANE_667: &str = "fc2d_granularflowonwall_00667_00000.dat";
const PLANE_2020: &str = "fc2d_granularflowonwall_02020_00213.dat";
const CUBES: &str = "local_problem_test.hdf5";

/// Of all problems: contacts, dimension, form of the file.
const ALL: [(&str, usize, usize); 11] = [
    (NE_SPHERES, 9, 3),
    (BOX_STACKS, 82, 3),
    (SPHERES, 356, 3),
    (BOXES_STACK, 52, 3),
    (PERIO_BOX, 60, 3),
    (KAPLAS, 570, 3),
    (PLANE_69, 69, 2),
    (PLANE_230, 230, 2),
    (PLANE_667, 667, 2),
    (PLANE_2020, 2020, 2),
    (CUBES, 48, 3),
];

/// Our copy, or that of the cases beside the repository, which also has the large ones.
fn find(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let places = [root.join("tests/problems"), root.join("../shared/cases/fc3d")];
    let found = places.iter().map(|place| place.join(name)).find(|path| path.is_file());
    if found.is_none() {
        eprintln!("NOT TESTED: {name} is neither in tests/problems nor in ../shared/cases/fc3d");
    }
    found
}

/// `None` where the file is missing, or packstone was built without its format.
fn problem(name: &str) -> Option<Problem> {
    if name.ends_with(".hdf5") && cfg!(not(feature = "fclib")) {
        eprintln!("NOT TESTED: {name}, without the feature fclib");
        return None;
    }
    find(name).map(|path| read(&path).unwrap())
}

fn options(tolerance: f64) -> Options {
    Options { tolerance, ..Options::default() }
}

/// An array of an .npz file: a zip whose members are stored as they are, each an .npy file.
fn array(bytes: &[u8], name: &str) -> Vec<f64> {
    let position = |haystack: &[u8], needle: &[u8]| haystack.windows(needle.len()).position(|window| window == needle);
    let member = position(bytes, format!("{name}.npy").as_bytes()).unwrap_or_else(|| panic!("no array {name}"));
    let file = &bytes[member + position(&bytes[member..], b"\x93NUMPY").unwrap()..];
    let begin = 10 + u16::from_le_bytes([file[8], file[9]]) as usize;
    let header = std::str::from_utf8(&file[10..begin]).unwrap();
    assert!(header.contains("'<f8'"), "{header}");
    let shape = &header[header.find("'shape': (").unwrap() + 10..];
    let length: usize = shape[..shape.find([',', ')']).unwrap()].parse().unwrap_or(1);
    let words = file[begin..].chunks_exact(8).take(length);
    words.map(|word| f64::from_le_bytes(word.try_into().unwrap())).collect()
}

fn blocks(dims: usize, values: &[f64]) -> Vec<DVec3> {
    values.chunks(dims).map(|v| DVec3::new(v[0], v[1], v.get(2).copied().unwrap_or(0.0))).collect()
}

fn norm(v: impl Iterator<Item = DVec3>) -> f64 {
    v.map(|v| v.length_squared()).sum::<f64>().sqrt()
}

/// How far velocities are from those of the reference, relative to ‖q‖.
fn distance(problem: &Problem, u: &[DVec3], reference: &[DVec3]) -> f64 {
    norm(u.iter().zip(reference).map(|(&a, &b)| a - b)) / problem.reference()
}

/// References with residual, as its authors found it by a function of their own.
fn references(name: &str) -> Vec<(String, Vec<u8>)> {
    let files = ["npz", "cadoux.npz"].map(|ending| format!("reference/{name}.{ending}"));
    files.into_iter().filter_map(|file| find(&file).map(|path| (file, fs::read(path).unwrap()))).collect()
}

#[test]
fn sizes_are_those_of_the_files() {
    for (name, n, dims) in ALL {
        if let Some(problem) = problem(name) {
            assert_eq!((problem.len(), problem.dims()), (n, dims), "{name}");
        }
    }
}

#[test]
fn the_residual_of_references_is_the_one_they_state() {
    let mut tested = 0;
    for (name, _, dims) in ALL {
        let Some(problem) = problem(name) else { continue };
        for (file, bytes) in references(name) {
            let (r, u) = (blocks(dims, &array(&bytes, "r")), blocks(dims, &array(&bytes, "u")));
            let ours = residual(&problem, &r);
            if file.contains("cadoux") {
                // Theirs is not scaled by contact: 9e-9 at most.
                assert!(ours < 1e-7, "{file}: {ours:e}");
            } else {
                let theirs = array(&bytes, "res_scaled")[0];
                // Round-off, and six digits of some matrices, move the small ones.
                assert!((ours - theirs).abs() < 0.05 * theirs + 1e-12, "{file}: {ours:e}, stated {theirs:e}");
            }
            let mut own = vec![DVec3::ZERO; r.len()];
            velocities(&problem, &mut problem.free(), &r, &mut own);
            assert!(distance(&problem, &own, &u) < 1e-9, "{file}");
            tested += 1;
        }
    }
    assert!(tested >= 3, "only {tested} references were there");
}

#[test]
fn forces_that_break_the_law_have_a_residual() {
    let problem = problem(NE_SPHERES).unwrap();
    let solution = solve(&problem, Solver::GaussSeidel, &options(1e-10)).unwrap();
    for (k, change) in [(0, DVec3::X), (3, -DVec3::X), (5, DVec3::Y), (7, DVec3::Z)] {
        let mut r = solution.r.clone();
        r[k] += 0.1 * change;
        assert!(residual(&problem, &r) > 1e-3, "contact {k}");
    }
}

#[test]
fn every_solver_reaches_the_tolerance_on_spheres() {
    for name in [NE_SPHERES, SPHERES] {
        let Some(problem) = problem(name) else { continue };
        let reference = references(name).into_iter().find(|(file, _)| !file.contains("cadoux")).unwrap().1;
        let reference = blocks(3, &array(&reference, "u"));
        for solver in Solver::ALL.into_iter().filter(|&solver| solver != Solver::Lemke) {
            for tolerance in [1e-4, 1e-7] {
                let solution = solve(&problem, solver, &options(tolerance)).unwrap();
                let what = format!("{name}, {} to {tolerance:e}: {:e}", solver.label(), solution.residual);
                assert!(solution.converged && solution.residual <= tolerance, "{what}");
                assert_eq!(solution.residual, residual(&problem, &solution.r), "{what}");
                // The natural map bounds the error of velocities up to a factor of the problem.
                let error = distance(&problem, &solution.u, &reference);
                assert!(error < 50.0 * tolerance, "{what}, velocities {error:e}");
            }
        }
    }
}

#[test]
fn every_order_reaches_the_same_velocities() {
    for name in [NE_SPHERES, BOX_STACKS, PLANE_69] {
        let Some(problem) = problem(name) else { continue };
        let reference = solve(&problem, Solver::ColouredAccelerated, &options(1e-10)).unwrap();
        for order in Order::ALL {
            let solution = solve(&problem, Solver::GaussSeidel, &Options { order, ..options(1e-8) }).unwrap();
            assert!(solution.converged, "{name}, {}", order.label());
            let error = distance(&problem, &solution.u, &reference.u);
            assert!(error < 1e-6, "{name}, {}: {error:e}", order.label());
        }
    }
}

/// Passes to 1e-4 at most: 1.2 times what the prototypes of these methods took.
#[test]
fn passes_are_few() {
    let bounds = [
        (NE_SPHERES, 17, 4),
        (BOX_STACKS, 34, 14),
        (SPHERES, 58, 28),
        (BOXES_STACK, 195, 152),
        (PERIO_BOX, 222, 61),
        (KAPLAS, 161, 60),
        (PLANE_230, 26, 10),
        (PLANE_2020, 219, 81),
    ];
    for (name, jacobi, colored) in bounds {
        let Some(problem) = problem(name) else { continue };
        for (solver, bound) in [(Solver::JacobiAccelerated, jacobi), (Solver::ColouredAccelerated, colored)] {
            let solution = solve(&problem, solver, &options(1e-4)).unwrap();
            let Solution { passes, converged, .. } = solution;
            let limit = (1.2 * bound as f64) as usize;
            assert!(converged && passes <= limit, "{name}, {}: {passes} passes, limit {limit}", solver.label());
        }
    }
}

/// Sum of normal impulses, ‖u‖/‖q‖, and contacts that are open, where these are known and unique enough.
#[test]
fn solutions_are_the_known_ones() {
    let known =
        [(NE_SPHERES, 3.5941305, 0.97966487), (SPHERES, 187.61618, 0.10648141), (PLANE_230, 0.027345574, 0.22800626)];
    for (name, impulse, velocity) in known {
        let Some(problem) = problem(name) else { continue };
        let solution = solve(&problem, Solver::ColouredAccelerated, &options(1e-9)).unwrap();
        let found = solution.r.iter().map(|r| r.x).sum::<f64>();
        assert!((found / impulse - 1.0).abs() < 1e-6, "{name}: {found}");
        let found = norm(solution.u.iter().copied()) / problem.reference();
        assert!((found / velocity - 1.0).abs() < 1e-6, "{name}: {found}");
    }
}

#[test]
fn pivoting_agrees_with_sweeps_in_the_plane() {
    for name in [PLANE_69, PLANE_230] {
        let Some(problem) = problem(name) else { continue };
        let exact = solve(&problem, Solver::Lemke, &options(1e-10)).unwrap();
        assert!(exact.converged, "{name}: {:e}", exact.residual);
        let swept = solve(&problem, Solver::GaussSeidel, &options(1e-9)).unwrap();
        let error = distance(&problem, &swept.u, &exact.u);
        assert!(error < 1e-6, "{name}: {error:e}");
    }
}

#[test]
fn the_associated_problem_is_another_one() {
    let problem = problem(NE_SPHERES).unwrap();
    let solution = solve(&problem, Solver::Socp, &Options { associated: true, ..options(1e-6) }).unwrap();
    assert!(solution.converged);
    let Solution { r, u, .. } = &solution;
    assert!(associated(&contacts(&problem), r, u, problem.reference()) <= 1e-6);
    assert!(relative(&contacts(&problem), r, u, problem.reference()) > 1e-2, "it slides without opening");
    let coulomb = solve(&problem, Solver::Socp, &options(1e-6)).unwrap();
    let apart = norm(u.iter().zip(&coulomb.u).map(|(&a, &b)| a - b)) / norm(coulomb.u.iter().copied());
    assert!((apart - 0.53).abs() < 0.01, "{apart}");
}

#[test]
fn the_cap_is_told_and_the_best_iterate_returned() {
    let problem = problem(BOX_STACKS).or_else(|| problem(NE_SPHERES)).unwrap();
    for solver in [Solver::GaussSeidel, Solver::Jacobi, Solver::JacobiAccelerated, Solver::ColouredAccelerated] {
        let solution = solve(&problem, solver, &Options { max_iterations: 5, ..options(1e-12) }).unwrap();
        assert!(!solution.converged && solution.passes == 5, "{}", solver.label());
        let best = solution.history.iter().map(|record| record.residual).fold(f64::INFINITY, f64::min);
        assert!((solution.residual / best - 1.0).abs() < 1e-9, "{}: {best:e}", solver.label());
    }
}

#[test]
fn neighbours_never_share_a_colour() {
    for name in [NE_SPHERES, BOXES_STACK, PLANE_667] {
        let problem = problem(name).unwrap();
        let colors = colors(&problem);
        for k in 0..problem.len() {
            assert!(problem.neighbours(k).all(|j| j == k || colors[j] != colors[k]), "{name}, contact {k}");
        }
    }
}

#[test]
fn friction_may_be_absent_or_huge() {
    let text = fs::read_to_string(find(NE_SPHERES).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for mu in ["0", "1e6"] {
        let (body, _) = text.trim_end().rsplit_once('\n').unwrap();
        let path = folder.path().join("changed.dat");
        fs::write(&path, format!("{body}\n{}\n", [mu; 9].join(" "))).unwrap();
        let problem = read(&path).unwrap();
        for solver in [Solver::GaussSeidel, Solver::JacobiAccelerated, Solver::ColouredAccelerated, Solver::Socp] {
            let solution = solve(&problem, solver, &options(1e-6)).unwrap();
            assert!(solution.converged, "μ = {mu}, {}: {:e}", solver.label(), solution.residual);
        }
        // The natural map contains μ u_T, and with it μ times the round-off of u_T: too much in single precision.
        if let Some(device) = device(Solver::JacobiAccelerated, mu != "0") {
            let solution = device.solve(&problem, &options(1e-6)).unwrap();
            assert!(solution.converged, "μ = {mu} on the device: {:e}", solution.residual);
        }
    }
}

/// W is singular and pushing contact 0 pulls at contact 1, so that no forces hold both: nothing may diverge.
#[test]
fn a_problem_without_solution_is_not_solved() {
    let entries = vec![(0, 0, 1.0), (0, 2, -1.0), (2, 0, -1.0), (2, 2, 1.0), (1, 1, 1.0), (3, 3, 1.0)];
    let w = Matrix { rows: 4, columns: 4, entries };
    let problem = Problem::local(2, &w, &[-1.0, 0.0, -1.0, 0.0], &[0.5, 0.5]).unwrap();
    for solver in Solver::ALL {
        let solution = solve(&problem, solver, &Options { max_iterations: 2000, ..options(1e-6) }).unwrap();
        assert!(!solution.converged && solution.residual.is_finite(), "{}: {:e}", solver.label(), solution.residual);
        assert!(solution.r.iter().all(|r| r.is_finite()), "{}", solver.label());
    }
    if let Some(device) = device(Solver::JacobiAccelerated, false) {
        let solution = device.solve(&problem, &Options { max_iterations: 2000, ..options(1e-6) }).unwrap();
        assert!(!solution.converged && solution.residual.is_finite() && solution.r.iter().all(|r| r.is_finite()));
    }
}

/// Contacts without friction, one of them open and not moving sideways.
#[test]
fn an_open_contact_without_friction_is_solved() {
    let w = Matrix { rows: 4, columns: 4, entries: (0..4).map(|i| (i, i, 1.0)).collect() };
    let problem = Problem::local(2, &w, &[1.0, 0.0, -1.0, 0.5], &[0.0, 0.0]).unwrap();
    let mut solutions: Vec<_> =
        Solver::ALL.into_iter().map(|solver| solve(&problem, solver, &options(1e-6)).unwrap()).collect();
    solutions.extend(device(Solver::Jacobi, false).map(|device| device.solve(&problem, &options(1e-6)).unwrap()));
    for Solution { r, residual, .. } in solutions {
        let error = norm(r.iter().zip([DVec3::ZERO, DVec3::X]).map(|(&a, b)| a - b));
        assert!(residual <= 1e-6 && error < 1e-5, "{r:?}: {residual:e}");
    }
}

#[test]
fn numbers_beyond_single_precision_are_refused_on_the_device() {
    let refused = |diagonal: f64, mu: f64, reason: &str| {
        let w = Matrix {
            rows: 4,
            columns: 4,
            entries: (0..4).map(|i| (i, i, if i < 2 { diagonal } else { 1.0 })).collect(),
        };
        let problem = Problem::local(2, &w, &[-1.0, 0.0, -1.0, 0.5], &[mu, mu]).unwrap();
        if let Some(device) = device(Solver::Jacobi, false) {
            let said = device.solve(&problem, &options(1e-4)).unwrap_err().to_string();
            assert!(said.contains(reason) && said.contains("--precision double"), "{said}");
        }
        if let Some(device) = device(Solver::Jacobi, true) {
            assert!(device.solve(&problem, &options(1e-4)).unwrap().converged);
        }
    };
    refused(1e-20, 0.5, "contact 0: W is 1e-20 of the largest");
    refused(1.0, 1e12, "contact 0: mu = 1e12");
}

/// `None` where there is no device.
/// A copy of a problem whose W differs from its transpose by this part of its norm, and from W by an antisymmetric
/// matrix.
fn asymmetric(problem: &Problem, part: f64, seed: u64) -> packstone::Result<Problem> {
    let (dims, n) = (problem.dims(), problem.len());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut entries = Vec::new();
    let (mut norm, mut skew) = (0.0, Vec::new());
    for i in 0..n {
        for (j, block) in problem.row(i) {
            for (a, b) in (0..dims * dims).map(|k| (k / dims, k % dims)) {
                let (row, column, value) = (dims * i + a, dims * j + b, block.col(b)[a]);
                entries.push((row, column, value));
                norm += value * value;
                if row < column {
                    skew.push((row, column, value * random.random_range(-1.0..1.0)));
                }
            }
        }
    }
    // Twice over the diagonal in W, and twice in W less its transpose.
    let size = skew.iter().map(|(_, _, value): &(usize, usize, f64)| 8.0 * value * value).sum::<f64>();
    let scale = part * (norm / size).sqrt();
    for (row, column, value) in skew {
        entries.extend([(row, column, scale * value), (column, row, -scale * value)]);
    }
    let q: Vec<f64> = problem.q().iter().flat_map(|q| q.to_array().into_iter().take(dims)).collect();
    let mu: Vec<f64> = (0..n).map(|k| problem.mu(k)).collect();
    Problem::local(dims, &Matrix { rows: n * dims, columns: n * dims, entries }, &q, &mu)
}

/// What a file has as W may be another's rounding, or the law of a contact that is not quite symmetric: local solvers
/// and the operator see the same mean with the transpose, so that it costs no pass.
#[test]
fn what_is_not_quite_symmetric_is_mended() {
    for name in [NE_SPHERES, BOX_STACKS, PLANE_69] {
        let Some(given) = problem(name) else { continue };
        for part in [1e-5, 1e-3, 0.049] {
            let copy = asymmetric(&given, part, 7).unwrap();
            assert!((copy.asymmetry() / part - 1.0).abs() < 1e-2, "{name}: {} for {part}", copy.asymmetry());
            for solver in [Solver::GaussSeidel, Solver::JacobiAccelerated, Solver::ColouredAccelerated] {
                let of = |problem: &Problem| solve(problem, solver, &options(1e-6)).unwrap();
                let (expected, found) = (of(&given), of(&copy));
                let what = format!("{name} {solver:?} {part}: {} passes, {}", found.passes, expected.passes);
                assert!(found.converged && found.passes <= expected.passes + expected.passes / 4, "{what}");
                assert!(distance(&given, &found.u, &expected.u) < 1e-4, "{what}");
            }
        }
        let reason = asymmetric(&given, 0.051, 7).unwrap_err().to_string();
        assert!(reason.contains("W is not symmetric"), "{reason}");
    }
}

/// Contacts of some bodies in random places with random normals: blocks of W that join normal and tangent as strongly as
/// may be.
fn tangle(bodies: usize, n: usize, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
    // Rows of velocities and spins of the bodies, in columns of the contacts.
    let mut h = vec![vec![DVec3::ZERO; 2 * bodies]; 3 * n];
    for k in 0..n {
        let normal = vector().normalize();
        let (s, t) = normal.any_orthonormal_pair();
        // One of the two may be the world.
        for (side, body) in [(1.0, k % bodies), (-1.0, (3 * k + 1 + k / bodies) % (bodies + 1))] {
            let arm = vector();
            for (row, axis) in [normal, s, t].into_iter().enumerate().filter(|_| body < bodies) {
                h[3 * k + row][2 * body] += side * axis;
                h[3 * k + row][2 * body + 1] += 1.5 * side * arm.cross(axis);
            }
        }
    }
    let product = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let w: Vec<f64> = h.iter().flat_map(|a| h.iter().map(move |b| product(a, b))).collect();
    let free: Vec<DVec3> = (0..2 * bodies).map(|_| vector()).collect();
    let q: Vec<f64> = h.iter().map(|row| product(row, &free)).collect();
    let mu: Vec<f64> = (0..n).map(|k| [0.3, 0.8, 1.5][k % 3]).collect();
    Problem::local(3, &Matrix::dense(3 * n, 3 * n, &w), &q, &mu).unwrap()
}

/// Sweeps by colours may go in circles where blocks join normal and tangent; they never end worse than Jacobi's passes.
#[test]
fn sweeps_do_not_go_in_circles() {
    let mut worse = 0;
    for seed in 0..60 {
        let problem = tangle(8, 25, seed);
        let of = |solver| solve(&problem, solver, &Options { max_iterations: 4_000, ..options(1e-8) }).unwrap();
        let (colored, jacobi) = (of(Solver::ColouredAccelerated), of(Solver::JacobiAccelerated));
        println!("{seed}: {} {:.1e}, {} {:.1e}", colored.passes, colored.residual, jacobi.passes, jacobi.residual);
        worse += u32::from(colored.residual > jacobi.residual.max(1e-8));
    }
    assert_eq!(worse, 0);
}

fn device(solver: Solver, double: bool) -> Option<Jacobi> {
    match Jacobi::open(solver, double) {
        Ok(device) => Some(device),
        Err(e) if !packstone::gpu::adapters().iter().any(|adapter| adapter.double || !double) => {
            eprintln!("NOT TESTED: {e}");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

const RELAXATIONS: [Solver; 2] = [Solver::Jacobi, Solver::JacobiAccelerated];

/// What the CPU and the device make of a problem within so many passes is the same.
fn same_iterates(what: &str, device: &Jacobi, solver: Solver, double: bool, problem: &Problem, passes: usize) {
    let what = format!("{what}, {}, double: {double}, {passes} passes", solver.label());
    let options = Options { max_iterations: passes, ..options(1e-14) };
    let twin = solve(problem, solver, &options).unwrap();
    let found = device.solve(problem, &options).unwrap();
    assert_eq!(found.residual, residual(problem, &found.r), "{what}");
    let error = norm(found.r.iter().zip(&twin.r).map(|(&a, &b)| a - b)) / norm(twin.r.iter().copied());
    let (close, closer) = if double { (1e-10, 1e-13) } else { (1e-3, 5e-6) };
    assert!(error < closer, "{what}: {error:e}");
    assert_eq!((found.passes, found.history.len()), (passes, passes + 1), "{what}");
    for (a, b) in found.history.iter().zip(&twin.history) {
        assert!((a.residual / b.residual - 1.0).abs() < close, "{what}: {a:?}, {b:?}");
    }
}

/// The CPU's solver is the twin of the kernels.
#[test]
fn a_device_takes_the_passes_of_its_twin() {
    // Power iteration finds not much of the one pair that hangs together among many contacts that do not, so the first
    // step is too long and L is raised. They are more than one workgroup adds up at once.
    let n = 20_000;
    let coupling = [(0, 2, 0.08), (2, 0, 0.08)];
    let entries = (0..2 * n).map(|i| (i, i, 1.0)).chain(coupling).collect();
    let w = Matrix { rows: 2 * n, columns: 2 * n, entries };
    let q: Vec<f64> = (0..2 * n).map(|i| if i == 0 || i == 2 { -1.0 } else { 0.0 }).collect();
    let pair = Problem::local(2, &w, &q, &vec![0.5; n]).unwrap();
    let raised = solve(&pair, Solver::Jacobi, &Options { max_iterations: 2, ..options(1e-14) }).unwrap();
    assert!((raised.r[0].x * 1.02 * 1.08 - 1.0).abs() < 1e-12, "L was not raised: {}", raised.r[0]);

    for (solver, double) in RELAXATIONS.into_iter().flat_map(|solver| [(solver, false), (solver, true)]) {
        let Some(device) = device(solver, double) else { continue };
        for passes in [1, 2, 3] {
            same_iterates("a pair", &device, solver, double, &pair, passes);
        }
        for (name, _, _) in ALL {
            let Some(problem) = problem(name) else { continue };
            for passes in [1, 2, 5, 20] {
                same_iterates(name, &device, solver, double, &problem, passes);
            }
        }
    }
}

/// Single precision costs no passes down to 1e-4, and some floor below that.
#[test]
fn a_device_solves_what_its_twin_solves() {
    let floors = [
        (NE_SPHERES, 1e-8),
        (BOX_STACKS, 3e-7),
        (SPHERES, 1e-6),
        (PERIO_BOX, 2e-6),
        (KAPLAS, 1e-6),
        (PLANE_69, 3e-7),
        (PLANE_230, 3e-7),
        (PLANE_667, 3e-7),
        (PLANE_2020, 2e-6),
    ];
    let Some(device) = device(Solver::JacobiAccelerated, false) else { return };
    for (name, _, _) in ALL {
        let Some(problem) = problem(name) else { continue };
        let twin = solve(&problem, Solver::JacobiAccelerated, &options(1e-4)).unwrap();
        let found = device.solve(&problem, &options(1e-4)).unwrap();
        let what = format!("{name}: {} passes, on the CPU {}", found.passes, twin.passes);
        assert!(found.converged && found.residual == residual(&problem, &found.r), "{what}");
        assert_eq!(device.solve(&problem, &options(1e-4)).unwrap().r, found.r, "{name}: the same bits every time");
        assert!(found.passes as f64 <= 1.2 * twin.passes as f64 + 3.0, "{what}");
        let error = distance(&problem, &found.u, &twin.u);
        assert!(error < 5e-3, "{what}, velocities {error:e}");
    }
    for (name, floor) in floors {
        let Some(problem) = problem(name) else { continue };
        let found = device.solve(&problem, &Options { max_iterations: 600, ..options(floor) }).unwrap();
        assert!(found.converged, "{name}: {:e}, not {floor:e}", found.residual);
    }
}

fn packstone(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_packstone")).arg("solve").args(arguments).output().unwrap()
}

fn refused(arguments: &[&str], reason: &str) {
    let output = packstone(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(said.contains(reason), "{arguments:?}: {said}");
}

#[test]
fn bad_input_is_named() {
    let spheres = find(NE_SPHERES).unwrap();
    let name = spheres.to_str().unwrap();
    refused(&[name, "--solver", "lemke"], "in the plane only");
    refused(&[name, "--solver", "newton"], "gauss-seidel, jacobi, jacobi-accelerated");
    refused(&[name, "--solver", "gauss-seidel", "--order", "best"], "random-sweep");
    refused(&[name, "--solver", "jacobi", "--order", "fixed"], "jacobi has none");
    refused(&[name, "--solver", "jacobi", "--associated"], "but socp can");
    refused(&[name, "--engine", "gpu", "--solver", "lemke"], "lemke runs with --engine cpu only");
    refused(&[name, "--engine", "auto"], "[possible values: cpu, gpu]");
    refused(&[name, "--engine", "gpu", "--judge", name], "cannot be used with");
    refused(&["/nowhere.dat", "--engine", "gpu"], "/nowhere.dat");
    refused(&[name, "--tolerance", "-1"], "tolerance = -1");
    refused(&["/nowhere.dat"], "/nowhere.dat");
    refused(&[find(PLANE_667).unwrap().to_str().unwrap(), "--solver", "lemke"], "at most 500 contacts, not 667");

    let text = fs::read_to_string(&spheres).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.dat");
    let with = |text: &str, reason: &str| {
        fs::write(&path, text).unwrap();
        refused(&[path.to_str().unwrap()], reason);
    };
    with("", "the file ends early");
    with("solid cube\n", "line 1: there is no number for dimension");
    with(&text[..text.len() / 2], "the file ends early");
    with(&text.replacen('3', "4", 1), "dimension = 4 must be 2 or 3");
    with(&text.replacen("\n27\n", "\n26\n", 1), "announced were 26 × 27");
    with(&text.replacen("\n0\n", "\n7\n", 1), "storage 7");
    with(&text.replacen("-9.809999999999792497096252e-02", "nan", 1), "q[0] = NaN");
    with(&text.replacen("8.000000000000000444089210e-01", "-0.8", 1), "mu[0] = -0.8");
    with(&text.replacen("2.000000000000000111022302e-01", "inf", 1), "W[0, 0] = inf");
    with(&text.replacen("2.000000000000000111022302e-01", "-0.2", 1), "block (0, 0) of W: W_nn");
    with(&text.replacen('9', "99999999999999999999", 1), "there is no number for number of contacts");
    with(&text.replacen('9', "9999999999999999999", 1), "too many");
}

#[test]
#[cfg(feature = "fclib")]
fn damaged_hdf5_files_are_refused() {
    let bytes = fs::read(find(BOX_STACKS).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.hdf5");
    for length in [8, 100, 3000, bytes.len() / 2] {
        fs::write(&path, &bytes[..length]).unwrap();
        refused(&[path.to_str().unwrap()], "bad.hdf5");
    }
    let mut renamed = bytes.clone();
    let place = renamed.windows(12).position(|window| window == b"fclib_global").unwrap();
    renamed[place] = b'x';
    fs::write(&path, renamed).unwrap();
    refused(&[path.to_str().unwrap()], "neither /fclib_local nor /fclib_global");
}

#[test]
fn the_command_tells_what_it_found() {
    let spheres = find(NE_SPHERES).unwrap();
    let name = spheres.to_str().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("history.csv");
    let output =
        packstone(&[name, "--solver", "jacobi", "--tolerance", "1e-6", "--history", history.to_str().unwrap()]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    for part in ["9 contacts in 3D", "2 open, 6 stick, 1 slip", "converged    jacobi reached 1e-6"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let rows: Vec<String> = fs::read_to_string(&history).unwrap().lines().map(str::to_owned).collect();
    assert_eq!(rows[0], "pass,residual,seconds");
    let last: f64 = rows.last().unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert!(last <= 1e-6);

    let output = packstone(&[name, "--json", "--max-iterations", "1", "--tolerance", "1e-9"]);
    assert_eq!(output.status.code(), Some(3), "not to converge has a code of its own");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["converged"], false);
    assert_eq!(found["r"].as_array().unwrap().len(), 9);
    let said = String::from_utf8(packstone(&[name, "--max-iterations", "1", "--tolerance", "1e-9"]).stdout).unwrap();
    assert!(said.contains("UNCONVERGED"), "{said}");
}
