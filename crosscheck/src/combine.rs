//! What leaves the controller: two reports combined to the safe side (DEC-25).

use shm_schema::drive::DriveRequest;
use shm_schema::report::Report;
use shm_schema::word::Word;

use crate::profile::StatusRules;

/// Status bits: errors and movements by OR, everything else by AND.
pub fn status(a: &Word, b: &Word, rules: &StatusRules) -> Word {
    let mut combined = Word::ZERO;
    let places = combined.0.iter_mut().zip(a.0).zip(b.0).zip(rules.either.0);
    for (((out, a), b), either) in places {
        let both = a & b;
        let any = (a | b) & either;
        *out = both | any;
    }
    combined
}

/// STO active, the error bit as `error` says, and what STO silences cleared (DEC-14).
pub fn overlay_sto(status: &Word, rules: &StatusRules, error: bool) -> Word {
    let mut shown = *status;
    let places = shown.0.iter_mut().zip(rules.silent_in_sto.0).zip(rules.sto.0).zip(rules.error.0);
    for (((out, silent), sto), error_bit) in places {
        *out &= !silent;
        *out |= sto;
        if error {
            *out |= error_bit;
        }
    }
    shown
}

/// The speed further from zero, 1/1000 rpm (DEC-25, LNZ-SPD-07).
pub const fn speed_mrpm(a: &Report, b: &Report) -> i32 {
    if b.speed_mrpm.unsigned_abs() > a.speed_mrpm.unsigned_abs() { b.speed_mrpm } else { a.speed_mrpm }
}

/// What the drive is asked while nothing is agreed: brake, brakes closed, outputs low.
pub const DRIVE_SAFE: DriveRequest = DriveRequest {
    brake: true,
    deceleration_rpm_s: 0,
    limit_set_point: true,
    set_point_max_mrpm: 0,
    set_point_min_mrpm: 0,
    brake_open: false,
    outputs: 0,
};

/// Requests to the drive: whatever either asks that restrains, whatever both permit.
pub fn drive(a: &DriveRequest, b: &DriveRequest) -> DriveRequest {
    let (max_a, min_a) = band(a);
    let (max_b, min_b) = band(b);
    let (max, min) = (max_a.min(max_b), min_a.max(min_b));
    let limited = a.limit_set_point | b.limit_set_point;
    let possible = limited && (min <= max);
    DriveRequest {
        brake: a.brake | b.brake,
        // The steeper of the two; 0 leaves the slope to the drive.
        deceleration_rpm_s: slope(a).max(slope(b)),
        limit_set_point: limited,
        // Two bands that do not meet leave standstill only.
        set_point_max_mrpm: if possible { max } else { 0 },
        set_point_min_mrpm: if possible { min } else { 0 },
        brake_open: a.brake_open & b.brake_open,
        outputs: a.outputs & b.outputs,
    }
}

const fn slope(of: &DriveRequest) -> u32 {
    if of.brake { of.deceleration_rpm_s } else { 0 }
}

const fn band(of: &DriveRequest) -> (i32, i32) {
    if of.limit_set_point { (of.set_point_max_mrpm, of.set_point_min_mrpm) } else { (i32::MAX, i32::MIN) }
}
