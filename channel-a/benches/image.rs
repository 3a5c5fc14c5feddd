//! A sealed image in encoding A, as the parameter compiler makes it (shm-schema, `image`).

use shm_schema::image::{MAGIC, VERSION};
use shm_schema::profile::Profile;
use std::vec::Vec;

/// The image of axis 1 with these keys and values; `crc32` is CRC-32 (ISO-HDLC).
pub fn sealed(profile: Profile, entries: &[(u32, i64)], crc32: fn(&[u8]) -> u32) -> Vec<u8> {
    let mut entries: Vec<(u32, i64)> = entries.to_vec();
    entries.sort_unstable();
    let octets = |words: &[u32]| -> Vec<u8> { words.iter().flat_map(|word| word.to_le_bytes()).collect() };
    let pairs: Vec<u32> = entries.iter().flat_map(|(key, value)| [*key, *value as u32]).collect();
    let keys = entries.iter().map(|(key, _)| *key);
    let template: Vec<u32> = [u32::from(VERSION), profile as u32].into_iter().chain(keys).collect();
    let content: Vec<u32> = core::iter::once(profile as u32).chain(pairs.iter().copied()).collect();
    let content = crc32(&octets(&content));
    let mut device = Vec::from(content.to_le_bytes());
    device.extend_from_slice(&[0; 24]);
    let kind = u32::from(VERSION) << 16 | (profile as u32) << 8 | 1;
    let mut words =
        Vec::from([MAGIC, kind, entries.len() as u32, crc32(&octets(&template)), content, crc32(&device), 1]);
    words.extend_from_slice(&[0; 6]);
    words.extend_from_slice(&pairs);
    let mut all = octets(&words);
    all.extend_from_slice(&crc32(&all).to_le_bytes());
    all
}
