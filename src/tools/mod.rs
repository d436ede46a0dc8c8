//! Rigid tools: bodies without elements, which press on the contact points of yarns and threads.
//!
//! The distance of a point from a tool is a function of `shape`, so tools need no search. Every step `touch` applies the forces on
//! the points, the gradient of the penalty energy ½ k δ² of their depths δ, with the damping and friction of contact between
//! bodies, and notes what each point does to each tool. These notes are summed in a fixed order, and `motion` moves the tools: along
//! with the schedule, or by the forces on them.

pub mod motion;
pub mod shape;
pub mod touch;
