//! The effects of a scene by name: what called for each, which stages are there for it alone, and the case without it.

use crate::case::FabricSource;
use crate::contact::EMPTY;
use crate::contact::candidates::MADE;
use crate::rigs;
use crate::rigs::read::Loaded;
use crate::settings::effects::Contact;
use crate::simulate::Simulation;

/// An effect that a scene has.
pub struct Effect {
    pub name: &'static str,
    /// The field of the case that asks for it, or what implies it.
    pub cause: String,
    /// Stages that are there for it alone.
    pub stages: &'static [&'static str],
    /// Takes it out of a case; `None` where it is what the case describes.
    pub off: Option<fn(&mut Loaded)>,
}

impl Effect {
    /// The case without the effect.
    pub fn without(&self, loaded: &Loaded) -> Option<Loaded> {
        self.off.map(|off| {
            let mut loaded = loaded.clone();
            off(&mut loaded);
            loaded
        })
    }
}

/// Changes contact, if there is any.
fn contact(loaded: &mut Loaded, change: impl Fn(&mut Contact)) {
    if let Some(contact) = &mut loaded.case.effects.contact {
        change(contact);
    }
}

/// The effects of a scene that has begun.
pub fn effects(loaded: &Loaded, simulation: &Simulation) -> Vec<Effect> {
    let (active, effects) = (simulation.model.active, &loaded.case.effects);
    let written = |path: &str| {
        let covers = |default: &str| {
            let inside =
                |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
            inside(default, path) || inside(path, default)
        };
        let default = loaded.defaults.iter().any(|(default, _)| covers(default));
        if default { format!("{path} by default") } else { path.to_owned() }
    };
    let mut found = Vec::new();
    let mut add = |is_on: bool, name, cause: &dyn Fn() -> String, stages, off| {
        if is_on {
            found.push(Effect { name, cause: cause(), stages, off });
        }
    };
    let thread = |largest: fn(&crate::mesh::Thread) -> f64| {
        simulation
            .mesh()
            .threads
            .iter()
            .map(largest)
            .fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most })
    };
    let [threads_near, yarns_near, pairs_near] = near(simulation);
    let skin = effects.contact.as_ref().map_or(0.0, |contact| contact.skin_mm);
    add(
        active.thread_yarn,
        "thread-yarn contact",
        &|| {
            format!(
                "{}; {threads_near} nodes of threads are closer than {skin} mm to a yarn",
                written("effects.contact.thread_yarn")
            )
        },
        &["thread-yarn candidates", "thread-yarn contact"],
        Some(|l| contact(l, |c| c.thread_yarn = false)),
    );
    add(
        active.yarn_yarn,
        "yarn-yarn contact",
        &|| {
            format!(
                "{}; {yarns_near} nodes of yarns are closer than {skin} mm to another yarn",
                written("effects.contact.yarn_yarn")
            )
        },
        &["yarn-yarn candidates", "yarn-yarn contact"],
        Some(|l| contact(l, |c| c.yarn_yarn = false)),
    );
    add(
        active.thread_thread,
        "thread-thread contact",
        &|| {
            format!(
                "{}; {pairs_near} pairs of beams are closer than {skin} mm",
                written("effects.contact.thread_thread")
            )
        },
        &["threads to grid", "thread-thread candidates", "thread-thread contact"],
        Some(|l| contact(l, |c| c.thread_thread = false)),
    );
    add(
        active.friction,
        "friction",
        &|| {
            format!(
                "{} and a coefficient of friction of {}",
                written("effects.contact.friction"),
                simulation.mesh().friction
            )
        },
        &[],
        Some(|l| contact(l, |c| c.friction = false)),
    );
    add(
        active.searches() && effects.contact.as_ref().is_some_and(|c| c.damping_ratio > 0.0),
        "contact damping",
        &|| written("effects.contact.damping_ratio"),
        &[],
        Some(|l| contact(l, |c| c.damping_ratio = 0.0)),
    );
    add(
        active.ties,
        "ties",
        &|| {
            let count =
                simulation.model.plan.step.iter().find(|stage| stage.name == "ties").map_or(0, |stage| stage.count);
            format!("{}; {count} nodes of cut threads are held", written("domain.specimen.thread_ends"))
        },
        &["ties"],
        Some(|l| {
            rigs::of_mut(&mut l.case.domain).free_thread_ends();
        }),
    );
    add(
        active.bending,
        "bending",
        &|| format!("{}; a thread has EI = {:.3e} N mm² > 0", written("effects.bending"), thread(|t| t.bending)),
        &["bend"],
        Some(|l| l.case.effects.bending = false),
    );
    add(
        active.thermal,
        "thermal strain",
        &|| format!("a pretension step, and a thread with a thermal strain of {} in it", thread(|t| t.thermal_strain)),
        &[],
        Some(|l| {
            if let Some(FabricSource::Inline(fabric)) = &mut l.case.fabric {
                fabric.stitch.thermal_strain = 0.0;
            }
            rigs::of_mut(&mut l.case.domain).relax_threads();
        }),
    );
    add(
        active.gravity,
        "gravity",
        &|| written("effects.gravity_mm_s2"),
        &[],
        Some(|l| l.case.effects.gravity_mm_s2 = None),
    );
    add(active.damping, "damping", &|| written("effects.damping"), &[], Some(|l| l.case.effects.damping = None));
    add(
        active.fibre_lines,
        "fibre lines",
        &|| format!("{}; fibres and threads of two nodes or more", written("effects.fibre_lines")),
        &["fibre lines", "hold"],
        Some(|l| l.case.effects.fibre_lines = None),
    );
    add(
        active.contact_mass,
        "contact-aware mass",
        &|| format!("{}; bodies can touch", written("effects.contact_mass")),
        &[],
        Some(|l| l.case.effects.contact_mass = None),
    );
    let (mass, truly) = (&simulation.model.mass, &simulation.model.true_mass);
    let heavier = mass.iter().zip(truly).filter(|(mass, truly)| mass > truly).count();
    add(
        heavier > 0,
        "mass floor",
        &|| {
            format!(
                "{}; {heavier} nodes would be lighter than {} of the mean of their body",
                written("effects.mass_floor"),
                effects.mass_floor
            )
        },
        &[],
        Some(|l| l.case.effects.mass_floor = 0.0),
    );
    add(active.periodic, "periodicity", &|| "domain.cell".into(), &["total kinetic energy"], None);
    let prescribed = simulation.prescribed_nodes().len();
    add(
        prescribed > 0,
        "prescribed motion",
        &|| format!("{prescribed} nodes of {}", grips(simulation)),
        &["prescribed"],
        None,
    );
    add(
        true,
        "energies by mode",
        &|| "guards look at the balance of energies between steps".into(),
        &["hex8 energy", "hex8 reduced energy", "totals", "totals taken", "kinetic energy", "axial energy"],
        None,
    );
    found
}

/// Names of what prescribes motion, the first few.
fn grips(simulation: &Simulation) -> String {
    const FEW: usize = 3;
    let motions = &simulation.scene.motions;
    let names: Vec<&str> = motions.iter().take(FEW).map(|motion| motion.name.as_str()).collect();
    let more = motions.len().saturating_sub(FEW);
    names.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

/// Beams and nodes of yarns that have another yarn within reach, and pairs of beams within reach of each other.
fn near(simulation: &Simulation) -> [usize; 3] {
    let buffers = &simulation.model.buffers;
    let entries = |buffer| simulation.backend().uints(buffer);
    let [threads, yarns] = buffers.faces.map(|faces| {
        faces.map_or(0, |faces| {
            let (lists, carriers) = (entries(faces.near), simulation.model.plan.buffers[faces.found.0].len);
            lists.chunks_exact(lists.len() / carriers).filter(|list| list[MADE] != EMPTY).count()
        })
    });
    let pairs = buffers.pair_keys.map_or(0, |keys| entries(keys).iter().filter(|key| **key != EMPTY).count());
    [threads, yarns, pairs]
}
