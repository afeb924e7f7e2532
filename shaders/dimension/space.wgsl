// twin: src/laws/dimension.rs
// Dimension slot: spheres in space.
alias Vec = Real3;
alias Spin = Real3;
alias Whole = vec3<i32>;
const DIMENSIONS = 3u;

/// A vector without the padding that arrays of vectors have.
struct Packed {
    x: Real,
    y: Real,
    z: Real,
}

fn packed(v: Vec) -> Packed {
    return Packed(v.x, v.y, v.z);
}

fn unpacked(p: Packed) -> Vec {
    return Vec(p.x, p.y, p.z);
}

/// ω × R, the second term of (2.6).
fn spin_velocity(spin: Spin, arm: Vec) -> Vec {
    return cross(spin, arm);
}

/// R × f, (2.3) and (2.16).
fn moment(arm: Vec, force: Vec) -> Spin {
    return cross(arm, force);
}

/// 1 / (J / m R²): J = 2/5 m R² for a sphere.
const INVERSE_GYRATION: f32 = 2.5;

fn first_axis() -> Vec {
    return Vec(1, 0, 0);
}

/// The two components around the vertical axis.
fn horizontal(x: Vec) -> Real2 {
    return x.xy;
}

fn from_horizontal(x: Real2) -> Vec {
    return Vec(x, 0);
}

fn outside(x: Vec, lower: Vec, upper: Vec) -> bool {
    return !(all(x >= lower) && all(x <= upper));
}

/// Cell of the grid, before wrapping: floor of the scaled position.
fn cell_coordinates(scaled: Vec) -> vec3<i32> {
    return vec3<i32>(floor(scaled));
}

fn spin_dot(a: Spin, b: Spin) -> Real {
    return dot(a, b);
}

fn spin_squared(spin: Spin) -> Real {
    return dot(spin, spin);
}

/// Which of d and -d this is: exactly one of two opposite vectors points backward.
fn backward(d: Vec) -> bool {
    return d.x < 0 || (d.x == 0 && (d.y < 0 || (d.y == 0 && d.z < 0)));
}
