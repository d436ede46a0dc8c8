//! `tricot devices`: the adapters that a run can use.

use crate::backend::gpu;
use std::fmt::Write as _;

/// One paragraph per adapter, starting with the default of `--backend gpu`.
pub fn devices() -> String {
    let mib = |bytes: u64| bytes / (1 << 20);
    let mut text = String::new();
    for d in gpu::devices() {
        // writing to a String does not fail
        let _ = writeln!(text, "{}: {}, {}, {}", d.name, d.kind, d.interface, d.driver);
        let _ = writeln!(
            text,
            "    a stage binds {} buffers of up to {} MiB; buffers up to {} MiB; {} KiB in a workgroup; timestamps: {}",
            d.storage_buffers,
            mib(d.binding_bytes),
            mib(d.buffer_bytes),
            d.workgroup_bytes / 1024,
            if d.has_timestamps { "yes" } else { "no" }
        );
    }
    if text.is_empty() {
        text.push_str("no adapter was found: runs use the CPU");
    }
    text
}
