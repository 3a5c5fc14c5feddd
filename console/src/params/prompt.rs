//! Questions to whoever sits at the terminal, or feeds a pipe.

use std::io::{self, BufRead as _, IsTerminal as _, Write as _};

use nix::sys::termios::{self, LocalFlags, SetArg, Termios};

/// Someone types: not a pipe, not a file.
pub fn is_terminal() -> bool {
    io::stdin().is_terminal()
}

/// One line, as it is typed.
///
/// # Errors
/// Nothing could be read.
pub fn line(question: &str) -> Result<String, String> {
    eprint!("{question}: ");
    let mut line = String::new();
    let read = io::stderr().flush().and_then(|()| io::stdin().lock().read_line(&mut line));
    read.map_err(|error| format!("standard input: {error}; expected an answer"))?;
    Ok(line.trim_end_matches(['\r', '\n']).into())
}

/// One line that the terminal does not show.
///
/// # Errors
/// Nothing could be read, or the terminal would show it.
pub fn secret(question: &str) -> Result<String, String> {
    if !is_terminal() {
        return line(question);
    }
    let hidden = Hidden::begin().map_err(|error| format!("terminal: {error}; expected one that can hide"))?;
    let answer = line(question);
    drop(hidden);
    eprintln!();
    answer
}

/// The terminal shows nothing as long as this lives.
struct Hidden(Termios);

impl Hidden {
    fn begin() -> nix::Result<Self> {
        let before = termios::tcgetattr(io::stdin())?;
        let mut quiet = before.clone();
        quiet.local_flags.remove(LocalFlags::ECHO);
        // Ctrl-C would leave the terminal silent: here it is a letter of a wrong password.
        quiet.local_flags.remove(LocalFlags::ISIG);
        termios::tcsetattr(io::stdin(), SetArg::TCSAFLUSH, &quiet)?;
        Ok(Self(before))
    }
}

impl Drop for Hidden {
    fn drop(&mut self) {
        // Nothing better can be done about a terminal that is gone.
        let _ = termios::tcsetattr(io::stdin(), SetArg::TCSAFLUSH, &self.0);
    }
}
