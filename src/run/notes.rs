//! Notes on a valid case that the user should know.

use crate::mesh::{Mesh, Ply};
use crate::rigs::read::Loaded;
use crate::settings::integration::Hexahedra;
use crate::settings::material::Material;
use crate::settings::steps::Step;

/// Poisson's ratio above which hexahedra with eight Gauss points lock: a slender beam of them bends visibly less than a beam of
/// hexahedra with one Gauss point.
const LOCKS: f64 = 0.4;

/// Sentences, each with a recommendation.
pub(super) fn notes(Loaded { case, .. }: &Loaded, mesh: &Mesh) -> Vec<String> {
    let mut found = Vec::new();
    let tightens = case.steps.iter().any(|step| matches!(step, Step::Pretension { .. }));
    let loose = mesh.threads.iter().map(|thread| thread.thermal_strain).find(|strain| *strain != 0.0 && !tightens);
    if let Some(strain) = loose {
        found.push(format!(
            "the stitch stays loose: without a pretension step its thermal strain of {strain} does not act"
        ));
    }
    if case.integration.hexahedra == Hexahedra::Full {
        let locked = locking(mesh);
        if let Some(first) = locked.first() {
            let more = if locked.len() > 1 { format!(" and {} more", locked.len() - 1) } else { String::new() };
            found.push(format!(
                "{first}{more} can hardly change its volume (Poisson's ratio above {LOCKS}): hexahedra with eight points lock, \
                 and are too stiff in bending; set integration.hexahedra to reduced"
            ));
        }
    }
    found
}

/// Plies and free blocks whose material law makes their hexahedra lock.
fn locking(mesh: &Mesh) -> Vec<&str> {
    let locks = |material: &Material| matches!(material, Material::NeoHookean { poisson, .. } if *poisson > LOCKS);
    let mut names: Vec<&str> = Vec::new();
    for block in mesh.blocks.iter().filter(|block| locks(&block.material)) {
        let name = match block.ply {
            Ply::Warp => "the warp",
            Ply::Weft => "the weft",
            Ply::Free => &block.name,
        };
        if names.last() != Some(&name) {
            names.push(name);
        }
    }
    names
}
