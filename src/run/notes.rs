//! What a user should know about a case that is valid all the same.

use crate::case::domain::Domain;
use crate::case::fabric::Material;
use crate::case::read::Loaded;
use crate::case::steps::{Hexahedra, Step};

/// Poisson's ratio above which hexahedra with eight points of integration lock so much that a slender beam of them bends visibly less
/// than one of hexahedra with one point.
const LOCKS: f64 = 0.4;

/// Sentences, each with what to do.
pub(super) fn notes(Loaded { case, fabric, .. }: &Loaded) -> Vec<String> {
    let inline = match &case.domain {
        Domain::Mesh(inline) => Some(inline),
        _ => None,
    };
    let blocks =
        inline.into_iter().flat_map(|inline| &inline.blocks).map(|block| (block.name.as_str(), &block.material));
    let plies = fabric.iter().flat_map(|f| [("the warp", &f.warp.material), ("the weft", &f.weft.material)]);
    let locks = |material: &Material| matches!(material, Material::NeoHookean { poisson, .. } if *poisson > LOCKS);
    let mut found = Vec::new();
    let tightens = case.steps.iter().any(|step| matches!(step, Step::Pretension { .. }));
    if let Some(strain) = fabric.as_ref().map(|f| f.stitch.thermal_strain).filter(|strain| *strain != 0.0 && !tightens)
    {
        found.push(format!(
            "the stitch stays loose: without a pretension step its thermal strain of {strain} does not act"
        ));
    }
    if case.integration.hexahedra == Hexahedra::Full {
        let locked: Vec<&str> = plies.chain(blocks).filter(|(_, m)| locks(m)).map(|(name, _)| name).collect();
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
