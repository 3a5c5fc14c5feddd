//! Time of day without a calendar library: UTC only.

const DAY_S: i64 = 86_400;

/// A time since 1970 as `2026-11-22T14:05:09.123Z`.
pub fn text(unix_ns: u64) -> String {
    let seconds = (unix_ns / 1_000_000_000) as i64;
    let (year, month, day) = civil(seconds.div_euclid(DAY_S));
    let of_day = seconds.rem_euclid(DAY_S);
    let (hour, minute, second) = (of_day / 3_600, of_day / 60 % 60, of_day % 60);
    let ms = unix_ns / 1_000_000 % 1_000;
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{ms:03}Z")
}

/// `2026-11-22`, `2026-11-22T14:05`, `2026-11-22T14:05:09Z`, or so long ago: `90s`, `15m`,
/// `2h`, `7d`. Nanoseconds since 1970.
pub fn parse(text: &str, now_ns: u64) -> Option<u64> {
    ago(text, now_ns).or_else(|| date(text.trim_end_matches('Z')))
}

fn ago(text: &str, now_ns: u64) -> Option<u64> {
    let (number, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let seconds = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3_600,
        "d" => DAY_S as u64,
        _ => return None,
    };
    let span = number.parse::<u64>().ok()?.checked_mul(seconds * 1_000_000_000)?;
    Some(now_ns.saturating_sub(span))
}

fn date(text: &str) -> Option<u64> {
    let (day, time) = text.split_once(['T', ' ']).unwrap_or((text, "00:00:00"));
    let mut parts = day.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    let sound = (1970..=9_999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let mut seconds = [0_i64; 3];
    for (at, part) in time.splitn(3, ':').enumerate() {
        seconds[at] = part.split('.').next()?.parse().ok()?;
    }
    let [hour, minute, second] = seconds;
    let of_day = (0..24).contains(&hour) && (0..60).contains(&minute) && (0..61).contains(&second);
    let days = days(year, month, day);
    let exists = civil(days) == (year, month, day);
    let all = [sound, of_day, exists].into_iter().all(|part| part);
    all.then(|| ((days * DAY_S + hour * 3_600 + minute * 60 + second) * 1_000_000_000) as u64)
}

/// Days since 1970 of a date of the Gregorian calendar; years begin in March inside.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

fn civil(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let of_era_year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * of_era_year + of_era_year / 4 - of_era_year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    (era * 400 + of_era_year + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_written_and_read_alike() {
        let leap = 1_709_208_000_123_000_000;
        assert_eq!(text(leap), "2024-02-29T12:00:00.123Z");
        assert_eq!(parse("2024-02-29T12:00:00Z", 0), Some(leap / 1_000_000_000 * 1_000_000_000));
        for day in 0..40_000_u64 {
            let ns = day * 86_400 * 1_000_000_000;
            assert_eq!(parse(&text(ns), 0), Some(ns));
        }
    }

    #[test]
    fn a_span_counts_back_from_now_and_nonsense_is_refused() {
        assert_eq!(parse("15m", 3_600_000_000_000), Some(2_700_000_000_000));
        assert_eq!(parse("2d", 5), Some(0));
        for nonsense in ["", "m", "2024-13-01", "2024-02-30", "2024-01-01T25:00", "yesterday"] {
            assert_eq!(parse(nonsense, 1), None, "{nonsense}");
        }
    }
}
