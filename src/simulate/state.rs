//! The state of a scene on the host: positions, velocities, forces, fields for pictures, and its hash.

use super::Simulation;
use crate::contact::{EMPTY, candidates, memory};
use crate::elements::LANES;
use crate::kernel::buffer::Buffer;
use crate::kernel::position::{QUANTUM, quanta};
use crate::mesh::frame::{Field, Frame};
use crate::settings::integration::Precision;
use std::hash::Hasher;

impl Simulation {
    /// Brings to the host what rows of tables are measured from, with one wait for a device.
    pub fn bring_row(&mut self) {
        let b = &self.model.buffers;
        let all = [Some(b.quanta), Some(b.remainder), b.beam_tension, b.reaction].into_iter().flatten();
        self.backend.bring(&all.chain(self.tool_buffers()).collect::<Vec<_>>());
    }

    /// Brings to the host what a [`frame`](Self::frame) consists of, with one wait for a device.
    pub fn bring_frame(&mut self) {
        let b = &self.model.buffers;
        let faces = b.faces.iter().flatten().flat_map(|faces| [faces.keys, faces.touches]);
        let of_nodes = [b.quanta, b.remainder, b.velocity];
        let fields = [b.hex_energy, b.beam_tension].into_iter().chain(b.slip).flatten();
        self.backend
            .bring(&of_nodes.into_iter().chain(fields).chain(faces).chain(self.tool_buffers()).collect::<Vec<_>>());
    }

    /// Axial force of each beam, N.
    pub fn tensions(&self) -> Vec<f64> {
        self.model.buffers.beam_tension.map_or_else(Vec::new, |b| self.backend.scalars(b))
    }

    /// Displacement of every node relative to F̄X, mm.
    pub fn fluctuations(&self) -> Vec<[f64; 3]> {
        let nodes = self.scene.mesh.nodes.len();
        let quanta = self.backend.ints(self.model.buffers.quanta);
        let remainder = self.backend.scalars(self.model.buffers.remainder);
        (0..nodes)
            .map(|n| [0, 1, 2].map(|k| f64::from(quanta[n + k * nodes]) * QUANTUM + remainder[n + k * nodes]))
            .collect()
    }

    /// Velocity of every node (of the fluctuation in a periodic cell), mm/s.
    pub fn velocities(&self) -> Vec<[f64; 3]> {
        let nodes = self.scene.mesh.nodes.len();
        let v = self.backend.scalars(self.model.buffers.velocity);
        (0..nodes).map(|n| [0, 1, 2].map(|k| v[n + k * nodes])).collect()
    }

    /// Replaces the velocity of every node, mm/s.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        let planes: [Vec<f64>; 3] = [0, 1, 2].map(|k| velocities.iter().map(|v| v[k]).collect());
        self.backend.set_scalars(self.model.buffers.velocity, &planes.concat());
    }

    /// Replaces the displacement of every node relative to F̄X, mm. The contact history is kept.
    pub fn set_fluctuations(&mut self, displacements: &[[f64; 3]]) {
        let planes: [Vec<f64>; 3] = [0, 1, 2].map(|k| displacements.iter().map(|w| w[k]).collect());
        let planes = planes.concat();
        let whole: Vec<i32> = match self.config.precision {
            Precision::F32 => planes.iter().map(|w| quanta(*w)).collect(),
            Precision::F64 => vec![0; planes.len()],
        };
        let rest: Vec<f64> = planes.iter().zip(&whole).map(|(w, q)| w - f64::from(*q) * QUANTUM).collect();
        self.backend.set_bytes(self.model.buffers.quanta, bytemuck::cast_slice(&whole));
        self.backend.set_scalars(self.model.buffers.remainder, &rest);
    }

    /// Nodes with prescribed components.
    pub fn prescribed_nodes(&self) -> Vec<usize> {
        let Some(buffer) = self.model.buffers.prescribed else { return Vec::new() };
        self.backend.uints(buffer).chunks_exact(2).map(|condition| condition[0] as usize).collect()
    }

    /// Force of the scene on the prescribed components of each of these nodes in the last step, N.
    pub fn reactions(&self) -> Vec<[f64; 3]> {
        self.model
            .buffers
            .reaction
            .map_or_else(Vec::new, |b| self.backend.scalars(b).chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect())
    }

    /// Largest prescribed displacement now, mm.
    pub fn displacement(&self) -> f64 {
        self.load().motion * self.scene.reach()
    }

    /// The deformed state without fields, as measures need it.
    pub fn shape(&self) -> Frame {
        let gradient = self.row(self.time, 1.0, 1.0).gradient;
        let f = [[1.0 + gradient[0][0], gradient[0][1]], [gradient[1][0], 1.0 + gradient[1][1]]];
        let positions = self
            .scene
            .mesh
            .nodes
            .iter()
            .zip(self.fluctuations())
            .map(|(x, w)| [f[0][0] * x[0] + f[0][1] * x[1] + w[0], f[1][0] * x[0] + f[1][1] * x[1] + w[1], x[2] + w[2]])
            .collect();
        Frame {
            time: self.time,
            angle_deg: self.load().angle.to_degrees(),
            displacement_mm: self.displacement(),
            gradient: f,
            positions,
            ..Frame::default()
        }
    }

    /// The deformed state, with the fields that pictures and ParaView show.
    pub fn frame(&self) -> Frame {
        let mut frame = self.shape();
        frame.hex_fields = self.hex_fields(&frame);
        frame.node_fields = self.contact_fields();
        let field = |name: &str, components, values| Field { name: name.into(), components, values };
        frame.node_fields.push(field("velocity_mm_s", 3, self.velocities().concat()));
        if !self.scene.mesh.threads.is_empty() {
            frame.beam_fields = vec![field("tension_n", 1, self.tensions())];
        }
        frame
    }

    /// Energy density by mode, smallest det F, and fibre stretch of each hexahedron.
    pub(super) fn hex_fields(&self, frame: &Frame) -> Vec<Field> {
        let Some(energy) = self.model.buffers.hex_energy else { return Vec::new() };
        let values = self.backend.scalars(energy);
        let names = [
            "elongation_energy_mpa",
            "compaction_energy_mpa",
            "distortion_energy_mpa",
            "shear_energy_mpa",
            "min_jacobian",
        ];
        let mut fields: Vec<Field> = names
            .iter()
            .enumerate()
            .map(|(mode, name)| {
                let density = self.model.hex_place.iter().zip(&self.model.hex_volume).map(|((block, lane), volume)| {
                    values[(block * 5 + mode) * LANES + lane] / if mode < 4 { *volume } else { 1.0 }
                });
                Field { name: (*name).into(), components: 1, values: density.collect() }
            })
            .collect();
        let mut stretches = Vec::with_capacity(self.scene.mesh.hexes());
        let length = |a: [f64; 3], b: [f64; 3]| libm::sqrt((0..3).map(|k| (b[k] - a[k]) * (b[k] - a[k])).sum());
        for block in &self.scene.mesh.blocks {
            for layer in 0..block.layers {
                for column in 0..block.columns {
                    for slice in 0..block.slices {
                        let c = block.corners(slice, column, layer);
                        let edges = [(0, 1), (3, 2), (4, 5), (7, 6)];
                        let stretch = edges.map(|(a, b)| {
                            let now =
                                length(frame.position(&self.scene.mesh, c[a]), frame.position(&self.scene.mesh, c[b]));
                            now / length(self.scene.mesh.position(c[a]), self.scene.mesh.position(c[b]))
                        });
                        stretches.push(stretch.iter().sum::<f64>() / 4.0);
                    }
                }
            }
        }
        fields.push(Field { name: "fibre_stretch".into(), components: 1, values: stretches });
        fields
    }

    /// Normal force, pressure on yarn surfaces and, with friction, slip of contact points, distributed to their nodes.
    pub(super) fn contact_fields(&self) -> Vec<Field> {
        let b = &self.model.buffers;
        let nodes = self.scene.mesh.nodes.len();
        let (mut force, mut pressure, mut slip) = (vec![0.0; nodes], vec![0.0; nodes], vec![0.0; nodes]);
        let mut measure = vec![0.0; nodes];
        for (kind, faces) in b.faces.iter().enumerate() {
            let Some(faces) = faces else { continue };
            let (keys, touches) = (self.backend.uints(faces.keys), self.backend.scalars(faces.touches));
            let slipped = b.slip[kind].map(|b| self.backend.scalars(b));
            let slots = self.capacity.slots;
            for (item, point) in self.model.points[kind].iter().enumerate() {
                let keys = &keys[item * (candidates::MADE + slots)..][candidates::MADE..][..slots];
                let slots = (0..slots).filter(|slot| keys[*slot] != EMPTY).map(|slot| item * slots + slot);
                let normal: f64 = slots.map(|slot| touches[slot * self.model.touch + memory::NORMAL]).sum();
                for (node, share) in point.nodes.into_iter().zip(point.shares) {
                    force[node] += share * normal;
                    slip[node] += share * point.measure * slipped.as_ref().map_or(0.0, |slipped| slipped[item]);
                    measure[node] += share * point.measure;
                    if kind == 1 && point.measure > 0.0 {
                        pressure[node] += share * normal / point.measure;
                    }
                }
            }
        }
        if b.faces.iter().all(Option::is_none) {
            return Vec::new();
        }
        slip.iter_mut()
            .zip(&measure)
            .filter(|(_, measure)| **measure > 0.0)
            .for_each(|(slip, measure)| *slip /= measure);
        let field = |name: &str, values| Field { name: name.into(), components: 1, values };
        let mut fields = vec![field("contact_force_n", force), field("contact_pressure_mpa", pressure)];
        fields.extend(b.slip.iter().any(Option::is_some).then(|| field("slip_mm", slip)));
        fields
    }

    /// Hash of all persistent buffers and the step number: equal for equal states, bit by bit.
    pub fn state_hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        for (i, description) in self.model.plan.buffers.iter().enumerate() {
            if description.persistent {
                hasher.update(description.name.as_bytes());
                hasher.update(&self.backend.bytes(Buffer(i)));
            }
        }
        hasher.write_u64(self.step);
        hasher.finish()
    }
}
