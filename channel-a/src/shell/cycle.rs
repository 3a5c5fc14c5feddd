//! The cycle: absolute deadlines, every overrun counted.

use std::sync::atomic::{AtomicBool, Ordering};

use shm_schema::command::{Command, CommandSource};
use shm_schema::exchange::{Inputs, Published, Received};
use shm_schema::inhibit::Inhibit;

use super::cells::{Axes, Axis};
use super::ending::Ending;
use super::options::Options;
use super::realtime::{now_ns, sleep_until};

/// What is the same for all axes.
struct Shared {
    plain_command: bool,
    image_sound: bool,
    overruns: u8,
}

/// An axis and what it published last.
struct Seat {
    axis: Axis,
    published: Option<Published>,
    edges: u64,
}

impl Drop for Seat {
    /// On every way out the path is off.
    fn drop(&mut self) {
        self.axis.line.off();
        self.axis.inhibit.publish(&Inhibit { edges: self.edges, ..Inhibit::default() }, now_ns());
    }
}

/// Runs until the end is wanted.
pub fn run(options: &Options, mut axes: Axes, ending: &Ending, sound: &AtomicBool) {
    let cycle_ns = options.cycle_ns();
    let phase_ns = options.phase_us * 1_000;
    let seat = |axis| Seat { axis, published: None, edges: 0 };
    let mut seats: Vec<Seat> = axes.each.drain(..).map(seat).collect();
    let mut due_ns = next_boundary(now_ns(), cycle_ns, phase_ns);
    let mut shared = Shared { plain_command: options.plain_command, image_sound: true, overruns: 0 };
    while !ending.is_wanted() {
        sleep_until(due_ns);
        let woken_ns = now_ns();
        let lost = lost_cycles(woken_ns, due_ns, cycle_ns);
        shared.overruns = if lost > 0 { shared.overruns.saturating_add(lost) } else { 0 };
        shared.image_sound = sound.load(Ordering::Relaxed);
        for seat in &mut seats {
            seat.step(&shared, now_ns());
        }
        due_ns = if lost > 0 { next_boundary(woken_ns, cycle_ns, phase_ns) } else { due_ns + cycle_ns };
    }
    drop(seats);
}

/// Whole cycles that went by between the deadline and the wake-up: each is an overrun of its own, so
/// that the step after a long stall already knows (design 3.6).
fn lost_cycles(woken_ns: u64, due_ns: u64, cycle_ns: u64) -> u8 {
    let cycles = woken_ns.saturating_sub(due_ns).checked_div(cycle_ns).unwrap_or(u64::MAX);
    u8::try_from(cycles).unwrap_or(u8::MAX)
}

/// The first multiple of the cycle plus phase behind `now`.
fn next_boundary(now_ns: u64, cycle_ns: u64, phase_ns: u64) -> u64 {
    let cycles = now_ns.saturating_sub(phase_ns) / cycle_ns;
    (cycles + 1) * cycle_ns + phase_ns
}

impl Seat {
    fn step(&mut self, shared: &Shared, now_ns: u64) {
        let axis = &mut self.axis;
        let inputs = Inputs {
            encoder: axis.encoder.read(),
            motion: None,
            io: axis.io.read(),
            command: accepted(axis.command.read(), shared.plain_command),
            partner: axis.partner.read(),
            agreement: axis.agreement.read(),
            readback: axis.readback.read(),
            published: self.published,
            overruns: shared.overruns,
            image_sound: shared.image_sound,
        };
        let outputs = axis.monitor.step(&inputs, now_ns);
        axis.line.drive(&outputs.inhibit);
        axis.inhibit.publish(&outputs.inhibit, now_ns);
        self.edges = outputs.inhibit.edges;
        let crc32 = axis.report.publish(&outputs.report, now_ns);
        if let Some(answer) = &outputs.answer {
            axis.answer.publish(answer, now_ns);
        }
        self.published = Some(Published { exchange: outputs.report.exchange, crc32 });
    }
}

/// An unprotected command is no command unless it was allowed; what the drive says in the
/// same cell stays, for that is no safe command (AMK-ACK-02).
fn accepted(mut received: Received<Command>, plain: bool) -> Received<Command> {
    if let Ok(cell) = &mut received {
        let unprotected = cell.payload.source == CommandSource::Plain;
        if unprotected && !plain {
            cell.payload.source = CommandSource::None;
        }
    }
    received
}

#[cfg(test)]
mod tests {
    use super::{accepted, lost_cycles, next_boundary};
    use shm_schema::command::{Command, CommandSource};
    use shm_schema::exchange::Sampled;

    #[test]
    fn a_refused_plain_command_keeps_the_words_of_the_drive() {
        // AMK-ACK-02
        let payload = Command {
            source: CommandSource::Plain,
            clear_error: true,
            drive_n0: true,
            drive_enabled: true,
            ..Command::default()
        };
        let cell = Sampled { sequence: 1, timestamp_ns: 0, crc32: 0, payload };
        let command = accepted(Ok(cell), false).unwrap().payload;
        assert_eq!(command, Command { source: CommandSource::None, ..payload });
        assert_eq!(accepted(Ok(cell), true).unwrap().payload, payload);
    }

    #[test]
    fn every_cycle_of_a_stall_is_an_overrun() {
        let lost = [9, 10, 19, 20, 25, 1_000_000].map(|woken| lost_cycles(woken, 10, 10));
        assert_eq!(lost, [0, 0, 0, 1, 1, u8::MAX]);
    }

    #[test]
    fn boundaries_are_multiples_of_the_cycle_plus_the_phase() {
        assert_eq!(next_boundary(0, 1_000, 300), 1_300);
        assert_eq!(next_boundary(1_299, 1_000, 300), 1_300);
        assert_eq!(next_boundary(1_300, 1_000, 300), 2_300);
    }
}
