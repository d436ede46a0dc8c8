//! Common to both backends: scalars and lanes, elementary functions, positions, buffers, stages and plans, records of host state.
//! A kernel is written once over [`lane::Lane`] and runs as f32 or f64, one item or a whole register at a time.

pub mod buffer;
pub mod dispatch;
pub mod exact;
pub mod interface;
pub mod io;
pub mod lane;
pub mod math;
pub mod node;
pub mod position;
pub mod record;
pub mod row;
pub mod scratch;
pub mod shader;
pub mod stage;
pub mod two;
pub mod vector;
