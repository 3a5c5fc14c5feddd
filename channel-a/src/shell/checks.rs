//! Check sums of the shell: CRC-32C for the cells B reads, and the walk over the images.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Pause between two walks over all images; far below the 10 s of design 8.
const PAUSE: Duration = Duration::from_secs(2);
const POLYNOMIAL: u32 = 0x82F6_3B78;
const TABLES: [[u32; 256]; 8] = tables();

const fn tables() -> [[u32; 256]; 8] {
    let mut tables = [[0; 256]; 8];
    let mut entry = 0;
    while entry < 8 * 256 {
        let (table, octet) = (entry / 256, entry % 256);
        let (mut value, rounds) = if table == 0 {
            (octet as u32, 8)
        } else {
            let before: u32 = tables[table - 1][octet];
            ((before >> 8) ^ tables[0][(before & 0xFF) as usize], 0)
        };
        let mut round = 0;
        while round < rounds {
            value = (value >> 1) ^ (POLYNOMIAL * (value & 1));
            round += 1;
        }
        tables[table][octet] = value;
        entry += 1;
    }
    tables
}

/// CRC-32C (iSCSI).
pub fn crc32c(octets: &[u8]) -> u32 {
    let (rounds, rest) = octets.as_chunks::<8>();
    let mut sum = u32::MAX;
    for round in rounds {
        let word = u64::from_le_bytes(*round) ^ u64::from(sum);
        let lane = |index: usize| TABLES[7 - index][(word >> (8 * index)) as usize & 0xFF];
        sum = lane(0) ^ lane(1) ^ lane(2) ^ lane(3) ^ lane(4) ^ lane(5) ^ lane(6) ^ lane(7);
    }
    for octet in rest {
        sum = (sum >> 8) ^ TABLES[0][((sum ^ u32::from(*octet)) & 0xFF) as usize];
    }
    !sum
}

/// Walks the images again and again outside the cycle; whether all are sound still.
pub fn watch(images: Vec<Vec<u8>>) -> Arc<AtomicBool> {
    let sound = Arc::new(AtomicBool::new(true));
    let result = Arc::clone(&sound);
    // An image refused at start is reported by its monitor, not by this walk.
    let images: Vec<Vec<u8>> = images.into_iter().filter(|image| channel_a::sound(image)).collect();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(PAUSE);
            if !images.iter().all(|image| channel_a::sound(image)) {
                result.store(false, Ordering::Relaxed);
            }
        }
    });
    sound
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_check_value_of_iscsi_is_reproduced() {
        assert_eq!(super::crc32c(b"123456789"), 0xE306_9283);
        assert_eq!(super::crc32c(&[0; 32]), 0x8A91_36AA);
    }
}
