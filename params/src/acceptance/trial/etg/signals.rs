//! SSM and SCA: a bit that shows a range.

use super::{Etg, Instance, Probe, REQUEST_MS, Trial};

/// Increments beyond a limit from which the range is entered.
const OUTSIDE: f64 = 1_000.0;

impl Etg<'_> {
    /// ETG-SSM-01
    pub(super) fn speed_signal(&self, of: Instance<'_>) -> Vec<Trial> {
        let (Some(bit), Some((low, high))) = (self.status(of.name), self.range(of, "velocity")) else {
            return Vec::new();
        };
        let sides = [(high, high + 5.0), (low, low - 5.0)];
        let reachable = sides.into_iter().filter(|(_, outside)| self.permitted(*outside));
        let side = |(limit, outside): (f64, f64)| {
            let action = format!("enter at {limit:.0} rpm from {outside:.0} rpm, and leave again");
            let mut step = self.start(of.name, action, outside);
            let way = 5.0 / self.steep;
            let (inside, out) = (REQUEST_MS + way, REQUEST_MS + way + 50.0);
            step.trial.course.speed(REQUEST_MS, outside).speed(inside, limit).speed(out, limit);
            step.trial.course.speed(out + way, outside);
            step.expect(format!("status bit {bit} is 1"), inside - 1.0, inside + 1.0, Probe::Bit(bit, true));
            step.expect(format!("status bit {bit} is 0"), out, out + 2.0, Probe::Bit(bit, false));
            self.settle(&mut step, out + way + 10.0, outside);
            step.trial
        };
        reachable.map(side).collect()
    }

    /// ETG-SCA-01
    pub(super) fn position_signal(&self, of: Instance<'_>) -> Vec<Trial> {
        let (Some(bit), Some((low, high))) = (self.status(of.name), self.range(of, "position")) else {
            return Vec::new();
        };
        let side = |(limit, side): (f64, f64)| {
            let mut step =
                self.start_still(of.name, format!("enter at {limit:.0} increments, and leave again"));
            let column = "pos_incr";
            step.trial.course.set(0.0, "accel_rpm_s", 0);
            let rate = (self.top.min(60.0) * 65_536.0 / 60_000.0).max(1.0);
            let inside = REQUEST_MS + (OUTSIDE / rate).ceil();
            let out = inside + 50.0;
            let outside = limit + side * OUTSIDE;
            let course = &mut step.trial.course;
            course.set(0.0, column, outside).set(REQUEST_MS, column, outside).set(inside, column, limit);
            course.set(out, column, limit).set(out + inside - REQUEST_MS, column, outside);
            step.expect(format!("status bit {bit} is 1"), inside - 1.0, inside + 1.0, Probe::Bit(bit, true));
            step.expect(format!("status bit {bit} is 0"), out, out + 2.0, Probe::Bit(bit, false));
            self.release(&mut step, out + inside);
            step.trial
        };
        [(high, 1.0), (low, -1.0)].map(side).into()
    }

    /// Both limits, where one of them is not zero (ETG-SSM-02, ETG-SCA-02).
    fn range(&self, of: Instance<'_>, quantity: &str) -> Option<(f64, f64)> {
        let limit = |side: &str| self.value(of.function, of.number, &format!("{quantity}_{side}_limit"));
        let (low, high) = (limit("lower")?, limit("upper")?);
        (low != 0.0 || high != 0.0).then_some((low, high))
    }
}
