//! Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.

pub mod case;
pub mod error;
pub mod mesh;
pub mod kernel;
pub mod materials; pub mod elements;
pub mod dynamics; pub mod conditions;
pub mod contact;
