//! packstone simulates granular packings: spheres and disks that touch, slide and come to rest, on any GPU that wgpu
//! reaches, with an f64 CPU path that checks every kernel.
//!
//! # A first packing
//!
//! A scene is built in code, or read from a TOML text ([`Scene::load`](scene::Scene::load)); keys, defaults and checks
//! are the same (`docs/scene.md`). All quantities are in SI units. It is validated into an
//! [`Assembly`](scene::Assembly), which a [`Simulation`](simulation::Simulation) advances:
//!
//! ```
//! use packstone::prelude::*;
//!
//! let glass = MaterialBuilder::new(2500.0) // kg/m³
//!     .normal_stiffness(2e3) // N/m
//!     .friction(0.5)
//!     .restitution(0.3);
//! let assembly = Scene::builder(3)
//!     .material("glass", glass)
//!     .wall(WallBuilder::plane("glass", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
//!     .grain(GrainBuilder::new("glass", [0.0, 0.0, 1.2e-3], 1e-3))
//!     .stop_time(0.1)
//!     .assemble()?;
//! let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
//! let mut simulation = Simulation::new(assembly, options)?;
//! simulation.advance((0.1 / simulation.dt()) as u64)?;
//!
//! // At rest the spring carries the weight: overlap = m g / k.
//! let grains = simulation.columns()?;
//! let weight = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-9 * 9.81;
//! assert!((1e-3 - grains.position[0].z - weight / 2e3).abs() < 1e-12);
//! # Ok::<(), packstone::Error>(())
//! ```
//!
//! # Cargo features
//!
//! All are on by default. `cli` is the program `packstone`; `bench` measures errors beside speed, `render` draws
//! pictures, `fclib` reads contact problems from HDF5 files, `socp` solves contact problems, of scenes too, by cone
//! programs. Without any of them all the rest of the simulator is there.
//!
//! # How it is built
//!
//! A scene implies a [`Model`](model::Model): one choice per slot, and nothing that the scene does not need. The model
//! gives a [`Plan`](plan::Plan), the [stages](stage::Stage) of a step in order; every stage is a WGSL kernel beside an
//! f64 twin. An [`Engine`](engine::Engine) runs the plan on a [`State`](state::State), arrays by name. Equation numbers
//! like (2.19) and errata like E7 in the documentation of laws and kernels are those of the theory the project
//! implements: the classic discrete element method of Cundall and Strack, in their sign conventions.
//! Kernels and their twins are for those who read the source, and not listed here. `ARCHITECTURE.md` says what to touch
//! to add a law, a kernel or a scene key.

#[cfg(feature = "bench")]
pub mod bench;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod body;
pub mod check;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod contact;
pub mod container;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod dem;
pub mod engine;
pub mod error;
pub mod gpu;
#[doc(hidden)] // for the program
pub mod input;
pub mod io;
pub mod measure;
pub(crate) mod memory;
pub mod model;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod neighbours;
pub(crate) mod nscd;
pub mod plan;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod plans;
pub mod prelude;
pub mod protocol;
pub(crate) mod record;
#[cfg(feature = "render")]
pub mod render;
pub mod scene;
#[doc(hidden)] // kernels and their twins: for the tests
pub mod shaders;
pub mod simulation;
pub mod solve;
pub(crate) mod space;
pub mod stage;
pub mod state;
pub mod time_step;
pub mod units;

pub use error::{Error, Result};
/// Vectors and quaternions of the interface.
pub use glam;
