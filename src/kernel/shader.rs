//! The WGSL twin of a kernel, and its text: files under `shaders/` composed for one stage.
//!
//! A twin has the path and the function names of its Rust file and repeats the same statements for one item. A kernel is a
//! function of an item number (or of the share of an item, if several invocations work on it), or of a share and the invocation
//! number if a workgroup works on it, or of the first of several items, their count and the invocation number. Its text starts with the constants and bindings that Rust declares for it (see
//! [`super::interface`]; only the constants that it uses), and ends with `kernel/stage`, which passes the items of a workgroup
//! to it. [`super::dispatch`] adds the entry point. Lines that begin with `#` direct the composition:
//!
//! - `#include "kernel/math"` inserts a file at its first occurrence; `#include LAW` inserts the file of the material law of
//!   the stage,
//! - `#if NAME`, `#else`, `#endif` keep lines only if the name is defined, so that an inactive effect leaves no text. The
//!   defined names are those given by the kernel, its own name, `ROOT` in the file of the kernel itself (whose kernels are not
//!   for the files that include it), and names added by `#define NAME`.
//!
//! Every line of the text records its source file and line. Group 0 holds the row of the step, group 1 the buffers of the stage
//! at the slot numbers of the kernel, group 2 the range of items and the parameters of the stage.

use super::dispatch::Dispatch;
use super::interface::Constant;
use super::stage::Stage;
use crate::error::{Error, Result};
use include_dir::{Dir, include_dir};
use std::collections::HashSet;
use std::fmt::Write as _;

static SHADERS: Dir = include_dir!("$CARGO_MANIFEST_DIR/shaders");

/// The file that passes items to the kernel, the file of the row, and the name of the entry point.
const STAGE: &str = "kernel/stage";
const ROW: &str = "kernel/row";
pub const ENTRY: &str = "main";

/// Invocations per workgroup.
pub const WORKGROUP: usize = 64;

/// Location of the twin of a kernel, and its build options.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shader {
    /// File under `shaders/`, without its suffix.
    pub file: &'static str,
    /// Name of the function.
    pub kernel: &'static str,
    /// Names defined for `#if`; see [`when`].
    pub defines: &'static [&'static str],
    /// The file for `#include LAW`.
    pub law: Option<&'static str>,
    /// Invocations or workgroups per item.
    pub share: Share,
    /// Whether its text is short and needs few registers, so that it may share a dispatch with stages beside it.
    pub light: bool,
    /// Constants available to its files, module by module.
    pub constants: &'static [&'static [Constant]],
}

/// How the items of a stage are shared by invocations and workgroups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Share {
    /// This number of invocations for an item.
    Invocations(usize),
    /// This number of workgroups for an item.
    Workgroups(usize),
    /// A workgroup for this number of items, whose work differs: all of it picks those with work, and shares them.
    Picks(usize),
}

impl Share {
    /// Number of workgroups for so many items.
    pub fn workgroups(self, items: usize) -> usize {
        match self {
            Self::Invocations(count) => (items * count).div_ceil(WORKGROUP),
            Self::Workgroups(count) => items * count,
            Self::Picks(count) => items.div_ceil(count),
        }
    }
}

impl Shader {
    /// One invocation per item, no names defined.
    pub const fn new(file: &'static str, kernel: &'static str) -> Self {
        Self { file, kernel, defines: &[], law: None, share: Share::Invocations(1), light: false, constants: &[] }
    }
}

/// A name defined only for kernels with a flag.
pub const fn when(flag: bool, name: &'static str) -> &'static str {
    if flag { name } else { "" }
}

/// The text of a stage's shader, and the origin of its lines.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Text {
    pub text: String,
    /// Source file and line of every line.
    pub lines: Vec<(&'static str, usize)>,
}

/// Composes files into a text.
struct Composer {
    shader: Shader,
    text: Text,
    included: Vec<&'static str>,
    defined: Vec<&'static str>,
}

impl Text {
    /// The text of a stage that has a dispatch of its own.
    ///
    /// # Errors
    /// A missing file, or an invalid directive, with its file and line.
    pub fn of(stage: &Stage) -> Result<Self> {
        Dispatch::alone(stage).text()
    }

    /// The row of the step for stages with these names defined.
    pub(super) fn row(shader: Shader, defined: &[&'static str]) -> Result<Self> {
        let mut composer = Composer { shader, text: Self::default(), included: Vec::new(), defined: defined.to_vec() };
        composer.include(ROW)?;
        Ok(composer.text)
    }

    /// The constants and functions of a stage, without bindings of buffers and without the row. A link of a chain has its
    /// number, and the number of links.
    pub(super) fn part(stage: &Stage, link: Option<[usize; 2]>) -> Result<Self> {
        let shader = stage.kernel.shader;
        let (shares, of_workgroups): (_, &[_]) = match shader.share {
            Share::Invocations(count) => (count, &["INVOCATIONS"]),
            Share::Workgroups(count) => (count, &["WORKGROUPS"]),
            Share::Picks(count) => (count, &["PICKS"]),
        };
        let of_chain: &[_] = if link.is_some() { &["CHAIN"] } else { &[] };
        let mut composer = Composer {
            shader,
            text: Self::default(),
            included: vec![ROW],
            defined: [&[shader.kernel], of_workgroups, of_chain, shader.defines].concat(),
        };
        composer.include(shader.file)?;
        composer.include(STAGE)?;
        let mut text = Self::default();
        let of_stage =
            [("WORKGROUP", WORKGROUP), ("ITEM_SHARES", shares)].into_iter().chain(stage.constants.iter().copied());
        let of_link = link.map_or(Vec::new(), |[link, links]| vec![("LINK", link), ("LINKS", links)]);
        let of_stage = of_stage.chain(of_link).map(|(name, value)| Constant::uint(name, value));
        let of_files = shader.constants.iter().copied().flatten().copied();
        let words = composer.text.words();
        for constant in of_stage.chain(of_files).filter(|constant| words.contains(constant.name)) {
            text.push(&constant.declaration(), ("constants from Rust", 0));
        }
        text.append(composer.text);
        Ok(text)
    }

    /// Adds another text.
    pub(super) fn append(&mut self, other: Self) {
        self.text.push_str(&other.text);
        self.lines.extend(other.lines);
    }

    /// Adds a line that comes from a line of a file.
    pub(super) fn push(&mut self, line: &str, from: (&'static str, usize)) {
        // writing to a String does not fail
        let _ = writeln!(self.text, "{line}");
        self.lines.push(from);
    }

    /// All words outside comments.
    pub fn words(&self) -> HashSet<&str> {
        let code = self.text.lines().map(|line| line.split("//").next().unwrap_or_default());
        code.flat_map(|code| code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')).collect()
    }

    /// The module, parsed and validated.
    ///
    /// # Errors
    /// The fault, with file and line of its source.
    #[cfg(feature = "gpu")]
    pub fn module(&self) -> Result<(naga::Module, naga::valid::ModuleInfo)> {
        let module = naga::front::wgsl::parse_str(&self.text).map_err(|error| {
            let line = error.location(&self.text).map(|at| at.line_number as usize);
            self.error(error.message(), line)
        })?;
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        let info = validator.validate(&module).map_err(|error| {
            let line = error.location(&self.text).map(|at| at.line_number as usize);
            let mut causes = vec![error.as_inner().to_string()];
            let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(error.as_inner());
            while let Some(inner) = cause {
                causes.push(inner.to_string());
                cause = inner.source();
            }
            self.error(&causes.join(": "), line)
        })?;
        Ok((module, info))
    }

    #[cfg(feature = "gpu")]
    fn error(&self, what: &str, line: Option<usize>) -> Error {
        match line.and_then(|line| self.lines.get(line.wrapping_sub(1))) {
            Some((file, number)) => Error::Shader(format!("shaders/{file}.wgsl:{number}: {what}")),
            None => Error::Shader(what.to_owned()),
        }
    }
}

impl Composer {
    fn include(&mut self, path: &'static str) -> Result<()> {
        if self.included.contains(&path) {
            return Ok(());
        }
        self.included.push(path);
        let file = SHADERS.get_file(format!("{path}.wgsl")).and_then(|f| f.contents_utf8());
        let file = file.ok_or_else(|| Error::Shader(format!("shaders/{path}.wgsl: there is no such file")))?;
        // whether the lines of each open #if are kept
        let mut kept: Vec<bool> = Vec::new();
        for (number, line) in file.lines().enumerate() {
            let number = number + 1;
            let wrong = |what: &str| Error::Shader(format!("shaders/{path}.wgsl:{number}: {what}"));
            let keep = kept.iter().all(|keep| *keep);
            let Some(directive) = line.trim_start().strip_prefix('#') else {
                if keep && path == STAGE {
                    self.text.push(&line.replace("KERNEL", self.shader.kernel), (path, number));
                } else if keep {
                    self.text.push(line, (path, number));
                }
                continue;
            };
            let (word, rest) = directive.trim_end().split_once(' ').unwrap_or((directive.trim_end(), ""));
            match word {
                "if" if rest == "ROOT" => kept.push(path == self.shader.file),
                "if" => kept.push(self.defined.contains(&rest)),
                "else" => {
                    let last = kept.last_mut().ok_or_else(|| wrong("#else without #if"))?;
                    *last = !*last;
                }
                "endif" => {
                    kept.pop().ok_or_else(|| wrong("#endif without #if"))?;
                }
                "define" if keep => self.defined.push(rest),
                "include" if keep && rest == "LAW" => {
                    let law = self.shader.law.ok_or_else(|| wrong("the stage has no law"))?;
                    self.include(law)?;
                }
                "include" if keep => self.include(rest.trim_matches('"'))?,
                "include" | "define" => {}
                other => return Err(wrong(&format!("#{other} is no directive"))),
            }
        }
        if kept.is_empty() { Ok(()) } else { Err(Error::Shader(format!("shaders/{path}.wgsl: #if without #endif"))) }
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::kernel::buffer::Buffer;
    use crate::kernel::exact::Exact;
    use crate::kernel::stage::{Code, Kernel, wires};

    fn stage(shader: Shader) -> Stage {
        let [increments, quanta, remainders, sum] = [0, 1, 2, 3].map(Buffer);
        let wires = wires![increments, quanta, remainders, sum];
        Stage::new("test", Code { shader, ..Code::of::<Exact>() }, (1, 1), &wires, [0u32; 0])
    }

    #[test]
    fn an_error_names_the_file_and_line_of_the_source() {
        let mut text = Text::of(&stage(Exact::SHADER)).unwrap();
        assert!(text.module().is_ok());
        let (file, number) = ("kernel/position", 2);
        let at = text.lines.iter().position(|l| *l == (file, number)).unwrap();
        let mut lines: Vec<&str> = text.text.lines().collect();
        for (wrong, why) in [("let x = ;", "expected"), ("fn wrong() -> f32 { return 1u; }", "return")] {
            lines[at] = wrong;
            let broken = Text { text: lines.join("\n"), lines: std::mem::take(&mut text.lines) };
            let message = broken.module().unwrap_err().to_string();
            println!("{message}");
            assert!(message.starts_with("shaders/kernel/position.wgsl:2: "), "{message}");
            assert!(message.to_lowercase().contains(why), "{message}");
            text.lines = broken.lines;
        }
        let missing = Text::of(&stage(Shader::new("kernel/nothing", "nothing"))).unwrap_err().to_string();
        assert!(missing.contains("shaders/kernel/nothing.wgsl"), "{missing}");
    }

    #[test]
    fn an_effect_that_is_missing_leaves_no_text() {
        let text = |defines: &'static [&'static str]| {
            let shader = Shader { defines, ..Shader::new("dynamics/integrate", "integrate") };
            Text::of(&stage(shader)).unwrap().text
        };
        let (bare, lines, falling) = (text(&[]), text(&["LINES"]), text(&["GRAVITY"]));
        assert!(lines.contains("correction") && !bare.contains("correction"));
        assert!(falling.contains("params.gravity") && !bare.contains("params.gravity"));
        assert!(!bare.contains('#'), "directives are not text");
    }
}
