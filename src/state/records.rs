//! Twins of the structs of WGSL that arrays and parameters are made of.

use crate::{
    record::{Element, record},
    units::{Quantity, Units},
};
use glam::{DVec3, DVec4, UVec3};

/// An angular quantity: three components in space, one about z in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spin(pub DVec3);

impl Element for Spin {
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        if dims == 2 { sink(self.0.z) } else { self.0.put(dims, sink) }
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Spin {
        Spin(if dims == 2 { DVec3::new(0.0, 0.0, source()) } else { DVec3::take(dims, source) })
    }
}

/// A vector without the padding that arrays of vectors have on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Packed(pub DVec3);

impl Element for Packed {
    fn names(dims: usize) -> &'static [&'static str] {
        &["x", "y", "z"][..dims]
    }
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        self.0.put(dims, sink);
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Packed {
        Packed(DVec3::take(dims, source))
    }
}

/// The turn from the axes of a body to those of the scene: a unit quaternion (x, y, z, w), in the plane (z, w) of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation(pub DVec4);

impl Element for Orientation {
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        self.0.to_array()[if dims == 2 { 2 } else { 0 }..].iter().for_each(|c| sink(*c));
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Orientation {
        let mut q = [0.0; 4];
        q[if dims == 2 { 2 } else { 0 }..].iter_mut().for_each(|c| *c = source());
        Orientation(q.into())
    }
}

/// What single precision leaves out of a velocity or a spin: parts of a unit in the last place, packed. Empty in double
/// precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowBits(pub [u32; 2]);

impl Element for LowBits {
    const INTEGER: bool = true;
    fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
        self.0.iter().for_each(|bits| sink(f64::from(*bits)));
    }
    fn take(_: usize, source: &mut impl FnMut() -> f64) -> LowBits {
        LowBits(std::array::from_fn(|_| source() as u32))
    }
}

record!(
    /// Where a grain is. Units and meaning of all records: `shaders/state.wgsl`.
    Position { x: DVec3 [Length], radius: f64 [Length] }
);
record!(
    /// What single precision leaves out of a place.
    PositionLow { x: DVec3 [Length], radius: f64 [Length] }
);
record!(
    /// How a grain moves.
    Velocity { v: DVec3 [Velocity], inverse_mass: f64 [InverseMass] }
);
record!(
    /// What single precision leaves out of velocity and spin.
    VelocityLow { v: LowBits, spin: LowBits }
);
record!(
    /// Contact parameters of a pair of materials.
    Pair {
        stiffness: f64 [NormalStiffness],
        tangential_stiffness: f64 [TangentialStiffness],
        friction: f64,
        dashpot: f64 [Dashpot],
    }
);
record!(
    /// Parameters of rolling resistance of a pair of materials (`shaders/contact/rolling/elastic_plastic.wgsl`).
    RollingPair { friction: f64, stiffness: f64, damping: f64 }
);
record!(
    /// A grain at time 0 (this and the next: `shaders/contact/growth/some.wgsl`).
    StartSize { radius: f64 [Length], radius_low: f64 [Length], inverse_mass: f64 [InverseMass] }
);
record!(
    /// What grains of a material have become, over what they were at time 0.
    GrowthStep { factor: f64, factor_low: f64, inverse_volume: f64, rate: f64 [Rate] }
);
record!(
    /// A wall (`shaders/space/walls/some.wgsl`).
    Wall {
        point: DVec3 [Length],
        low: DVec3 [Length],
        normal: DVec3,
        normal_low: DVec3,
        velocity: DVec3 [Velocity],
        radius: f64 [Length],
        radius_low: f64 [Length],
        growth: f64 [Velocity],
        velocity_next: DVec3 [Velocity],
        growth_next: f64 [Velocity],
        driven: u32,
        spin: Spin [Rate],
    }
);
record!(
    /// The servo of a wall (`shaders/measure/servo_walls.wgsl`).
    WallServo {
        along: DVec3 [Velocity],
        force: f64 [Force],
        pressure: f64 [Stress],
        factor: f64,
        breadth: f64 [Length],
        depth: f64 [Length],
        breadth_from: u32,
        breadth_to: u32,
        depth_from: u32,
        depth_to: u32,
        time: f64 [Time],
        most_speed: f64 [Velocity],
        least_stiffness: f64 [Stiffness],
        least_radius: f64 [Length],
    }
);
record!(
    /// The periodic cell (`shaders/space/boundary/deforming.wgsl`).
    Cell {
        length: DVec3 [Length],
        length_low: DVec3 [Length],
        tilt: Spin [Length],
        tilt_low: Spin [Length],
        turned_back: Spin,
        stretch: DVec3,
        stretch_tilt: Spin,
        rate: DVec3 [Rate],
        shear_rate: Spin [Rate],
        rate_next: DVec3 [Rate],
        shear_rate_next: Spin [Rate],
        steady_rate: DVec3 [Rate],
        steady_shear_rate: Spin [Rate],
        settled: f64,
        largest_rate: f64 [Rate],
        stress: DVec3 [Stress],
        stress_above: Spin [Stress],
    }
);
record!(
    /// A level of the grid (`shaders/neighbours/grid.wgsl`).
    Level { inverse_cell: DVec3 [InverseLength], radius: f64 [Length], cells: UVec3, first_cell: u32, strip: u32 }
);
record!(
    /// What the device tells the host once per chunk.
    Counters {
        entries_needed: u32,
        steps_done: u32,
        max_displacement: u32,
        max_coordinate: u32,
        lost_body: u32,
        active_contacts: u32,
        restored_contacts: u32,
        unlisted: u32,
        deep_overlaps: u32,
        narrow_cell: u32,
    }
);
record!(
    /// A row of the measurement (`shaders/measure/measure.wgsl`).
    PartialSums {
        kinetic: f64 [Energy],
        potential: f64 [Energy],
        elastic: f64 [Energy],
        net_force: f64 [Force],
        contact_force: f64 [Force],
        dissipation: f64 [Power],
        sliding: f64 [Power],
        wall_power: f64 [Power],
        fixed_power: f64 [Power],
        growth_power: f64 [Power],
        overlap: f64,
        sides: u32,
        single_sides: u32,
        virial: DVec3 [Energy],
        virial_above: Spin [Energy],
        flux: DVec3 [Energy],
        flux_above: Spin [Energy],
        stiffness: f64 [Energy],
    }
);
record!(
    /// What grains do to a wall (`shaders/measure/sums.wgsl`).
    WallLoad { force: DVec3 [Force], moment: Spin [Torque], normal_force: f64 [Force], stiffness: f64 [Stiffness] }
);
record!(
    /// Dissipation and works since the host has read them (`shaders/measure/sums.wgsl`).
    Works {
        dissipated: f64 [Energy],
        walls: f64 [Energy],
        fixed: f64 [Energy],
        cell: f64 [Energy],
        growth: f64 [Energy],
    }
);
record!(
    /// A contact of a step of contact dynamics (this and the next: `shaders/nscd/contact.wgsl`).
    ContactGeometry { n: DVec3, speed: f64 [Velocity] }
);
record!(
    /// What an impulse does to the two of a contact.
    InverseEffectiveMass {
        arm: f64 [Length],
        arm_to: f64 [Length],
        normal: f64 [InverseMass],
        tangential: f64 [InverseMass],
    }
);
record!(
    /// Sums of a group of grains.
    ResidualSums {
        reference: f64 [VelocitySquared],
        lipschitz_bound: f64,
        residual_squared: f64 [VelocitySquared],
        restart_criterion: f64 [Energy],
        curvature: f64 [Energy],
        step_squared: f64 [Energy],
        largest_residual: f64,
        resolved_residual: f64,
        max_normal_impulse: f64 [Impulse],
        coulomb_excess: f64 [Impulse],
        late_contacts: u32,
    }
);
record!(
    /// The colour of a contact (this and the next four: `shaders/nscd/coloring/priority.wgsl`).
    ContactColor { color: u32, rank: u32 }
);
record!(
    /// A contact in the order of the colours.
    ColoredContact { first: u32, second: u32, entry: u32, back: u32 }
);
record!(
    /// How far a pass is.
    ColorCursor { colors: u32, contacts: u32 }
);
record!(
    /// How far the colouring is.
    ColoringState { uncolored: u32, colors: u32, contacts: u32 }
);
record!(
    /// Contacts of a grain that have no colour.
    LargeContacts { small: u32, heavy: u32 }
);
record!(
    /// How hard the iterations for the rotation of clumps had to work (`shaders/body/grains/clumps.wgsl`).
    RotationIterations { most: u32, capped: u32 }
);
record!(
    /// What every kernel may know.
    Params {
        gravity: DVec3 [Acceleration],
        lower: DVec3 [Length],
        upper: DVec3 [Length],
        period: DVec3 [Length],
        period_low: DVec3 [Length],
        inverse_period: DVec3 [InverseLength],
        cell_origin: DVec3 [Length],
        narrowest: f64 [Length],
        stress: DVec3 [Stress],
        stress_above: Spin [Stress],
        controlled: DVec3,
        controlled_above: Spin,
        servo_time: f64 [Time],
        servo_recall: f64,
        servo_band: f64 [Stress],
        most_rate: f64 [Rate],
        least_rigidity: f64 [Viscosity],
        dt: f64 [Time],
        history_dt: f64 [Time],
        damping: f64 [Rate],
        reach: f64 [Length],
        margin: f64 [Length],
        quantum: f64 [Length],
        inverse_quantum: f64 [InverseLength],
        position_slack: f64 [Length],
        length_unit: f64 [Length],
        inverse_length_unit: f64 [InverseLength],
        arm_unit: f64 [Length],
        inverse_arm_unit: f64 [InverseLength],
        step_limit: f64 [Length],
        displacement_limit: f64 [Length],
        tolerance: f64,
        load_fraction: f64,
        load_rounding: f64,
        max_momentum: f64,
        max_correction_velocity: f64 [Velocity],
        wall_depth: f64 [Length],
        deep_overlap: f64,
        turn_limit: f64,
        gap_band: f64 [Length],
        pair: Pair,
        axes: UVec3,
        cells: u32,
        levels: u32,
        bodies: u32,
        large: u32,
        slice_shift: u32,
        clumps: u32,
        arm_shift: u32,
        arm_shift_fine: u32,
        walls: u32,
        materials: u32,
        partial_sums_len: u32,
        entries: u32,
        history: u32,
        colors: u32,
        servo_steps: u32,
        step: u32,
    }
);

impl Params {
    /// As a device in single precision sees them.
    pub fn rounded(&self, dims: usize, units: &Units) -> Params {
        let quantities = Params::quantities(Quantity::Number, dims);
        let lanes = self.lanes(dims).into_iter().zip(quantities);
        // Counts may be more than f32 has digits for.
        let mut lanes = lanes.map(|(x, q)| if x == x.trunc() && x.abs() < 4.3e9 { x } else { units.rounded(q, x) });
        Params::take(dims, &mut || lanes.next().expect("as many lanes as were put"))
    }
}
