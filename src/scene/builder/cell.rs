//! The periodic cell.

use crate::scene::schema;

/// How the cell between periodic faces deforms.
#[derive(Clone, Debug, Default)]
pub struct CellBuilder(pub(super) schema::Cell);

/// A component of the strain of a cell: `Xy` is what moves along x with the distance along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    Xx,
    Yy,
    Zz,
    Yz,
    Xz,
    Xy,
}

impl Component {
    pub(super) fn set(self, components: &mut schema::Components, value: f64) {
        let component = match self {
            Component::Xx => &mut components.xx,
            Component::Yy => &mut components.yy,
            Component::Zz => &mut components.zz,
            Component::Yz => &mut components.yz,
            Component::Xz => &mut components.xz,
            Component::Xy => &mut components.xy,
        };
        *component = Some(value);
    }
}

impl CellBuilder {
    /// A cell that keeps its form.
    pub fn new() -> CellBuilder {
        CellBuilder::default()
    }

    /// Rate of a component of its strain, 1/s. Default: 0.
    #[must_use]
    pub fn strain_rate(mut self, component: Component, rate: f64) -> Self {
        component.set(&mut self.0.strain_rate, rate);
        self
    }

    /// Target of a component of the stress, Pa (in two dimensions N/m), to which a servo brings it; compression is
    /// positive.
    #[must_use]
    pub fn stress(mut self, component: Component, stress: f64) -> Self {
        component.set(&mut self.0.stress, stress);
        self
    }

    /// Inertial number up to which the servo goes. Default: 1e-3.
    #[must_use]
    pub fn inertial_number(mut self, number: f64) -> Self {
        self.0.inertial_number = Some(number);
        self
    }

    /// Part of a missing stress that the servo adds in a step, in (0, 1]. Default: 3e-3.
    #[must_use]
    pub fn gain(mut self, gain: f64) -> Self {
        self.0.gain = Some(gain);
        self
    }
}
