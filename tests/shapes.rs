//! Shapes of clumps: mass properties of unions against closed forms and brute force, meshes, what scenes say of them,
//! and what is refused.

mod common;

use common::{R, members};
use glam::{DMat3, DQuat, DVec3};
use packstone::scene::{Assembly, Member, Scene, Shape};
use std::{f64::consts::PI, fmt::Write, path::Path};

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Member {
    Member { arm: DVec3::new(x, y, z), radius }
}

/// Volume (area), in the unit of the members.
fn volume(shape: &Shape, dimension: usize) -> f64 {
    if dimension == 2 { PI * shape.radius.powi(2) } else { 4.0 / 3.0 * PI * shape.radius.powi(3) }
}

/// Inertia about the centre of mass, along the given axes, at density 1.
fn inertia(shape: &Shape, dimension: usize) -> DMat3 {
    let unit = volume(shape, dimension) * shape.radius.powi(2);
    let axes = DMat3::from_quat(shape.frame);
    axes * DMat3::from_diagonal(unit * shape.gyration) * axes.transpose()
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs().max(1e-3),
        "found {found:.15e}, expected {expected:.15e}"
    );
}

#[test]
fn touching_balls_add_up() {
    // Two balls that touch: with m the mass of one, J = 2.8 m R² across and 0.8 m R² along the line of centres.
    let shape = Shape::of_union("dimer", &members(&[-DVec3::X, DVec3::X]), 3);
    let m = 4.0 / 3.0 * PI;
    near(volume(&shape, 3), 2.0 * m, 1e-14);
    let j = inertia(&shape, 3);
    near(j.x_axis.x, 0.8 * m, 1e-13);
    near(j.y_axis.y, 2.8 * m, 1e-13);
    near(j.z_axis.z, 2.8 * m, 1e-13);
    assert_eq!(shape.gyration.y, shape.gyration.z, "equal moments are equal to the last bit");
}

#[test]
fn what_two_balls_share_counts_once() {
    // At the distance of a radius: 8π/3 less the lens π (4R + d)(2R - d)² / 12.
    let shape = Shape::of_union("dimer", &[ball(0.0, 0.0, 0.0, 1.0), ball(0.6, 0.0, 0.8, 1.0)], 3);
    near(volume(&shape, 3), 8.0 * PI / 3.0 - 5.0 * PI / 12.0, 1e-13);
    assert!(shape.error < 1e-13);
    assert!((shape.center - DVec3::new(0.3, 0.0, 0.4)).length() < 1e-14);
    // A third one, hidden inside, changes nothing; nor does the same one again.
    for extra in [ball(0.3, 0.0, 0.4, 0.4), ball(0.0, 0.0, 0.0, 1.0)] {
        let again = Shape::of_union("dimer", &[ball(0.0, 0.0, 0.0, 1.0), ball(0.6, 0.0, 0.8, 1.0), extra], 3);
        near(volume(&again, 3), volume(&shape, 3), 1e-12);
    }
}

/// Moments of a union by counting points of a fine grid.
fn counted(members: &[Member], dimension: usize, points: usize) -> (f64, DVec3, DMat3) {
    let low = members.iter().map(|m| m.arm - DVec3::splat(m.radius)).fold(DVec3::INFINITY, DVec3::min);
    let high = members.iter().map(|m| m.arm + DVec3::splat(m.radius)).fold(DVec3::NEG_INFINITY, DVec3::max);
    let layers = if dimension == 2 { 1 } else { points };
    let cell = (high - low) / points as f64;
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for k in 0..layers {
        for j in 0..points {
            for i in 0..points {
                let mut x = low + (DVec3::new(i as f64, j as f64, k as f64) + 0.5) * cell;
                if dimension == 2 {
                    x.z = 0.0;
                }
                if members.iter().any(|m| m.arm.distance_squared(x) < m.radius * m.radius) {
                    volume += 1.0;
                    first += x;
                    second += DMat3::from_cols(x * x.x, x * x.y, x * x.z);
                }
            }
        }
    }
    let part = if dimension == 2 { cell.x * cell.y } else { cell.x * cell.y * cell.z };
    let center = first / volume;
    let about = second - volume * DMat3::from_cols(center * center.x, center * center.y, center * center.z);
    let trace = about.x_axis.x + about.y_axis.y + about.z_axis.z;
    (part * volume, center, part * (trace * DMat3::IDENTITY - about))
}

#[test]
fn three_fold_overlaps_agree_with_counting() {
    let cluster = [
        ball(0.0, 0.0, 0.0, 1.0),
        ball(0.9, 0.1, 0.2, 0.8),
        ball(0.3, 0.8, -0.1, 0.7),
        ball(0.2, 0.3, 0.9, 0.6),
        ball(-0.9, -0.4, 0.3, 0.5),
    ];
    for (dimension, points, tolerance) in [(2, 2000, 1e-4), (3, 160, 1e-3)] {
        let flat: Vec<Member> = cluster
            .iter()
            .map(|m| Member { arm: if dimension == 2 { m.arm.with_z(0.0) } else { m.arm }, ..*m })
            .collect();
        let shape = Shape::of_union("cluster", &flat, dimension);
        let (size, center, j) = counted(&flat, dimension, points);
        println!("{dimension}D: error bound {:.1e}", shape.error);
        near(volume(&shape, dimension), size, tolerance);
        assert!((shape.center - center).length() < tolerance);
        let difference = inertia(&shape, dimension) - j;
        let off = if dimension == 2 {
            difference.z_axis.z.abs()
        } else {
            difference.to_cols_array().iter().fold(0.0, |a: f64, b| a.max(b.abs()))
        };
        assert!(off < 2.0 * tolerance * j.z_axis.z, "{difference}");
        assert!(shape.error < 1e-10);
    }
}

#[test]
fn turned_members_are_the_same_shape() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -1.0, 0.6).normalize(), 0.8);
    let cluster =
        [ball(0.0, 0.0, 0.0, 1.0), ball(1.1, 0.1, 0.2, 0.8), ball(0.4, 1.2, -0.1, 0.7), ball(0.5, 0.5, 0.8, 0.6)];
    let turned: Vec<Member> =
        cluster.iter().map(|m| Member { arm: turn * m.arm + DVec3::new(5.0, -3.0, 2.0), ..*m }).collect();
    let (a, b) = (Shape::of_union("a", &cluster, 3), Shape::of_union("b", &turned, 3));
    near(a.radius, b.radius, 1e-9);
    let sorted = |s: &Shape| {
        let mut g = s.gyration.to_array();
        g.sort_by(f64::total_cmp);
        g
    };
    for (x, y) in sorted(&a).into_iter().zip(sorted(&b)) {
        near(x, y, 1e-8);
    }
    // Members come out where they were put.
    for (shape, given) in [(&a, &cluster[..]), (&b, &turned[..])] {
        for (own, given) in shape.members.iter().zip(given) {
            let back = shape.center + shape.radius * (shape.frame * own.arm);
            assert!((back - given.arm).length() < 1e-12, "{back} {}", given.arm);
        }
    }
}

#[test]
fn regular_shapes_are_round() {
    let scene = |kind: &str| {
        let text = format!(
            "dimension = 3\n[material.a]\ndensity = 1000\nnormal_stiffness = 1e4\n[[grain]]\nposition = [0, 0, 0]\nradius = 1e-3\n\
             material = \"a\"\nshape = \"{kind}\"\n[stop]\nsteps = 1\n"
        );
        Scene::parse(&text, "test", Path::new(""), &[]).unwrap().assemble().unwrap()
    };
    for (kind, count, round) in [
        ("sphere", 1, true),
        ("dimer", 2, false),
        ("rod", 3, false),
        ("triangle", 3, false),
        ("square", 4, false),
        ("cross", 7, true),
        ("tetrahedron", 4, true),
        ("octahedron", 6, true),
        ("cube", 8, true),
        ("random", 5, false),
    ] {
        let assembly = scene(kind);
        let shape = &assembly.shapes[0];
        assert_eq!((shape.members.len(), shape.is_round()), (count, round), "{kind}: {:?}", shape.gyration);
        assert_eq!(assembly.grains.len(), count);
        assert_eq!(assembly.clumps.len(), 1);
        // The size is that of the sphere of the same volume.
        assert!(assembly.grains.iter().all(|g| g.radius <= R * (1.0 + 1e-12)));
    }
}

/// A closed surface in ASCII STL.
fn stl(triangles: &[[DVec3; 3]]) -> String {
    let mut text = "solid test\n".to_owned();
    for t in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for x in t {
            writeln!(text, "vertex {:e} {:e} {:e}", x.x, x.y, x.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid test\n"
}

/// The surface of a box, from 0 to its edges.
fn block(edges: DVec3) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (a, b, c) = (DVec3::AXES[axis], DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        for side in [0.0, 1.0] {
            let corner = |u: f64, v: f64| (side * a + u * b + v * c) * edges;
            let (p, q, r, s) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0));
            let faces = [[p, q, r], [p, r, s]];
            triangles.extend(faces.map(|[x, y, z]| if side == 1.0 { [x, y, z] } else { [x, z, y] }));
        }
    }
    triangles
}

#[test]
fn a_mesh_is_filled_from_within() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.stl");
    let edges = DVec3::new(1.0, 1.5, 2.0);
    // Inside out as well: which way is out follows from the volume.
    for flip in [false, true] {
        let mut triangles = block(edges);
        if flip {
            triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        std::fs::write(&path, stl(&triangles)).unwrap();
        let mut last = f64::INFINITY;
        for count in [5, 20, 80] {
            let shape = Shape::of_mesh("block", &path, count).unwrap();
            let misfit = shape.misfit.unwrap();
            println!("{count} spheres: mean {:.4} R, largest {:.4} R", misfit.mean, misfit.max);
            assert!(shape.members.len() <= count && misfit.mean < last);
            last = misfit.mean;
            near(volume(&shape, 3), 3.0, 1e-6);
            let j = inertia(&shape, 3);
            near(j.x_axis.x, 3.0 / 12.0 * (1.5 * 1.5 + 4.0), 1e-6);
            for member in &shape.members {
                let x = shape.center + shape.radius * (shape.frame * member.arm);
                let room = x.min(edges - x).min_element();
                assert!(
                    member.radius * shape.radius <= room + 1e-9,
                    "a sphere reaches out by {}",
                    member.radius * shape.radius - room
                );
            }
        }
        assert!(last < 0.06, "{last}");
    }
    // Thinner than the distance of the points that spread over it: no sphere may look for room on the other side.
    std::fs::write(&path, stl(&block(DVec3::new(1.0, 1.0, 0.02))).replace(" 0e0", " -0e0")).unwrap();
    let plate = Shape::of_mesh("plate", &path, 200).unwrap();
    for member in &plate.members {
        let x = plate.center + plate.radius * (plate.frame * member.arm);
        assert!(member.radius * plate.radius <= x.z.min(0.02 - x.z) + 1e-9, "{x} {}", member.radius * plate.radius);
    }
    for (triangles, part) in [(&block(edges)[1..], "is not closed"), (&[][..], "has no triangles")] {
        std::fs::write(&path, stl(triangles)).unwrap();
        let message = Shape::of_mesh("block", &path, 5).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    std::fs::write(&path, "nothing of the kind").unwrap();
    assert!(Shape::of_mesh("block", &path, 5).unwrap_err().to_string().contains("is no STL mesh"));
}

fn assemble(rest: &str) -> packstone::Result<Assembly> {
    let head = "gravity = [0, 0, 0]\n[domain]\nlower = [0, 0, 0]\nupper = [0.05, 0.05, 0.05]\nboundary = \"periodic\"\n\
                [material.a]\ndensity = 1000\nnormal_stiffness = 1e4\n[stop]\nsteps = 1\n";
    Scene::parse(&format!("dimension = 3\n{head}{rest}"), "test", Path::new(""), &[])?.assemble()
}

#[test]
fn populations_mix_shapes_in_random_orientations() {
    for placement in ["lattice", "random"] {
        let assembly = assemble(&format!(
            "[[population]]\nmaterial = \"a\"\ncount = 900\nradius = {{ uniform = [0.8e-3, 1e-3] }}\nplacement = \"{placement}\"\n\
             shape = {{ dimer = 2, tetrahedron = 1 }}\nvelocity_spread = 0.1\n"
        ))
        .unwrap();
        assert_eq!(assembly.clumps.len(), 900);
        let dimers = assembly.clumps.iter().filter(|c| assembly.shapes[c.shape as usize].name == "dimer").count();
        assert!((540..660).contains(&dimers), "{dimers}");
        assert_eq!(assembly.grains.len(), 2 * dimers + 4 * (900 - dimers));
        // Directions of a body's axis are uniform on the sphere: mean 0, mean square 1/3 each.
        let axes: Vec<DVec3> = assembly.clumps.iter().map(|c| c.orientation * DVec3::X).collect();
        let mean = axes.iter().sum::<DVec3>() / 900.0;
        let square = axes.iter().map(|a| *a * *a).sum::<DVec3>() / 900.0;
        assert!(mean.length() < 0.08 && (square - 1.0 / 3.0).abs().max_element() < 0.04, "{mean} {square}");
    }
}

#[test]
fn spheres_among_clumps_are_clumps_of_one() {
    let assembly = assemble(
        "[[grain]]\nposition = [0.01, 0.01, 0.01]\nradius = 1e-3\nmaterial = \"a\"\n\
         [[grain]]\nposition = [0.02, 0.01, 0.01]\nradius = 1e-3\nmaterial = \"a\"\nshape = \"dimer\"\n\
         [[grain]]\nposition = [0.03, 0.01, 0.01]\nradius = 1e-3\nmaterial = \"a\"\n",
    )
    .unwrap();
    let sizes: Vec<usize> = (0..3).map(|k| assembly.members(k).len()).collect();
    assert_eq!((sizes, assembly.owners()), (vec![1, 2, 1], vec![0, 1, 1, 2]));
}

#[test]
fn euler_angles_and_quaternions_are_the_same_turn() {
    let grain = |orientation: &str| {
        assemble(&format!(
            "[[grain]]\nposition = [0.01, 0.01, 0.01]\nradius = 1e-3\nmaterial = \"a\"\nshape = \"dimer\"\norientation = {orientation}\n"
        ))
        .unwrap()
        .clumps[0]
            .orientation
    };
    let (phi, theta, psi) = (0.3_f64, 0.7_f64, -1.1_f64);
    // (2.34)-(2.37); the chapter's (q1, q2, q3, q4) is (-y, x, z, w).
    let (s, c) = (0.5 * theta).sin_cos();
    let (minus, plus) = (0.5 * (psi - phi), 0.5 * (psi + phi));
    let [q1, q2, q3, q4] = [s * minus.sin(), s * minus.cos(), c * plus.sin(), c * plus.cos()];
    let euler = grain(&format!("{{ euler = [{phi}, {theta}, {psi}] }}"));
    let other = grain(&format!("{{ quaternion = [{}, {}, {}, {}] }}", 3.0 * q4, 3.0 * q2, -3.0 * q1, 3.0 * q3));
    assert!((euler.dot(other).abs() - 1.0).abs() < 1e-15, "{euler} {other}");
}

#[test]
fn bad_shapes_are_refused() {
    let grain = "[[grain]]\nposition = [0.01, 0.01, 0.01]\nradius = 1e-3\nmaterial = \"a\"\n";
    for (text, part) in [
        (format!("{grain}shape = \"banana\"\n"), "is no shape; there are sphere, dimer"),
        (format!("{grain}shape = \"disk\"\n"), "is no shape"),
        (format!("{grain}orientation = {{ euler = [0, 0, 0] }}\n"), "goes with `shape` only"),
        (format!("{grain}shape = \"dimer\"\norientation = {{ quaternion = [0, 0, 0, 0] }}\n"), "a length other than 0"),
        (format!("{grain}shape = \"dimer\"\norientation = 0.5\n"), "must be { quaternion"),
        (format!("{grain}shape = \"dimer\"\norientation = \"random\"\n"), "is for populations"),
        ("[[shape]]\nname = \"x\"\n".to_owned() + grain, "needs exactly one of members, file, kind, mesh"),
        ("[[shape]]\nname = \"x\"\nmembers = []\n".to_owned() + grain, "must have at least one"),
        (
            "[[shape]]\nname = \"x\"\nmembers = [{ center = [0, 0, 0], radius = -1 }]\n".to_owned() + grain,
            "must be a positive number",
        ),
        ("[[shape]]\nname = \"x\"\nkind = \"rod\"\ncount = 0\n".to_owned() + grain, "must be from 1 to"),
        ("[[shape]]\nname = \"x\"\nkind = \"cube\"\ncount = 9\n".to_owned() + grain, "goes with kind = \"rod\""),
        ("[[shape]]\nname = \"x\"\nkind = \"potato\"\n".to_owned() + grain, "must be one of sphere"),
        ("[[shape]]\nname = \"x\"\nkind = \"rod\"\nvolume = 3\n".to_owned() + grain, "go together"),
        (
            "[[shape]]\nname = \"x\"\nkind = \"rod\"\nvolume = 3\ncenter = [0, 0, 0]\ninertia = [1, 1, 9, 0, 0, 0]\n"
                .to_owned()
                + grain,
            "belongs to no body",
        ),
        (
            "[[shape]]\nname = \"sphere\"\nkind = \"rod\"\n".to_owned() + grain,
            "neither another shape nor the library has",
        ),
        ("[[shape]]\nname = \"x\"\nmesh = \"nowhere.stl\"\n".to_owned() + grain, "nowhere.stl"),
        (
            "[[population]]\nmaterial = \"a\"\ncount = 5\nradius = 1e-3\nshape = { dimer = 0 }\n".to_owned(),
            "add up to a positive number",
        ),
        (
            "[[population]]\nmaterial = \"a\"\ncount = 1\nradius = 1.6e-2\nshape = \"dimer\"\n".to_owned(),
            "must be at least",
        ),
        (format!("{grain}shape = \"dimer\"\n[solver]\ngyroscopic = true\n"), "is for method = \"cd\" only"),
    ] {
        let message = assemble(&text).expect_err(&text).to_string();
        assert!(message.contains(part), "{message}\n(expected \"{part}\")");
    }
}
