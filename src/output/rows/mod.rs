//! One type for each table of a run: its fields are the columns, with their names, in their order.
//!
//! Writing and reading go through the same type, so that a column has its place in the program once. Tables whose columns
//! depend on the scene (`energies.csv`, `probes.csv`) have none; they are [`Named`](super::table::Named).

mod contacts;
mod crossings;
mod history;
mod reactions;
mod shear;
mod stitches;
mod stress;
mod yarns;
mod yarns_each;
mod zones;

pub use contacts::Contacts;
pub use crossings::Crossing;
pub use history::History;
pub use reactions::Reaction;
pub use shear::Shear;
pub use stitches::Stitches;
pub use stress::Stress;
pub use yarns::Yarns;
pub use yarns_each::Yarn;
pub use zones::Zones;

use super::table::text;
use serde::Serializer;

/// How fields that are f64 are written; `serde_with::apply` gives it to all of them.
pub(crate) fn number<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&text(*value))
}
