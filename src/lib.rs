//! Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.
//!
//! # What is solved
//! Yarns are hexahedra with a fibre-bundle law, stitching threads are chains of beams, and all bodies may come into contact. In a
//! periodic cell the deformation gradient F̄(t) of the fabric is prescribed, except for the stretches of its two fibre directions
//! where they follow a membrane force. The unknown is the fluctuation w:
//!
//! ```text
//! x = F̄ X + w,   w periodic                                positions (w = displacement in a free scene, F̄ = I)
//! M ẅ = −∫ P(F) : ∇N dV + f_thread + f_contact − α M ẇ      motion, integrated by central differences
//! P = ∂W/∂F,   W = elongation + compaction + distortion + longitudinal shear        yarns (Charmetant et al.)
//! N = EA (l/L₀ − 1 − ε_th),   E_bend = (2 EI/l̄)(tan θ/2 − T₀)²                      threads
//! f_contact = −∂Ψ/∂x,   |f_t| ≤ μ f_n with true stick                               contact: penalty energy Ψ of depths
//! P̄ = (1/V) ∂W/∂F̄ by virtual power,   F_nor = dW_ext/dγ / (A₀ cos γ)                what is measured
//! ```
//!
//! Fibres are so stiff that their axial waves would limit the time step. Selective mass scaling raises this limit: along each
//! *fibre line* (a row of yarn nodes along the fibre, or a thread) the lumped mass matrix gains β dt² Σ k b bᵀ, which changes
//! neither statics nor rigid motion. It costs one tridiagonal solve per line and step.
//!
//! # How data flow
//! ```text
//! case.json ─► case ─► rigs/<rig> ─► Scene ─► plan ──────► backend ◄── schedule      the engine knows no JSON and no rig
//!  what the     typed,  fabric →      bodies,  buffers and  runs        loads in
//!  user wrote   checked geometry,     motions, stages: the  stages,     time
//!                       clamps, ties  steps    algorithm    knows no
//!                                              as data      physics
//!                       rig.observer ◄──── simulate: the loop in time ────► measure ─► output: vtu, csv, png, json, page
//!               └────────── run: one case from end to end; study: many runs ──────────┘
//! ```
//! Elements write forces on their own corners only, and every node gathers them in a fixed order. Contact pairs change, so
//! contact forces are summed as integers: any order gives the same bits. A case therefore gives the same result on any number of
//! threads.
//!
//! # Where things are
//! | module | what it holds |
//! |---|---|
//! | [`error`] | the one error type: every message names its culprit |
//! | [`kernel`] | shared by all backends: lanes and pairs of registers, elementary functions, positions in quanta, buffers, work space, kernel interfaces, stages, the text of shaders |
//! | [`settings`] | effects, load steps, integration, laws, tools: plain structs with their JSON form |
//! | [`mesh`] | nodes, blocks of hexahedra, threads, frames (deformed states), surfaces, closed solids, quality |
//! | [`materials`] | constitutive laws: energy, first Piola–Kirchhoff stress, stiffness |
//! | [`elements`] | hexahedra, beams, bending between beams |
//! | [`contact`] | search and forces: points on closed surfaces, lines on lines, friction |
//! | [`dynamics`] | assembly, fibre lines, integration, limit of the time step |
//! | [`tools`] | rigid tools: shapes as signed distances, forces on points, motion |
//! | [`conditions`] | prescribed motion |
//! | [`scene`] | the complete input of the solver, independent of the case file |
//! | [`plan`] | the scene as buffers and stages: the algorithm as data |
//! | [`backend`] | runs stages: the CPU, with threads and registers of any width; a GPU, with the WGSL twins of the kernels |
//! | [`measure`] | widths, thicknesses, gaps, crossings, tensions, shear force |
//! | [`schedule`] | load steps as smooth functions of time |
//! | [`simulate`] | a scene in time: steps, contact searches, energies, guards |
//! | [`case`] | user input: typed JSON with units, ranges, defaults, schema and overrides |
//! | [`fabric`] | geometry from the parameters of a fabric: yarn sections, the path of the stitch, a cell, a cut piece |
//! | [`output`] | frames, tables, maps, pictures, pages, checkpoints |
//! | [`rigs`] | test rigs: cell, bias extension, picture frame, compaction, pull-out, friction, thread, yarn, inline mesh; what each checks, builds, measures and reports |
//! | [`run`] | a case with its files, as the program runs it |
//! | [`study`] | many runs at once: the tests of a fabric, tables over a folder of scenes, how results differ, what accuracy costs |
//!
//! Imports point one way: a module uses only the modules before it in this list (`tests/program/structure.rs` checks it).
//! ```text
//! error kernel settings mesh materials elements contact dynamics tools conditions scene plan backend measure schedule simulate case fabric output rigs run study
//! ```
//! Moreover, the backend uses only `error` and `kernel`, and `output` does not use `measure`.
//!
//! # From Rust
//! `examples/cell.rs` shears a cell and prints its force; a [`scene::Scene`] may also be made by hand:
//! ```
//! use tricot::prelude::*;
//!
//! // a thread of 10 mm that swings once it is let go: 11 nodes, 100 N, held at both ends
//! let case = read_value(serde_json::json!({
//!     "title": "a string",
//!     "domain": { "mesh": { "threads": [{
//!         "name": "string", "nodes": (0..=10).map(|x| [f64::from(x), 0.0, 0.0]).collect::<Vec<_>>(),
//!         "radius_mm": 0.1, "axial_n": 100, "linear_density_tex": 10
//!     }], "conditions": [{ "within": [[0, 0, 0], [0, 0, 0]] }, { "within": [[10, 0, 0], [10, 0, 0]] }] } },
//!     "effects": { "contact": null, "damping": null, "gravity_mm_s2": [0, 0, -9810] },
//!     "steps": [{ "hold": { "time_s": 1e-4 } }]
//! }))?;
//! let mut string = Simulation::new(scene(&case)?, BackendConfig { precision: Precision::F64, ..BackendConfig::default() })?;
//! string.advance(1e-4, |_| false)?;
//! let fallen = string.fluctuations()[5][2];
//! assert!((fallen + 0.5 * 9810.0 * 1e-8).abs() < 1e-2 * fallen.abs());
//! # Ok::<(), tricot::error::Error>(())
//! ```
//!
//! # Where to add
//! - **A material**: a file in `materials` with `impl Material` and its twin under `shaders`, an arm in `materials::Law` and in
//!   [`settings::material::Material`]. The tests of `materials` compare its stress with differences of its energy.
//! - **An element**: a kernel in `elements` and its twin, its tables and a stage in `plan`, its slots in [`dynamics::assemble`].
//! - **A buffer or a constant of a kernel**: a slot among its `SLOTS`, which the plan binds by name, or a constant among those of its
//!   shader. The twin gets both from there, see [`kernel::interface`].
//! - **A contact law**: beside `contact::friction`; it sees one pair with its state and returns a force.
//! - **A shape of tools**: its distance in [`tools::shape`] and its twin, its numbers in `plan::tools`, its JSON in [`settings::tool::Shape`].
//! - **An effect**: a flag in [`plan::Active`] that says what in a case calls for it, a const flag of the kernels it changes and the same
//!   name for `#if` in their twins, a name and how to turn it off in [`run::effects`], a scene with and without it in `tests/physics/effects.rs`.
//! - **A measure**: a file in `measure`, from [`mesh::Mesh`] and [`mesh::frame::Frame`]; a column in [`output::rows`].
//! - **A test rig**: a folder in [`rigs`] with `impl Rig`, its piece of fabric in [`case::domain`], an arm in [`rigs::of`] and [`rigs::of_mut`].
//! - **A test of a characterisation**: a row in `study::characterise::parts`.
//! - **A knob of accuracy**: a row in [`study::accuracy::variations`].
//! - **A scene**: a JSON file in `cases/`. `tricot schema` lists every field.

pub mod backend;
pub mod case;
pub mod conditions;
pub mod contact;
pub mod dynamics;
pub mod elements;
pub mod error;
pub mod fabric;
pub mod kernel;
pub mod materials;
pub mod measure;
pub mod mesh;
pub mod output;
pub mod plan;
pub mod rigs;
#[cfg(feature = "cli")]
pub mod run;
pub mod scene;
pub mod schedule;
pub mod settings;
pub mod simulate;
#[cfg(feature = "cli")]
pub mod study;
pub mod tools;

/// The types that users of the library need most.
pub mod prelude {
    pub use crate::case::Case;
    pub use crate::case::fabric::Fabric;
    pub use crate::error::{Error, Result};
    pub use crate::measure::shear::CellCurve;
    pub use crate::measure::{stitches, yarns};
    pub use crate::mesh::frame::Frame;
    pub use crate::mesh::{Block, Mesh, Thread};
    pub use crate::rigs::read::{read, read_value};
    pub use crate::rigs::scene;
    pub use crate::scene::{Motion, Scene, Tie};
    pub use crate::settings::effects::Effects;
    pub use crate::settings::integration::{Integration, Precision};
    pub use crate::settings::material::Material;
    pub use crate::settings::steps::Step;
    pub use crate::simulate::{BackendConfig, Energies, Health, Simulation};
}
