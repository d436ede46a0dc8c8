//! Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.

pub mod case;
pub mod error;
pub mod measure;
pub mod mesh;
pub mod output;
