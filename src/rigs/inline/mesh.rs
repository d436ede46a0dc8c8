//! Builds the mesh that is written inline in a case.

use crate::case::domain::{InlineBlock, InlineMesh, InlineThread};
use crate::error::{Error, Result};
use crate::fabric::{MOST_NODES, positive, quantised, require};
use crate::mesh::vector::{Vector, norm, sub, unit};
use crate::mesh::{Block, Mesh, Part, Ply, Thread, quality};

/// Builds the blocks and threads of an inline mesh.
pub fn build(inline: &InlineMesh) -> Result<Mesh> {
    let mut mesh = Mesh { friction: inline.friction, tools: inline.tools.clone(), ..Mesh::default() };
    require(!inline.blocks.is_empty() || !inline.threads.is_empty(), "domain.mesh", || {
        "holds neither blocks nor threads".into()
    })?;
    for (i, block) in inline.blocks.iter().enumerate() {
        add_block(&mut mesh, block, &format!("domain.mesh.blocks[{i}]"))?;
    }
    for (i, thread) in inline.threads.iter().enumerate() {
        add_thread(&mut mesh, thread, &format!("domain.mesh.threads[{i}]"))?;
    }
    Ok(mesh)
}

fn add_block(mesh: &mut Mesh, block: &InlineBlock, place: &str) -> Result<()> {
    let [slices, columns, layers] = block.elements;
    let elements = format!("{place}.elements");
    require(block.elements.iter().all(|&n| n >= 1), &elements, || {
        format!("is {:?}, but every number must be at least 1", block.elements)
    })?;
    let count: f64 = block.elements.iter().map(|&n| n as f64 + 1.0).product();
    require(count <= MOST_NODES, &elements, || format!("asks for {count:.1e} nodes, more than {MOST_NODES:.0e}"))?;
    positive(block.density_t_mm3, &format!("{place}.density_t_mm3"))?;
    require(finite(&block.fibre) && norm(block.fibre) > 0.0, &format!("{place}.fibre"), || {
        format!("is {:?}, but must be a direction", block.fibre)
    })?;
    let nodes = match (&block.corners, &block.nodes) {
        (Some(corners), None) => box_nodes(*corners, block.elements),
        (None, Some(nodes)) => nodes.clone(),
        _ => return Err(Error::case(place, "give either corners or nodes")),
    };
    require(nodes.len() as f64 == count, &format!("{place}.nodes"), || {
        format!("holds {} nodes, but elements {:?} need {count}", nodes.len(), block.elements)
    })?;
    require(nodes.iter().all(finite), place, || "its nodes must be finite".into())?;
    let first = mesh.nodes.len();
    mesh.nodes.extend(nodes.into_iter().map(|p| p.map(quantised)));
    let built = Block {
        name: block.name.clone(),
        ply: Ply::Free,
        first,
        slices,
        columns,
        layers,
        wrap: None,
        fibre: unit(block.fibre),
        density: block.density_t_mm3,
        material: block.material.clone(),
        velocity: block.velocity_mm_s,
    };
    let worst = quality::scaled_jacobian(mesh, &built);
    require(worst > 0.0, place, || {
        format!(
            "block `{}` has a hexahedron with a scaled Jacobian of {worst:.3}; slices, columns and layers must be \
             right-handed and span a volume",
            block.name
        )
    })?;
    mesh.blocks.push(built);
    Ok(())
}

fn box_nodes([a, b]: [Vector; 2], [slices, columns, layers]: [usize; 3]) -> Vec<Vector> {
    let at = |axis: usize, i: usize, n: usize| {
        let [low, high] = [a[axis].min(b[axis]), a[axis].max(b[axis])];
        low + (high - low) * i as f64 / n as f64
    };
    let mut nodes = Vec::new();
    for layer in 0..=layers {
        for column in 0..=columns {
            nodes
                .extend((0..=slices).map(|slice| [at(0, slice, slices), at(1, column, columns), at(2, layer, layers)]));
        }
    }
    nodes
}

fn add_thread(mesh: &mut Mesh, thread: &InlineThread, place: &str) -> Result<()> {
    let count = thread.nodes.len();
    require(count >= 2, &format!("{place}.nodes"), || format!("holds {count} nodes, but a thread needs at least 2"))?;
    require(thread.nodes.iter().all(finite), &format!("{place}.nodes"), || "its nodes must be finite".into())?;
    positive(thread.radius_mm, &format!("{place}.radius_mm"))?;
    positive(thread.axial_n, &format!("{place}.axial_n"))?;
    positive(thread.linear_density_tex, &format!("{place}.linear_density_tex"))?;
    let nodes: Vec<Vector> = thread.nodes.iter().map(|p| p.map(quantised)).collect();
    for (i, ends) in nodes.windows(2).enumerate() {
        require(norm(sub(ends[1], ends[0])) > 0.0, &format!("{place}.nodes[{}]", i + 1), || {
            "coincides with the node before it".into()
        })?;
    }
    let closed = thread.is_ring();
    require(!closed || count > 3, &format!("{place}.nodes"), || "closes after two beams, but a ring has three".into())?;
    let (count, beams) = (count - usize::from(closed), count - 1);
    let first = mesh.nodes.len();
    mesh.nodes.extend(&nodes[..count]);
    mesh.threads.push(Thread {
        name: thread.name.clone(),
        first,
        count,
        wrap: closed.then_some([0, 0]),
        radius: thread.radius_mm,
        axial: thread.axial_n,
        bending: thread.bending_n_mm2,
        rest_curvature: thread.rest_curvature,
        linear_density: thread.linear_density_tex * quality::TONNES_PER_MM_OF_TEX,
        thermal_strain: thread.thermal_strain,
        velocity: thread.velocity_mm_s,
        parts: vec![Part::Free; beams],
        excess: vec![0.0; beams],
    });
    Ok(())
}

fn finite(p: &Vector) -> bool {
    p.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::friction::Friction;

    fn block(json: &str) -> Result<Mesh> {
        let base =
            r#""name": "b", "density_t_mm3": 1e-9, "material": { "neo_hookean": { "young_mpa": 1, "poisson": 0.3 } }"#;
        let block = serde_json::from_str(&format!("{{ {base}, {json} }}")).unwrap();
        build(&InlineMesh {
            blocks: vec![block],
            threads: vec![],
            friction: Friction::default(),
            conditions: vec![],
            tools: vec![],
        })
    }

    #[test]
    fn a_box_has_its_nodes_slices_first() {
        let mesh = block(r#""elements": [2, 1, 1], "corners": [[2, 1, 0], [0, 0, 1]]"#).unwrap();
        assert_eq!(mesh.nodes.len(), 12);
        assert_eq!(mesh.nodes[1], [1.0, 0.0, 0.0]);
        assert_eq!(mesh.nodes[3], [0.0, 1.0, 0.0]);
        assert!((quality::volume(&mesh, &mesh.blocks[0]) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_meshed_is_refused_with_its_place() {
        for (json, word) in [
            (r#""elements": [2, 1, 1]"#, "either corners or nodes"),
            (r#""elements": [0, 1, 1], "corners": [[2, 1, 0], [0, 0, 1]]"#, "elements"),
            (r#""elements": [1, 1, 1], "nodes": [[0, 0, 0]]"#, "need 8"),
            (r#""elements": [1, 1, 1], "corners": [[0, 0, 0], [1, 1, 0]]"#, "Jacobian"),
            (r#""elements": [1, 1, 1], "corners": [[0, 0, 0], [1, 1, 1]], "fibre": [0, 0, 0]"#, "fibre"),
        ] {
            let message = block(json).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("domain.mesh.blocks[0]"), "{message}");
        }
    }

    #[test]
    fn a_thread_with_coincident_nodes_is_refused() {
        let thread = r#"{ "name": "t", "nodes": [[0, 0, 0], [0, 0, 0]], "radius_mm": 0.1, "axial_n": 1, "linear_density_tex": 1 }"#;
        let inline = InlineMesh {
            blocks: vec![],
            threads: vec![serde_json::from_str(thread).unwrap()],
            friction: Friction::default(),
            conditions: vec![],
            tools: vec![],
        };
        let message = build(&inline).unwrap_err().to_string();
        assert!(message.contains("threads[0].nodes[1]"), "{message}");
    }
}
