//! Whatever comes in: no panic, and no torque without the conditions for it.

use std::vec::Vec;

use shm_schema::agreement::Agreement;
use shm_schema::command::Command;
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{CellFault, Inputs, Motion, Published, Received, Sampled, Setup, Start};
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::profile::{Profile, common};
use shm_schema::report::Report;
use shm_schema::wire::{Source, Wire};

use super::bench::image;
use crate::Monitor;

/// A seeded generator (xorshift); the same seed makes the same run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Extremes as often as everything else.
    fn number(&mut self) -> u64 {
        match self.next() % 6 {
            0 => u64::MAX,
            1 => 0,
            2 => 1 << (self.next() % 64),
            3 => self.next() % 4,
            4 => i64::MIN as u64,
            _ => self.next(),
        }
    }

    fn payload<T: Wire>(&mut self) -> T {
        loop {
            let octets: Vec<u8> =
                (0..T::LENGTH.div_ceil(8)).flat_map(|_| self.number().to_le_bytes()).collect();
            let sparse: Vec<u8> = octets
                .iter()
                .map(|octet| if self.next().is_multiple_of(3) { *octet } else { octet & 1 })
                .collect();
            if let Some(payload) = T::take(&mut Source::new(&sparse)) {
                return payload;
            }
        }
    }

    fn cell<T: Wire>(&mut self, near: u64) -> Received<T> {
        if self.next().is_multiple_of(8) {
            return Err(CellFault::CheckSum);
        }
        let time = if self.next().is_multiple_of(4) { self.number() } else { near };
        let sequence = if self.next().is_multiple_of(4) { self.number() } else { near / 1_000_000 };
        Ok(Sampled { sequence, timestamp_ns: time, crc32: 0, payload: self.payload() })
    }

    fn inputs(&mut self, now_ns: u64) -> Inputs {
        let motion = Motion {
            position: self.number() as i64,
            speed_mrpm: self.number() as i32,
            acceleration_mrpm_s: self.next().is_multiple_of(2).then(|| self.number() as i64),
        };
        Inputs {
            encoder: self.cell::<Encoder>(now_ns),
            motion: self.next().is_multiple_of(2).then_some(motion),
            io: self.cell::<Io>(now_ns),
            command: self.cell::<Command>(now_ns),
            partner: self.cell::<Report>(now_ns),
            agreement: self.cell::<Agreement>(now_ns),
            readback: self.cell::<Readback>(now_ns),
            published: (self.next().is_multiple_of(2))
                .then(|| Published { exchange: self.number(), crc32: self.number() as u32 }),
            overruns: self.number() as u8,
            image_sound: !self.next().is_multiple_of(16),
        }
    }
}

fn keys(profile: Profile) -> Vec<u32> {
    use shm_schema::facts;
    match profile {
        Profile::AmkKw => facts::amk_kw::PARAMETERS.iter().map(|row| row.key).collect(),
        Profile::LenzeSm301 => facts::lenze_sm301::PARAMETERS.iter().map(|row| row.key).collect(),
        Profile::Atv340 => facts::atv340::PARAMETERS.iter().map(|row| row.key).collect(),
        _ => {
            let rows = facts::etg_6100_2::PARAMETERS.iter();
            rows.flat_map(|row| [1, 2, 9].map(|instance| row.key | instance << 8))
                .chain([common::CONTROL_WORD + 200])
                .collect()
        }
    }
}

const PROFILES: [Profile; 4] = [Profile::AmkKw, Profile::LenzeSm301, Profile::Atv340, Profile::Etg61002];

#[test]
fn no_input_and_no_parameter_makes_a_step_panic() {
    let mut random = Random(0x5AFE_9A18);
    for round in 0..120_u64 {
        let profile = PROFILES[(round % 4) as usize];
        let entries: Vec<(u32, i64)> = keys(profile)
            .into_iter()
            .map(|key| (key, i64::from(random.number() as i32), !random.next().is_multiple_of(7)))
            .filter(|(_, _, named)| *named)
            .map(|(key, value, _)| (key, value))
            .collect();
        let octets = image(profile, &entries);
        crate::findings(&octets, &mut |_| {});
        let start = if round % 3 == 0 { Start::Cold } else { Start::Settled };
        let mut setup = Setup::new(1, 9, start);
        setup.cycle_ns = random.number();
        setup.stale_cycles = random.number() as u8;
        let mut monitor = Monitor::new(&octets, &setup);
        // A refused set monitors nothing: every second round runs it all the same.
        if round % 2 == 0 {
            monitor.force_operational();
        }
        for k in 0..300_u64 {
            let now_ns = if random.next().is_multiple_of(16) { random.number() } else { k * 1_000_000 };
            let outputs = monitor.step(&random.inputs(now_ns), now_ns);
            let ready_first = !outputs.report.driving | outputs.report.ready | (round % 2 == 0);
            assert!(ready_first, "{round} {k}");
        }
    }
}

#[test]
fn no_octets_make_an_image_panic() {
    let mut random = Random(7);
    let sound = image(Profile::AmkKw, &[(67, 3_000)]);
    for _ in 0..2_000 {
        let mut octets = sound.clone();
        for _ in 0..random.next() % 4 {
            let at = (random.next() as usize) % octets.len();
            octets[at] = random.number() as u8;
        }
        octets.truncate((random.next() as usize) % (octets.len() + 40));
        if octets.len() >= 4 {
            let body = octets.len() - 4;
            let sum = crate::crc32(&octets[..body]).to_le_bytes();
            octets[body..].copy_from_slice(&sum);
        }
        let setup = Setup::new(1, 9, Start::Cold);
        let _ = Monitor::new(&octets, &setup);
    }
}
