//! Dispatches: stages that a device runs at once, since each dispatch costs it a few microseconds.
//!
//! Light stages that run beside each other share a dispatch, with a range of workgroups for each. The stages of a chain share one
//! with a workgroup for each unit, which passes a barrier between two stages. Every other stage has a dispatch of its own.
//!
//! The text of a dispatch is that of its stages: their module-scope names get the number of their stage, and a buffer that several
//! of them bind is one variable.

use super::buffer::{Buffer, Kind};
use super::interface::declaration;
use super::shader::{ENTRY, Text, WORKGROUP};
use super::stage::{Cut, Order, Stage};
use crate::error::Result;
use std::collections::HashMap;
use std::fmt::Write as _;

/// Uniform buffers that every device binds: the row, and two for each stage.
const UNIFORMS: usize = 12;
/// The table of the items of units.
const CUTS: &str = "cuts";

/// How stages share a dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Form {
    Beside,
    Chain,
}

/// Stages that run at once.
pub struct Dispatch<'a> {
    form: Form,
    stages: Vec<&'a Stage>,
}

/// A buffer that a dispatch binds.
struct Bound {
    buffer: Buffer,
    /// Name of its first slot.
    name: &'static str,
    kind: Kind,
    atomic: bool,
    written: bool,
}

impl<'a> Dispatch<'a> {
    /// A stage alone.
    pub fn alone(stage: &'a Stage) -> Self {
        Self { form: Form::Beside, stages: vec![stage] }
    }

    /// The dispatches of a list of stages that have items, each with at most so many storage buffers.
    pub fn of(stages: &'a [Stage], most: usize) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        // the first dispatch of the stages that run beside each other
        let mut group = 0;
        for stage in stages.iter().filter(|stage| stage.count > 0) {
            if stage.order != Order::Beside {
                group = all.len();
            }
            let place = match stage.order {
                Order::Waits => None,
                Order::Beside => (group..all.len()).find(|i| all[*i].is_light() && stage.kernel.shader.light),
                Order::Follows => all.len().checked_sub(1).filter(|i| stage.continues(all[*i].last())),
            };
            let form = if stage.order == Order::Follows { Form::Chain } else { Form::Beside };
            match place.and_then(|place| Some((place, all[place].with(stage, form, most)?))) {
                Some((place, joined)) => all[place] = joined,
                None => all.push(Self::alone(stage)),
            }
        }
        all
    }

    fn last(&self) -> &'a Stage {
        self.stages[self.stages.len() - 1]
    }

    /// Whether more stages may share it.
    fn is_light(&self) -> bool {
        self.stages.iter().all(|stage| stage.kernel.shader.light)
    }

    /// The dispatch with another stage, if it fits.
    fn with(&self, stage: &'a Stage, form: Form, most: usize) -> Option<Self> {
        let stages = [&self.stages[..], &[stage]].concat();
        let joined = Self { form, stages };
        let buffers = joined.bound()?.len() + usize::from(form == Form::Chain);
        (buffers <= most && 2 * joined.stages.len() < UNIFORMS).then_some(joined)
    }

    /// The stages.
    pub fn stages(&self) -> &[&'a Stage] {
        &self.stages
    }

    /// Name for messages and timings.
    pub fn name(&self) -> String {
        self.stages.iter().map(|stage| stage.name).collect::<Vec<_>>().join(" + ")
    }

    /// All buffers in the order of their bindings, unless one of them is atomic to some stages only.
    fn bound(&self) -> Option<Vec<Bound>> {
        let mut all: Vec<Bound> = Vec::new();
        for (buffer, slot) in self.stages.iter().flat_map(|stage| stage.bound()) {
            match all.iter_mut().find(|bound| bound.buffer == buffer) {
                Some(known) if known.atomic != slot.is_atomic() => return None,
                Some(known) => known.written |= slot.access.is_some(),
                None => all.push(Bound {
                    buffer,
                    name: slot.name,
                    kind: slot.kind,
                    atomic: slot.is_atomic(),
                    written: slot.access.is_some(),
                }),
            }
        }
        Some(all)
    }

    /// The buffers in the order of their bindings, and whether each is written.
    pub fn buffers(&self) -> Vec<(Buffer, bool)> {
        let bound = self.bound().expect("stages with other needs have dispatches of their own");
        bound.into_iter().map(|bound| (bound.buffer, bound.written)).collect()
    }

    /// First item of each unit of a chain in each stage, and the ends; bound behind the buffers.
    pub fn cuts(&self) -> Option<Vec<u32>> {
        let units = |stage: &&Stage| match &stage.cut {
            Cut::Units(units) => units.clone(),
            Cut::Grain(_) => unreachable!("the stages of a chain are cut into units"),
        };
        let units: Vec<_> = (self.form == Form::Chain).then(|| self.stages.iter().map(units).collect())?;
        Some((0..units[0].len()).flat_map(|unit| units.iter().map(move |cuts| cuts[unit] as u32)).collect())
    }

    /// Number of workgroups.
    pub fn workgroups(&self) -> usize {
        let of_stage = |stage: &&Stage| stage.kernel.shader.share.workgroups(stage.count);
        match self.cuts() {
            Some(cuts) => cuts.len() / self.stages.len() - 1,
            None => self.stages.iter().map(of_stage).sum(),
        }
    }

    /// The text of the shader.
    ///
    /// # Errors
    /// A missing file, or an invalid directive, with its file and line.
    pub fn text(&self) -> Result<Text> {
        let links = self.stages.len();
        let is_chain = self.form == Form::Chain;
        let parts = (0..links).map(|i| Text::part(self.stages[i], is_chain.then_some([i, links])));
        let parts = parts.collect::<Result<Vec<_>>>()?;
        let defined: Vec<_> = self.stages.iter().flat_map(|stage| stage.kernel.shader.defines).copied().collect();
        let row = Text::row(self.stages[0].kernel.shader, &defined)?;
        let words: Vec<_> = parts.iter().map(Text::words).collect();
        let reads_row = declared(&row.text).any(|name| words.iter().any(|words| words.contains(name)));
        let mut text = if reads_row { row } else { Text::default() };
        let bound = self.bound().expect("stages with other needs have dispatches of their own");
        let name = |number: usize| {
            if links == 1 { bound[number].name.to_owned() } else { format!("{}_{number}", bound[number].name) }
        };
        let from = ("slots of the kernels", 0);
        for (number, buffer) in bound.iter().enumerate() {
            text.push(&declaration(&name(number), buffer.kind, buffer.atomic, buffer.written, number), from);
        }
        if is_chain {
            text.push(&declaration(CUTS, Kind::Uint, false, false, bound.len()), from);
        }
        for (i, (stage, part)) in self.stages.iter().zip(parts).enumerate() {
            if links == 1 {
                text.append(part);
                continue;
            }
            let mut names: HashMap<&str, String> =
                declared(&part.text).map(|name| (name, format!("{name}_{i}"))).collect();
            for (buffer, slot) in stage.bound() {
                let number = bound.iter().position(|bound| bound.buffer == buffer).expect("it is one of them");
                names.insert(slot.name, name(number));
            }
            let numbered =
                [0, 1].map(|k| (format!("@group(2) @binding({k})"), format!("@group(2) @binding({})", 2 * i + k)));
            let mut renamed = renamed(&part.text, &names);
            for (old, new) in numbered.iter().rev() {
                renamed = renamed.replace(old, new);
            }
            text.append(Text { text: renamed, lines: part.lines });
        }
        for line in self.entry().lines() {
            text.push(line, ("entry point", 0));
        }
        Ok(text)
    }

    /// The entry point. If one row of workgroups is not enough, they fill a plane.
    fn entry(&self) -> String {
        let mut text = format!(
            "@compute @workgroup_size({WORKGROUP})
fn {ENTRY}(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {{
    var group = workgroup.y * workgroups.x + workgroup.x;
"
        );
        let links = self.stages.len();
        // writing to a String does not fail
        _ = match self.form {
            Form::Beside if links == 1 => writeln!(text, "    stage(group, local);"),
            Form::Beside => (0..links).try_for_each(|i| {
                writeln!(
                    text,
                    "    if group < stage_workgroups_{i}() {{
        stage_{i}(group, local);
        return;
    }}
    group = group - stage_workgroups_{i}();"
                )
            }),
            Form::Chain => {
                _ = writeln!(
                    text,
                    "    if (group + 1u) * {links}u >= arrayLength(&{CUTS}) {{\n        return;\n    }}"
                );
                (0..links).try_for_each(|i| {
                    let barrier = if i == 0 { "" } else { "    storageBarrier();\n" };
                    writeln!(text, "{barrier}    stage_{i}(group, local);")
                })
            }
        };
        text.push_str("}\n");
        text
    }
}

/// Names that a text declares at module scope.
fn declared(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let rest = ["fn ", "struct ", "const "].iter().find_map(|word| line.strip_prefix(word));
        let rest = rest.or_else(|| {
            let variable = line.find("var<").filter(|_| line.starts_with("var<") || line.starts_with('@'))?;
            line[variable..].split_once("> ").map(|(_, rest)| rest)
        })?;
        rest.split(|c: char| !is_of_word(c)).next()
    })
}

fn is_of_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// A text with other names for some of its words: not for members, nor in comments.
fn renamed(text: &str, names: &HashMap<&str, String>) -> String {
    let mut new = String::with_capacity(text.len());
    let mut in_struct = false;
    for line in text.lines() {
        let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
        let is_member = in_struct && line.starts_with(' ');
        in_struct = line.starts_with("struct ") || is_member;
        let mut rest = code;
        let mut before = ' ';
        while let Some(c) = rest.chars().next() {
            let end =
                rest.find(|c: char| is_of_word(c) != is_of_word(rest.as_bytes()[0] as char)).unwrap_or(rest.len());
            let (word, after) = rest.split_at(end);
            let member = before == '.' || is_member && after.starts_with(':');
            match names.get(word).filter(|_| is_of_word(c) && !member) {
                Some(name) => new.push_str(name),
                None => new.push_str(word),
            }
            before = word.chars().next_back().unwrap_or(' ');
            rest = after;
        }
        new.push_str(comment);
        new.push('\n');
    }
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_the_module_change() {
        let text = "\
struct Pair {
    // scale of it
    scale: f32,
}
@group(2) @binding(1) var<uniform> params: Pair;
var<workgroup> shared_rows: array<f32, 4>;
const FACE: u32 = 4u;
fn scale(x: f32) -> f32 {
    return x * params.scale * 4e0; // scale
}
fn twice(pair: Pair) -> f32 {
    return scale(pair.scale) + f32(FACE);
}
";
        let names: Vec<_> = declared(text).collect();
        assert_eq!(names, ["Pair", "params", "shared_rows", "FACE", "scale", "twice"]);
        let names = names.into_iter().map(|name| (name, format!("{name}_1"))).collect();
        let expected = "\
struct Pair_1 {
    // scale of it
    scale: f32,
}
@group(2) @binding(1) var<uniform> params_1: Pair_1;
var<workgroup> shared_rows_1: array<f32, 4>;
const FACE_1: u32 = 4u;
fn scale_1(x: f32) -> f32 {
    return x * params_1.scale * 4e0; // scale
}
fn twice_1(pair: Pair_1) -> f32 {
    return scale_1(pair.scale) + f32(FACE_1);
}
";
        assert_eq!(renamed(text, &names), expected);
    }
}
