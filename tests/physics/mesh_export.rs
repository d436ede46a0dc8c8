//! The mesh as an input file for Abaqus: every element in its true shape, sets by name, periodic pairs.

use super::geometry::paper_mesh;
use std::collections::HashMap;
use tricot::mesh::export;
use tricot::mesh::vector::{norm, sub};

#[test]
fn the_abaqus_file_holds_every_element_in_its_true_shape() {
    let mesh = paper_mesh();
    let mut text = Vec::new();
    export::inp(&mesh, &[], &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let mut nodes = HashMap::new();
    let mut elements = Vec::new();
    let mut keyword = "";
    for line in text.lines().filter(|l| !l.starts_with("**")) {
        if line.starts_with('*') {
            keyword = line;
            continue;
        }
        // CalculiX reads no longer ones
        assert!(keyword == "*HEADING" || line.split(',').all(|number| number.trim().len() <= 20), "{line}");
        let numbers: Vec<f64> = line.split(',').filter_map(|x| x.trim().parse().ok()).collect();
        if keyword.starts_with("*NODE") {
            nodes.insert(numbers[0] as usize, [numbers[1], numbers[2], numbers[3]]);
        } else if keyword.starts_with("*ELEMENT") {
            elements.push(numbers.iter().map(|&n| n as usize).collect::<Vec<_>>());
        }
    }
    assert_eq!(elements.iter().filter(|e| e.len() == 9).count(), 4488);
    assert_eq!(elements.iter().filter(|e| e.len() == 3).count(), 480);
    let mut ids: Vec<usize> = elements.iter().map(|e| e[0]).collect();
    ids.sort_unstable();
    assert_eq!(ids, (1..=4968).collect::<Vec<_>>());
    for element in &elements {
        for pair in element[1..].windows(2) {
            assert!(norm(sub(nodes[&pair[0]], nodes[&pair[1]])) < 0.7, "{element:?}");
        }
    }
    // Copies: one ring of nodes a yarn, one node a thread.
    assert_eq!(nodes.len(), mesh.nodes.len() + 3 * (2 * 19 + 4 * 9) + 2);
    for word in ["*MATERIAL, NAME=WARP\n", "*MATERIAL, NAME=WEFT\n", "*MATERIAL, NAME=STITCH\n", "ELSET=STITCH\n"] {
        assert_eq!(text.matches(word).count(), 1, "{word}");
    }
    // every copy is one period from its original, in the direction of its set
    let set = |name: &str| -> Vec<usize> {
        let lines = text.lines().skip_while(|line| *line != format!("*NSET, NSET={name}, UNSORTED")).skip(1);
        let lines = lines.take_while(|line| !line.starts_with('*'));
        lines.flat_map(|line| line.split(", ").map(|n| n.parse().unwrap())).collect()
    };
    for (name, count, way) in [("X", 4 * 27, [10.0, 0.0, 0.0]), ("Y", 2 * 57 + 2, [0.0, 10.0, 0.0])] {
        let [copies, originals] = ["COPY", "ORIGINAL"].map(|kind| set(&format!("PERIODIC_{name}_{kind}")));
        assert_eq!((copies.len(), originals.len()), (count, count));
        for (copy, original) in copies.iter().zip(&originals) {
            let apart = sub(sub(nodes[copy], nodes[original]), way);
            assert!(norm(apart) < 1e-3, "node {copy} of {original}: {apart:?}");
        }
    }
}
