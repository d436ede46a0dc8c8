//! The command line: arguments in, one library call, text or one line of error out.

mod cli;

use clap::Parser as _;
use clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
use cli::arguments::Arguments;
use cli::{BAD_INPUT, Done, UNEXPECTED, perform};
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use tricot::error::Error;

fn main() -> ExitCode {
    // Mesa's layer that chooses a default device for windows complains on stderr where there are none; tricot opens none.
    // SAFETY: no other thread runs yet.
    unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if !error.use_stderr() || error.kind() == DisplayHelpOnMissingArgumentOrSubcommand => {
            return finish(&error.to_string(), 0);
        }
        Err(error) => return fail(&usage(&error), BAD_INPUT),
    };
    std::panic::set_hook(Box::new(|panic| {
        _ = fail(&format!("unexpected failure, please report it with the case: {panic}"), UNEXPECTED);
    }));
    match std::panic::catch_unwind(|| perform(arguments.command)) {
        Ok(Ok(Done { text, code })) => finish(&text, code),
        Ok(Err(error)) => fail(&error.to_string(), error.exit_code()),
        Err(_) => ExitCode::from(UNEXPECTED),
    }
}

/// The first paragraph of a message about the command line, on one line.
fn usage(error: &clap::Error) -> String {
    let text = error.to_string();
    let first: Vec<&str> = text.lines().take_while(|l| !l.is_empty()).map(str::trim).collect();
    let tip = text.lines().find_map(|line| line.trim().strip_prefix("tip: "));
    let tip = tip.map_or(String::new(), |tip| format!("; {tip}"));
    format!("{}{tip} (try --help)", first.join(" ").trim_start_matches("error: "))
}

/// Prints to stdout; a reader that has gone away is no failure.
fn finish(text: &str, code: u8) -> ExitCode {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            fail(&format!("standard output: {error}"), Error::file("", "").exit_code())
        }
        _ => ExitCode::from(code),
    }
}

/// Prints one line to stderr.
fn fail(message: &str, code: u8) -> ExitCode {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Nothing is left to do when even this cannot be written.
    _ = writeln!(std::io::stderr(), "error: {line}");
    ExitCode::from(code)
}
