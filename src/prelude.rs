//! What a first packing needs: `use packstone::prelude::*;`

pub use crate::{
    Error,
    measure::{Sample, packing_fraction},
    model::Precision,
    scene::{
        Assembly, Face, Format, Grain, Placement, Scene, SceneBuilder, Twist,
        builder::{
            GrainBuilder, GrowthBuilder, InsertionBuilder, MaterialBuilder, Orientation, OutletBuilder, PairBuilder,
            PopulationBuilder, Radii, ShapeBuilder, Side, SolverBuilder, StageBuilder, WallBuilder,
        },
    },
    simulation::{Columns, EngineChoice, Options, Simulation, StageRun},
    solve::{Order, Solver},
};
pub use glam::{DQuat, DVec2, DVec3};
