//! Output files of a run: frames for ParaView, tables and pictures. Everything is written from a [`Mesh`](crate::mesh::Mesh)
//! and a [`Frame`](crate::mesh::frame::Frame) or from plain numbers; nothing here computes results.
//!
//! - [`vtu`]: frames and their collection, [`vtu_read`] reads them back; [`map`]: points with values;
//! - [`table`]: CSV files, each an [`appended`] file; [`rows`]: the types of their rows; [`columns`] reads them back;
//! - [`picture`] renders a frame: [`scene`] turns it into triangles, [`raster`] draws and lights them with a depth buffer,
//!   [`image`] holds pixels, with letters from [`text`] and colours from [`colour`];
//! - [`page`]: a self-contained HTML page, with charts from [`chart`] and [`scatter`];
//! - [`checkpoint`]: the state of a run in one file, from which it can resume;
//! - [`directory`]: results folders, each limited to one run at a time by its [`lock`];
//! - [`mod@file`]: atomic replacement of a file.

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
