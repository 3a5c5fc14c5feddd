//! Processor time of a cycle over the number of axes, every axis with torque and in motion.

use std::{thread, time::Duration};

use super::{Args, cpu_ns, plan, reaction};
use crate::master::Master;
use crate::run::{Plan, Role, Set};
use crate::watch::Watch;

/// Longest look at one number of axes, cycles.
const CYCLES_MOST: u64 = 5_000;

/// One point of the picture.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Point {
    /// Axes of the set.
    pub axes: u8,
    /// Mean processor time of one cycle, µs: A, B, crosscheck.
    pub cycle_cpu_us: [f64; 3],
}

/// A point for each of `args.growth`, each with a set of its own.
///
/// # Errors
/// When a set does not start or an axis gets no torque.
pub fn measure(args: &Args, say: &dyn Fn(&str)) -> Result<Vec<Point>, String> {
    let point = |axes: &u8| {
        say(&format!("growth: {axes} axes"));
        let plan = plan(args, *axes)?;
        let set = Set::start(&plan).map_err(|error| error.to_string())?;
        let found = cycle_cpu_us(&plan, &set, args.cycles.min(CYCLES_MOST));
        set.stop();
        Ok(Point { axes: *axes, cycle_cpu_us: found? })
    };
    args.growth.iter().map(point).collect()
}

fn cycle_cpu_us(plan: &Plan, set: &Set, cycles: u64) -> Result<[f64; 3], String> {
    let domain = set.domain().ok_or("no shared memory")?;
    for axis in &plan.axes {
        let watch = Watch::open(domain, *axis).map_err(|error| error.to_string())?;
        let master = Master::connect(&plan.folder, *axis)?;
        reaction::awaits(&watch)?;
        reaction::energise(&watch, &master)?;
        master.set_point(400.0)?;
    }
    let processes = [Role::ChannelA, Role::ChannelB, Role::Crosscheck].map(|role| set.process(role));
    let spent = || processes.map(|process| cpu_ns(process).unwrap_or(0));
    let before = spent();
    thread::sleep(Duration::from_micros(u64::from(plan.timing.cycle_us).saturating_mul(cycles)));
    let after = spent();
    let mut mean = [0.0; 3];
    for (mean, (before, after)) in mean.iter_mut().zip(before.into_iter().zip(after)) {
        *mean = after.saturating_sub(before) as f64 / cycles.max(1) as f64 / 1e3;
    }
    Ok(mean)
}

/// What each further axis costs, µs, and what remains without any: least squares over the points.
pub fn line(points: &[Point], process: usize) -> Option<(f64, f64)> {
    let count = points.len() as f64;
    let of = |point: &Point| (f64::from(point.axes), point.cycle_cpu_us.get(process).copied().unwrap_or(0.0));
    let (sum_x, sum_y) = points.iter().map(of).fold((0.0, 0.0), |(x, y), (nx, ny)| (x + nx, y + ny));
    let (mean_x, mean_y) = (sum_x / count, sum_y / count);
    let spread: f64 = points.iter().map(of).map(|(x, _)| (x - mean_x).powi(2)).sum();
    let together: f64 = points.iter().map(of).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    (points.len() > 1 && spread > 0.0).then(|| {
        let each = together / spread;
        (each, mean_y - each * mean_x)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_growth_gives_its_slope_and_its_rest() {
        let point = |axes: u8| Point { axes, cycle_cpu_us: [3.0 + 2.0 * f64::from(axes), 0.0, 1.0] };
        let points = [1, 8, 64].map(point);
        let (each, rest) = line(&points, 0).expect("three points");
        assert!((each - 2.0).abs() < 1e-9 && (rest - 3.0).abs() < 1e-9, "{each} {rest}");
        assert_eq!(line(&points[..1], 0), None);
    }
}
