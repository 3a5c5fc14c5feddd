//! A limit as inline SVG.

use params::acceptance::limits::Envelope;
use plotters::prelude::*;

const SIZE: (u32, u32) = (640, 240);
const FONT: &str = "sans-serif";

/// Highest and lowest value with some air, and the last time.
pub fn bounds(limit: &Envelope) -> (f64, f64, f64) {
    let values = || limit.upper.iter().chain(&limit.lower).map(|(_, value)| *value);
    let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
    let air = ((high - low) * 0.08).max(1.0);
    let end = limit.upper.iter().map(|(ms, _)| *ms).fold(1.0, f64::max);
    (low - air, high + air, end)
}

/// The picture, or the points as text where it cannot be drawn.
pub fn svg(limit: &Envelope) -> String {
    let mut svg = String::new();
    match draw(limit, &mut svg) {
        Ok(()) => svg,
        Err(_) => format!("<pre>{:?}\n{:?}</pre>", limit.upper, limit.lower),
    }
}

fn draw(limit: &Envelope, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let (low, high, end) = bounds(limit);
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut plot = ChartBuilder::on(&root)
        .margin(6)
        .x_label_area_size(34)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end, low..high)?;
    plot.configure_mesh()
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(BLACK.mix(0.12))
        .x_desc("ms after the request")
        .y_desc(limit.unit)
        .label_style((FONT, 12))
        .draw()?;
    let shape: Vec<_> = limit.upper.iter().copied().chain(limit.lower.iter().rev().copied()).collect();
    let green = RGBColor(46, 139, 87);
    plot.draw_series(std::iter::once(Polygon::new(shape, green.mix(0.15))))?;
    for line in [&limit.upper, &limit.lower] {
        plot.draw_series(LineSeries::new(line.iter().copied(), green.stroke_width(2)))?;
    }
    root.present()?;
    Ok(())
}
