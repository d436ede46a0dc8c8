//! The effects of a scene by name: cause, exclusive stages, and the case without the effect.

use crate::case::FabricSource;
use crate::contact::EMPTY;
use crate::contact::candidates::MADE;
use crate::mesh::Thread;
use crate::rigs;
use crate::rigs::read::Loaded;
use crate::settings::effects::Contact;
use crate::simulate::Simulation;

/// An effect that a scene has.
pub struct Effect {
    pub name: &'static str,
    /// The field of the case that requests it, or what implies it.
    pub cause: String,
    /// Stages that exist for this effect alone.
    pub stages: &'static [&'static str],
    /// Removes it from a case; `None` if it cannot be turned off.
    pub off: Option<Off>,
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

/// Stages of rigid tools.
const TOOLS: &[&str] = &[
    "tools on threads",
    "tools on yarns",
    "forces of threads on tools",
    "forces of yarns on tools",
    "motion of tools",
];

/// Changes contact, if there is any.
fn contact(loaded: &mut Loaded, change: impl Fn(&mut Contact)) {
    if let Some(contact) = &mut loaded.case.effects.contact {
        change(contact);
    }
}

/// The effects of a scene that has begun.
pub fn effects(loaded: &Loaded, simulation: &Simulation) -> Vec<Effect> {
    let mut found = Found { loaded, simulation, effects: Vec::new() };
    found.contact();
    found.bodies();
    found.numerics();
    found.scene();
    found.effects
}

/// Removes an effect from a case.
type Off = fn(&mut Loaded);

/// The effects found so far.
struct Found<'a> {
    loaded: &'a Loaded,
    simulation: &'a Simulation,
    effects: Vec<Effect>,
}

impl Found<'_> {
    fn add(&mut self, name: &'static str, cause: String, stages: &'static [&'static str], off: Option<Off>) {
        self.effects.push(Effect { name, cause, stages, off });
    }

    /// The path of a field, and whether it was written or is a default.
    fn written(&self, path: &str) -> String {
        let inside = |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        let covers = |default: &str| inside(default, path) || inside(path, default);
        let default = self.loaded.defaults.iter().any(|(default, _)| covers(default));
        if default { format!("{path} by default") } else { path.to_owned() }
    }

    /// Contact by kind of pair, friction, damping, and ties.
    fn contact(&mut self) {
        let (active, written) = (self.simulation.model.active, |path: &str| self.written(path));
        let settings = self.loaded.case.effects.contact.as_ref();
        let skin = settings.map_or(0.0, |contact| contact.skin_mm);
        let [threads_near, yarns_near, pairs_near] = near(self.simulation);
        let pairs: [(bool, &'static str, String, &'static [&'static str], Off); 3] = [
            (
                active.thread_yarn,
                "thread-yarn contact",
                format!(
                    "{}; {threads_near} nodes of threads are closer than {skin} mm to a yarn",
                    written("effects.contact.thread_yarn")
                ),
                &["thread-yarn candidates", "thread-yarn contact"],
                |l| contact(l, |c| c.thread_yarn = false),
            ),
            (
                active.yarn_yarn,
                "yarn-yarn contact",
                format!(
                    "{}; {yarns_near} nodes of yarns are closer than {skin} mm to another yarn",
                    written("effects.contact.yarn_yarn")
                ),
                &["yarn-yarn candidates", "yarn-yarn contact"],
                |l| contact(l, |c| c.yarn_yarn = false),
            ),
            (
                active.thread_thread,
                "thread-thread contact",
                format!(
                    "{}; {pairs_near} pairs of beams are closer than {skin} mm",
                    written("effects.contact.thread_thread")
                ),
                &["threads to grid", "thread-thread candidates", "thread-thread contact"],
                |l| contact(l, |c| c.thread_thread = false),
            ),
        ];
        for (_, name, cause, stages, off) in pairs.into_iter().filter(|(is_on, ..)| *is_on) {
            self.add(name, cause, stages, Some(off));
        }
        if active.friction {
            let (mesh, written) = (self.simulation.mesh(), self.written("effects.contact.friction"));
            let cause = if mesh.friction.largest() > 0.0 {
                format!("{written} and a coefficient of friction of {}", mesh.friction)
            } else {
                format!("{written} and a tool with a coefficient of friction")
            };
            self.add("friction", cause, &[], Some(|l| contact(l, |c| c.friction = false)));
        }
        if (active.searches() || active.tools) && settings.is_some_and(|c| c.damping_ratio > 0.0) {
            let cause = self.written("effects.contact.damping_ratio");
            self.add("contact damping", cause, &[], Some(|l| contact(l, |c| c.damping_ratio = 0.0)));
        }
        if active.tools {
            let names: Vec<&str> = self.simulation.mesh().tools.iter().map(|tool| tool.name.as_str()).collect();
            self.add("tools", format!("the rigid tools {}", names.join(", ")), TOOLS, None);
        }
        if active.ties {
            let count = self.simulation.scene.ties.len();
            let cause =
                format!("{}; {count} nodes of cut threads are held", self.written("domain.specimen.thread_ends"));
            self.add("ties", cause, &["ties"], Some(|l| rigs::of_mut(&mut l.case.domain).free_thread_ends()));
        }
    }

    /// Effects inside bodies, and gravity.
    fn bodies(&mut self) {
        let active = self.simulation.model.active;
        let thread = |of: fn(&Thread) -> f64| {
            let values = self.simulation.mesh().threads.iter().map(of);
            values.fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most })
        };
        let (bending, strain) = (thread(|t| t.bending), thread(|t| t.thermal_strain));
        if active.bending {
            let cause = format!("{}; a thread has EI = {bending:.3e} N mm² > 0", self.written("effects.bending"));
            self.add("bending", cause, &["bend"], Some(|l| l.case.effects.bending = false));
        }
        if active.thermal {
            let cause = format!("a pretension step, and a thread with a thermal strain of {strain} in it");
            let off: Off = |l| {
                if let Some(FabricSource::Inline(fabric)) = &mut l.case.fabric {
                    fabric.stitch.thermal_strain = 0.0;
                }
                rigs::of_mut(&mut l.case.domain).relax_threads();
            };
            self.add("thermal strain", cause, &[], Some(off));
        }
        if active.gravity {
            let cause = self.written("effects.gravity_mm_s2");
            self.add("gravity", cause, &[], Some(|l| l.case.effects.gravity_mm_s2 = None));
        }
        if active.damping {
            let cause = self.written("effects.damping");
            self.add("damping", cause, &[], Some(|l| l.case.effects.damping = None));
        }
    }

    /// Effects that lengthen the time step.
    fn numerics(&mut self) {
        let model = &self.simulation.model;
        if model.active.fibre_lines {
            let cause = format!("{}; fibres and threads of two nodes or more", self.written("effects.fibre_lines"));
            self.add("fibre lines", cause, &["fibre lines"], Some(|l| l.case.effects.fibre_lines = None));
        }
        if model.active.contact_mass {
            let cause = format!("{}; bodies can touch", self.written("effects.contact_mass"));
            self.add("contact-aware mass", cause, &[], Some(|l| l.case.effects.contact_mass = None));
        }
        let heavier = model.mass.iter().zip(&model.true_mass).filter(|(mass, truly)| mass > truly).count();
        if heavier > 0 {
            let floor = self.loaded.case.effects.mass_floor;
            let cause = format!(
                "{}; {heavier} nodes would be lighter than {floor} of the mean of their body",
                self.written("effects.mass_floor")
            );
            self.add("mass floor", cause, &[], Some(|l| l.case.effects.mass_floor = 0.0));
        }
    }

    /// Effects that follow from the domain of the case, and effects of every scene.
    fn scene(&mut self) {
        if self.simulation.model.active.periodic {
            self.add("periodicity", "domain.cell".into(), &["total kinetic energy"], None);
        }
        let prescribed = self.simulation.prescribed_nodes().len();
        if prescribed > 0 {
            let cause = format!("{prescribed} nodes of {}", grips(self.simulation));
            self.add("prescribed motion", cause, &["prescribed"], None);
        }
        let cause = "guards look at the balance of energies between steps".into();
        let stages =
            &["hex8 energy", "hex8 reduced energy", "totals", "totals taken", "kinetic energy", "axial energy"];
        self.add("energies by mode", cause, stages, None);
    }
}

/// Names of the first few prescribed motions.
fn grips(simulation: &Simulation) -> String {
    const FEW: usize = 3;
    let motions = &simulation.scene.motions;
    let names: Vec<&str> = motions.iter().take(FEW).map(|motion| motion.name.as_str()).collect();
    let more = motions.len().saturating_sub(FEW);
    names.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

/// Numbers of beams near yarns, of yarn nodes near other yarns, and of pairs of beams near each other.
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
