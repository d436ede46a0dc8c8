//! Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.

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
pub mod run;
pub mod schedule;
pub mod simulate;
