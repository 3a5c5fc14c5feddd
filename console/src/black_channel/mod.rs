//! `safepair black-channel answer`: what a slave answers, frame by frame, in virtual time.
//! `safepair gateway`: the same behind a UDP socket.

mod device;
pub mod gateway;

use std::{
    io::{self, BufRead, Write},
    process::ExitCode,
};

use shm_schema::profile::Profile;

use crate::report::{bad_input, fell_short};
use device::{Device, Protocol, Shape, Source, telegram};

/// Longest advance of time in one line: a day.
const ADVANCE_MAX_MS: u64 = 86_400_000;

/// Look at the black channel without a machine.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, clap::Subcommand)]
enum Task {
    /// Answer the frames on standard input: one in hexadecimal a line; "+MS" lets time pass.
    Answer(AnswerArgs),
}

#[derive(Debug, clap::Args)]
struct AnswerArgs {
    #[command(flatten)]
    shape: ShapeArgs,
    /// Safe inputs to send, hexadecimal. Without it the application is not enabled.
    #[arg(long)]
    process_data: Option<String>,
    /// Each answer as a JSON object a line.
    #[arg(long)]
    json: bool,
}

/// Options that describe one device.
#[derive(Debug, clap::Args)]
pub struct ShapeArgs {
    /// amk-kw, lenze-sm301, atv340 or etg-6100-2: gives the lengths of the process data.
    #[arg(long)]
    profile: String,
    /// Whose answer.
    #[arg(long, value_enum, default_value = "split")]
    channel: Source,
    /// Id of the first session, 0xHHHH; later sessions use the next number each.
    #[arg(long, value_parser = number)]
    session_id: u16,
    /// Own address: FSoE 1 to 65,535, PROFIsafe 1 to 65,534.
    #[arg(long, value_parser = number)]
    address: u16,
    /// Octets from the master, instead of the profile's.
    #[arg(long)]
    out: Option<u8>,
    /// Octets to the master, instead of the profile's.
    #[arg(long)]
    r#in: Option<u8>,
    /// Application parameters the FSoE master has to send, hexadecimal.
    #[arg(long, default_value = "")]
    application_parameters: String,
    /// The protocol.
    #[arg(long, value_enum, default_value = "fsoe")]
    protocol: Protocol,
    /// F-parameter block of the host with its CRC, hexadecimal.
    #[arg(long, default_value = "")]
    f_parameters: String,
}

impl ShapeArgs {
    /// The device described, and the shape it was built from.
    ///
    /// # Errors
    /// One line that names the option and what was expected.
    fn device(&self) -> Result<(Device, Shape), String> {
        let profiles = [Profile::AmkKw, Profile::LenzeSm301, Profile::Atv340, Profile::Etg61002];
        let named = profiles.into_iter().find(|profile| profile.name() == self.profile);
        let profile = named.ok_or_else(|| {
            format!("--profile {}: expected amk-kw, lenze-sm301, atv340 or etg-6100-2", self.profile)
        })?;
        let (outputs, inputs) = telegram(profile);
        let shape = Shape {
            protocol: self.protocol,
            outputs: self.out.unwrap_or(outputs),
            inputs: self.r#in.unwrap_or(inputs),
            address: self.address,
            session_id: self.session_id,
            application_parameters: hexadecimal(&self.application_parameters)
                .ok_or("--application-parameters: expected hexadecimal octets")?,
            f_parameters: hexadecimal(&self.f_parameters)
                .ok_or("--f-parameters: expected hexadecimal octets")?,
        };
        Ok((Device::new(&shape, self.channel)?, shape))
    }
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let Task::Answer(args) = &args.task;
    match answer(args, &mut io::stdin().lock(), &mut io::stdout().lock()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Stop::Input(line)) => bad_input(&line),
        Err(Stop::Output(error)) => fell_short(&error.to_string()),
    }
}

enum Stop {
    Input(String),
    Output(io::Error),
}

fn answer(args: &AnswerArgs, input: &mut impl BufRead, output: &mut impl Write) -> Result<(), Stop> {
    let (mut device, shape) = args.shape.device().map_err(Stop::Input)?;
    let inputs = process_data(args.process_data.as_deref(), &shape).map_err(Stop::Input)?;
    let mut now_ns = 0;
    for (number, line) in input.lines().enumerate() {
        let line = line.map_err(|error| Stop::Input(format!("line {}: {error}", number + 1)))?;
        let line = line.trim();
        let wrong = |expected: &str| {
            Stop::Input(format!("line {}: expected {expected}, found \"{line}\"", number + 1))
        };
        if line.is_empty() {
            continue;
        }
        if let Some(advance) = line.strip_prefix('+') {
            let ms: u64 = advance.parse().map_err(|_| wrong("+ and whole milliseconds"))?;
            now_ns += ms.min(ADVANCE_MAX_MS) * 1_000_000;
            if let Some(frame) = device.advance(now_ns) {
                print(args.json, now_ns, Some(&frame), output).map_err(Stop::Output)?;
            }
            continue;
        }
        let image = hexadecimal(line).ok_or_else(|| wrong("a frame in hexadecimal"))?;
        let answer = device
            .receive(&image, inputs.as_deref(), now_ns)
            .map_err(|_| wrong("a frame of this device's length"))?;
        print(args.json, now_ns, answer.as_deref(), output).map_err(Stop::Output)?;
    }
    Ok(())
}

fn process_data(text: Option<&str>, shape: &Shape) -> Result<Option<Vec<u8>>, String> {
    let Some(text) = text else { return Ok(None) };
    let octets = hexadecimal(text).ok_or("--process-data: expected hexadecimal octets")?;
    if octets.len() == usize::from(shape.inputs) {
        return Ok(Some(octets));
    }
    Err(format!("--process-data: expected {} octets, found {}", shape.inputs, octets.len()))
}

fn print(json: bool, now_ns: u64, frame: Option<&[u8]>, output: &mut impl Write) -> io::Result<()> {
    let text = frame.map(to_hexadecimal);
    if json {
        let line = serde_json::json!({ "t_ms": now_ns / 1_000_000, "answer": text });
        return writeln!(output, "{line}");
    }
    writeln!(output, "{}", text.as_deref().unwrap_or("-"))
}

/// Octets of a text of hexadecimal digits; blanks between octets are allowed.
fn hexadecimal(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|octet| !octet.is_ascii_whitespace()).collect();
    let pairs = digits.chunks_exact(2);
    let whole = pairs.remainder().is_empty();
    let value = |digit: u8| (digit as char).to_digit(16);
    let octets =
        pairs.map(|pair| Some((value(pair[0])? * 16 + value(pair[1])?) as u8)).collect::<Option<_>>();
    octets.filter(|_| whole)
}

fn to_hexadecimal(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02x}")).collect()
}

/// A number of 16 bits, decimal or 0x….
fn number(text: &str) -> Result<u16, String> {
    let parsed =
        text.strip_prefix("0x").map_or_else(|| text.parse(), |digits| u16::from_str_radix(digits, 16));
    parsed.map_err(|_| format!("expected 0 to 65535, or 0x0000 to 0xFFFF, found \"{text}\""))
}

#[cfg(test)]
mod tests;
