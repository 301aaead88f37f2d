//! The end of a command: its files are written, then its findings are printed.

use std::io::{self, Write};

use crate::Error;
use crate::look::Look;
use crate::output::{Found, Kind, Output};

/// Writes the files, then prints the findings and the names of the files.
pub(crate) fn finish(
    found: &impl Found,
    text: &str,
    outputs: &[Output],
    out: &mut dyn Write,
    look: Look,
) -> Result<(), Error> {
    // The files are written first: they are complete even if the reader of the text closes the pipe. If a file cannot be written, the text
    // is printed nevertheless.
    let written: Vec<_> = outputs.iter().map(|output| output.write(found)).collect();
    let mut text = text.to_string();
    if !outputs.is_empty() {
        text.push('\n');
    }
    let mut failed = Ok(());
    for (output, written) in outputs.iter().zip(written) {
        let path = output.path().display();
        let written = match written {
            Ok(written) => written,
            Err(error) => {
                failed = Err(error);
                continue;
            }
        };
        text += &look.faint(match (written, output.kind()) {
            (true, _) => format!("wrote {path}"),
            (false, Kind::Record) => {
                format!("{path} is not written: no experiment is worth applying")
            }
            (false, _) => {
                format!("{path} is not written: the residual shows no function of a variable")
            }
        });
        text.push('\n');
    }
    say(out, &text)?;
    failed
}

/// Writes text; a reader that has closed the pipe is no error.
pub(crate) fn say(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
