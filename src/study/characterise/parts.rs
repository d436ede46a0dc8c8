//! The tests of a characterisation. Each is a shipped case with a few changes.

/// A test.
pub(super) struct Part {
    /// Name of its folder.
    pub name: &'static str,
    /// Title on the page.
    pub title: &'static str,
    case: &'static str,
    /// Changes to the case, as of `--set`.
    changes: &'static [&'static str],
    /// Changes that make a coarse, quick test of it.
    quick: &'static [&'static str],
    /// Whether a quick characterisation leaves it out.
    pub is_long: bool,
    /// Its curve.
    pub curve: Curve,
}

/// The curve of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curve {
    /// F_nor over the shear angle.
    Shear,
    /// Membrane force over the stretch of the warps or the wefts.
    Tension { of_warp: bool },
    /// Pressure over thickness.
    Compaction,
    /// None; its property is a number.
    Property,
}

const IN_SHEAR: &str = "in-plane shear: force over angle";
const ALONG_WARPS: &str = "membrane stiffness along the warps";
const ALONG_WEFTS: &str = "membrane stiffness along the wefts";
const THROUGH: &str = "compaction through the thickness: pressure over thickness";
const ON_TOOL: &str = "friction on a tool";

/// What a macroscopic material card of a fabric asks for. No test here gives the bending.
pub(super) const CARD: [&str; 6] =
    [IN_SHEAR, ALONG_WARPS, ALONG_WEFTS, THROUGH, ON_TOOL, "bending of the fabric: moment over curvature"];

const CELL: &str = include_str!("../../../cases/unit_cell_shear.json");
const SPECIMEN: &str = include_str!("../../../cases/bias_extension_small.json");
const FRAME: &str = include_str!("../../../cases/picture_frame_small.json");
const ON_A_TOOL: &str = include_str!("../../../cases/tool_friction.json");
const BETWEEN_PLATES: &str = include_str!("../../../cases/cell_compaction.json");
const THREAD: &str = include_str!("../../../cases/thread_tension.json");
const CANTILEVER: &str = include_str!("../../../cases/cantilever.json");
const COMPACTION: &str = include_str!("../../../cases/yarn_compaction.json");
const YARN: &str = include_str!("../../../cases/yarn_shear.json");

const PREVIEW: &[&str] = &["accuracy=preview"];

/// A test that gives a property, and is quick anyway.
const fn of_constituent(
    name: &'static str,
    title: &'static str,
    case: &'static str,
    changes: &'static [&'static str],
) -> Part {
    Part { name, title, case, changes, quick: &[], is_long: false, curve: Curve::Property }
}

/// A test of a cell with load steps of its own.
const fn of_cell(name: &'static str, title: &'static str, steps: &'static [&'static str], curve: Curve) -> Part {
    Part { name, title, case: CELL, changes: steps, quick: PREVIEW, is_long: false, curve }
}

/// All tests, in the order in which they run.
pub(super) const PARTS: &[Part] = &[
    of_constituent("thread-tension", "Tension of the thread", THREAD, &[]),
    of_constituent("thread-bending", "Thread under its own weight", CANTILEVER, &[]),
    of_constituent("warp-shear", "Longitudinal shear of a warp", YARN, &[]),
    of_constituent(
        "weft-shear",
        "Longitudinal shear of a weft",
        YARN,
        &["domain.yarn_shear.ply=weft", r#"resolution={ "weft_columns": 6, "slice_mm": 1 }"#],
    ),
    of_constituent("warp-compaction", "Compaction of a warp in a die", COMPACTION, &[]),
    of_cell(
        "shear",
        "Shear of the fabric and back",
        &[r#"steps=[{ "pretension": { "time_s": 3e-3 } },
            { "stretch": { "warp": "corner_driven", "weft": "corner_driven", "time_s": 0.5e-3 } },
            { "shear": { "angle_deg": 45, "time_s": 13e-3 } }, { "shear": { "angle_deg": 0, "time_s": 13e-3 } }]"#],
        Curve::Shear,
    ),
    of_cell(
        "shear-other-way",
        "Shear of the fabric the other way and back",
        &[r#"steps=[{ "pretension": { "time_s": 3e-3 } },
            { "stretch": { "warp": "corner_driven", "weft": "corner_driven", "time_s": 0.5e-3 } },
            { "shear": { "angle_deg": -45, "time_s": 13e-3 } }, { "shear": { "angle_deg": 0, "time_s": 13e-3 } }]"#],
        Curve::Shear,
    ),
    of_cell(
        "warp-tension",
        "Tension of the fabric along the warps, and back",
        &[r#"steps=[{ "pretension": { "time_s": 3e-3 } }, { "stretch": { "warp": { "to": 1.002 },
            "weft": { "force_n_per_mm": 0 }, "time_s": 4e-3 } }, { "stretch": { "warp": { "to": 1 },
            "weft": { "force_n_per_mm": 0 }, "time_s": 4e-3 } }]"#],
        Curve::Tension { of_warp: true },
    ),
    of_cell(
        "weft-tension",
        "Tension of the fabric along the wefts, and back",
        &[r#"steps=[{ "pretension": { "time_s": 3e-3 } }, { "stretch": { "weft": { "to": 1.002 },
            "warp": { "force_n_per_mm": 0 }, "time_s": 4e-3 } }, { "stretch": { "weft": { "to": 1 },
            "warp": { "force_n_per_mm": 0 }, "time_s": 4e-3 } }]"#],
        Curve::Tension { of_warp: false },
    ),
    Part {
        name: "fabric-compaction",
        title: "Compaction of the fabric between plates",
        case: BETWEEN_PLATES,
        changes: &[],
        quick: PREVIEW,
        is_long: false,
        curve: Curve::Compaction,
    },
    of_constituent("tool-friction", "Friction of the fabric on a tool", ON_A_TOOL, &[]),
    Part {
        name: "picture-frame",
        title: "Shear of a small sample in a picture frame, its yarns pinned",
        case: FRAME,
        changes: &[],
        quick: &[],
        is_long: false,
        curve: Curve::Shear,
    },
    Part {
        name: "bias-extension",
        title: "Bias extension of a small specimen",
        case: SPECIMEN,
        changes: &[],
        quick: &[],
        is_long: true,
        curve: Curve::Shear,
    },
];

impl Part {
    /// What the test gives to a macroscopic material card.
    pub fn gives(&self) -> Option<&'static str> {
        match self.name {
            "shear" | "shear-other-way" | "picture-frame" | "bias-extension" => Some(IN_SHEAR),
            "warp-tension" => Some(ALONG_WARPS),
            "weft-tension" => Some(ALONG_WEFTS),
            "fabric-compaction" => Some(THROUGH),
            "tool-friction" => Some(ON_TOOL),
            _ => None,
        }
    }

    /// The text of its case, and the changes to it.
    pub fn case(&self, quick: bool) -> (&'static str, impl Iterator<Item = &'static str> + use<>) {
        let quick = if quick { self.quick } else { &[] };
        (self.case, self.changes.iter().chain(quick).copied())
    }
}
