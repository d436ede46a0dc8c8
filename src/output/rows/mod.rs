//! Row types of the tables of a run: the fields of a type are the columns, by name and in order.
//!
//! Writing and reading use the same type, so each column is declared once. Tables whose columns depend on the scene
//! (`energies.csv`, `probes.csv`) have no row type; they are [`Named`](super::table::Named).

mod cantilever;
mod compaction;
mod contacts;
mod crossings;
mod frame;
mod history;
mod plates;
mod reactions;
mod shear;
mod stitches;
mod stress;
mod tools;
mod yarns;
mod yarns_each;
mod zones;

pub use cantilever::Cantilever;
pub use compaction::Compaction;
pub use contacts::Contacts;
pub use crossings::Crossing;
pub use frame::PictureFrame;
pub use history::History;
pub use plates::Plates;
pub use reactions::Reaction;
pub use shear::Shear;
pub use stitches::Stitches;
pub use stress::Stress;
pub use tools::Tool;
pub use yarns::Yarns;
pub use yarns_each::Yarn;
pub use zones::Zones;

use super::table::text;
use serde::Serializer;

/// Serialises fields of type f64; `serde_with::apply` applies it to all of them.
pub(crate) fn number<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&text(*value))
}
