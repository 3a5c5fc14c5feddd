//! The table for the terminal, and the report: HTML with the picture inside, SVG, JSON.

use std::{fmt::Write as _, fs, io, path::Path};

use plotters::prelude::*;

use super::growth;
use super::histogram::{Line, PERCENTILES};
use super::{Args, Results};
use crate::run::Plan;

const COLOURS: [RGBColor; 8] = [
    RGBColor(120, 120, 120),
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
    RGBColor(188, 189, 34),
];

const PROCESSES: [&str; 3] = ["channel A", "channel B", "crosscheck"];

/// What the figures belong to.
pub fn machine(args: &Args, plan: &Plan) -> Vec<(String, String)> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let model =
        read("/proc/cpuinfo").lines().find_map(|line| Some(line.strip_prefix("model name")?.to_owned()));
    let loads = args.load.iter().map(|load| format!("{load:?}").to_lowercase()).collect::<Vec<_>>();
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    vec![
        ("command".into(), format!("safepair {command}")),
        ("processor".into(), model.unwrap_or_default().trim_start_matches([' ', '\t', ':']).to_owned()),
        ("cores".into(), std::thread::available_parallelism().map_or(0, usize::from).to_string()),
        ("kernel".into(), read("/proc/version").split_whitespace().take(3).collect::<Vec<_>>().join(" ")),
        ("timing".into(), plan.timing.to_string()),
        ("load".into(), if loads.is_empty() { "none of ours".into() } else { loads.join(", ") }),
    ]
}

/// For the terminal.
pub fn table(results: &Results) -> String {
    let mut out = String::new();
    for (name, value) in &results.machine {
        let _ = writeln!(out, "{name:10} {value}");
    }
    let _ = write!(out, "\n{:40} {:>8}", "µs", "count");
    for (name, _) in PERCENTILES {
        let _ = write!(out, " {name:>9}");
    }
    let _ = writeln!(out, "       max  × floor at p50, p99.99");
    for line in &results.lines {
        let _ = write!(out, "{:40} {:>8}", line.what, line.count);
        for value in line.percentiles_us {
            let _ = write!(out, " {value:>9.2}");
        }
        let _ = writeln!(out, " {:>9.2}  {}", line.max_us, ratio(line));
    }
    let [a, b] = results.skipped;
    let _ = writeln!(out, "samples skipped: A {a}, B {b}");
    let mean = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.1} µs"));
    let [a, b, crosscheck] = results.cycle_cpu_us.map(mean);
    let _ = writeln!(out, "processor time of a cycle, mean: A {a}, B {b}, crosscheck {crosscheck}");
    for growth::Point { axes, cycle_cpu_us: [a, b, crosscheck] } in &results.growth {
        let _ = writeln!(out, "{axes:3} axes: A {a:.1} µs, B {b:.1} µs, crosscheck {crosscheck:.1} µs");
    }
    for (name, each, rest) in slopes(results) {
        let _ = writeln!(out, "{name}: {each:.2} µs for each axis and {rest:.1} µs");
    }
    out
}

/// Name, cost of one axis and of none, µs, of each process, where there are points enough.
fn slopes(results: &Results) -> impl Iterator<Item = (&'static str, f64, f64)> {
    let line = |(process, name): (usize, &'static str)| {
        growth::line(&results.growth, process).map(|(each, rest)| (name, each, rest))
    };
    PROCESSES.into_iter().enumerate().filter_map(line)
}

fn ratio(line: &Line) -> String {
    line.ratio.map_or(String::new(), |[median, high]| {
        format!("{median:.2}, {high:.2} ({})", line.floor.unwrap_or_default())
    })
}

/// Writes `latency.html`, `latency.svg`, `latency.json` and, with points, `growth.svg` into `folder`.
///
/// # Errors
/// When a file cannot be written or the drawing fails.
pub fn write(results: &Results, folder: &Path) -> io::Result<()> {
    let svg = draw(results).map_err(|error| io::Error::other(error.to_string()))?;
    fs::write(folder.join("latency.svg"), &svg)?;
    let growth = match results.growth.as_slice() {
        [] => String::new(),
        points => draw_growth(points).map_err(|error| io::Error::other(error.to_string()))?,
    };
    if !growth.is_empty() {
        fs::write(folder.join("growth.svg"), &growth)?;
    }
    fs::write(folder.join("latency.json"), serde_json::to_string_pretty(results)?)?;
    fs::write(folder.join("latency.html"), html(results, &(svg + &growth)))
}

fn html(results: &Results, svg: &str) -> String {
    let escape = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
    let mut rows = String::new();
    for line in &results.lines {
        let _ = write!(rows, "<tr><td>{}</td><td>{}</td>", escape(&line.what), line.count);
        for value in line.percentiles_us {
            let _ = write!(rows, "<td>{value:.2}</td>");
        }
        let _ = writeln!(rows, "<td>{:.2}</td><td>{}</td></tr>", line.max_us, escape(&ratio(line)));
    }
    let head = PERCENTILES.iter().fold(String::new(), |text, (name, _)| text + "<th>" + name + "</th>");
    let machine = results.machine.iter().fold(String::new(), |text, (name, value)| {
        text + &format!("<tr><th>{name}</th><td>{}</td></tr>\n", escape(value))
    });
    let [a, b] = results.skipped;
    format!(
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>safepair latency</title>\n<style>body{{font:15px \
         sans-serif;margin:2em;max-width:75em}}table{{border-collapse:collapse;margin:1em 0}}td,th{{padding:.2em \
         .7em;text-align:right;border-bottom:1px solid \
         #ddd}}td:first-child,th:first-child{{text-align:left}}</style>\n<h1>safepair \
         latency</h1>\n<table>{machine}</table>\n<p>Times in µs. Figures belong to this machine and this command; what \
         compares are the ratios to the floor, measured in the same run. Maxima are reported, not \
         judged.</p>\n<table><tr><th></th><th>count</th>{head}<th>max</th><th>× floor at p50, \
         p99.99</th></tr>\n{rows}</table>\n<p>Samples skipped: A {a}, B {b}.</p>\n{svg}\n"
    )
}

fn draw(results: &Results) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    let lines: Vec<&Line> = results.lines.iter().filter(|line| line.count > 1).collect();
    let points = || lines.iter().flat_map(|line| &line.tail);
    let most = points().map(|point| point.0).fold(1.0, f64::max) * 1.2;
    let least = points().map(|point| point.1).fold(1.0, f64::min);
    {
        let root = SVGBackend::with_string(&mut svg, (1_100, 560)).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .caption("share of times that are longer", ("sans-serif", 18))
            .build_cartesian_2d((0.05_f64..most).log_scale(), (least..1.0).log_scale())?;
        chart.configure_mesh().x_desc("µs").y_desc("share").draw()?;
        for (at, line) in lines.iter().enumerate() {
            let colour = COLOURS[at % COLOURS.len()];
            let series = LineSeries::new(line.tail.iter().copied(), colour.stroke_width(2));
            chart
                .draw_series(series)?
                .label(line.what.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.85)).border_style(BLACK).draw()?;
        root.present()?;
    }
    Ok(svg)
}

/// Processor time of a cycle over the number of axes.
fn draw_growth(points: &[growth::Point]) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    let most_axes = points.iter().map(|point| point.axes).max().unwrap_or(1);
    let most = points.iter().flat_map(|point| point.cycle_cpu_us).fold(1.0, f64::max) * 1.1;
    {
        let root = SVGBackend::with_string(&mut svg, (1_100, 420)).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .caption("processor time of a cycle", ("sans-serif", 18))
            .build_cartesian_2d(0.0..f64::from(most_axes) + 1.0, 0.0..most)?;
        chart.configure_mesh().x_desc("axes").y_desc("µs").draw()?;
        for (process, name) in PROCESSES.into_iter().enumerate() {
            let colour = COLOURS[process + 1];
            let at = |point: &growth::Point| (f64::from(point.axes), point.cycle_cpu_us[process]);
            chart
                .draw_series(LineSeries::new(points.iter().map(at), colour.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
            chart.draw_series(points.iter().map(|point| Circle::new(at(point), 4, colour.filled())))?;
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.85)).border_style(BLACK).draw()?;
        root.present()?;
    }
    Ok(svg)
}
