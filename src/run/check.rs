//! A look at a case before it is run: sizes, effects, expected time, and on request the whole algorithm.

use super::scene;
use crate::case::domain::Domain;
use crate::case::read::Loaded;
use crate::error::Result;
use crate::simulate::{Make, Simulation};
use std::fmt::Write as _;
use std::time::Instant;

/// Sizes and cost of a case; with `explain` the defaults in use and every stage of its plan.
pub fn check(loaded: &Loaded, explain: bool) -> Result<String> {
    let (mesh, friction) = scene(loaded)?;
    let mut probe = Simulation::new(&loaded.case, friction, mesh, Make::default())?;
    let bytes: usize = probe.model.plan.buffers.iter().map(|b| 4 * b.len).sum();
    probe.advance(0.0, |_| false)?;
    let (dt, end) = (probe.dt(), probe.schedule.end());
    // a few steps for the expected time; the first burst warms up
    probe.advance(16.0 * dt, |_| false)?;
    let warm = Instant::now();
    let steps = probe.step();
    probe.advance(probe.time() + 64.0 * dt, |_| false)?;
    let per_step = warm.elapsed().as_secs_f64() / (probe.step() - steps).max(1) as f64;
    let settled = loaded
        .case
        .integration
        .dt_s
        .unwrap_or(loaded.case.integration.dt_max_s.min(loaded.case.integration.safety * probe.health().dt_limit));
    let steps = end / settled;
    let mut t = String::new();
    // writing to a String does not fail
    let _ = writeln!(t, "{}: valid", loaded.case.title);
    let _ = writeln!(
        t,
        "mesh       {} hexes, {} beams, {} nodes; {:.1} MB of buffers in f32",
        probe.mesh.hexes(),
        probe.mesh.beams(),
        probe.mesh.nodes.len(),
        bytes as f64 / 1e6
    );
    let _ = writeln!(t, "effects    {}", effects(loaded).join(", "));
    let _ = write!(
        t,
        "time       {:.3} ms; limit {:.2e} s at node {} ({}), step {settled:.2e} s, about {steps:.0} steps of {:.3} ms: {:.0} s on {}",
        1e3 * end,
        probe.health().dt_limit,
        probe.health().limiting_node,
        probe.node_owner(probe.health().limiting_node),
        1e3 * per_step,
        per_step * steps,
        probe.backend().describe()
    );
    if explain {
        let plan = &probe.model.plan;
        for (list, stages) in [
            ("step", &plan.step),
            ("watch", &plan.watch),
            ("search", &plan.search),
            ("diagnose", &plan.diagnose),
            ("collect", &plan.collect),
        ] {
            let _ = write!(t, "\n{list}");
            for stage in stages {
                let names = |buffers: Vec<_>| {
                    let names: Vec<&str> =
                        buffers.into_iter().map(|b: crate::kernel::buffer::Buffer| plan.buffers[b.0].name).collect();
                    names.join(", ")
                };
                let _ = write!(
                    t,
                    "\n  {:<14} {:>7} items  reads {}; writes {}",
                    stage.name,
                    stage.count,
                    names(stage.reads.clone()),
                    names(stage.writes.iter().map(|w| w.0).collect())
                );
            }
        }
        let _ = write!(t, "\ndefaults");
        for (path, value) in &loaded.defaults {
            let _ = write!(t, "\n  {path} = {value}");
        }
    }
    Ok(t)
}

/// Names of the effects that are on.
fn effects(loaded: &Loaded) -> Vec<String> {
    let e = &loaded.case.effects;
    let contact = e.contact.as_ref();
    let on = [
        ("thread–yarn contact", contact.is_some_and(|c| c.thread_yarn)),
        ("yarn–yarn contact", contact.is_some_and(|c| c.yarn_yarn)),
        ("thread–thread contact", contact.is_some_and(|c| c.thread_thread)),
        ("friction", contact.is_some_and(|c| c.friction)),
        ("bending", e.bending),
        ("damping", e.damping.is_some()),
        ("fibre lines", e.fibre_lines.is_some()),
        ("contact mass", e.contact_mass.is_some()),
        ("mass floor", e.mass_floor > 0.0),
        ("gravity", e.gravity_mm_s2.is_some()),
        ("periodic cell", matches!(loaded.case.domain, Domain::Cell { .. })),
    ];
    on.into_iter().filter(|(_, on)| *on).map(|(name, _)| name.to_owned()).collect()
}
