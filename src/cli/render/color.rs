//! What colours of grains show.

use packstone::render::ColorBy;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum, Serialize, Deserialize)]
pub enum Color {
    Radius,
    Speed,
    Id,
    /// A hue for each material
    Material,
    /// Sum of the contact forces on a grain, N
    Force,
    /// Mean pressure in a grain, Pa
    Stress,
    /// Contacts of a grain
    Coordination,
}

impl Color {
    pub fn by(self) -> ColorBy {
        match self {
            Color::Radius => ColorBy::Radius,
            Color::Speed => ColorBy::Speed,
            Color::Id | Color::Material => ColorBy::Id,
            Color::Force | Color::Stress | Color::Coordination => ColorBy::Size,
        }
    }

    pub fn title(self) -> &'static str {
        match self {
            Color::Radius => "radius (m)",
            Color::Speed => "speed (m/s)",
            Color::Id => "number",
            Color::Material => "material",
            Color::Force => "sum of forces (N)",
            Color::Stress => "pressure (Pa)",
            Color::Coordination => "contacts",
        }
    }

    /// Whether it takes contacts.
    pub fn has_contacts(self) -> bool {
        matches!(self, Color::Force | Color::Stress | Color::Coordination)
    }
}
