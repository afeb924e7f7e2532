//! The WGSL text, embedded; file names are relative to `shaders/`.

macro_rules! embed {
    ($($file:literal),* $(,)?) => {
        /// Every file of `shaders/` that kernels are composed from, with its text.
        pub static FILES: &[(&str, &str)] = &[$(($file, include_str!(concat!("../shaders/", $file)))),*];
    };
}

embed![
    "scalar/single.wgsl",
    "scalar/double.wgsl",
    "precision/single.wgsl",
    "precision/double.wgsl",
    "dimension/plane.wgsl",
    "dimension/space.wgsl",
    "dispatch.wgsl",
    "params.wgsl",
    "bodies.wgsl",
    "lists.wgsl",
    "boundary/open.wgsl",
    "boundary/periodic.wgsl",
    "grid.wgsl",
    "touch.wgsl",
    "normal/hooke.wgsl",
    "normal/rigid.wgsl",
    "dashpot/none.wgsl",
    "dashpot/restitution.wgsl",
    "dashpot/mass_scaled.wgsl",
    "friction/none.wgsl",
    "friction/coulomb.wgsl",
    "rotation/none.wgsl",
    "rotation/sphere.wgsl",
    "materials/one.wgsl",
    "materials/many.wgsl",
    "walls/none.wgsl",
    "walls/some.wgsl",
    "contact.wgsl",
    "method/dem.wgsl",
    "method/cd.wgsl",
    "leapfrog.wgsl",
    "tally.wgsl",
    "scan_reduce.wgsl",
    "scan_top.wgsl",
    "scan_down.wgsl",
    "remember.wgsl",
    "bin.wgsl",
    "sort.wgsl",
    "order.wgsl",
    "permute.wgsl",
    "count.wgsl",
    "neighbours.wgsl",
    "half_kick.wgsl",
    "advance.wgsl",
    "move_walls.wgsl",
    "meet.wgsl",
    "seed.wgsl",
    "probe.wgsl",
    "gauge.wgsl",
    "set_out.wgsl",
    "relax.wgsl",
    "steer.wgsl",
    "extrapolate.wgsl",
    "judge.wgsl",
    "conclude.wgsl",
    "displace.wgsl",
    "survey.wgsl",
    "measure.wgsl",
    "synchronise.wgsl",
    "forces.wgsl",
    "problem/relaxation.wgsl",
    "problem/project.wgsl",
    "problem/multiply.wgsl",
    "problem/steer.wgsl",
];

/// Name and text of an embedded file. Panics on a name that is not there.
pub fn file(name: &str) -> (&'static str, &'static str) {
    *FILES.iter().find(|(file, _)| *file == name).unwrap_or_else(|| panic!("no shader file is called `{name}`"))
}
