//! Whether a running set may get a new one: only where every axis stands in STO.

use shm_schema::report::{Report, Stop};

use crate::ctl::sets;
use crate::run::RunFolder;
use crate::watch::{Frame, Watch, domain_of};

/// The transfer is refused while the drive is enabled (AMKD-P1-02).
pub const REFUSED: &str = "3610/40/0/15";

/// Every axis of the running set is in STO, and both its paths are off.
///
/// # Errors
/// The first axis that is not, or that cannot be read: that counts as not.
pub fn in_sto(folder: &RunFolder) -> Result<(), String> {
    let domain = domain_of(folder)?;
    for set in sets(folder, None)? {
        let watch = Watch::open(&domain, set.number);
        let frame = watch.map_err(|error| format!("axis {}: {error}", set.number))?.now();
        let frame = frame.ok_or_else(|| format!("axis {}: not every cell is written yet", set.number))?;
        standing(&frame).map_err(|line| format!("axis {}: {line}", set.number))?;
    }
    Ok(())
}

fn standing(frame: &Frame) -> Result<(), String> {
    let (_, paths) = frame.readback;
    if paths.path_a | paths.path_b {
        return Err("torque is on".into());
    }
    let off = |report: &Report| (report.stop == Stop::Sto) & !report.driving;
    match (off(&frame.a), off(&frame.b)) {
        (true, true) => Ok(()),
        _ => Err("STO is not requested".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shm_schema::{agreement::Agreement, inhibit::Readback};

    fn frame(stop_b: Stop, path_b: bool) -> Frame {
        let report = |stop| Report { stop, ..Report::default() };
        Frame {
            time_ns: 0,
            a: report(Stop::Sto),
            b: report(stop_b),
            agreement: Agreement::default(),
            readback: (0, Readback { path_b, ..Readback::default() }),
        }
    }

    /// AMK-PMT-12: both channels in STO, and both paths off.
    #[test]
    fn a_running_set_gets_a_new_one_in_sto_only() {
        assert_eq!(standing(&frame(Stop::Sto, false)), Ok(()));
        assert!(standing(&frame(Stop::Sto, true)).is_err());
        for stop in [Stop::None, Stop::Ss1, Stop::Ss2, Stop::Sos] {
            assert!(standing(&frame(stop, false)).is_err(), "{stop:?}");
        }
    }
}
