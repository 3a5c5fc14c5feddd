//! Angle of a sine/cosine pair by rotation with integers (CORDIC).

/// Steps; each adds one bit.
const STEPS: u32 = 17;
/// A full turn of the inner angle.
const TURN_BITS: u32 = 32;
/// atan(2^-n) in 2^-32 turns, n = 0 to 16.
const ARCTANGENTS: [i64; STEPS as usize] = [
    536_870_912,
    316_933_406,
    167_458_907,
    85_004_756,
    42_667_331,
    21_354_465,
    10_679_838,
    5_340_245,
    2_670_163,
    1_335_087,
    667_544,
    333_772,
    166_886,
    83_443,
    41_722,
    20_861,
    10_430,
];
/// Guard bits of the rotated vector.
const GUARD_BITS: u32 = 12;

/// Angle of (`cosine`, `sine`) in 1/65,536 turn, 0 to 65,535, rounded to nearest.
pub fn angle(sine: i16, cosine: i16) -> i64 {
    let mut x = i64::from(cosine) << GUARD_BITS;
    let mut y = i64::from(sine) << GUARD_BITS;
    let mut turned = 0;
    if x < 0 {
        x = -x;
        y = -y;
        turned = 1 << (TURN_BITS - 1);
    }
    for (step, arctangent) in ARCTANGENTS.into_iter().enumerate() {
        let (dx, dy) = (x >> step, y >> step);
        if y > 0 {
            x = x.wrapping_add(dy);
            y = y.wrapping_sub(dx);
            turned += arctangent;
        } else {
            x = x.wrapping_sub(dy);
            y = y.wrapping_add(dx);
            turned -= arctangent;
        }
    }
    ((turned + (1 << 15)) >> 16) & 0xFFFF
}

#[cfg(test)]
mod tests {
    use super::angle;

    #[test]
    fn the_eight_main_directions_are_exact() {
        let cases = [
            (0, 1, 0),
            (1, 1, 8_192),
            (1, 0, 16_384),
            (1, -1, 24_576),
            (0, -1, 32_768),
            (-1, -1, 40_960),
            (-1, 0, 49_152),
            (-1, 1, 57_344),
        ];
        for (sine, cosine, expected) in cases {
            assert_eq!(angle(sine * 16_000, cosine * 16_000), expected, "{sine} {cosine}");
        }
    }
}
