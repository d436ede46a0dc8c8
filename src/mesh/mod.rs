//! Nodes, blocks of hexahedra (yarns) and threads of beams. Straight extrusions keep their structure: nodes are numbered
//! along the fibre first, so that the corners of neighbouring hexahedra are contiguous and every fibre line is a range.

use crate::settings::friction::Friction;
use crate::settings::material::Material;
use crate::settings::tool::Tool;

pub mod centre;
pub mod clearance;
pub mod export;
pub mod frame;
pub mod linking;
pub mod quality;
pub mod report;
#[cfg(test)]
pub(crate) mod sample;
pub mod solid;
pub mod surface;
pub mod vector;

/// (ξ, η, ζ) of the eight corners of a hexahedron, in the order of [`Block::corners`].
pub const CORNER_SIGNS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// All discretised bodies in their reference position. Lengths in mm.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Reference positions, mm.
    pub nodes: Vec<[f64; 3]>,
    /// Lengths of the periodic cell along x and y, mm; `None` for a free scene.
    pub period: Option<[f64; 2]>,
    /// Yarns and other solid blocks. Their nodes come before those of threads.
    pub blocks: Vec<Block>,
    /// Threads.
    pub threads: Vec<Thread>,
    /// Coulomb friction coefficient of every contact between yarns and threads.
    pub friction: Friction,
    /// Rigid tools.
    pub tools: Vec<Tool>,
}

/// Which ply a yarn belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ply {
    Warp,
    Weft,
    /// A block of an inline mesh.
    Free,
}

/// A structured block of `slices × columns × layers` hexahedra. Slices follow the fibre (local ξ), columns the width (η),
/// layers the thickness (ζ); (ξ, η, ζ) is right-handed.
#[derive(Debug, Clone)]
pub struct Block {
    pub name: String,
    pub ply: Ply,
    /// First node.
    pub first: usize,
    pub slices: usize,
    pub columns: usize,
    pub layers: usize,
    /// For a yarn that closes on itself through the periodic cell: the image `[i, j]`, in periods, of the slice after the last.
    pub wrap: Option<[i32; 2]>,
    /// Unit fibre direction.
    pub fibre: [f64; 3],
    /// Density, tonne/mm³, chosen to give the areal mass on this mesh.
    pub density: f64,
    pub material: Material,
    /// Initial velocity, mm/s.
    pub velocity: [f64; 3],
}

/// A chain of 2-node beams.
#[derive(Debug, Clone)]
pub struct Thread {
    pub name: String,
    /// First node; nodes are consecutive.
    pub first: usize,
    /// Number of nodes.
    pub count: usize,
    /// For a closed chain: the image `[i, j]`, in periods, of the first node as it follows the last.
    pub wrap: Option<[i32; 2]>,
    /// Contact radius, mm.
    pub radius: f64,
    /// EA, N.
    pub axial: f64,
    /// Bending stiffness, N·mm².
    pub bending: f64,
    /// Share of the generated curvature that is stress-free.
    pub rest_curvature: f64,
    /// Mass per length, tonne/mm (1 tex = 1e-12 tonne/mm).
    pub linear_density: f64,
    /// Thermal strain at full pre-tension.
    pub thermal_strain: f64,
    /// Initial velocity, mm/s.
    pub velocity: [f64; 3],
    /// Which part of the lap each beam belongs to (`beam i` joins nodes i and i + 1).
    pub parts: Vec<Part>,
    /// Arc length that each beam spans as a chord, over the length of the chord, less 1.
    pub excess: Vec<f64>,
}

/// Part of a lap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Loop,
    Underlap,
    /// A thread of an inline mesh.
    Free,
}

/// A node and one of its periodic images, in periods along x and y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    pub node: usize,
    pub image: [i32; 2],
}

impl Mesh {
    /// Position of a node in an image, in the reference configuration, mm.
    pub fn position(&self, seen: Seen) -> [f64; 3] {
        let [x, y, z] = self.nodes[seen.node];
        let [lx, ly] = self.period.unwrap_or_default();
        [x + f64::from(seen.image[0]) * lx, y + f64::from(seen.image[1]) * ly, z]
    }

    /// Arc, mm, within which points of one thread make no contact with each other: half a turn of the tightest bend of a thread,
    /// whose radius is that of the thread and whose inside folds. Points further apart have room for both radii in any wider
    /// bend.
    pub fn self_arc(&self) -> f64 {
        std::f64::consts::PI * self.threads.iter().map(|t| t.radius).fold(0.0, f64::max)
    }

    /// Number of hexahedra.
    pub fn hexes(&self) -> usize {
        self.blocks.iter().map(Block::hexes).sum()
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.threads.iter().map(Thread::beams).sum()
    }

    /// First node that belongs to a thread.
    pub fn first_thread_node(&self) -> usize {
        self.threads.first().map_or(self.nodes.len(), |t| t.first)
    }
}

impl Block {
    /// Number of hexahedra.
    pub fn hexes(&self) -> usize {
        self.slices * self.columns * self.layers
    }

    /// Nodes along one fibre line.
    pub fn stations(&self) -> usize {
        if self.wrap.is_some() { self.slices } else { self.slices + 1 }
    }

    /// Number of fibre lines.
    pub fn lines(&self) -> usize {
        (self.columns + 1) * (self.layers + 1)
    }

    /// Number of nodes.
    pub fn count(&self) -> usize {
        self.lines() * self.stations()
    }

    /// First node of the fibre line at `column` (0 ..= columns) and `layer` (0 ..= layers).
    pub fn line(&self, column: usize, layer: usize) -> usize {
        self.first + (layer * (self.columns + 1) + column) * self.stations()
    }

    /// The node at a slice boundary (0 ..= slices), column and layer boundary; the last slice boundary of a closed yarn
    /// is the first one in the next image.
    pub fn node(&self, slice: usize, column: usize, layer: usize) -> Seen {
        let line = self.line(column, layer);
        match self.wrap {
            Some(image) if slice == self.slices => Seen { node: line, image },
            _ => Seen { node: line + slice, image: [0, 0] },
        }
    }

    /// The eight corners of a hexahedron, in the usual order: ζ = −1 counter-clockwise, then ζ = +1.
    pub fn corners(&self, slice: usize, column: usize, layer: usize) -> [Seen; 8] {
        let at = |i, j, k| self.node(slice + i, column + j, layer + k);
        [at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]
    }
}

impl Thread {
    /// Number of beams.
    pub fn beams(&self) -> usize {
        if self.wrap.is_some() { self.count } else { self.count - 1 }
    }

    /// The two nodes of beam `i`.
    pub fn beam(&self, i: usize) -> [Seen; 2] {
        let here = Seen { node: self.first + i, image: [0, 0] };
        match self.wrap {
            Some(image) if i + 1 == self.count => [here, Seen { node: self.first, image }],
            _ => [here, Seen { node: self.first + i + 1, image: [0, 0] }],
        }
    }
}
