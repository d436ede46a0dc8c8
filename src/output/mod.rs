//! What a run leaves on disk: frames for ParaView, tables and pictures. Everything is written from a [`Mesh`](crate::mesh::Mesh)
//! and a [`Frame`](crate::mesh::frame::Frame) or from plain numbers; nothing here computes a result.
//!
//! - [`vtu`]: frames and their collection, [`vtu_read`] reads them back; [`map`]: points with values;
//! - [`table`]: CSV files, each a file that is [`appended`] to; [`rows`]: the types of their rows; [`columns`] reads them back;
//! - [`picture`] renders a frame: [`scene`] turns it into triangles, [`raster`] draws those into a depth buffer and lights
//!   them, [`image`] holds pixels, with letters from [`text`] and colours from [`colour`];
//! - [`page`]: a page of HTML that stands by itself, with charts from [`chart`] and [`scatter`];
//! - [`checkpoint`]: the state of a run in one file, to go on from;
//! - [`directory`]: where results go, one run at a time by its [`lock`];
//! - [`mod@file`]: how a file is replaced as a whole or not at all.

pub mod appended;
pub mod chart;
pub mod checkpoint;
pub mod colour;
pub mod columns;
pub mod directory;
pub mod file;
#[cfg(feature = "cli")]
pub mod image;
pub mod lock;
pub mod map;
pub mod page;
#[cfg(feature = "cli")]
pub mod picture;
#[cfg(feature = "cli")]
pub mod raster;
pub mod results;
pub mod rows;
pub mod scatter;
#[cfg(feature = "cli")]
pub mod scene;
pub mod table;
#[cfg(feature = "cli")]
pub mod text;
pub mod vtu;
pub mod vtu_read;
