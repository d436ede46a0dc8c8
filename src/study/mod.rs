//! Many runs at once: tables over a folder of scenes, and how results differ.
//!
//! [`difference`] holds the mathematics of comparing curves, [`results`] reads them from the folder of a run, and [`compare`]
//! compares two folders. [`accuracy`] runs a case many times to measure the cost of accuracy; [`effects`] turns effects off one
//! by one.

pub mod accuracy;
pub mod characterise;
pub mod compare;
pub mod difference;
pub mod effects;
pub mod results;
pub mod scene;
pub mod stability;
pub mod step;
