//! Lines of nodes: the units of the chain from forces to motion.

use super::Tables;
use crate::dynamics::fibre_lines::{CLOSED, FREE, Line, OPEN};
use crate::kernel::position::quanta;
use crate::kernel::shader::WORKGROUP;
use crate::mesh::Mesh;
use crate::settings::effects::FibreLines;
use std::sync::Arc;

/// The items of each line in the stages of the chain.
pub(super) struct Units {
    pub nodes: Arc<[usize]>,
    pub lines: Arc<[usize]>,
    /// Prescribed nodes.
    pub conditions: Arc<[usize]>,
}

impl Units {
    pub fn new(t: &Tables) -> Self {
        let nodes: Vec<usize> = std::iter::once(0).chain(t.lines.iter().map(|line| line.nodes().end)).collect();
        let held: Vec<usize> = t.conditions.nodes.chunks_exact(2).map(|condition| condition[0] as usize).collect();
        assert!(held.is_sorted(), "conditions are in the order of their nodes");
        Self {
            conditions: nodes.iter().map(|first| held.partition_point(|node| node < first)).collect(),
            lines: (0..nodes.len()).collect(),
            nodes: nodes.into(),
        }
    }
}

/// Lines of consecutive nodes in the order of their nodes, each node on one: fibres and threads, if the scene has fibre lines, and
/// between them free lines of a workgroup's length.
pub(super) fn lines(mesh: &Mesh, chosen: Option<&FibreLines>) -> Vec<Line> {
    let period = mesh.period.unwrap_or_default().map(quanta);
    let line = |first: usize, stations: usize, wrap: Option<[i32; 2]>| Line {
        first: first as u32,
        stations: stations as u32,
        kind: if wrap.is_some() { CLOSED } else { OPEN },
        shift: wrap.map_or([0; 2], |[x, y]| [x * period[0], y * period[1]]),
    };
    let blocks = mesh.blocks.iter().filter(|_| chosen.is_some());
    let fibres = blocks.flat_map(|b| (0..b.lines()).map(|i| line(b.first + i * b.stations(), b.stations(), b.wrap)));
    let threads = mesh.threads.iter().filter(|_| chosen.is_some_and(|lines| lines.threads));
    let threads = threads.map(|thread| line(thread.first, thread.count, thread.wrap));
    // a closed line of two nodes has two segments between the same nodes: its fibres stay explicit
    let are_fibres = |line: &Line| line.stations >= 2 + u32::from(line.kind == CLOSED);
    let mut found: Vec<Line> = fibres.chain(threads).filter(are_fibres).collect();
    found.sort_unstable_by_key(|line| line.first);
    let mut all = Vec::new();
    let mut next = 0;
    let end = line(mesh.nodes.len(), 0, None);
    for line in found.into_iter().chain([end]) {
        while next < line.first {
            let stations = (line.first - next).min(WORKGROUP as u32);
            all.push(Line { first: next, stations, kind: FREE, shift: [0; 2] });
            next += stations;
        }
        if line.stations > 0 {
            next = line.nodes().end as u32;
            all.push(line);
        }
    }
    all
}
