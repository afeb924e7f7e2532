// twin: src/laws/dimension.rs
// Dimension slot: disks of unit thickness in the plane; spin is the one component about z.
alias Vec = Real2;
alias Spin = Real;
alias Whole = vec2<i32>;
const DIMENSIONS = 2u;

/// A vector without the padding that arrays of vectors may have.
struct Packed {
    x: Real,
    y: Real,
}

fn packed(v: Vec) -> Packed {
    return Packed(v.x, v.y);
}

fn unpacked(p: Packed) -> Vec {
    return Vec(p.x, p.y);
}

/// ω × R, the second term of (2.6).
fn spin_velocity(spin: Spin, arm: Vec) -> Vec {
    return spin * Vec(-arm.y, arm.x);
}

/// R × f, (2.3) and (2.16).
fn moment(arm: Vec, force: Vec) -> Spin {
    return arm.x * force.y - arm.y * force.x;
}

/// 1 / (J / m R²): J = 1/2 m R² for a disk.
const INVERSE_GYRATION: f32 = 2.0;

fn first_axis() -> Vec {
    return Vec(1, 0);
}

/// The two components around the vertical axis: all there are.
fn horizontal(x: Vec) -> Real2 {
    return x;
}

fn from_horizontal(x: Real2) -> Vec {
    return x;
}

fn outside(x: Vec, lower: Vec, upper: Vec) -> bool {
    return !(all(x >= lower) && all(x <= upper));
}

/// Cell of the grid, before wrapping: floor of the scaled position. There is one layer of cells.
fn cell_coordinates(scaled: Vec) -> vec3<i32> {
    return vec3<i32>(vec2<i32>(floor(scaled)), 0);
}

fn spin_dot(a: Spin, b: Spin) -> Real {
    return a * b;
}

fn spin_squared(spin: Spin) -> Real {
    return spin * spin;
}

/// Which of d and -d this is: exactly one of two opposite vectors points backward.
fn backward(d: Vec) -> bool {
    return d.x < 0 || (d.x == 0 && d.y < 0);
}
