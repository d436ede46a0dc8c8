//! The simulated piece of fabric and its mesh resolution.

mod constituents;
mod inline;
mod pieces;
mod resolution;

pub use constituents::{Cantilever, OnePly, Sides, ThreadTension, YarnCompaction, YarnShear};
pub use inline::{Condition, InlineBlock, InlineMesh, InlineThread};
pub use pieces::{
    Cell, CellCompaction, Clamps, FrameClamps, PictureFrame, PullOut, Specimen, ThreadEnds, ToolFriction,
};
pub use resolution::Resolution;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The piece of fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Domain {
    /// A periodic cell of whole repeats: x spans `warps` warp pitches, y spans `wefts` weft pitches.
    Cell(Cell),
    /// A periodic cell, compacted between plates.
    CellCompaction(CellCompaction),
    /// A rectangle cut from the fabric at an angle and pulled: the bias-extension test.
    Specimen(Specimen),
    /// A cross-shaped sample in a hinged frame (Fig. 14).
    PictureFrame(PictureFrame),
    /// A yarn that is pulled out of a rectangle of fabric.
    PullOut(PullOut),
    /// A rectangle of fabric on a plate that slides under it.
    ToolFriction(ToolFriction),
    /// A piece of the stitching thread, pulled along its length (Fig. 10 of the paper).
    ThreadTension(ThreadTension),
    /// A piece of the stitching thread, clamped at one end, that bends under its own weight (Fig. 11).
    Cantilever(Cantilever),
    /// A single yarn, sheared along its fibres by the outermost ones (Fig. 8).
    YarnShear(YarnShear),
    /// A single yarn, compacted between plates.
    YarnCompaction(YarnCompaction),
    /// A mesh written out in the case, for verification scenes.
    Mesh(InlineMesh),
}
